"""L-SHADE (Tanabe and Fukunaga 2014, doi 10.1109/CEC.2014.6900380), the root of most winners of later contests.

Form: current-to-pbest/1/bin with an archive,

    v = x_i + F (x_pbest - x_i) + F (x_r1 - x_r2),    x_r1 of the population, x_r2 of population and archive,

F and CR drawn about a memory of what succeeded, and a population that shrinks linearly with the evaluations to 4
at the end of the horizon. The constants are the authors': H = 6, p = 0.11, archive 2.6 times the population. They
start with 18 d points; here the first population is what is given. Points outside are for the bound policy; the
authors put a coordinate half-way between the target and the bound.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from algorithms.contract import Array, Box, as_loss
from algorithms.success_history import SuccessHistory

SMALLEST = 4


@dataclass(frozen=True)
class LSHADEParams:
    """history: entries of the memory. best_share: of the points that may be pbest, two at least."""

    history: int = 6
    best_share: float = 0.11
    archive_ratio: float = 2.6


@dataclass
class LSHADEState:
    """first_size, evaluations, planned: for the shrinking. scaling, crossover (n,): of the trials that were asked."""

    params: LSHADEParams
    population: Array
    fitness: Array
    archive: Array
    history: SuccessHistory
    first_size: int
    planned: int
    rng: np.random.Generator
    evaluations: int = 0
    scaling: Array = field(default_factory=lambda: np.zeros(0))
    crossover: Array = field(default_factory=lambda: np.zeros(0))


class LSHADE:
    """Success-history based adaptive differential evolution with linear population size reduction."""

    name = "l-shade"
    Params = LSHADEParams

    @staticmethod
    def init(params: LSHADEParams, population: Array, box: Box, horizon: int, rng: np.random.Generator) -> LSHADEState:
        n, d = population.shape
        if n < SMALLEST:
            raise ValueError(f"L-SHADE takes a target and three others: {n} points are too few")
        history = SuccessHistory(*np.full((2, params.history), 0.5))
        fitness = np.full(n, np.inf)
        return LSHADEState(params, population.copy(), fitness, np.empty((0, d)), history, n, n * (horizon + 1), rng)

    @staticmethod
    def ask(state: LSHADEState) -> tuple[Array, LSHADEState]:
        if not state.evaluations:
            return state.population.copy(), state
        state.scaling, state.crossover = state.history.rates(len(state.population), state.rng)
        return _trials(state), state

    @staticmethod
    def tell(state: LSHADEState, X: Array, fitness: Array) -> LSHADEState:
        loss = as_loss(fitness)
        if state.evaluations:
            _learn(state, loss)
        chosen = loss <= state.fitness
        np.copyto(state.population, X, where=chosen[:, None])
        np.copyto(state.fitness, loss, where=chosen)
        state.evaluations += len(X)
        _shrink(state)
        return state

    @staticmethod
    def incumbent(state: LSHADEState) -> tuple[Array, float]:
        best = state.fitness.argmin()
        return state.population[best].copy(), float(state.fitness[best])

    @staticmethod
    def finished(state: LSHADEState) -> bool:
        return False


def _trials(state: LSHADEState) -> Array:
    X, rng = state.population, state.rng
    n, d = X.shape
    place = np.floor(rng.random(n) * _best_count(state)).astype(np.intp)
    best = _best_ones(state)[place]
    first, second = _donors(n, n + len(state.archive), rng)
    others = np.concatenate([X, state.archive])
    mutants = X + state.scaling[:, None] * (X[best] - X + X[first] - others[second])
    crossed = rng.random((n, d)) < state.crossover[:, None]
    crossed[np.arange(n), (rng.random(n) * d).astype(np.intp)] = True
    return np.where(crossed, mutants, X)


def _best_ones(state: LSHADEState) -> NDArray[np.intp]:
    return np.argsort(state.fitness, kind="stable")


def _best_count(state: LSHADEState) -> int:
    return max(round(state.params.best_share * len(state.population)), 2)


def _donors(n: int, total: int, rng: np.random.Generator) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """For each of n targets another of the n, and a third of `total`; the three are different."""
    target = np.arange(n)
    first = (rng.random(n) * (n - 1)).astype(np.intp)
    second = (rng.random(n) * (total - 2)).astype(np.intp)
    first += first >= target
    second += second >= np.minimum(first, target)
    second += second >= np.maximum(first, target)
    return first, second


def _learn(state: LSHADEState, loss: Array) -> None:
    """Remember what made points better, and keep those that were replaced."""
    better = loss < state.fitness
    gain = state.fitness[better] - loss[better]
    state.history.learn(state.scaling[better], state.crossover[better], gain)
    state.archive = np.concatenate([state.archive, state.population[better]])


def _shrink(state: LSHADEState) -> None:
    """Linear population size reduction (eq. 10); the worst points go, and chance takes from the archive."""
    share = min(state.evaluations / state.planned, 1.0)
    size = round(state.first_size + (SMALLEST - state.first_size) * share)
    kept = np.sort(_best_ones(state)[:size])
    state.population, state.fitness = state.population[kept], state.fitness[kept]
    room = round(state.params.archive_ratio * size)
    if len(state.archive) > room:
        drawn = np.argsort(state.rng.random(len(state.archive)), kind="stable")[:room]
        state.archive = state.archive[np.sort(drawn)]
