"""pygmo's (pagmo 2, in C++) particle swarm, grey wolves and differential evolution, as they come.

`pygmo-pso`: constriction (omega = 0.7298, eta = 2.05), a ring of four neighbours instead of the global best,
speed limit half of the box width, particles move one after the other. Ours: global best, w = 0.72, c = 1.45,
the swarm moves as one.
`pygmo-gwo`: the leaders change within a generation; ours change after it.
`pygmo-de`: rand/1/exp, F = 0.8, CR = 0.9; ours is rand/1/bin with F = 0.85, CR = 1. Its end when the
population has converged is switched off.
All evaluate one point at a time.
"""

from dataclasses import dataclass
from typing import Any

import pygmo

from algorithms.contract import Box
from algorithms.peers.peer import Evaluate, Peer, Start
from armlab.common.arrays import Array


@dataclass(frozen=True)
class _UserProblem:
    """What pygmo calls a user-defined problem."""

    box: Box
    evaluate: Evaluate

    def fitness(self, point: Array) -> Array:
        return self.evaluate(point[None])

    def get_bounds(self) -> tuple[Array, Array]:
        return self.box.lower, self.box.upper


@dataclass(frozen=True)
class PygmoPSOParams:
    """pagmo's defaults; max_vel is a fraction of the width of the box."""

    omega: float = 0.7298
    eta1: float = 2.05
    eta2: float = 2.05
    max_vel: float = 0.5
    variant: int = 5
    neighb_type: int = 2
    neighb_param: int = 4


class PygmoPSO(Peer):
    """Local-best particle swarm with constriction."""

    name = "pygmo-pso"
    rival = "spso"
    Params = PygmoPSOParams
    fewest = 2

    @staticmethod
    def search(params: PygmoPSOParams, start: Start, evaluate: Evaluate) -> None:
        _evolve_population(pygmo.pso(gen=start.horizon + 1, seed=start.seed, **vars(params)), start, evaluate)


@dataclass(frozen=True)
class PygmoGWOParams:
    """There is nothing to set."""


class PygmoGWO(Peer):
    """Grey wolves that follow their leaders at once."""

    name = "pygmo-gwo"
    rival = "gwo"
    Params = PygmoGWOParams
    fewest = 3

    @staticmethod
    def search(params: PygmoGWOParams, start: Start, evaluate: Evaluate) -> None:
        generations = max(start.horizon, 3)  # it refuses fewer; its `a` falls with them
        _evolve_population(pygmo.gwo(gen=generations, seed=start.seed), start, evaluate)


@dataclass(frozen=True)
class PygmoDEParams:
    """pagmo's defaults; variant 2 is rand/1/exp."""

    F: float = 0.8
    CR: float = 0.9
    variant: int = 2


class PygmoDE(Peer):
    """Differential evolution, rand/1/exp."""

    name = "pygmo-de"
    rival = "de"
    Params = PygmoDEParams
    fewest = 5

    @staticmethod
    def search(params: PygmoDEParams, start: Start, evaluate: Evaluate) -> None:
        method = pygmo.de(gen=start.horizon + 1, seed=start.seed, ftol=-1.0, xtol=-1.0, **vars(params))
        _evolve_population(method, start, evaluate)


def _evolve_population(method: Any, start: Start, evaluate: Evaluate) -> None:
    population = pygmo.population(pygmo.problem(_UserProblem(start.box, evaluate)), 0, seed=start.seed)
    for point, loss in zip(start.X, start.loss, strict=True):
        population.push_back(point, [loss])
    pygmo.algorithm(method).evolve(population)
