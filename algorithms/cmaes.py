"""CMA-ES from the package `cmaes`, as a yardstick: with the population size of the swarm, and with restarts (IPOP).

Neither is part of the paper. One generation of lambda points x_k, sorted by fitness, with mean m, step size s and
covariance matrix C (Hansen 2016; the package names the same equations in its source):

    x_k = m + s y_k,   y_k from N(0, C)                                           eq. 38-40
    y_w = sum_(i <= mu) w_i y_i,   m <- m + s y_w                                 eq. 41-42
    p_s <- (1 - c_s) p_s + sqrt(c_s (2 - c_s) mu_eff) C^(-1/2) y_w                eq. 43
    s <- s exp(c_s / d_s (||p_s|| / E||N(0, I)|| - 1))                            eq. 44
    p_c <- (1 - c_c) p_c + h sqrt(c_c (2 - c_c) mu_eff) y_w                       eq. 45
    w_i' = w_i if w_i >= 0, else w_i d / ||C^(-1/2) y_i||^2                       eq. 46
    C <- (1 + c_1 (1 - h) c_c (2 - c_c) - c_1 - c_mu sum w_i) C + c_1 p_c p_c^T + c_mu sum_i w_i' y_i y_i^T   eq. 47

h is 0 while ||p_s|| is large, else 1; weights and rates are the defaults of eq. 48-58, which depend on lambda and on
the number of dimensions d alone. A state around the package's optimiser can be pickled and resumed. In both
algorithms coordinates are normalised by the box, since the first step size is one number.

`cma-es`: lambda is the swarm size. The first population is told as the first generation of a distribution at the
centre of the box with the spread of uniform points, s = 1 / sqrt(12) of the width; from then on populations of the
same size are drawn. Points that the bound policy moved are told where they are. It is finished when the package's
own stopping tests say so.

`ipop-cma-es` (Auger and Hansen 2005): lambda = 4 + floor(3 ln d) (eq. 48) until the package's stopping tests say that
the search is over; then it begins anew at a uniform point with

    lambda <- 2 lambda,

for ever. The first population, whatever its size, is a random search for the first mean: its best point. Points that
the bound policy moved are told where they are. All others are told exactly as the package drew them: small
populations leave eigenvalues equal, and rounding that depends on the place of the box would choose the vectors.

How peers differ: Auger and Hansen 2005 start every run with half of the width of the box as step size, here 0.3 of it
(within the advice of Hansen 2016); pycma's `fmin2(restarts=...)` resamples points outside.
"""

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from annotated_types import Ge
from cmaes import CMA

from algorithms.contract import Box, as_loss
from algorithms.leaders import Leaders, leader, no_leaders, promote
from algorithms.parameter_types import Positive
from armlab.common.arrays import Array


class PicklableOptimiserState:
    """Base of a state dataclass with a field `optimiser`, which holds the random generator."""

    def __getstate__(self) -> dict[str, Any]:
        # pickled by itself, the optimiser would lose its random generator and half of its covariance matrix
        state = self.__dict__
        return {**state, "optimiser": dict(state["optimiser"].__dict__)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        optimiser = CMA.__new__(CMA)
        optimiser.__dict__.update(state["optimiser"])
        self.__dict__.update({**state, "optimiser": optimiser})


@dataclass(frozen=True)
class CMAESParams:
    """Initial step size as a fraction of the width of the box."""

    first_step_size: Positive = 1.0 / math.sqrt(12.0)


@dataclass
class CMAESState(PicklableOptimiserState):
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
    calls_lapack = True
    fewest = 2  # they are ranked against each other

    @staticmethod
    def init(params: CMAESParams, population: Array, box: Box, horizon: int, rng: np.random.Generator) -> CMAESState:
        n, d = population.shape
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


MEAN_DECIMALS = 9


@dataclass(frozen=True)
class IPOPParams:
    """Step size of every start as a fraction of the width of the box; growth of the population at a restart."""

    first_step_size: Positive = 0.3
    growth: Annotated[int, Ge(1)] = 2


@dataclass
class IPOPState(PicklableOptimiserState):
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
    calls_lapack = True

    @staticmethod
    def init(params: IPOPParams, population: Array, box: Box, horizon: int, rng: np.random.Generator) -> IPOPState:
        optimiser = _start_optimiser(params, np.full(population.shape[1], 0.5), None, rng)
        return IPOPState(params, optimiser, population.copy(), box, no_leaders(population, 1), rng)

    @staticmethod
    def ask(state: IPOPState) -> tuple[Array, IPOPState]:
        if not state.started:
            return state.asked.copy(), state
        state.asked = np.array([state.optimiser.ask() for _ in range(state.optimiser.population_size)])
        return _from_unit_box(state.asked, state.box), state

    @staticmethod
    def tell(state: IPOPState, X: Array, fitness: Array) -> IPOPState:
        loss = as_loss(fitness)
        promote(state.leaders, X, loss)
        U = (X - state.box.lower) / (state.box.upper - state.box.lower)
        if not state.started:
            mean = np.round(U[loss.argmin()], MEAN_DECIMALS)
            state.optimiser = _start_optimiser(state.params, mean, None, state.rng)
            state.started = True
            return state
        U = np.where(_from_unit_box(state.asked, state.box) == X, state.asked, U)
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


def _from_unit_box(U: Array, box: Box) -> Array:
    return box.lower + U * (box.upper - box.lower)


def _restart(state: IPOPState) -> None:
    size = state.params.growth * state.optimiser.population_size
    state.optimiser = _start_optimiser(state.params, state.rng.random(len(state.box.lower)), size, state.rng)
    state.restarts += 1


def _start_optimiser(params: IPOPParams, mean: Array, size: int | None, rng: np.random.Generator) -> CMA:
    """The package's optimiser in the unit box; size: of its population, its own advice if None."""
    return CMA(mean, params.first_step_size, seed=int(rng.integers(2**32)), population_size=size)
