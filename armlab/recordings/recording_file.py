"""The folder of a recording: the keys of `recording.yaml`, the reader of the file, and the writer of a new folder."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal

import yaml
from annotated_types import Ge, Gt, Le, Len
from pydantic import ConfigDict, Field, model_validator

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.files import all_or_none
from armlab.common.settings import Settings, read_yaml, to_plain_data, validate
from armlab.recordings.recording import Role

FILE_NAME = "recording.yaml"
PIECE_ROWS = 100_000  # of a run, that are written at once
Names = Annotated[tuple[str, ...], Len(min_length=1)]
Bounded = Annotated[float, Ge(-1e9), Le(1e9)]  # in SI units no arm has a larger number
Matrix = tuple[tuple[Bounded, ...], ...]
Positive = Annotated[float, Gt(0)]
NotNegative = Annotated[float, Ge(0)]
PerJoint = Annotated[tuple[Bounded | None, ...], Len(min_length=1)]
PositivePerJoint = Annotated[tuple[Annotated[float, Gt(0), Le(1e9)] | None, ...], Len(min_length=1)]
NotNegativePerJoint = Annotated[tuple[Annotated[float, Ge(0), Le(1e9)] | None, ...], Len(min_length=1)]


class Columns(Settings):
    """Names of the columns in the run files, one a joint in the order of the robot.

    A recording has `torque`, or `current` with `gains`. A recording of motion only has `reference_position` instead;
    a `current` beside it has an unknown scale and sign. `voltage` and `temperature`: one a sensor.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "anyOf": [{"required": ["torque"]}, {"required": ["current"]}, {"required": ["reference_position"]}]
        }
    )

    time: str
    position: Names
    torque: Names | None = None
    current: Names | None = None
    velocity: Names | None = None
    temperature: Names | None = None
    voltage: Names | None = None
    link_position: Names | None = None
    reference_position: Names | None = None
    reference_velocity: Names | None = None
    simulated_torque: Names | None = None
    simulated_position: Names | None = None

    @model_validator(mode="after")
    def _consistent(self) -> "Columns":
        if self.torque is not None and self.current is not None:
            raise ValueError("columns should name either torque or current, not both")
        if self.torque is None and self.current is None and self.reference_position is None:
            raise ValueError(
                "columns should name either torque or current; a recording of motion only names reference_position"
            )
        names = [name for signal in self.signals().values() for name in signal]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"column '{twice[0]}' is named twice")
        return self

    def signals(self) -> dict[str, tuple[str, ...]]:
        """Column names of each signal that the file names, time first."""
        given = {name: getattr(self, name) for name in type(self).model_fields if name != "time"}
        return {"time": (self.time,), **{name: names for name, names in given.items() if names is not None}}


class TransmissionEntry(Settings):
    """Matrices from raw channels to joints: q = position @ raw + offset, tau = torque @ raw."""

    position: Matrix | None = None
    offset: tuple[Bounded, ...] | None = None
    torque: Matrix | None = None


class ControllerEntry(Settings):
    """The drive as the simulation has it: tau = kp (reference - position) + kd (reference velocity - velocity).

    kp, ki_speed: N m/rad; kd: N m s/rad; ki: N m/(rad s); torque_limit, integral_limit: N m; limit_slope: N m s/rad, by
    which the torque limit falls with speed where the drive does work; one a joint, null where unknown. ki_speed: of a
    cascade whose integral acts on the velocity, too: the integral grows by ki (reference - position) - ki_speed
    velocity, and kp holds ki_speed.
    reference_velocity: zero, or the derivative of the reference. feedforward: what the drive adds, from the simulation.
    delay: s, of the command, of all joints or one a joint. read_delay: s, one a joint, where joints are read one after
    another. offset: rad (m), added to the command; dead_band: rad (m), whole width of the errors that the drive
    ignores. rate_hz: how often the command is taken over and held. velocity_filter_hz: cut-off of the velocity that the
    drive feeds back. supply, kt, resistance: V, N m/A, ohm, of a drive that commands a voltage.
    """

    type: Literal["pd"]
    kp: PositivePerJoint
    kd: NotNegativePerJoint
    ki: PerJoint | None = None
    ki_speed: PerJoint | None = None
    reference_velocity: Literal["zero", "derivative"] = "zero"
    feedforward: Literal["none", "gravity", "model"] = "none"
    torque_limit: PositivePerJoint | None = None
    limit_slope: Annotated[tuple[NotNegative | None, ...], Len(min_length=1)] | None = None
    integral_limit: PerJoint | None = None
    delay: NotNegative | Annotated[tuple[NotNegative, ...], Len(min_length=1)] = 0.0
    offset: PerJoint | None = None
    dead_band: PerJoint | None = None
    read_delay: tuple[NotNegative, ...] | None = None
    rate_hz: Positive | None = None
    velocity_filter_hz: Positive | None = None
    supply: Positive | None = None
    kt: PerJoint | None = None
    resistance: PerJoint | None = None


