"""The search for better trajectories, `armlab bench best-known`.

Each start is a random point, the end of a CMA-ES run or a perturbation of the best known; the records are written after
each start.
"""

import fcntl
import json
import os
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from algorithms.cmaes import CMAESParams
from algorithms.contract import Box, uniform_points
from algorithms.driver import minimise
from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.streams import named_generator
from bench.config import find_algorithm
from bench.execute import canonical
from bench.provenance import provenance
from bench.studies.best_known.descent import SearchEnd, check_supported, descend, evaluate_point, keep_limits
from bench.studies.best_known.records import (
    RECORDS_FILE,
    Record,
    SearchPlan,
    build_excitation,
    read_records,
    read_search_plan,
    write_records,
)
from problem.excitation import ExcitationProblem
from problem.fitness import Criterion
from problem.safe_motion import SafeConstraints

METHOD_TURNS = ("cma-es", "gradient", "kick", "cma-es", "kick", "kick")  # one after the other
METHOD_TURNS_WITH_COLLISIONS = ("gradient", "kick", "kick")  # the same where a population is dear
METHOD_TURNS_WITHOUT_DERIVATIVES = ("cma-es", "kick")  # the same where there are no derivatives
EVALUATIONS_WITHOUT_DERIVATIVES = 10_000  # of such a start: these problems are dear
RANDOM_DRAWS = 200  # random points, the best of which is a start
POPULATION, DOUBLINGS = 25, 4  # of CMA-ES: doubled from one restart to the next (Auger and Hansen 2005), then anew
CMAES_GENERATIONS = 600  # generations
SWING_RANGE = (0.25, 1.0)  # of random points with collisions: at 1 none of 300 of the TX40 is clear, at 0.5 a fifth
KICK_RANGE = (0.05, 0.6)  # range of their standard deviations, in halves of the box
KICKED_POINTS = 4  # kicked points, the best of which is a start: of more, the best would be the least moved one


@dataclass(frozen=True)
class SearchStart:
    """One start of a problem's search; seed, name and number decide it, and for a perturbation the best known too."""

    seed: int
    name: str
    number: int

    def run(self, problem: ExcitationProblem, best: Array | None) -> tuple[str, SearchEnd]:
        """How this start began, and its end; best: the point (dimension,) to perturb, if there is one yet."""
        rng = self._stream()
        box = Box(problem.lower, problem.upper)
        if not problem.spectral:
            return self._run_without_derivatives(problem, box, best, rng)
        turns: Sequence[str] = METHOD_TURNS
        if isinstance(problem.constraints, SafeConstraints):
            turns = METHOD_TURNS_WITH_COLLISIONS
        plain = _with_smooth_criterion(problem)
        turn = turns[self.number % len(turns)]
        if turn == "cma-es":
            return turn, self._evolve_and_descend(plain, box, rng)
        if turn == "kick" and best is not None:
            return turn, self.descend_from_kick(problem, best)
        points = uniform_points(RANDOM_DRAWS, box, rng)
        if isinstance(problem.constraints, SafeConstraints):
            points = keep_limits(problem, _shrink_swings(problem, points, rng.uniform(*SWING_RANGE, RANDOM_DRAWS)))
        return "gradient", _descend_from_best_of(plain, points)

    def descend_from_kick(self, problem: ExcitationProblem, best: Array) -> SearchEnd:
        """The end of a descent from the surroundings of the best known point (dimension,)."""
        rng = self._stream()
        spread = np.exp(rng.uniform(*np.log(KICK_RANGE))) * (problem.upper - problem.lower) / 2
        touched = rng.random((KICKED_POINTS, len(best))) < rng.random((KICKED_POINTS, 1))  # few numbers or many
        points = best + spread * touched * rng.normal(size=(KICKED_POINTS, len(best)))
        return _descend_from_best_of(_with_smooth_criterion(problem), np.clip(points, problem.lower, problem.upper))

    def _run_without_derivatives(
        self, problem: ExcitationProblem, box: Box, best: Array | None, rng: np.random.Generator
    ) -> tuple[str, SearchEnd]:
        turn = (
            METHOD_TURNS_WITHOUT_DERIVATIVES[self.number % len(METHOD_TURNS_WITHOUT_DERIVATIVES)]
            if best is not None
            else "cma-es"
        )
        if turn == "kick" and best is not None:
            reach = np.exp(rng.uniform(*np.log(KICK_RANGE))) * (box.upper - box.lower) / 2
            box = Box(np.maximum(best - reach, box.lower), np.minimum(best + reach, box.upper))
        return turn, _run_cmaes(problem, box, POPULATION, EVALUATIONS_WITHOUT_DERIVATIVES, rng)

    def _stream(self) -> np.random.Generator:
        return named_generator("best known", self.seed, self.name, self.number)

    def _evolve_and_descend(self, plain: ExcitationProblem, box: Box, rng: np.random.Generator) -> SearchEnd:
        restarts = sum(METHOD_TURNS[number % len(METHOD_TURNS)] == "cma-es" for number in range(self.number))
        size = POPULATION * 2 ** (restarts % DOUBLINGS)
        before = _run_cmaes(plain, box, size, CMAES_GENERATIONS * size, rng)
        after = descend(plain, before.point)
        best = after if after.better_than(before) else replace(before, gradients=after.gradients)
        return replace(best, evaluations=before.evaluations + after.evaluations)


