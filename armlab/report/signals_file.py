"""`signals.mcap`: measured and predicted signals of a diagnosis as ROS 2 joint states.

Foxglove, PlotJuggler and `ros2 bag` read it.

Each topic is `/RUN/SIGNAL` for what was recorded, and `/RUN/ROLE/SIGNAL` for what was compared: ROLE is `identify` for
rows of the fit and `validate` for rows that are held out. All messages are `sensor_msgs/msg/JointState`.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.packages import import_package
from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.torque.rows.data import rows_in
from armlab.recordings.recording import MotionRun, Role

SIGNALS_FILE = "signals.mcap"
STATE_TYPE = "sensor_msgs/msg/JointState"
STAMP_TYPE = "builtin_interfaces/msg/Time"
STAMP_END = 2.0**31  # s: what a ROS 2 time holds


@dataclass(frozen=True, eq=False)
class Track:
    """One topic. time: (samples,), s. position, rad (m), velocity and effort, N m (N): (samples, joints) or None."""

    topic: str
    time: Array
    position: Array | None = None
    velocity: Array | None = None
    effort: Array | None = None


def check_signals_writer() -> None:
    """InputError where the package that writes the file is not installed."""
    import_package("rosbags", "--mcap")


def diagnosis_tracks(diagnosis: Diagnosis) -> list[Track]:
    """The topics of a diagnosis with torque.

    `recorded`: as read, on the joint side. `measured`: at the compared rows, torque filtered, motion smoothed.
    `simulated` (where there is a simulation), `refitted` (the rigid body) and `corrected` (the model found): their
    torque for the measured motion, at the same rows and through the same filter.
    """
    runs = diagnosis.recording.runs
    names = topic_names(runs)
    tracks = [recorded_track(run, names[run.name], run.torque) for run in runs]
    observed, refit, final = diagnosis.observed, diagnosis.refit, diagnosis.final
    if observed is None or refit is None or final is None:
        return tracks
    residuals = {"refitted": refit, "corrected": final}
    if diagnosis.simulation.kind != "refit" and diagnosis.nominal is not None:
        residuals = {"simulated": diagnosis.nominal, **residuals}
    time, torque = np.concatenate([each.time for each in observed.signals]), observed.torque
    position, velocity = observed.kept("position"), observed.kept("velocity")
    for number, name in enumerate(observed.names):
        for role in get_args(Role):
            own = [each for each in observed.of_role(role) if each.run == number]
            if not own:
                continue
            rows, topic = rows_in(own, observed.rows), f"/{names[name]}/{role}"
            tracks.append(Track(f"{topic}/measured", time[rows], position[rows], velocity[rows], torque[rows]))
            for signal, left in residuals.items():
                tracks.append(Track(f"{topic}/{signal}", time[rows], effort=(torque - left)[rows]))
    return tracks


def recorded_track(run: MotionRun, name: str, torque: Array | None = None) -> Track:
    """A run as it was read. name: of the run in topics."""
    return Track(f"/{name}/recorded", run.time, run.position, run.velocity, torque)


def topic_names(runs: Sequence[MotionRun]) -> dict[str, str]:
    """Names of runs as ROS allows them in a topic: letters, digits and single `_`, a letter first, none twice."""
    names: dict[str, str] = {}
    for run in runs:
        stem = Path(run.file).with_suffix("").as_posix() + (f" part {run.part}" if run.part else "")
        plain = re.sub(r"[^A-Za-z0-9]+", "_", stem).strip("_")
        plain = plain if plain[:1].isalpha() else f"run_{plain}".rstrip("_")
        free, count = plain, 2
        while free in names.values():
            free, count = f"{plain}_{count}", count + 1
        names[run.name] = free
    return names


def signals_content(tracks: Sequence[Track], joints: Sequence[str]) -> tuple[bytes, str | None]:
    """The bytes of the file, messages in the order of their stamps, and a line where the stamps had to be moved.

    joints: names of the columns. Stamps are those of the recording; where a ROS 2 time cannot hold them, all are
    counted from the first.
    """
    first, last = min(each.time[0] for each in tracks), max(each.time[-1] for each in tracks)
    moved = first < 0 or last >= STAMP_END
    stamps = [_nanoseconds(each.time, first if moved else 0.0) for each in tracks]
    numbers = np.repeat(np.arange(len(tracks)), [len(each) for each in stamps])
    rows = np.concatenate([np.arange(len(each)) for each in stamps])
    order = np.argsort(np.concatenate(stamps), kind="stable")
    with TemporaryDirectory() as folder:
        bag = Path(folder) / "signals"
        _write_bag(bag, tracks, stamps, joints, zip(numbers[order].tolist(), rows[order].tolist(), strict=True))
        content = (bag / SIGNALS_FILE).read_bytes()
    return content, f"{SIGNALS_FILE}: 0 s is {first:g} s of the recording" if moved else None


def _nanoseconds(time: Array, first: float) -> NDArray[np.int64]:
    return np.asarray(np.rint((time - first) * 1e9), dtype=np.int64)


def _write_bag(
    bag: Path,
    tracks: Sequence[Track],
    stamps: Sequence[NDArray[np.int64]],
    joints: Sequence[str],
    messages: Iterable[tuple[int, int]],
) -> None:
    """Write a ROS 2 bag as a folder. messages: number of the track and of its row, in the order of their stamps."""
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    state, header, instant = (store.types[name] for name in (STATE_TYPE, "std_msgs/msg/Header", STAMP_TYPE))
    unknown, names = np.array([]), list(joints)
    writer = Writer(bag, version=Writer.VERSION_LATEST, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with writer:
        topics = [writer.add_connection(each.topic, STATE_TYPE, typestore=store) for each in tracks]
        for number, row in messages:
            track, stamp = tracks[number], int(stamps[number][row])
            signals = [
                unknown if each is None else each[row] for each in (track.position, track.velocity, track.effort)
            ]
            message = state(header(instant(*divmod(stamp, 10**9)), ""), names, *signals)
            writer.write(topics[number], stamp, store.serialize_cdr(message, STATE_TYPE))