class TimingEntry(Settings):
    """What is wrong with the time of a recording: its stamps are clock_factor x true time, its torques are late.

    torque_delay: s of true time, of all torques or one a joint.
    """

    clock_factor: Positive = 1.0
    torque_delay: float | tuple[float, ...] = 0.0

    def delays(self, joints: int) -> tuple[float, ...]:
        """Seconds by which the torque of each joint is late; ValueError for another number of them than of joints."""
        own = self.torque_delay if isinstance(self.torque_delay, tuple) else (self.torque_delay,) * joints
        if len(own) != joints:
            raise ValueError(f"timing.torque_delay should hold one number or {joints}, not {len(own)}")
        return own


class RunEntry(Settings):
    """One run file and what it is for.

    exclude: stretches [first, last] of the time column, s, that are left out: contact, a hand that touched the arm.
    """

    file: str
    role: Role = "identify"
    exclude: tuple[tuple[float, float], ...] = ()

    @model_validator(mode="after")
    def _stretches_in_order(self) -> "RunEntry":
        for first, last in self.exclude:
            if first >= last:
                raise ValueError(f"exclude of {self.file} should hold [first, last], so [{last:g}, {first:g}]")
        return self


class RecordingFile(Settings):
    """The content of `recording.yaml` (schema recording/1).

    robot: a path beside the file or the name of a built-in robot. simulation: the model to compare with, a path.
    units: of each signal, one for all its columns or one a column. gains: N m (N) per A or V, one a channel.
    controller: of the simulation; null where it is unknown. recorded: the day, as 2026-01-31. timing: errors of the
    clock that are taken back. gravity: m/s2 in the base frame, where the arm is mounted otherwise than its robot file
    says. restore_gravity: whether the gravity of the robot's links, which the drive took from the torque, is added.
    without_torque: joints, from 1, whose columns of torque hold none: they are left out. joints: of a recording of
    motion only, names of the joints that the columns belong to; all if left out. The others are held at zero.
    """

    schema_: Literal["recording/1"] = Field(alias="schema")
    robot: str
    simulation: str | None = None
    sample_rate_hz: Positive | None = None
    columns: Columns
    units: dict[str, str | tuple[str, ...]]
    transmission: TransmissionEntry = TransmissionEntry()
    gains: tuple[Bounded, ...] | None = None
    controller: ControllerEntry | None = None
    joints: Names | None = None
    recorded: date | None = None
    timing: TimingEntry | None = None
    gravity: tuple[float, float, float] | None = None
    restore_gravity: bool = False
    without_torque: tuple[Annotated[int, Ge(1)], ...] = ()
    runs: Annotated[tuple[RunEntry, ...], Len(min_length=1)]

    @property
    def has_torque(self) -> bool:
        """False for a recording of motion only: commands and positions, and no torque."""
        if self.columns.torque is not None:
            return True
        return self.columns.current is not None and (self.gains is not None or self.columns.reference_position is None)

    @model_validator(mode="after")
    def _runs_once(self) -> "RecordingFile":
        files = [entry.file for entry in self.runs]
        twice = sorted({file for file in files if files.count(file) > 1})
        if twice:
            raise ValueError(f"run '{twice[0]}' is listed twice: a run cannot both identify and validate")
        return self


