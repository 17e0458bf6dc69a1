"""Overhead of the algorithms on the sphere in 15 dimensions, 50 points, 30 iterations.

`one`: the objective takes one point and costs about a microsecond; `all`: it takes the population at once. The figures
are microseconds an evaluation, the objective's own time included, as a user would see them.
"""

from collections.abc import Callable

import numpy as np

from algorithms.contract import Box
from algorithms.driver import minimise
from algorithms.registry import load
from armlab.common.arrays import Array
from bench.studies.speed import peers
from bench.studies.speed.clock import Task, median_seconds

DIMENSION, SWARM_SIZE, ITERATIONS, HALF_WIDTH = 15, 50, 30, 100.0
ALGORITHMS = ("mupso", "spso", "gwo", "woa", "goa", "de", "cma-es", "random-search")
OVERHEAD_ROUNDS = 15


def measure_overheads() -> dict[str, dict[str, float]]:
    """Microseconds an evaluation: `{algorithm: {package, way: figure}}`; all competitors take turns in each round."""
    tasks: dict[tuple[str, str], tuple[Task, int]] = {}
    for name in ALGORITHMS:
        tasks[name, "armlab, one"] = armlab_task(name, one_at_a_time=True)
        tasks[name, "armlab, all"] = armlab_task(name, one_at_a_time=False)
    box = peers.SphereBox(DIMENSION, HALF_WIDTH, SWARM_SIZE, ITERATIONS)
    tasks.update(peers.peer_tasks(box))
    seconds = median_seconds({"/".join(key): task for key, (task, _) in tasks.items()}, OVERHEAD_ROUNDS)
    table: dict[str, dict[str, float]] = {}
    for (algorithm, way), (_, evaluations) in tasks.items():
        table.setdefault(algorithm, {})[way] = 1e6 * seconds[f"{algorithm}/{way}"] / evaluations
    return table


def armlab_task(name: str, one_at_a_time: bool) -> tuple[Task, int]:
    """One run of an algorithm of ours on the sphere, and its evaluations."""
    algorithm = load(name)
    box = Box(np.full(DIMENSION, -HALF_WIDTH), np.full(DIMENSION, HALF_WIDTH))
    population = np.random.default_rng(0).uniform(*box, (SWARM_SIZE, DIMENSION))
    budget = SWARM_SIZE * (ITERATIONS + 1)
    objective: Callable[[Array], Array] = _sphere_of_each if one_at_a_time else _sphere_of_all

    def run() -> object:
        rng = np.random.default_rng(1)
        return minimise(algorithm, algorithm.Params(), objective, box, population, budget, rng)

    return run, budget


def _sphere_of_each(points: Array) -> Array:
    return np.array([peers.sphere(point) for point in points])


def _sphere_of_all(points: Array) -> Array:
    return np.asarray(np.square(points).sum(axis=1))
