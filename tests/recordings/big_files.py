"""A CSV of 100 MB and a bag of 1 GB, written and imported on demand: `python tests/recordings/big_files.py`.

Prints seconds and the memory that the import takes beyond that of the loaded libraries, over the size of the numbers
that the recording keeps. Nothing stays.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from recording_folders import ARM, motion_at

from problem.regressor import rigid_body_torque

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
    """Rows t, q, tau in pieces, (rows, 7)."""
    for first in range(0, count, piece):
        number = np.arange(first, min(first + piece, count))
        clock = number / rate_hz
        motion = motion_at(clock % 600.0)
        noise = np.random.default_rng(first).normal(0, 0.02, motion.position.shape)
        torque = rigid_body_torque(ARM, motion).reshape(motion.position.shape)
        yield np.column_stack([clock, motion.position, torque + motion.velocity + noise])


def write_csv(path: Path, size: int) -> int:
    """Rows of a CSV of about so many bytes."""
    count = size // 128
    with path.open("w") as stream:
        stream.write("time,q1_rad,q2_rad,q3_rad,tau1_Nm,tau2_Nm,tau3_Nm\n")
        for rows in rows_of_motion(count, 1000.0):
            stream.writelines(",".join(map(repr, row)) + "\n" for row in rows.tolist())
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
                    header(stamp(*divmod(ns, 10**9)), "base_link_of_the_robot"), joints, row[1:4], row[1:4], row[4:7]
                )
                writer.write(topic, ns, store.serialize_cdr(message, name))
    return count


def measure(source: Path, folder: Path) -> str:
    """A line of seconds and memory of an import."""
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
        return f"{source.name}: failed: {done.stderr[-600:]}"
    _, seconds, memory, progress = said[0].split()
    from armlab.recordings.load import load_recording

    kept = sum(run.time.nbytes + run.position.nbytes + run.torque.nbytes for run in load_recording(out).runs)
    return (
        f"{source.name}: {size / 1e6:.0f} MB in {seconds} s, {int(memory) / 1e6:.0f} MB of memory for "
        f"{kept / 1e6:.0f} MB kept ({int(memory) / kept:.1f} times), {progress} lines of progress"
    )


def main(arguments: list[str]) -> int:
    """Writes, imports and measures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--csv-mb", type=int, default=100)
    parser.add_argument("--bag-mb", type=int, default=1000)
    options = parser.parse_args(arguments)
    for name, write, size in (("log.csv", write_csv, options.csv_mb), ("bag", write_bag, options.bag_mb)):
        if not size:
            continue
        with tempfile.TemporaryDirectory() as folder:
            started = time.monotonic()
            write(Path(folder) / name, size * 10**6)
            print(f"{name}: written in {time.monotonic() - started:.0f} s", flush=True)
            print(measure(Path(folder) / name, Path(folder)), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
