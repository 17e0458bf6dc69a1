"""Whale optimization algorithm (Mirjalili and Lewis 2016).

Update of a whale at X; the prey X* is the best point so far, X_rand another whale or itself, drawn at random:

    A = 2 a r - a,   C = 2 r'                                                     eq. 2.3, 2.4
    p < 0.5, |A| < 1:    X(t + 1) = X* - A |C X* - X|                             eq. 2.1, 2.2
    p < 0.5, |A| >= 1:   X(t + 1) = X_rand - A |C X_rand - X|                     eq. 2.7, 2.8
    p >= 0.5:            X(t + 1) = |X* - X| exp(b l) cos(2 pi l) + X*            eq. 2.5, 2.6

with r and r' uniform in [0, 1), drawn anew for every whale and coordinate; p in [0, 1), l in [-1, 1) and X_rand
drawn once a whale; b = 1. A is a vector, and the source does not say what |A| < 1 means for one: here it is asked
coordinate by coordinate. The source lets a fall linearly from 2 to 0; here

    a = 2 (1 - (t - 1) / horizon),   t = 1 ... horizon,

2 at the first move and 2 / horizon at the last.

Other readings (`reading`):
- `text`: |A| is the length of the vector A, as the bars say, and a falls to 0 at the last move, as the text says.
- `program`, the authors' MATLAB: one number A and one C for a whale; another random whale for each coordinate; whales
  move one after the other, so that a random whale may have moved already; l from (a2, 1] with a2 falling from -1
  towards -2; a and a2 fall by 1 / (horizon + 1) of their way at each move. Compared with public copies of its `WOA.m`:
  A, C, l, p, the random whale of each coordinate and the order of the moves agree.

It is drawn to the origin of coordinates, since C multiplies a position: a property of the equations.

How peers differ: mealpy uses one random number for A and C and takes a fresh uniform point in place of the random
whale.
"""

from dataclasses import dataclass

import numpy as np

from algorithms.contract import Box
from algorithms.leaders import Leaders, leader, no_leaders, promote
from algorithms.parameter_types import OURS, NotNegative, Reading
from armlab.common.arrays import Array


@dataclass(frozen=True)
class WOAParams:
    """Table 2: the value from which a falls to 0; b is the shape of the spiral."""

    first_a: NotNegative = 2.0
    b: NotNegative = 1.0
    reading: Reading = OURS


@dataclass
class WOAState:
    params: WOAParams
    position: Array
    leaders: Leaders
    horizon: int
    rng: np.random.Generator
    iteration: int = 0


class WOA:
    """Whales that encircle the prey, search around each other, or spiral in."""

    name = "woa"
    Params = WOAParams

    @staticmethod
    def init(params: WOAParams, population: Array, box: Box, horizon: int, rng: np.random.Generator) -> WOAState:
        return WOAState(params, population.copy(), no_leaders(population, 1), horizon, rng)

    @staticmethod
    def ask(state: WOAState) -> tuple[Array, WOAState]:
        if state.iteration > 0:
            state.position = _hunt_in_turn(state) if state.params.reading == "program" else _hunt(state)
        return state.position.copy(), state

    @staticmethod
    def tell(state: WOAState, X: Array, fitness: Array) -> WOAState:
        promote(state.leaders, X, fitness)
        state.position[...] = X
        state.iteration += 1
        return state

    @staticmethod
    def incumbent(state: WOAState) -> tuple[Array, float]:
        return leader(state.leaders)

    @staticmethod
    def finished(state: WOAState) -> bool:
        return False


def _hunt(state: WOAState) -> Array:
    """New positions (n, d): around the prey or another whale, or on a spiral, with equal chance (eq. 2.6)."""
    X, prey = state.position, state.leaders.position[0]
    p, turn, whale = state.rng.random((3, len(X), 1))
    random_whales = X[(whale[:, 0] * len(X)).astype(np.intp)]
    spiral = _spiral(X, prey, 2.0 * turn - 1.0, state.params.b)
    return np.where(p < 0.5, _encircle(state, random_whales, prey), spiral)  # eq. 2.6


def _hunt_in_turn(state: WOAState) -> Array:
    """New positions (n, d) of the authors' program: scalar A and C, whales one after the other."""
    X, prey, params, rng = state.position.copy(), state.leaders.position[0], state.params, state.rng
    n, d = X.shape
    progress = min((state.iteration - 1) / (state.horizon + 1), 1.0)
    a, last_turn = params.first_a * (1.0 - progress), -1.0 - progress
    A, C, turn, p = rng.random((4, n))
    A = 2.0 * a * A - a  # eq. 2.3
    turn = 1.0 + (last_turn - 1.0) * turn
    whales = (rng.random((n, d)) * n).astype(np.intp)
    for i in range(n):
        if p[i] >= 0.5:
            X[i] = _spiral(X[i], prey, turn[i], params.b)  # eq. 2.5
        else:
            target = prey if abs(A[i]) < 1.0 else X[whales[i], np.arange(d)]
            X[i] = target - A[i] * np.abs(2.0 * C[i] * target - X[i])  # eq. 2.1-2.2 or 2.7-2.8
    return X


def _encircle(state: WOAState, random_whales: Array, prey: Array) -> Array:
    """X* - A |C X* - X| (eq. 2.1-2.2) where |A| < 1, else X_rand - A |C X_rand - X| (eq. 2.7-2.8)."""
    as_printed = state.params.reading == "text"
    moves = state.horizon - 1 if as_printed else state.horizon
    a = state.params.first_a * max(1.0 - (state.iteration - 1) / max(moves, 1), 0.0)
    A, C = state.rng.random((2, *state.position.shape))  # r of eq. 2.3, r of eq. 2.4
    A *= 2.0 * a
    A -= a  # eq. 2.3
    C *= 2.0  # eq. 2.4
    size = np.linalg.norm(A, axis=1, keepdims=True) if as_printed else np.abs(A)
    X = np.where(size < 1.0, prey, random_whales)
    C *= X
    C -= state.position
    A *= np.abs(C, out=C)
    X -= A
    return X


def _spiral(X: Array, prey: Array, turn: Array | float, b: float) -> Array:
    """|X* - X| exp(b l) cos(2 pi l) + X* (eq. 2.5); turn is l, (n, 1), or one number for one whale."""
    distance: Array = np.abs(prey - X)
    distance *= np.exp(b * turn) * np.cos(2.0 * np.pi * turn)
    distance += prey
    return distance
