"""Random search: the yardstick that a search has to beat.

Every point of every population is drawn anew, x = lb + r (ub - lb) with r uniform in [0, 1) for every coordinate; lb
and ub are the limits of the box. No point learns from another.
"""

from dataclasses import dataclass

import numpy as np

from algorithms.contract import Box, uniform_points
from algorithms.leaders import Leaders, leader, no_leaders, promote
from armlab.common.arrays import Array


@dataclass(frozen=True)
class RandomSearchParams:
    """No hyper-parameters."""


@dataclass
class RandomSearchState:
    population: Array
    box: Box
    leaders: Leaders
    rng: np.random.Generator
    started: bool = False


class RandomSearch:
    """Uniform points, none of which learns from another."""

    name = "random-search"
    Params = RandomSearchParams

    @staticmethod
    def init(
        params: RandomSearchParams, population: Array, box: Box, horizon: int, rng: np.random.Generator
    ) -> RandomSearchState:
        return RandomSearchState(population.copy(), box, no_leaders(population, 1), rng)

    @staticmethod
    def ask(state: RandomSearchState) -> tuple[Array, RandomSearchState]:
        if state.started:
            state.population = uniform_points(len(state.population), state.box, state.rng)
        return state.population.copy(), state

    @staticmethod
    def tell(state: RandomSearchState, X: Array, fitness: Array) -> RandomSearchState:
        promote(state.leaders, X, fitness)
        state.started = True
        return state

    @staticmethod
    def incumbent(state: RandomSearchState) -> tuple[Array, float]:
        return leader(state.leaders)

    @staticmethod
    def finished(state: RandomSearchState) -> bool:
        return False
