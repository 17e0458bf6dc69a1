"""Whale optimization algorithm (Mirjalili and Lewis 2016, doi 10.1016/j.advengsoft.2016.01.008).

Form: eq. 2.1-2.8 of that paper with vectors A and C, fresh for every whale and coordinate; |A| < 1 is asked
coordinate by coordinate; p, l in [-1, 1] and the random whale are drawn once a whale; b = 1; the prey is the
best point so far. a falls linearly from 2 at the first move to 2 / horizon at the last, as in the authors'
code.

It is drawn to the origin of coordinates, since C multiplies a position: a property of the equations.

How peers differ: the authors' MATLAB draws scalar A and C for a whale, a random whale for each coordinate,
and l from [a2, 1] with a2 falling from -1 to -2; mealpy uses one random number for A and C and takes a fresh
uniform point in place of the random whale.
"""

from dataclasses import dataclass

import numpy as np

from algorithms.contract import Box
from algorithms.leaders import Leaders, leader, no_leaders, promote
from armlab.common.arrays import Array


@dataclass(frozen=True)
class WOAParams:
    """Table 2: the value from which a falls to 0; b is the shape of the spiral."""

    first_a: float = 2.0
    b: float = 1.0


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
            state.position = _hunt(state)
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
    X, prey = state.position, state.leaders.position[0]
    p, turn, whale = state.rng.random((3, len(X), 1))
    random_whales = X[(whale[:, 0] * len(X)).astype(np.intp)]
    spiral = _spiral(X, prey, 2.0 * turn - 1.0, state.params.b)
    return np.where(p < 0.5, _encircle(state, random_whales, prey), spiral)  # eq. 2.6


def _encircle(state: WOAState, random_whales: Array, prey: Array) -> Array:
    """Move around the prey (eq. 2.1-2.2) where |A| < 1, else around a random whale (eq. 2.7-2.8)."""
    a = state.params.first_a * max(1.0 - (state.iteration - 1) / max(state.horizon, 1), 0.0)
    A, C = state.rng.random((2, *state.position.shape))  # r of eq. 2.3, r of eq. 2.4
    A *= 2.0 * a
    A -= a  # eq. 2.3
    C *= 2.0  # eq. 2.4
    X = np.where(np.abs(A) < 1.0, prey, random_whales)
    C *= X
    C -= state.position
    A *= np.abs(C, out=C)
    X -= A
    return X


def _spiral(X: Array, prey: Array, turn: Array, b: float) -> Array:
    """Eq. 2.5; turn is its l, (n, 1) in [-1, 1]."""
    distance: Array = np.abs(prey - X)
    distance *= np.exp(b * turn) * np.cos(2.0 * np.pi * turn)
    distance += prey
    return distance
