"""The recording as it should be read: in memory, and as `recording.yaml` and `robot.yaml`."""

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from armlab.common.arrays import Array
from armlab.common.settings import to_plain_data
from armlab.recordings.channels import read_late, restore_gravity
from armlab.recordings.load import open_recording
from armlab.recordings.reading.mistakes import read_robot_file
from armlab.recordings.reading.reading import Reading
from armlab.recordings.recording import Recording, Run, Transmission
from armlab.recordings.recording_file import RecordingFile, TimingEntry
from problem.pseudo_inertia import links_of
from problem.robot_file import LinkEntry, RobotFile

CORRECTED_FOLDER = "corrected"
POSITION_SIGNALS = ("position", "reference_position")
VELOCITY_SIGNALS = ("velocity", "reference_velocity")


def correct_recording(recording: Recording, reading: Reading) -> Recording:
    """The recording as a reading has it.

    Positions of link encoders stay: they have no transmission. So do velocities where the clock is wrong: it is doubted
    only where they are not the slopes of the positions.
    """
    arm = reading.arm
    if recording.arm.links is not None and recording.simulation is None and reading.inertial is not None:
        arm = replace(arm, links=links_of(reading.inertial))
    runs = tuple(_correct_run(run, recording.transmission, reading) for run in recording.runs)
    given = recording.transmission
    transmission = Transmission(
        _at_channels(reading.position, reading.position_order),
        reading.offset,
        _at_channels(reading.torque, reading.torque_order) / given.gains,
        given.gains,
    )
    return replace(recording, arm=arm, runs=runs, transmission=transmission)


def _at_channels(matrix: Array, order: tuple[int, ...]) -> Array:
    """Columns of a matrix at the channels that they read."""
    out = np.empty_like(matrix)
    out[:, list(order)] = matrix
    return out


def _correct_run(run: Run, given: Transmission, reading: Reading) -> Run:
    to_joints = reading.position @ np.linalg.inv(given.position)[list(reading.position_order)]
    to_torque = reading.torque @ np.linalg.inv(given.torque * given.gains)[list(reading.torque_order)]
    signals = {"torque": run.torque @ to_torque.T}
    for name, signal in run.signals.items():
        if name in POSITION_SIGNALS:
            signals[name] = _mix(signal - given.offset, to_joints) + reading.offset
        elif name in VELOCITY_SIGNALS:
            signals[name] = _mix(signal, to_joints)
    read = read_late(run.with_signals(run.time / reading.clock, signals), reading.delay)
    return restore_gravity(read, reading.arm) if reading.adds_gravity else read


def _mix(signal: Array, matrix: Array) -> Array:
    """Signals of joints (samples, joints) by a matrix; a joint without a sensor stays so."""
    out = np.nan_to_num(signal) @ matrix.T
    missing = np.isnan(signal).any(axis=0)
    out[:, np.any((matrix != 0) & missing, axis=1)] = np.nan
    return np.asarray(out)


def corrected_texts(source: Path, reading: Reading, folder: Path) -> dict[str, str]:
    """`recording.yaml`, and `robot.yaml` where the robot is a D-H table, as they should stand in a folder.

    source: the folder of the recording as it is. The runs stay where they are.
    """
    recording, file = open_recording(source)
    robot = read_robot_file(recording)
    settings = _recording_settings(recording, file, reading, folder, robot is None)
    texts = {"recording.yaml": _yaml_text(settings)}
    if robot is not None:
        texts["robot.yaml"] = _yaml_text(_robot_settings(robot, recording, reading))
    return texts


def _recording_settings(
    recording: Recording, file: RecordingFile, reading: Reading, folder: Path, urdf: bool
) -> dict[str, Any]:
    settings = file.model_dump(mode="json", by_alias=True, exclude_unset=True)

    def beside(path: str) -> str:
        return os.path.relpath(recording.folder / path, folder)

    settings["robot"] = beside(recording.robot) if urdf else "robot.yaml"
    if urdf and reading.arm.gravity != recording.arm.gravity:
        settings["gravity"] = list(reading.arm.gravity)
    if reading.adds_gravity:
        settings["restore_gravity"] = True
    if reading.arm.unmeasured:
        settings["without_torque"] = [joint + 1 for joint in sorted(reading.arm.unmeasured)]
    for run in settings["runs"]:
        run["file"] = beside(run["file"])
    if file.simulation is not None:
        settings["simulation"] = beside(file.simulation)
    for signal in (*POSITION_SIGNALS, *VELOCITY_SIGNALS):
        _reorder(settings, signal, reading.position_order)
    _reorder(settings, "torque" if file.columns.torque else "current", reading.torque_order)
    given = recording.transmission
    stated = {
        "position": (reading.position, np.eye(reading.joints)),
        "offset": (reading.offset, np.zeros(reading.joints)),
        "torque": (reading.torque / given.gains, np.eye(reading.joints)),
    }
    changed = {name: each.tolist() for name, (each, usual) in stated.items() if not np.array_equal(each, usual)}
    settings.pop("transmission", None)
    if changed:
        settings["transmission"] = changed
    before = file.timing or TimingEntry()
    delays = np.add(reading.delay, np.divide(before.delays(reading.joints), reading.clock))
    if reading.clock != 1.0 or np.any(delays):
        clock = before.clock_factor * reading.clock
        settings["timing"] = {"clock_factor": clock, "torque_delay": delays.tolist()}
    return settings


def _reorder(settings: dict[str, Any], signal: str, order: tuple[int, ...]) -> None:
    """Names and units of the columns of a signal in another order."""
    names = settings["columns"].get(signal)
    if names is None or len(names) != len(order):
        return
    settings["columns"][signal] = [names[place] for place in order]
    units = settings["units"].get(signal)
    if isinstance(units, list):
        settings["units"][signal] = [units[place] for place in order]


def _robot_settings(robot: RobotFile, recording: Recording, reading: Reading) -> dict[str, Any]:
    changed: dict[str, Any] = {"gravity": reading.arm.gravity}
    form = next((each.form for each in reading.mistakes if each.effect == "dh_convention"), None)
    if form is not None:
        changed["dh_convention"] = form
    if robot.links is not None and recording.simulation is None and reading.inertial is not None:
        links = links_of(reading.inertial)
        changed["links"] = tuple(
            LinkEntry(mass=each.mass, first_moment=each.first_moment, inertia=each.inertia) for each in links
        )
    return robot.model_copy(update=changed).model_dump(mode="json", exclude_none=True)


def _yaml_text(settings: dict[str, Any]) -> str:
    return yaml.safe_dump(to_plain_data(settings), sort_keys=False, default_flow_style=None, width=110)