def _run_cmaes(
    problem: ExcitationProblem, box: Box, size: int, evaluations: int, rng: np.random.Generator
) -> SearchEnd:
    """Where CMA-ES ends in a box."""
    algorithm, population = find_algorithm("cma-es", "best-known"), uniform_points(size, box, rng)
    with np.errstate(over="ignore"):  # in the package, when every point of a generation is as good
        found = minimise(
            algorithm, CMAESParams(), lambda X: problem.evaluate(X).fitness, box, population, evaluations, rng
        )
    return _add_evaluations(evaluate_point(problem, found.best_x), found.evaluations - 1)


def _with_smooth_criterion(problem: ExcitationProblem) -> ExcitationProblem:
    """The same problem, where the fitness is the condition number, or D-optimality, and the penalty alone."""
    return problem if problem.criterion.kind == "d_optimality" else replace(problem, criterion=Criterion("eq44"))


def _descend_from_best_of(plain: ExcitationProblem, points: Array) -> SearchEnd:
    return _add_evaluations(descend(plain, points[np.argmin(plain.evaluate(points).fitness)]), len(points))


def _shrink_swings(problem: ExcitationProblem, points: Array, shares: Array) -> Array:
    """Points (points, dimension) whose swings about q0 have a share (points,) of their size."""
    swings = np.array([not name.startswith("q0") for name in problem.trajectory.names])
    return np.where(swings, shares[:, None] * points, points)


def _add_evaluations(end: SearchEnd, evaluations: int) -> SearchEnd:
    return replace(end, evaluations=end.evaluations + evaluations)


CONFIG_FILE = Path("configs/best_known.yaml")
MAX_INFEASIBLE_STARTS = 20  # starts before a problem counts as one without feasible trajectories
_END_DIGITS = 6  # of the ends, which are there to be compared


def improve_best_known(
    results: Path, minutes: float, problem: str | None = None, config: Path = CONFIG_FILE
) -> Iterator[str]:
    """Continue the search for better trajectories, of one problem or of all in turn; yields a line after each start.

    It continues from the records in the folder `results`, so it can be stopped at any time; only a better one replaces
    a record. minutes: no start begins later; each problem gets at least one. Raises InputError, in one line, for any
    mistake in the configuration or the records.
    """
    plan = read_search_plan(config)
    searches = [_make_search(plan, name, results / RECORDS_FILE) for name in ([problem] if problem else plan.problems)]
    results.mkdir(parents=True, exist_ok=True)
    began, first = time.monotonic(), True
    while first or time.monotonic() - began < 60 * minutes:
        for search in searches:
            if first or time.monotonic() - began < 60 * minutes:
                yield search.step()
        first = False


def _make_search(plan: SearchPlan, name: str, path: Path) -> "_ProblemSearch":
    settings = plan.settings(name)
    problem = build_excitation(settings, name)
    check_supported(problem, name)
    return _ProblemSearch(plan, name, settings.model_dump(mode="json"), problem, path)


