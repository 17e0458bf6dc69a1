"""`recording.yaml`: its keys, their types, and what must fit together."""

from pathlib import Path
from typing import Annotated, Literal

from annotated_types import Gt, Len
from pydantic import Field, model_validator

from problem.errors import InputError
from problem.settings import Settings, validate
from problem.yaml_input import read_yaml
from recordings.run import Role

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
