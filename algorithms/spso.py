"""Standard particle swarm: global best, constant inertia weight, with the constants of Table 2.

Form: eq. 1-2 with w = 0.72, c1 = c2 = 1.45. That is the constriction form of Clerc and Kennedy (2002),
written with an inertia weight, near its usual constants chi = 0.7298 and chi * 2.05 = 1.4962. The speed limit
is half of the box width, Vmax = Xmax, as Eberhart and Shi (2000) advise beside constriction;
`algorithms.swarm` lists the other choices.

How peers differ: pygmo defaults to a ring of neighbours (local best) with constriction; mealpy moves a
particle only if the new place is better; NiaPy sets w = 1; pymoo adapts its constants; evosax knows no
bounds.
"""

from dataclasses import dataclass

import numpy as np

from algorithms.contract import Array, Box
from algorithms.swarm import Swarm, fly, global_best, land, new_swarm


@dataclass(frozen=True)
class SPSOParams:
    """Table 2; velocity_limit is a fraction of the width of the box."""

    inertia: float = 0.72
    cognitive: float = 1.45
    social: float = 1.45
    velocity_limit: float = 0.5


@dataclass
class SPSOState:
    params: SPSOParams
    swarm: Swarm
    rng: np.random.Generator
    started: bool = False


class SPSO:
    """Particle swarm of eq. 1-2 with constant coefficients."""

    name = "spso"
    Params = SPSOParams

    @staticmethod
    def init(params: SPSOParams, population: Array, box: Box, horizon: int, rng: np.random.Generator) -> SPSOState:
        return SPSOState(params, new_swarm(population, box, params.velocity_limit), rng)

    @staticmethod
    def ask(state: SPSOState) -> tuple[Array, SPSOState]:
        if state.started:
            params = state.params
            fly(state.swarm, params.inertia, params.cognitive, params.social, state.rng)
        return state.swarm.position.copy(), state

    @staticmethod
    def tell(state: SPSOState, X: Array, fitness: Array) -> SPSOState:
        land(state.swarm, X, fitness)
        state.started = True
        return state

    @staticmethod
    def incumbent(state: SPSOState) -> tuple[Array, float]:
        x, fitness = global_best(state.swarm)
        return x.copy(), fitness

    @staticmethod
    def finished(state: SPSOState) -> bool:
        return False
