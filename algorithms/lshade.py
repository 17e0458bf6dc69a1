"""L-SHADE (Tanabe and Fukunaga 2014), the root of most winners of later contests.

Update of target x_i of a population of N points, current-to-pbest/1/bin with an archive:

    CR_i = normal(M_CR[r_i], 0.1) cut to [0, 1],  F_i = Cauchy(M_F[r_i], 0.1), again if <= 0, cut to 1       eq. 1-2
    v_i = x_i + F_i (x_pbest - x_i) + F_i (x_r1 - x_r2)                                                      eq. 3
    u_ij = v_ij if rand_ij < CR_i or j = j_i, else x_ij                                                      eq. 5
    x_i <- u_i if f(u_i) <= f(x_i), else x_i                                                                 eq. 6
    M_F[k], M_CR[k] <- sum_i w_i S_i^2 / sum_i w_i S_i,  w_i = gain_i / sum gain                             eq. 7-9
    N <- round(N_first + (4 - N_first) evaluations / planned evaluations)                                    eq. 10

with r_i one of the H entries of the memory M; x_pbest one of the best round(p N) points, of two at least; x_r1 of the
population and x_r2 of population and archive, with i, r1 and r2 all different; rand_ij and j_i as in `algorithms.de`.
S are the F_i or CR_i of the trials that are better than their targets, gain_i = f(x_i) - f(u_i). Each generation with
such a trial replaces the next entry k; an M_CR[k] for which all S are 0 stays 0 from then on. Targets that were beaten
go to the archive, chance takes from it what is above 2.6 N points, and the worst points leave the population. H = 6,
p = 0.11 and 2.6 are the authors' constants.

Where this differs from the source: the authors start with 18 d points, here the first population is what is given;
eq. 4 puts a coordinate outside half-way between target and bound, here the bound policy moves it; a gain out of a
fitness that is not finite counts as much as the largest finite one.
"""

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from annotated_types import Ge, Interval
from numpy.typing import NDArray
from scipy.special import ndtri

from algorithms.contract import Box, as_loss
from algorithms.parameter_types import NotNegative
from armlab.common.arrays import Array

MEMORY_SPREAD = 0.1  # of both distributions about a memory entry


@dataclass
class SuccessHistory:
    """Entries (H,) each of scaling factors and crossover rates; a rate of NaN is the terminal value: always 0.

    place: the entry that is replaced next.
    """

    scaling: Array
    crossover: Array
    place: int = 0

    def rates(self, n: int, rng: np.random.Generator) -> tuple[Array, Array]:
        """Scaling factors and crossover rates for n points, (n,) each (eq. 1-2)."""
        entry = (rng.random(n) * len(self.scaling)).astype(np.intp)
        rates = self.crossover[entry] + MEMORY_SPREAD * ndtri(rng.random(n))
        return _draw_scaling_factors(self.scaling[entry], rng), np.clip(np.nan_to_num(rates, nan=0.0), 0.0, 1.0)

    def learn(self, scaling: Array, crossover: Array, gain: Array) -> None:
        """Replace an entry by the means of what succeeded, (k,) each, weighted by the gain in fitness (eq. 7-9)."""
        if not len(gain):
            return
        weights = _finite_gains(gain) / _finite_gains(gain).sum()
        ended = np.isnan(self.crossover[self.place]) or crossover.max() == 0.0
        self.crossover[self.place] = np.nan if ended else lehmer_mean(crossover, weights)
        self.scaling[self.place] = lehmer_mean(scaling, weights)
        self.place = (self.place + 1) % len(self.scaling)


def lehmer_mean(values: Array, weights: Array) -> float:
    """Sum of weighted squares over the weighted sum (eq. 7)."""
    return float((weights * values**2).sum() / (weights * values).sum())


def _finite_gains(gain: Array) -> Array:
    """Gains (k,) divided by the largest finite one; a step out of the losses counts as much as that one."""
    finite: NDArray[np.bool_] = np.isfinite(gain)
    largest = gain[finite].max() if finite.any() else 1.0
    return np.where(finite, gain, largest) / largest


def _draw_scaling_factors(centres: Array, rng: np.random.Generator) -> Array:
    """Cauchy about the centres (n,), drawn again where not positive, 1 at most."""
    factors = np.zeros(len(centres))
    while (again := factors <= 0.0).any():
        factors[again] = centres[again] + MEMORY_SPREAD * np.tan(np.pi * (rng.random(int(again.sum())) - 0.5))
    return np.minimum(factors, 1.0)


MIN_POPULATION = 4


@dataclass(frozen=True)
class LSHADEParams:
    """history: entries of the memory. best_share: of the points that may be pbest, two at least."""

    history: Annotated[int, Ge(1)] = 6
    best_share: Annotated[float, Interval(gt=0, le=1)] = 0.11
    archive_ratio: NotNegative = 2.6


@dataclass
class LSHADEState:
    """first_size, evaluations, planned: for eq. 10. scaling, crossover (n,): F_i and CR_i of the trials asked for."""

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
    fewest = MIN_POPULATION  # a target and three others

    @staticmethod
    def init(params: LSHADEParams, population: Array, box: Box, horizon: int, rng: np.random.Generator) -> LSHADEState:
        n, d = population.shape
        history = SuccessHistory(*np.full((2, params.history), 0.5))
        fitness = np.full(n, np.inf)
        return LSHADEState(params, population.copy(), fitness, np.empty((0, d)), history, n, n * (horizon + 1), rng)

    @staticmethod
    def ask(state: LSHADEState) -> tuple[Array, LSHADEState]:
        if not state.evaluations:
            return state.population.copy(), state
        state.scaling, state.crossover = state.history.rates(len(state.population), state.rng)
        return _build_trials(state), state

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


def _build_trials(state: LSHADEState) -> Array:
    """Trials u of all targets (n, d), eq. 3 and 5."""
    X, rng = state.population, state.rng
    n, d = X.shape
    place = np.floor(rng.random(n) * _best_count(state)).astype(np.intp)
    best = _order_by_fitness(state)[place]
    first, second = _draw_donors(n, n + len(state.archive), rng)
    others = np.concatenate([X, state.archive])
    mutants = X + state.scaling[:, None] * (X[best] - X + X[first] - others[second])
    crossed = rng.random((n, d)) < state.crossover[:, None]
    crossed[np.arange(n), (rng.random(n) * d).astype(np.intp)] = True
    return np.where(crossed, mutants, X)


def _order_by_fitness(state: LSHADEState) -> NDArray[np.intp]:
    return np.argsort(state.fitness, kind="stable")


def _best_count(state: LSHADEState) -> int:
    return max(round(state.params.best_share * len(state.population)), 2)


def _draw_donors(n: int, total: int, rng: np.random.Generator) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
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
    size = round(state.first_size + (MIN_POPULATION - state.first_size) * share)
    kept = np.sort(_order_by_fitness(state)[:size])
    state.population, state.fitness = state.population[kept], state.fitness[kept]
    room = round(state.params.archive_ratio * size)
    if len(state.archive) > room:
        drawn = np.argsort(state.rng.random(len(state.archive)), kind="stable")[:room]
        state.archive = state.archive[np.sort(drawn)]
