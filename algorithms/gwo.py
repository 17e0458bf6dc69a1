"""Grey wolf optimizer (Mirjalili, Mirjalili and Lewis 2014).

Update of a wolf at X; the leaders X_k, k = 1, 2, 3 (alpha, beta, delta), are the three best points so far:

    A_k = 2 a r1 - a,   C_k = 2 r2                                                eq. 3.3, 3.4
    D_k = |C_k X_k - X|                                                           eq. 3.5
    X_k' = X_k - A_k D_k                                                          eq. 3.6
    X(t + 1) = (X_1' + X_2' + X_3') / 3                                           eq. 3.7

with r1 and r2 uniform in [0, 1), drawn anew for every wolf, leader and coordinate. Eq. 3.5-3.7 are eq. 3.1-3.2 for
three leaders. Every wolf moves, better or not. The source lets a fall linearly from 2 to 0; here

    a = 2 (1 - (t - 1) / horizon),   t = 1 ... horizon,

2 at the first move and 2 / horizon at the last, as in the authors' code: with a = 0 all wolves would stand on one
point.

It is drawn to the origin of coordinates, since C multiplies a position: a property of the equations.

How peers differ: the authors' MATLAB does not demote a leader that is overtaken; mealpy accepts only
improvements; pygmo updates the leaders inside the generation, which makes the pull to the origin far
stronger; in NiaPy a stays 2 for a budget in iterations.
"""

from dataclasses import dataclass

import numpy as np

from algorithms.contract import Box
from algorithms.leaders import Leaders, leader, no_leaders, promote
from algorithms.ranges import NotNegative
from armlab.common.arrays import Array


@dataclass(frozen=True)
class GWOParams:
    """Table 2: the value from which a falls to 0."""

    first_a: NotNegative = 2.0


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
    """Move all wolves in place: X = mean over the leaders of X_k - A_k |C_k X_k - X| (eq. 3.3-3.7)."""
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
