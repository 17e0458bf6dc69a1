"""A CSV of 100 MB and a bag of 1 GB, written and imported on demand: `python tests/recordings/big_files.py`.

Prints seconds and the memory that the import takes at most beyond that of the loaded libraries, over the size of what
the recording keeps: its columns in double precision. Fails where that is more than three times. Nothing stays.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from recording_folders import ARM, motion_at

from armlab.recordings.table import read_table
from problem.regressor import rigid_body_torque

MAX_TIMES_KEPT = 3.0
MEASURED = """
import resource, sys, time
from pathlib import Path
from armlab.recordings.imports import files, ros  # what an import loads
import pandas, pyarrow.parquet, scipy.interpolate, rosbags.highlevel, rosbags.typesys
def memory():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
from functools import partial
from armlab.recordings.imports.plan import plan_import
from armlab.recordings.imports.sources import read_sources
names = ("tip", "gains", "gear_ratio", "motor_side", "joints", "separator", "decimal", "topic", "time", "position")
options = dict.fromkeys((*names, "torque", "reference_position", "command_topic"))
options |= {"robot": "irb120-arm", "lock": (), "validate": (), "units": (), "out": Path(sys.argv[2])}
told = []
before, started = memory(), time.monotonic()
files.write_plan(plan_import([Path(sys.argv[1])], options, partial(read_sources, progress=told.append)))
print(f"MEASURED {time.monotonic() - started:.1f} {memory() - before} {len(told)}", file=sys.stderr)
"""


def rows_of_motion(count: int, rate_hz: float, piece: int = 100_000) -> "np.ndarray":
    """Rows t, q, tau, velocity in pieces, (rows, 10)."""
    for first in range(0, count, piece):
        number = np.arange(first, min(first + piece, count))
        clock = number / rate_hz
        motion = motion_at(clock % 600.0)
        noise = np.random.default_rng(first).normal(0, 0.02, motion.position.shape)
        torque = rigid_body_torque(ARM, motion).reshape(motion.position.shape)
        yield np.column_stack([clock, motion.position, torque + motion.velocity + noise, motion.velocity])


def write_csv(path: Path, size: int) -> int:
    """Rows of a CSV of about so many bytes."""
    count = size // 128
    with path.open("w") as stream:
        stream.write("time,q1_rad,q2_rad,q3_rad,tau1_Nm,tau2_Nm,tau3_Nm\n")
        for rows in rows_of_motion(count, 1000.0):
            stream.writelines(",".join(map(repr, row)) + "\n" for row in rows[:, :7].tolist())
    return count


def write_bag(path: Path, size: int) -> int:
    """Messages of a bag of about so many bytes."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store, name = get_typestore(Stores.ROS2_HUMBLE), "sensor_msgs/msg/JointState"
    stamp, header, state = (store.types[each] for each in ("builtin_interfaces/msg/Time", "std_msgs/msg/Header", name))
    joints = [joint.name for joint in ARM.joints]
    count = size // 221
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topic = writer.add_connection("/joint_states", name, typestore=store)
        for rows in rows_of_motion(count, 1000.0):
            for row in np.ascontiguousarray(rows):
                ns = round(row[0] * 1e9) + 10**18
                message = state(
                    header(stamp(*divmod(ns, 10**9)), "base_link_of_the_robot"), joints, row[1:4], row[7:10], row[4:7]
                )
                writer.write(topic, ns, store.serialize_cdr(message, name))
    return count


def measure(source: Path, folder: Path) -> tuple[str, bool]:
    """A line of seconds and memory of an import, and whether the memory is within its limit."""
    out = folder / "recording"
    size = sum(each.stat().st_size for each in ([source] if source.is_file() else source.iterdir()))
    done = subprocess.run(
        [sys.executable, "-c", MEASURED, str(source), str(out)],
        capture_output=True,
        text=True,
        check=False,
    )
    said = [line for line in done.stderr.splitlines() if line.startswith("MEASURED")]
    if done.returncode or not said:
        return f"{source.name}: failed: {done.stderr[-600:]}", False
    _, seconds, memory, progress = said[0].split()
    kept = sum(read_table(each).values.nbytes for each in out.iterdir() if each.suffix in (".csv", ".parquet"))
    line = (
        f"{source.name}: {size / 1e6:.0f} MB in {seconds} s, {int(memory) / 1e6:.0f} MB of memory for "
        f"{kept / 1e6:.0f} MB kept ({int(memory) / kept:.1f} times), {progress} lines of progress"
    )
    return line, int(memory) <= MAX_TIMES_KEPT * kept


def main(arguments: list[str]) -> int:
    """Writes, imports and measures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--csv-mb", type=int, default=100)
    parser.add_argument("--bag-mb", type=int, default=1000)
    options, good = parser.parse_args(arguments), True
    for name, write, size in (("log.csv", write_csv, options.csv_mb), ("bag", write_bag, options.bag_mb)):
        if not size:
            continue
        with tempfile.TemporaryDirectory() as folder:
            started = time.monotonic()
            write(Path(folder) / name, size * 10**6)
            print(f"{name}: written in {time.monotonic() - started:.0f} s", flush=True)
            line, is_within = measure(Path(folder) / name, Path(folder))
            print(line, flush=True)
            good &= is_within
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
