"""Writes a recording folder: `recording.yaml` and a CSV a run, the numbers to their last digit."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from problem.errors import InputError
from problem.settings import validate
from recordings.recording_file import FILE_NAME, RecordingFile
from recordings.run import Array, Role

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
        (folder / FILE_NAME).write_text(_yaml(settings, draft.source), encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write {folder}: {error.strerror}") from None
    return folder


def _yaml(settings: dict[str, Any], source: tuple[str, ...]) -> str:
    comment = "".join(f"# {line}\n" for line in source)
    return comment + yaml.safe_dump(_plain(settings), sort_keys=False, default_flow_style=None, width=110)


def _plain(data: Any) -> Any:
    """The data with lists for tuples, as YAML writes them."""
    if isinstance(data, dict):
        return {key: _plain(value) for key, value in data.items()}
    return [_plain(item) for item in data] if isinstance(data, list | tuple) else data
