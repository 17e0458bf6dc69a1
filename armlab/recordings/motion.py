"""Recordings of motion only: commands and positions of position servos, without torque."""

from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING

from armlab.common.errors import InputError
from armlab.common.settings import suggest_name
from armlab.recordings.channels import channel_units, make_raw_motion_run, make_transmission
from armlab.recordings.load import RepairPlaces, repair_run
from armlab.recordings.recording import Finding, MotionRun, Role, Transmission, describe_runs
from armlab.recordings.recording_file import (
    FILE_NAME,
    ControllerEntry,
    RecordingFile,
    RunEntry,
    read_recording_file,
)
from armlab.recordings.table import read_table
from problem.arm import Arm
from problem.coupled_joints import refuse_coupled
from problem.mjcf import compile_mjcf
from problem.mjcf_servos import refuse_other_drives
from problem.robot_file import load_arm

if TYPE_CHECKING:  # by those who ask for frames or figures
    import pandas as pd

    from armlab.common.report.figures import ShownFigure

PER_JOINT_KEYS = (
    "kp",
    "kd",
    "ki",
    "ki_speed",
    "delay",
    "torque_limit",
    "limit_slope",
    "integral_limit",
    "offset",
    "dead_band",
    "read_delay",
    "kt",
    "resistance",
)


@dataclass(frozen=True, eq=False)
class MotionRecording:
    """What `recording.yaml` and its runs hold where no torque was recorded.

    arm: the whole robot; joints: places in it, from 0, of the joints that the columns belong to. The other joints are
    held at zero. controller: of the simulation, None where it is unknown or stands in the robot's MJCF.
    """

    folder: Path
    robot: str
    arm: Arm
    joints: tuple[int, ...]
    runs: tuple[MotionRun, ...]
    transmission: Transmission
    controller: ControllerEntry | None = None
    findings: tuple[Finding, ...] = ()
    recorded: date | None = None

    @property
    def name(self) -> str:
        """Name of the folder."""
        return self.folder.resolve().name

    @property
    def recorded_arm(self) -> Arm:
        """The joints that the columns belong to, as an arm without links: names, kinds and limits."""
        return Arm(self.arm.name, tuple(self.arm.joints[joint] for joint in self.joints))

    def __getitem__(self, signal: str) -> "pd.DataFrame":
        """A signal of all runs, SI units: rows by run and time, a column a joint."""
        from armlab.recordings.views import signal_frame

        return signal_frame(self.runs, self.recorded_arm, signal)

    def plot(self, run: str | None = None) -> "ShownFigure":
        """A figure of command and position of each joint. run: its name, the first if left out."""
        from armlab.recordings.views import plot_run, run_named

        return plot_run(run_named(self.runs, run), self.recorded_arm)

    def __repr__(self) -> str:
        """The robot, the runs, and how many findings there are."""
        title = f"Motion recording {self.name!r} of {self.arm.name}; joints: {len(self.joints)}"
        return describe_runs(title, self.runs, self.findings)

    def with_role(self, role: Role) -> tuple[MotionRun, ...]:
        """The runs that identify, or those that validate."""
        return tuple(run for run in self.runs if run.role == role)


def is_motion_only(folder: Path) -> bool:
    """Whether a recording folder holds commands and positions, and no torque; InputError where its file is wrong."""
    return not read_recording_file(folder).has_torque


def load_motion_recording(folder: str | Path) -> MotionRecording:
    """The recording of motion only in a folder, in SI units on the joint side.

    Raises InputError, in one line, for what is missing, wrong, or not safe to repair.
    """
    empty, file = open_motion_recording(Path(folder))
    return with_motion_runs(empty, [run for entry in file.runs for run in load_motion_runs(empty, file, entry)])


def open_motion_recording(folder: Path) -> tuple[MotionRecording, RecordingFile]:
    """The recording without its runs, and the file that lists them; InputError where the file is wrong."""
    file = read_recording_file(folder)
    if file.columns.reference_position is None:
        raise InputError(
            f"columns in {folder / FILE_NAME} has no reference_position: this is no recording of motion only"
        )
    if file.without_torque:
        raise InputError(f"without_torque in {folder / FILE_NAME}: a recording of motion only has no torque at all")
    if file.timing is not None or file.gravity is not None or file.restore_gravity:
        raise InputError(f"timing and gravity in {folder / FILE_NAME}: a recording of motion only has neither")
    if file.simulation is not None:
        raise InputError(
            f"simulation in {folder / FILE_NAME}: motion only is compared with the MJCF of `robot` and `controller`"
        )
    arm = load_arm(file.robot, folder)
    refuse_coupled(arm, "a recording of motion only")
    joints = _recorded_joints(file, arm, folder)
    _check_controller(file, len(joints), folder)
    transmission = make_transmission(file, Arm(arm.name, tuple(arm.joints[joint] for joint in joints)), folder)
    if file.controller is None and file.robot.endswith(".xml"):
        refuse_other_drives(compile_mjcf(folder / file.robot), joints, folder / file.robot)
    empty = MotionRecording(folder, file.robot, arm, joints, (), transmission, file.controller)
    return replace(empty, recorded=file.recorded), file


def _recorded_joints(file: RecordingFile, arm: Arm, folder: Path) -> tuple[int, ...]:
    known = [joint.name for joint in arm.joints]
    if file.joints is None:
        return tuple(range(len(known)))
    for name in file.joints:
        if name not in known:
            raise InputError(f"joints in {folder / FILE_NAME}: no joint '{name}': {suggest_name(name, known)}")
    return tuple(known.index(name) for name in file.joints)


def _check_controller(file: RecordingFile, joints: int, folder: Path) -> None:
    for key in PER_JOINT_KEYS if file.controller is not None else ():
        values = getattr(file.controller, key)
        if isinstance(values, tuple) and len(values) != joints:
            where = f"controller.{key} in {folder / FILE_NAME}"
            raise InputError(f"{where} should hold {joints} numbers, one a joint, not {len(values)}")


def load_motion_runs(recording: MotionRecording, file: RecordingFile, entry: RunEntry) -> tuple[MotionRun, ...]:
    """The runs of one file: several where its clock starts anew or its signals jump at a gap."""
    units = channel_units(file, recording.recorded_arm, recording.folder)
    table = read_table(recording.folder / entry.file)
    places = RepairPlaces(table.row_numbers, file, entry, units, recording.recorded_arm.joints, recording.transmission)
    return repair_run(make_raw_motion_run(table, file, entry, units), places)


def with_motion_runs(recording: MotionRecording, runs: list[MotionRun]) -> MotionRecording:
    """The recording with its runs, and a note where none validates."""
    findings: tuple[Finding, ...] = ()
    if not any(run.role == "validate" for run in runs):
        text = "no run has the role validate: the last third of each run that identifies is held out"
        findings = (Finding("no_validation", "note", text),)
    return replace(recording, runs=tuple(runs), findings=findings)
