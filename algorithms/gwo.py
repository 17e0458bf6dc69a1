"""Grey wolf optimizer (Mirjalili, Mirjalili and Lewis 2014, doi 10.1016/j.advengsoft.2013.12.007).

Form: eq. 3.1-3.7 of that paper with vectors A and C, fresh for every wolf, leader and coordinate; alpha, beta
and delta are the three best points so far; every wolf moves, better or not. a falls linearly from 2 at the
first move to 2 / horizon at the last, as in the authors' code: with a = 0 all wolves would land on one point.

It is drawn to the origin of coordinates, since C multiplies a position: a property of the equations.

How peers differ: the authors' MATLAB does not demote a leader that is overtaken; mealpy accepts only
improvements; pygmo updates the leaders inside the generation, which makes the pull to the origin far
stronger; in NiaPy a stays 2 for a budget in iterations.
"""

from dataclasses import dataclass

import numpy as np

from algorithms.contract import Box
from algorithms.leaders import Leaders, leader, no_leaders, promote
from armlab.common.arrays import Array


@dataclass(frozen=True)
class GWOParams:
    """Table 2: the value from which a falls to 0."""

    first_a: float = 2.0


@dataclass
class GWOState:
    params: GWOParams
    position: Array
    leaders: Leaders
    horizon: int
    rng: np.random.Generator
    iteration: int = 0


class GWO:
    """Wolves that move to the mean of where alpha, beta and delta send them."""

    name = "gwo"
    Params = GWOParams

    @staticmethod
    def init(params: GWOParams, population: Array, box: Box, horizon: int, rng: np.random.Generator) -> GWOState:
        return GWOState(params, population.copy(), no_leaders(population, 3), horizon, rng)

    @staticmethod
    def ask(state: GWOState) -> tuple[Array, GWOState]:
        if state.iteration > 0:
            _hunt(state)
        return state.position.copy(), state

    @staticmethod
    def tell(state: GWOState, X: Array, fitness: Array) -> GWOState:
        promote(state.leaders, X, fitness)
        state.position[...] = X
        state.iteration += 1
        return state

    @staticmethod
    def incumbent(state: GWOState) -> tuple[Array, float]:
        return leader(state.leaders)

    @staticmethod
    def finished(state: GWOState) -> bool:
        return False


def _hunt(state: GWOState) -> None:
    X, leaders = state.position, state.leaders.position[:, None, :]
    a = state.params.first_a * max(1.0 - (state.iteration - 1) / max(state.horizon, 1), 0.0)
    A, D = state.rng.random((2, 3, *X.shape))  # r1, r2: (leader, wolf, coordinate)
    A *= 2.0 * a
    A -= a  # eq. 3.3
    D *= 2.0 * leaders  # eq. 3.4: C = 2 r2
    D -= X
    np.abs(D, out=D)  # eq. 3.5
    A *= D
    np.subtract(leaders, A, out=A)  # eq. 3.6
    np.add.reduce(A, axis=0, out=X)
    X /= 3.0  # eq. 3.7
