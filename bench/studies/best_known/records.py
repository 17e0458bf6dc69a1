"""Records of the best known trajectories: the problems that have one, the file, and the gap of a condition number to
its record.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from armlab.common.errors import InputError
from armlab.common.files import write_whole
from armlab.common.settings import Settings, read_json, read_yaml, suggest_name, validate
from bench.execute import canonical
from bench.plan import Entry
from problem.excitation import ExcitationProblem
from problem.registry import ProblemSettings, parse_problem
from problem.suite import InstanceSettings, definition_of


class SearchPlan(Settings):
    """Problems by name, as `problem.registry` reads them.

    start_from: problems that start in turn from the record of another problem and from perturbations of their own best.
    """

    name: str
    seed: Annotated[int, Field(ge=0)]
    problems: Annotated[dict[str, dict[str, Any]], Field(min_length=1)]
    start_from: dict[str, str] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _starts_are_problems(self) -> Self:
        for name in (*self.start_from, *self.start_from.values()):
            if name not in self.problems:
                raise ValueError(f"start_from names no problem '{name}': {suggest_name(name, list(self.problems))}")
        return self

    def settings(self, name: str) -> ProblemSettings:
        """Settings of one problem; raises InputError, in one line, for an unknown name or a mistake in them."""
        if name not in self.problems:
            raise InputError(f"no problem '{name}': {suggest_name(name, list(self.problems))}")
        return parse_problem(self.problems[name], f"problem '{name}'")


def read_search_plan(path: Path) -> SearchPlan:
    """The plan in a YAML file; raises InputError, in one line, for any mistake in it."""
    return validate(SearchPlan, read_yaml(path), str(path))


def build_excitation(settings: ProblemSettings, name: str) -> ExcitationProblem:
    """The problem; raises InputError if it is no trajectory of an arm, or one in shifted coordinates."""
    problem = settings.build()
    if not isinstance(problem, ExcitationProblem):
        raise InputError(f"{name}: should be a trajectory of an arm in its own coordinates, not '{problem.name}'")
    return problem


RECORDS_SCHEMA = "best-known/1"
RECORDS_FILE = "best_known.json"
METHODS_FROM_SCRATCH = ("cma-es", "gradient")


class Record(Settings):
    """The best trajectory known for one problem.

    settings: of the problem, in full. value: its condition number, or for D-optimality det(W'W)^(-1/n). coefficients:
    the point by the names of its coordinates. method, seed, start: the search that found it. evaluations, gradients:
    sum over all starts so far. versions: of the packages that found it. ends: by method the values at which the starts
    ended, in order; null for an infeasible one.
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

    def count_agreeing(self, tolerance: float) -> tuple[int, int]:
        """How many starts from scratch ended within a share of the best, and how many there were."""
        ends = [end for method in METHODS_FROM_SCRATCH for end in self.ends.get(method, ())]
        return sum(end is not None and end <= self.value * (1 + tolerance) for end in ends), len(ends)


class RecordFile(Settings):
    """All records by the problem's name."""

    schema_name: Literal["best-known/1"] = Field(alias="schema")
    problems: dict[str, Record]


def read_records(path: Path) -> dict[str, Record]:
    """Records by name, none if there is no file. Raises InputError, in one line, if it is not as written."""
    if not path.exists():
        return {}
    return dict(validate(RecordFile, read_json(path), str(path)).problems)


def write_records(path: Path, records: Mapping[str, Record]) -> None:
    """Write all records, sorted by name, a line for each key of a record."""
    problems = ",\n".join(f" {json.dumps(name)}: {_record_text(record)}" for name, record in sorted(records.items()))
    write_whole(path, f'{{"schema": "{RECORDS_SCHEMA}",\n"problems": {{\n{problems}\n}}}}\n')


def _record_text(record: Record) -> str:
    entries = record.model_dump(mode="json").items()
    return "{\n" + ",\n".join(f"  {json.dumps(key)}: {json.dumps(entry)}" for key, entry in entries) + "\n }"


_IGNORED_SETTINGS = (
    "criterion",
    "penalty",
    "frame_seed",
    "search_space",
)  # a trajectory's value and limits stay as they are


def record_key(settings: ProblemSettings) -> str:
    """Canonical text of the settings that decide the values and limits of a problem: equal text, equal best."""
    if isinstance(settings, InstanceSettings):
        settings = definition_of(settings.preset)
    kept = {name: value for name, value in settings.model_dump(mode="json").items() if name not in _IGNORED_SETTINGS}
    if kept["preset"] == "random-frame":
        kept["preset"] = "joint-fourier"  # the same trajectories in other coordinates
    return canonical(kept)


def records_by_problem(path: Path) -> dict[str, Record]:
    """Records of condition numbers in a file, by the key of their problem."""
    parsed = {name: (parse_record(record, name, path), record) for name, record in read_records(path).items()}
    return {record_key(settings): record for settings, record in parsed.values() if not is_d_optimal(settings)}


def parse_record(record: Record, name: str, path: Path) -> ProblemSettings:
    """The settings of a record's problem; raises InputError, in one line, for a mistake in them."""
    return parse_problem(record.settings, f"{path}, '{name}'")


def is_d_optimal(settings: ProblemSettings) -> bool:
    """Whether a problem asks for D-optimality in place of the condition number."""
    criterion = getattr(settings, "criterion", None)
    return criterion is not None and criterion.kind == "d_optimality"


def gap_to_best_known(settings: ProblemSettings, value: float, known: dict[str, Record]) -> float | None:
    """Relative excess of a condition number over the best known, 0.1 for 10 % more; None without a record.

    known: as `best_known_values` returns it. Negative for a value that beats the record.
    """
    record = known.get(record_key(settings))
    return None if record is None else value / record.value - 1


def best_known_values(entries: Sequence[Entry], records: Path) -> dict[str, float]:
    """By the label of the entry's problem; problems without a record are left out."""
    return known_values({entry.problem: entry.trial.problem for entry in entries}, records)


def known_values(problems: Mapping[str, ProblemSettings], records: Path) -> dict[str, float]:
    """Best known condition numbers by label; problems without a record are left out."""
    known = records_by_problem(records)
    keys = {label: record_key(settings) for label, settings in problems.items()}
    return {label: known[key].value for label, key in keys.items() if key in known}
