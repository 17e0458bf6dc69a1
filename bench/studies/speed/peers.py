"""The same run in other packages, each as its own documentation calls it.

mealpy: PSO, GWO, WOA, GOA, DE `Original...`, logging off. pygmo: `pso` and `pso_gen`, `gwo`, `de`; `pso_gen`
also with the population at once (`batch_fitness`). scipy: `differential_evolution`, immediate (as it comes),
deferred and vectorised updating, without polish and without an early end.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from bench.studies.speed.clock import Task

Tasks = dict[tuple[str, str], tuple[Task, int]]


@dataclass(frozen=True)
class SphereBox:
    """The common task: dimension, half width of the box, swarm size, iterations after the first population."""

    dimension: int
    half_width: float
    swarm_size: int
    iterations: int

    @property
    def evaluations(self) -> int:
        """Evaluations with the first population."""
        return self.swarm_size * (self.iterations + 1)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds, (dimension,) each."""
        return np.full(self.dimension, -self.half_width), np.full(self.dimension, self.half_width)


def sphere(point: Array) -> float:
    """Sum of squares of one point (dimension,)."""
    return float(point @ point)


def peer_tasks(box: SphereBox) -> Tasks:
    """Runs and their evaluations, by algorithm and package."""
    return {**_mealpy_tasks(box), **_pygmo_tasks(box), **_scipy_tasks(box)}


def _mealpy_tasks(box: SphereBox) -> Tasks:
    from mealpy import DE, GOA, GWO, PSO, WOA, FloatVar

    lower, upper = box.bounds
    problem = {"bounds": FloatVar(lower, upper), "obj_func": sphere, "minmax": "min", "log_to": None}
    kinds = {
        "spso": PSO.OriginalPSO,
        "gwo": GWO.OriginalGWO,
        "woa": WOA.OriginalWOA,
        "goa": GOA.OriginalGOA,
        "de": DE.OriginalDE,
    }

    def run(kind: Any) -> Task:
        return lambda: kind(epoch=box.iterations, pop_size=box.swarm_size).solve(problem, seed=1)

    return {(name, "mealpy, one"): (run(kind), box.evaluations) for name, kind in kinds.items()}


@dataclass
class _PygmoSphere:
    """User-defined problem of pygmo."""

    box: SphereBox

    def fitness(self, point: Array) -> list[float]:
        return [sphere(point)]

    def batch_fitness(self, points: Array) -> Array:
        return np.asarray(np.square(points.reshape(-1, self.box.dimension)).sum(axis=1))

    def get_bounds(self) -> tuple[Array, Array]:
        return self.box.bounds


def _pygmo_tasks(box: SphereBox) -> Tasks:
    import pygmo

    def run(user_algorithm: Any, batch: bool = False) -> Task:
        algorithm = pygmo.algorithm(user_algorithm)
        problem = pygmo.problem(_PygmoSphere(box))
        at_once = {"b": pygmo.bfe(pygmo.member_bfe())} if batch else {}
        return lambda: algorithm.evolve(pygmo.population(problem, box.swarm_size, seed=1, **at_once))

    generational = pygmo.pso_gen(gen=box.iterations, seed=1)
    at_once = pygmo.pso_gen(gen=box.iterations, seed=1)
    at_once.set_bfe(pygmo.bfe(pygmo.member_bfe()))
    runs = {
        ("spso", "pygmo, one"): run(pygmo.pso(gen=box.iterations, seed=1)),
        ("spso", "pygmo generational, one"): run(generational),
        ("spso", "pygmo generational, all"): run(at_once, batch=True),
        ("gwo", "pygmo, one"): run(pygmo.gwo(gen=box.iterations, seed=1)),
        ("de", "pygmo, one"): run(pygmo.de(gen=box.iterations, seed=1, ftol=0.0, xtol=0.0)),
    }
    return {key: (task, box.evaluations) for key, task in runs.items()}


def _scipy_tasks(box: SphereBox) -> Tasks:
    from scipy.optimize import differential_evolution

    lower, upper = box.bounds
    start = np.random.default_rng(0).uniform(lower, upper, (box.swarm_size, box.dimension))
    common: dict[str, Any] = {
        "bounds": list(zip(lower, upper, strict=True)),
        "maxiter": box.iterations,
        "init": start,
        "polish": False,
        "tol": 0.0,
        "rng": 1,
    }

    def columns(points: Array) -> Array:
        return np.asarray(np.square(points).sum(axis=0))

    runs: dict[str, Task] = {
        "scipy immediate, one": lambda: differential_evolution(sphere, **common),
        "scipy deferred, one": lambda: differential_evolution(sphere, **common, updating="deferred"),
        "scipy, all": lambda: differential_evolution(columns, **common, updating="deferred", vectorized=True),
    }
    return {("de", name): (task, box.evaluations) for name, task in runs.items()}