@dataclass(frozen=True, eq=False)
class _ProblemSearch:
    """The search for one problem; all that it knows of earlier starts is in the file."""

    plan: SearchPlan
    name: str
    settings: dict[str, Any]
    problem: ExcitationProblem
    path: Path

    def step(self) -> str:
        """Make one more start, or as many as it takes to find the first feasible point; returns a line about it."""
        records = read_records(self.path)
        old = self._check_record(records.get(self.name))
        made: list[_Start] = []
        while not made or (old is None and not made[-1].end.feasible):
            chosen = SearchStart(self.plan.seed, self.name, (old.starts if old else 0) + len(made))
            method, end = self._run(chosen, old, records)
            made.append(_Start(chosen.number, method, end))
            if old is None and not end.feasible and len(made) == MAX_INFEASIBLE_STARTS:
                return (
                    f"{self.name}: {MAX_INFEASIBLE_STARTS} starts found nothing within all limits, so there "
                    "is no record"
                )
        with _alone_in(self.path.parent):
            records = read_records(self.path)  # another search may have written meanwhile
            record = self._add_starts(self._check_record(records.get(self.name)), made)
            write_records(self.path, records | {self.name: record})
        close, of = record.count_agreeing(1e-3)
        start = made[-1]
        told = f"{start.end.value:.6g}" if start.end.feasible else "infeasible"
        best = f"best {record.value:.6g}, met by {close} of {of}"
        return f"{self.name}: start {start.number}, {start.method}: {told}; {best}"

    def _check_record(self, record: Record | None) -> Record | None:
        """The record, if it is of this very problem."""
        if record is not None and canonical(record.settings) != canonical(self.settings):
            raise InputError(
                f"{self.path}: '{self.name}' has other settings there: rename the problem or remove its record"
            )
        return record

    def _run(self, start: SearchStart, old: Record | None, records: dict[str, Record]) -> tuple[str, SearchEnd]:
        best = record_point(old) if old else None
        source = self.plan.start_from.get(self.name)
        if source is None:
            return start.run(self.problem, best)
        if best is not None and start.number % 2:
            return "kick", start.descend_from_kick(self.problem, best)
        if source not in records:
            raise InputError(f"{self.name} starts from the record of '{source}', which does not exist yet")
        return f"from {source}", descend(self.problem, record_point(records[source]))

    def _add_starts(self, record: Record | None, made: Sequence["_Start"]) -> Record:
        """The record with the added effort, or a new one where a start ended better (one is feasible)."""
        spent = _Effort(record.ends, record.evaluations, record.gradients) if record else _Effort({}, 0, 0)
        for start in made:
            spent = spent.plus(start.method, start.end)
        best = min(made, key=lambda start: start.end.value if start.end.feasible else np.inf)
        if record is not None and not (best.end.feasible and best.end.value < record.value):
            return record.model_copy(update=vars(spent))
        return Record(
            settings=self.settings,
            value=best.end.value,
            coefficients=dict(zip(self.problem.trajectory.names, best.end.point.tolist(), strict=True)),
            method=best.method,
            seed=self.plan.seed,
            start=best.number,
            versions=_package_versions(),
            evaluations=spent.evaluations,
            gradients=spent.gradients,
            ends=spent.ends,
        )


@contextmanager
def _alone_in(folder: Path) -> Iterator[None]:
    """Waits until no other search writes into the folder, where the file system has locks."""
    opened = os.open(folder, os.O_RDONLY)
    try:
        with suppress(OSError):
            fcntl.flock(opened, fcntl.LOCK_EX)
        yield
    finally:
        os.close(opened)


@dataclass(frozen=True)
class _Start:
    """A start that was made: its number, how it began, and its end."""

    number: int
    method: str
    end: SearchEnd


@dataclass(frozen=True)
class _Effort:
    """Ends of the starts so far, by method, and their effort."""

    ends: dict[str, tuple[float | None, ...]]
    evaluations: int
    gradients: int

    def plus(self, method: str, end: SearchEnd) -> "_Effort":
        """The effort with one more start."""
        value = float(f"{end.value:.{_END_DIGITS}g}") if end.feasible else None
        ends = self.ends | {method: (*self.ends.get(method, ()), value)}
        return _Effort(ends, self.evaluations + end.evaluations, self.gradients + end.gradients)


def record_point(record: Record) -> Array:
    """The point (dimension,) of a record, in the problem's own order."""
    return np.array(list(record.coefficients.values()))


def _package_versions() -> dict[str, str]:
    facts = json.loads(provenance())
    return {name: facts[name] for name in ("python", "armlab", "numpy", "scipy", "cmaes")}
