"""The records on the disk: one problem's best trajectory, how it was found, and how all starts ended."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from bench.files import write_whole
from problem.errors import InputError
from problem.settings import Settings, validate

SCHEMA = "best-known/1"
FILE = "best_known.json"
SCRATCH = ("cma-es", "gradient")


class Record(Settings):
    """The best trajectory known for one problem.

    settings: of the problem, in full. value: its condition number. coefficients: the point by the names of its
    numbers. method, seed, start: what found it. evaluations, gradients: spent over all starts so far.
    versions: of the packages that found it. ends: by method the values at which the starts ended, in order;
    null for an infeasible one.
    """

    settings: dict[str, Any]
    value: float
    coefficients: dict[str, float]
    method: str
    seed: int
    start: int
    evaluations: int
    gradients: int
    versions: dict[str, str]
    ends: dict[str, tuple[float | None, ...]] = Field(default_factory=dict)

    @property
    def starts(self) -> int:
        """Starts made so far."""
        return sum(map(len, self.ends.values()))

    def agreeing(self, tolerance: float) -> tuple[int, int]:
        """How many starts from scratch ended within a share of the best, and of how many; no kicks, no warm starts."""
        ends = [end for method in SCRATCH for end in self.ends.get(method, ())]
        return sum(end is not None and end <= self.value * (1 + tolerance) for end in ends), len(ends)


class RecordFile(Settings):
    """All records by the problem's name."""

    schema_name: Literal["best-known/1"] = Field(alias="schema")
    problems: dict[str, Record]


def read_records(path: Path) -> dict[str, Record]:
    """Records by name, none if there is no file. Raises InputError, in one line, if it is not as written."""
    if not path.exists():
        return {}
    try:
        content = json.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read the records {path}: {error}") from None
    return dict(validate(RecordFile, content, str(path)).problems)


def write_records(path: Path, records: Mapping[str, Record]) -> None:
    """Write all records, sorted by name, a line for each key of a record."""
    problems = ",\n".join(f" {json.dumps(name)}: {_text(record)}" for name, record in sorted(records.items()))
    write_whole(path, f'{{"schema": "{SCHEMA}",\n"problems": {{\n{problems}\n}}}}\n')


def _text(record: Record) -> str:
    entries = record.model_dump(mode="json").items()
    return "{\n" + ",\n".join(f"  {json.dumps(key)}: {json.dumps(entry)}" for key, entry in entries) + "\n }"
