"""What `armlab best-known` does: start after start, the records written after each, until the time is up."""

import json
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bench.best_known.config import Plan, build_excitation, read_plan
from bench.best_known.descent import End, check_supported, descend
from bench.best_known.record import FILE, Record, read_records, write_records
from bench.best_known.search import Start
from bench.provenance import provenance
from bench.trial import canonical
from problem.errors import InputError
from problem.excitation_problem import ExcitationProblem
from problem.transforms import Array

CONFIG = Path("configs/best_known.yaml")
FIRST_TRIES = 20  # starts before a problem counts as one without feasible trajectories
_DIGITS = 6  # of the ends, which are there to be compared


def improve_best_known(
    results: Path, minutes: float, problem: str | None = None, config: Path = CONFIG
) -> Iterator[str]:
    """Search on for better trajectories, of one problem or of all in turn; yields a line after each start.

    It goes on where the records in the folder `results` end, so it can be stopped at any time; a record is
    only ever replaced by a better one. minutes: no start begins later; each problem gets at least one.
    Raises InputError, in one line, for any mistake in the configuration or the records.
    """
    plan = read_plan(config)
    searches = [_search(plan, name, results / FILE) for name in ([problem] if problem else plan.problems)]
    results.mkdir(parents=True, exist_ok=True)
    began, first = time.monotonic(), True
    while first or time.monotonic() - began < 60 * minutes:
        for search in searches:
            if first or time.monotonic() - began < 60 * minutes:
                yield search.step()
        first = False


def _search(plan: Plan, name: str, path: Path) -> "_Search":
    settings = plan.settings(name)
    problem = build_excitation(settings, name)
    check_supported(problem, name)
    return _Search(plan, name, settings.model_dump(mode="json"), problem, path)


@dataclass(frozen=True, eq=False)
class _Search:
    """The search for one problem; all that it knows of earlier starts stands in the file."""

    plan: Plan
    name: str
    settings: dict[str, Any]
    problem: ExcitationProblem
    path: Path

    def step(self) -> str:
        """Make one start more, or so many that one is feasible for the first time; tell how it ended."""
        records = read_records(self.path)
        record = old = self._own(records.get(self.name))
        spent = _Spent(old.ends, old.evaluations, old.gradients) if old else _Spent({}, 0, 0)
        while record is None or record is old:
            start = Start(self.plan.seed, self.name, spent.starts)
            method, end = self._run(start, old, records)
            spent = spent.plus(method, end)
            record = self._updated(old, start, method, end, spent)
            if record is None and spent.starts == FIRST_TRIES:
                return f"{self.name}: {FIRST_TRIES} starts found nothing within all limits, so there is no record"
        write_records(self.path, read_records(self.path) | {self.name: record})
        close, of = record.agreeing(1e-3)
        told = f"{end.value:.6g}" if end.feasible else "infeasible"
        return f"{self.name}: start {start.number}, {method}: {told}; best {record.value:.6g}, met by {close} of {of}"

    def _own(self, record: Record | None) -> Record | None:
        """The record, if it is of this very problem."""
        if record is not None and canonical(record.settings) != canonical(self.settings):
            raise InputError(f"{self.path}: '{self.name}' has other settings there: rename the problem or remove it")
        return record

    def _run(self, start: Start, old: Record | None, records: dict[str, Record]) -> tuple[str, End]:
        best = point_of(old) if old else None
        source = self.plan.start_from.get(self.name)
        if source is None:
            return start.run(self.problem, best)
        if best is not None and start.number % 2:
            return "kick", start.kicked(self.problem, best)
        if source not in records:
            raise InputError(f"{self.name} starts from the record of '{source}', which is not there yet")
        return f"from {source}", descend(self.problem, point_of(records[source]))

    def _updated(self, old: Record | None, start: Start, method: str, end: End, spent: "_Spent") -> Record | None:
        """The old record with what was spent, or the new one in its place; None while nothing is feasible."""
        if not end.feasible or (old is not None and end.value >= old.value):
            return old.model_copy(update=vars(spent)) if old else None
        return Record(
            settings=self.settings,
            value=end.value,
            coefficients=dict(zip(self.problem.trajectory.names, end.point.tolist(), strict=True)),
            method=method,
            seed=start.seed,
            start=start.number,
            versions=_versions(),
            evaluations=spent.evaluations,
            gradients=spent.gradients,
            ends=spent.ends,
        )


@dataclass(frozen=True)
class _Spent:
    """How the starts ended so far, by method, and what they took."""

    ends: dict[str, tuple[float | None, ...]]
    evaluations: int
    gradients: int

    @property
    def starts(self) -> int:
        return sum(map(len, self.ends.values()))

    def plus(self, method: str, end: End) -> "_Spent":
        """With one start more."""
        value = float(f"{end.value:.{_DIGITS}g}") if end.feasible else None
        ends = self.ends | {method: (*self.ends.get(method, ()), value)}
        return _Spent(ends, self.evaluations + end.evaluations, self.gradients + end.gradients)


def point_of(record: Record) -> Array:
    """The point (dimension,) of a record, in the problem's own order."""
    return np.array(list(record.coefficients.values()))


def _versions() -> dict[str, str]:
    facts = json.loads(provenance())
    return {name: facts[name] for name in ("python", "armlab", "numpy", "scipy", "cmaes")}
