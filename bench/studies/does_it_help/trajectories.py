"""Feasible trajectories from bad to the best known, on which the criteria are compared."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from algorithms.contract import Box
from algorithms.driver import minimise
from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.streams import named_generator
from bench.config import find_algorithm
from bench.studies.best_known.records import Record, build_excitation
from bench.studies.best_known.search import record_point
from problem.excitation import ExcitationProblem
from problem.fitness import Criterion
from problem.registry import parse_problem

PROBLEM_SETTINGS: dict[str, Any] = {"preset": "joint-fourier"}
BEST_RECORD = "joint-fourier"  # the record of that problem
FAMILY_RECORDS = ("joint-fourier", "joint-fourier-rest")
UNIT_COLUMN_RECORDS = (
    "joint-fourier-unit-columns",
    "joint-fourier-rest-unit-columns",
)  # looked at, but in no correlation
ALGORITHMS = ("random-search", "spso", "de", "cma-es")
SEARCH_CRITERIA: tuple[Literal["eq44", "d_optimality", "e_optimality"], ...] = ("eq44", "d_optimality", "e_optimality")
REPETITIONS, SWARM = 2, 50
BUDGETS = (200, 500, 1500, 4000, 10000)  # evaluations
RANDOM = 90
PATHS, STEPS = 12, (0.1, 0.25, 0.45, 0.7, 0.9)  # from the best known towards random ones


@dataclass(frozen=True, eq=False)
class Specimen:
    """One trajectory: a point (dimension,) of a problem. group: trajectories with a common origin, e.g. one search."""

    problem: ExcitationProblem
    point: Array
    source: str
    group: str


def make_specimens(seed: int, records: dict[str, Record]) -> list[Specimen]:
    """All specimens, each feasible and different from the others; raises InputError without a record to start from."""
    if BEST_RECORD not in records:
        raise InputError(f"there is no best-known record of '{BEST_RECORD}': make one with `armlab bench best-known`")
    problem = build_excitation(parse_problem(PROBLEM_SETTINGS, "does-it-help"), "does-it-help")
    best = record_point(records[BEST_RECORD])
    found = [
        *_recorded_specimens(records, FAMILY_RECORDS, "best known"),
        *_random_specimens(problem, seed),
        *_specimens_between(problem, best, seed),
        *_searched_specimens(problem, seed),
    ]
    return list({specimen.point.tobytes(): specimen for specimen in found}.values())


def random_feasible(problem: ExcitationProblem, rng: np.random.Generator) -> Array:
    """A point (dimension,) within all limits: a random one, drawn towards the middle of the box by a random share."""
    middle, half = (problem.lower + problem.upper) / 2, (problem.upper - problem.lower) / 2
    while True:
        point = middle + rng.uniform(0.05, 1.0) * rng.uniform(-half, half)
        if problem.evaluate(point[None]).violation[0] == 0:
            return np.asarray(point)


def unit_column_specimens(records: dict[str, Record]) -> list[Specimen]:
    """The best known for unit columns, where there is a record of them."""
    return list(_recorded_specimens(records, UNIT_COLUMN_RECORDS, "best known, unit columns"))


def _recorded_specimens(records: dict[str, Record], names: Sequence[str], source: str) -> Iterator[Specimen]:
    for name in names:
        if name in records:
            problem = build_excitation(parse_problem(records[name].settings, name), name)
            yield Specimen(problem, record_point(records[name]), source, name)


def _random_specimens(problem: ExcitationProblem, seed: int) -> Iterator[Specimen]:
    for number in range(RANDOM):
        rng = named_generator("does it help", "random", seed, number)
        yield Specimen(problem, random_feasible(problem, rng), "random", f"random {number}")


def _specimens_between(problem: ExcitationProblem, best: Array, seed: int) -> Iterator[Specimen]:
    """Points between the best known and random ones; they are feasible, because the limits are convex."""
    for number in range(PATHS):
        other = random_feasible(problem, named_generator("does it help", "path", seed, number))
        for step in STEPS:
            yield Specimen(problem, best + step * (other - best), "between", f"path {number}")


def _searched_specimens(problem: ExcitationProblem, seed: int) -> Iterator[Specimen]:
    for algorithm in ALGORITHMS:
        for kind in SEARCH_CRITERIA:
            for repetition in range(REPETITIONS):
                group = f"{algorithm} {kind} {repetition}"
                for point in _search_points(
                    replace(problem, criterion=Criterion(kind, 0.01, 0.01)), algorithm, seed, group
                ):
                    yield Specimen(problem, point, algorithm, group)


def _search_points(problem: ExcitationProblem, algorithm: str, seed: int, group: str) -> Sequence[Array]:
    """The best point at each budget of one search, where it is feasible."""
    rng = named_generator("does it help", "search", seed, group)
    box = Box(problem.lower, problem.upper)
    population = rng.uniform(box.lower, box.upper, (SWARM, len(box.lower)))
    chosen = find_algorithm(algorithm, "does-it-help")
    with np.errstate(over="ignore"):  # in CMA-ES, when every point of a generation is as good
        result = minimise(
            chosen, chosen.Params(), lambda X: problem.evaluate(X).fitness, box, population, BUDGETS[-1], rng
        )
    used = np.searchsorted(result.history_evaluations, BUDGETS, side="right") - 1
    points = result.best_x_history[used]
    return list(points[problem.evaluate(points).violation == 0])
