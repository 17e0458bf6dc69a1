"""The folder of a recording: the keys of `recording.yaml`, how the file is read, and how a new folder is written."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import pandas as pd
import yaml
from annotated_types import Gt, Len
from pydantic import Field, model_validator

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.settings import Settings, read_yaml, validate
from armlab.recordings.recording import Role

FILE_NAME = "recording.yaml"
Names = Annotated[tuple[str, ...], Len(min_length=1)]
Matrix = tuple[tuple[float, ...], ...]


class Columns(Settings):
    """Names of the columns of the run files, one a joint in the order of the robot."""

    time: str
    position: Names
    torque: Names | None = None
    current: Names | None = None
    velocity: Names | None = None
    temperature: Names | None = None
    link_position: Names | None = None
    reference_position: Names | None = None
    simulated_torque: Names | None = None
    simulated_position: Names | None = None

    @model_validator(mode="after")
    def _consistent(self) -> "Columns":
        if (self.torque is None) == (self.current is None):
            raise ValueError("columns should name either torque or current")
        names = [name for signal in self.signals().values() for name in signal]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"column '{twice[0]}' is named twice")
        return self

    def signals(self) -> dict[str, tuple[str, ...]]:
        """Column names of each signal that is there, time first."""
        given = {name: getattr(self, name) for name in type(self).model_fields if name != "time"}
        return {"time": (self.time,), **{name: names for name, names in given.items() if names is not None}}


class TransmissionEntry(Settings):
    """Matrices from raw channels to joints: q = position @ raw + offset, tau = torque @ raw."""

    position: Matrix | None = None
    offset: tuple[float, ...] | None = None
    torque: Matrix | None = None


class RunEntry(Settings):
    """One run file and what it is for."""

    file: str
    role: Role = "identify"


class RecordingFile(Settings):
    """The content of `recording.yaml` (schema recording/1)."""

    schema_: Literal["recording/1"] = Field(alias="schema")
    robot: str
    simulation: str | None = None
    sample_rate_hz: Annotated[float, Gt(0)] | None = None
    columns: Columns
    units: dict[str, str | tuple[str, ...]]
    transmission: TransmissionEntry = TransmissionEntry()
    gains: tuple[float, ...] | None = None
    runs: Annotated[tuple[RunEntry, ...], Len(min_length=1)]

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
    if not path.is_file():
        raise InputError(f"no {FILE_NAME} in {folder}: a recording is a folder with {FILE_NAME} and its runs")
    return validate(RecordingFile, read_yaml(path), str(path))


Keys = dict[str, str | tuple[str, ...]]


@dataclass(frozen=True, eq=False)
class DraftRun:
    """One run to be written: values (samples, columns) as they were recorded, under their names."""

    file: str
    role: Role
    names: tuple[str, ...]
    values: Array


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
        runs = [{"file": run.file, "role": run.role} for run in self.runs]
        given = {"columns": self.columns, "units": self.units, **self.others, "runs": runs}
        return {"schema": "recording/1", "robot": self.robot, **given}


def write_recording(draft: Draft, folder: Path) -> Path:
    """Writes a draft into a new folder and returns its path.

    Raises InputError for a folder that holds something already and for a draft that is no valid recording.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder} is there already and not empty: choose a new folder")
    settings = draft.settings()
    file = validate(RecordingFile, settings, str(folder / FILE_NAME))
    wanted = [name for names in file.columns.signals().values() for name in names]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for run in draft.runs:
            table = pd.DataFrame(run.values, columns=list(run.names))
            table[wanted].to_csv(folder / run.file, index=False, lineterminator="\n")
        (folder / FILE_NAME).write_text(_to_yaml(settings, draft.source), encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write {folder}: {error.strerror}") from None
    return folder


def _to_yaml(settings: dict[str, Any], source: tuple[str, ...]) -> str:
    comment = "".join(f"# {line}\n" for line in source)
    return comment + yaml.safe_dump(_to_plain_data(settings), sort_keys=False, default_flow_style=None, width=110)


def _to_plain_data(data: Any) -> Any:
    """The data with lists for tuples, as YAML writes them."""
    if isinstance(data, dict):
        return {key: _to_plain_data(value) for key, value in data.items()}
    return [_to_plain_data(item) for item in data] if isinstance(data, list | tuple) else data
