"""CMA-ES (Hansen 2016, arXiv 1604.00772) from the package `cmaes`, as a yardstick; not part of the paper.

Coordinates are normalised by the box, since the first step size is one number. The first population is told
as the first generation of a distribution at the centre of the box with the spread of uniform points,
1 / sqrt(12) of the width; from then on populations of the same size are drawn. Points that the bound policy
moved are told where they are. It is finished when the package's own stopping tests say so.
"""

import math
from dataclasses import dataclass

import numpy as np
from cmaes import CMA

from algorithms.cma_state import HoldsOptimiser
from algorithms.contract import Array, Box, as_loss
from algorithms.leaders import Leaders, leader, no_leaders, promote


@dataclass(frozen=True)
class CMAESParams:
    """Initial step size as a fraction of the width of the box."""

    first_step_size: float = 1.0 / math.sqrt(12.0)


@dataclass
class CMAESState(HoldsOptimiser):
    """The package's optimiser holds the random generator, seeded by the one that was given."""

    optimiser: CMA
    population: Array
    box: Box
    leaders: Leaders
    started: bool = False


class CMAES:
    """Covariance matrix adaptation with the population size of the swarm."""

    name = "cma-es"
    Params = CMAESParams

    @staticmethod
    def init(params: CMAESParams, population: Array, box: Box, horizon: int, rng: np.random.Generator) -> CMAESState:
        n, d = population.shape
        if n < 2:
            raise ValueError(f"CMA-ES ranks points against each other: {n} is too few")
        seed = int(rng.integers(2**32))
        centre = np.full(d, 0.5)
        optimiser = CMA(centre, params.first_step_size, seed=seed, population_size=n)
        return CMAESState(optimiser, population.copy(), box, no_leaders(population, 1))

    @staticmethod
    def ask(state: CMAESState) -> tuple[Array, CMAESState]:
        if not state.started:
            return state.population.copy(), state
        U = np.array([state.optimiser.ask() for _ in range(len(state.population))])
        return state.box.lower + U * (state.box.upper - state.box.lower), state

    @staticmethod
    def tell(state: CMAESState, X: Array, fitness: Array) -> CMAESState:
        loss = as_loss(fitness)
        promote(state.leaders, X, loss)
        U = (X - state.box.lower) / (state.box.upper - state.box.lower)
        with np.errstate(invalid="ignore", over="ignore"):  # a diverging step size: should_stop sees it
            state.optimiser.tell(list(zip(U, loss.tolist(), strict=True)))
        state.started = True
        return state

    @staticmethod
    def incumbent(state: CMAESState) -> tuple[Array, float]:
        return leader(state.leaders)

    @staticmethod
    def finished(state: CMAESState) -> bool:
        with np.errstate(invalid="ignore"):  # a generation of nothing but losses: inf - inf
            return bool(state.optimiser.should_stop())
