"""Grey wolf optimizer (Mirjalili, Mirjalili and Lewis 2014).

Update of a wolf at X; the leaders X_k, k = 1, 2, 3 (alpha, beta, delta), are the three best points so far:

    A_k = 2 a r1 - a,   C_k = 2 r2                                                eq. 3.3, 3.4
    D_k = |C_k X_k - X|                                                           eq. 3.5
    X_k' = X_k - A_k D_k                                                          eq. 3.6
    X(t + 1) = (X_1' + X_2' + X_3') / 3                                           eq. 3.7

with r1 and r2 uniform in [0, 1), drawn anew for every wolf, leader and coordinate. Eq. 3.5-3.7 are eq. 3.1-3.2 for
three leaders. Every wolf moves, better or not. The source lets a fall linearly from 2 to 0; here

    a = 2 (1 - (t - 1) / horizon),   t = 1 ... horizon,

2 at the first move and 2 / horizon at the last: with a = 0 all wolves would stand on one point.

Other readings (`reading`):
- `text`: a falls to 0 at the last move, as the text says.
- `program`, the authors' MATLAB: a leader that is overtaken is forgotten, not demoted, wolf by wolf; a falls by
  1 / (horizon + 1) of its way at each move; a leader that is not known yet stands at the origin of coordinates.
  Compared with public copies of its `GWO.m`: the order of the three leaders, a, A, C and eq. 3.5-3.7 agree.

It is drawn to the origin of coordinates, since C multiplies a position: a property of the equations.

How peers differ: mealpy accepts only improvements; pygmo updates the leaders inside the generation, which makes the
pull to the origin far stronger; in NiaPy a stays 2 for a budget in iterations.
"""

from dataclasses import dataclass

import numpy as np

from algorithms.contract import Box, as_loss
from algorithms.leaders import Leaders, leader, no_leaders, promote
from algorithms.parameter_types import OURS, NotNegative, Reading
from armlab.common.arrays import Array


@dataclass(frozen=True)
class GWOParams:
    """Table 2: the value from which a falls to 0."""

    first_a: NotNegative = 2.0
    reading: Reading = OURS


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
        leaders = no_leaders(population, 3)
        if params.reading == "program":
            leaders.position[...] = 0.0
        return GWOState(params, population.copy(), leaders, horizon, rng)

    @staticmethod
    def ask(state: GWOState) -> tuple[Array, GWOState]:
        if state.iteration > 0:
            _hunt(state)
        return state.position.copy(), state

    @staticmethod
    def tell(state: GWOState, X: Array, fitness: Array) -> GWOState:
        if state.params.reading == "program":
            _replace_leaders(state.leaders, X, as_loss(fitness))
        else:
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


def _replace_leaders(leaders: Leaders, X: Array, loss: Array) -> None:
    """Wolf by wolf, replace the first leader that it is better than and not as good as the one above."""
    for x, value in zip(X, loss, strict=True):
        if value < leaders.fitness[0]:
            place = 0
        elif leaders.fitness[0] < value < leaders.fitness[1]:
            place = 1
        elif leaders.fitness[1] < value < leaders.fitness[2]:
            place = 2
        else:
            continue
        leaders.position[place], leaders.fitness[place] = x, value


def _hunt(state: GWOState) -> None:
    """Move all wolves in place: X = mean over the leaders of X_k - A_k |C_k X_k - X| (eq. 3.3-3.7)."""
    X, leaders = state.position, state.leaders.position[:, None, :]
    moves = {"ours": state.horizon, "text": state.horizon - 1, "program": state.horizon + 1}[state.params.reading]
    a = state.params.first_a * max(1.0 - (state.iteration - 1) / max(moves, 1), 0.0)
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