def read_recording_file(folder: Path) -> RecordingFile:
    """The checked content of `recording.yaml` in a folder; InputError, in one line, where it is wrong."""
    path = folder / FILE_NAME
    if folder.is_file():
        raise InputError(
            f"{folder} is a file: `armlab recording import {folder} --out FOLDER` makes a recording of a log"
        )
    if not path.is_file():
        raise InputError(f"no {FILE_NAME} in {folder}: a recording is a folder with {FILE_NAME} and its runs")
    return validate(RecordingFile, read_yaml(path), str(path))


Keys = dict[str, str | tuple[str, ...]]


@dataclass(frozen=True, eq=False)
class DraftRun:
    """One run to be written: values (samples, columns) as they were recorded, under their names.

    exclude: stretches of time that are left out when it is read, as in `RunEntry`.
    """

    file: str
    role: Role
    names: tuple[str, ...]
    values: Array
    exclude: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, eq=False)
class Draft:
    """A recording to be written; columns, units and the other keys are those of `recording.yaml`.

    columns: column names of each signal; other columns of the runs are left out. others: further keys.
    source: lines of comment that say where the data come from.
    """

    robot: str
    columns: Keys
    units: Keys
    runs: tuple[DraftRun, ...]
    others: dict[str, Any] = field(default_factory=dict)
    source: tuple[str, ...] = ()

    def settings(self) -> dict[str, Any]:
        """The content of `recording.yaml`."""
        runs: list[dict[str, Any]] = [{"file": run.file, "role": run.role} for run in self.runs]
        for entry, run in zip(runs, self.runs, strict=True):
            if run.exclude:
                entry["exclude"] = run.exclude
        given = {"columns": self.columns, "units": self.units, **self.others, "runs": runs}
        return {"schema": "recording/1", "robot": self.robot, **given}


def check_new_folder(folder: Path) -> None:
    """Raises InputError for a folder that holds something already."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder} is there already and not empty: choose a new folder")


def write_recording(draft: Draft, folder: Path, beside: Mapping[str, str | bytes] = MappingProxyType({})) -> Path:
    """Writes a draft into a new folder and returns its path. beside: further files by name, such as the robot.

    Raises InputError for a folder that holds something already and for a draft that is no valid recording.
    """
    check_new_folder(folder)
    settings = draft.settings()
    file = validate(RecordingFile, settings, str(folder / FILE_NAME))
    wanted = [name for names in file.columns.signals().values() for name in names]
    with all_or_none(folder.absolute()) as place:
        for run in draft.runs:
            _write_run(run, wanted, place / run.file)
        for name, text in {**beside, FILE_NAME: _to_yaml(settings, draft.source)}.items():
            (place / name).write_bytes(text.encode() if isinstance(text, str) else text)
    return folder


def _write_run(run: DraftRun, wanted: list[str], path: Path) -> None:
    """A run as CSV or Parquet, by its ending, piece by piece."""
    import pandas as pd  # loaded by those who write

    places = [run.names.index(name) for name in wanted]
    pieces = (run.values[first : first + PIECE_ROWS, places] for first in range(0, len(run.values), PIECE_ROWS))
    if path.suffix == ".parquet":
        import pyarrow as arrow
        from pyarrow import parquet

        schema = arrow.schema([(name, arrow.float64()) for name in wanted])
        with parquet.ParquetWriter(path, schema, use_dictionary=False) as writer:
            for piece in pieces:
                writer.write_table(arrow.table(list(piece.T.copy()), schema=schema))
        arrow.default_memory_pool().release_unused()
        return
    with path.open("w", encoding="utf-8", newline="") as stream:
        stream.write(pd.DataFrame(columns=wanted).to_csv(index=False, lineterminator="\n"))
        for piece in pieces:
            pd.DataFrame(piece).to_csv(stream, index=False, header=False, lineterminator="\n")


def _to_yaml(settings: dict[str, Any], source: tuple[str, ...]) -> str:
    comment = "".join(f"# {line}\n" for line in source)
    return comment + yaml.safe_dump(to_plain_data(settings), sort_keys=False, default_flow_style=None, width=110)
