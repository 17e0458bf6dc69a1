"""CMA-ES with restarts and doubled populations (Auger and Hansen 2005, doi 10.1109/CEC.2005.1554902).

Form: the package `cmaes` searches in coordinates normalised by the box, with the population size 4 + 3 ln d that
it recommends, until its own stopping tests say that it is over; then it begins anew at a uniform point with twice
the population, for ever. The first population, whatever its size, is a random search for the first mean: its best
point. Points that the bound policy moved are told where they are; all others exactly as the package drew them, since
small populations leave eigenvalues equal, and rounding that depends on the place of the box would choose the vectors.

How peers differ: Auger and Hansen start every run with half of the width of the box as step size, here 0.3 of it
(within the advice of Hansen 2016, arXiv 1604.00772); pycma's `fmin2(restarts=...)` resamples points outside.
"""

from dataclasses import dataclass

import numpy as np
from cmaes import CMA

from algorithms.cma_state import HoldsOptimiser
from algorithms.contract import Array, Box, as_loss
from algorithms.leaders import Leaders, leader, no_leaders, promote

MEAN_DECIMALS = 9


@dataclass(frozen=True)
class IPOPParams:
    """Step size of every start as a fraction of the width of the box; growth of the population at a restart."""

    first_step_size: float = 0.3
    growth: int = 2


@dataclass
class IPOPState(HoldsOptimiser):
    """asked: the population in the unit box. rng: seeds every start and draws the later means. restarts: so far."""

    params: IPOPParams
    optimiser: CMA
    asked: Array
    box: Box
    leaders: Leaders
    rng: np.random.Generator
    started: bool = False
    restarts: int = 0


class IPOPCMAES:
    """CMA-ES that begins anew with a larger population whenever it has converged."""

    name = "ipop-cma-es"
    Params = IPOPParams

    @staticmethod
    def init(params: IPOPParams, population: Array, box: Box, horizon: int, rng: np.random.Generator) -> IPOPState:
        optimiser = _start(params, np.full(population.shape[1], 0.5), None, rng)
        return IPOPState(params, optimiser, population.copy(), box, no_leaders(population, 1), rng)

    @staticmethod
    def ask(state: IPOPState) -> tuple[Array, IPOPState]:
        if not state.started:
            return state.asked.copy(), state
        state.asked = np.array([state.optimiser.ask() for _ in range(state.optimiser.population_size)])
        return _from_unit(state.asked, state.box), state

    @staticmethod
    def tell(state: IPOPState, X: Array, fitness: Array) -> IPOPState:
        loss = as_loss(fitness)
        promote(state.leaders, X, loss)
        U = (X - state.box.lower) / (state.box.upper - state.box.lower)
        if not state.started:
            mean = np.round(U[loss.argmin()], MEAN_DECIMALS)
            state.optimiser = _start(state.params, mean, None, state.rng)
            state.started = True
            return state
        U = np.where(_from_unit(state.asked, state.box) == X, state.asked, U)
        with np.errstate(invalid="ignore", over="ignore"):  # inf - inf; a diverging step size: should_stop sees it
            state.optimiser.tell(list(zip(U, loss.tolist(), strict=True)))
            if state.optimiser.should_stop():
                _restart(state)
        return state

    @staticmethod
    def incumbent(state: IPOPState) -> tuple[Array, float]:
        return leader(state.leaders)

    @staticmethod
    def finished(state: IPOPState) -> bool:
        return False


def _from_unit(U: Array, box: Box) -> Array:
    return box.lower + U * (box.upper - box.lower)


def _restart(state: IPOPState) -> None:
    size = state.params.growth * state.optimiser.population_size
    state.optimiser = _start(state.params, state.rng.random(len(state.box.lower)), size, state.rng)
    state.restarts += 1


def _start(params: IPOPParams, mean: Array, size: int | None, rng: np.random.Generator) -> CMA:
    """The package's optimiser in the unit box; size: of its population, its own advice if None."""
    return CMA(mean, params.first_step_size, seed=int(rng.integers(2**32)), population_size=size)
