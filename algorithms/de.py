"""Differential evolution, DE/rand/1/bin (Storn and Price 1997).

Update of target x_i in coordinate j:

    v_i = x_r1 + F (x_r2 - x_r3)                                                  mutant
    u_ij = v_ij if rand_ij < CR or j = j_i, else x_ij                             trial
    x_i(t + 1) = u_i if f(u_i) <= f(x_i), else x_i                                selection

with r1, r2, r3 and i all different, rand_ij uniform in [0, 1), drawn anew for every target and coordinate, and the
coordinate j_i drawn once a target. All trials are built from one generation. F = 0.85 and CR = 1 are Table 2's; with
CR = 1 the trial is the mutant.

Where this differs from the source: there a trial has to be better than its target; here it is enough that it is not
worse, so the population can move on a plateau.

Other readings (`reading`):
- `text`: a trial has to be better.
- `program`, the authors' MATLAB: r1 is a random order of the population, r2 and r3 are the same order turned by 1 to 4
  places and again by another such number, so that one of them may be i; the mutant is x_r3 + F (x_r1 - x_r2); no
  coordinate is forced. Compared with public copies of its `deopt.m`, strategy 1, and `left_win.m`: turns, mutant,
  crossover and the selection, in which an equal trial wins, agree. Its treatment of the box, a random place between
  base and limit, is not part of the reading: the bound policy of the experiment decides here.

How peers differ: scipy defaults to best/1/bin with dithered F, updates at once and polishes the end; pygmo
defaults to rand/1/exp; mealpy has F = 0.1 and no forced coordinate; pymoo adds polynomial mutation.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from annotated_types import Interval
from numpy.typing import NDArray

from algorithms.contract import Box, as_loss
from algorithms.parameter_types import OURS, Reading, Share
from armlab.common.arrays import Array


@dataclass(frozen=True)
class DEParams:
    """Table 2."""

    scaling_factor: Annotated[float, Interval(ge=0, le=2)] = 0.85  # the source's range
    crossover_rate: Share = 1.0
    reading: Reading = OURS


@dataclass
class DEState:
    params: DEParams
    population: Array
    fitness: Array
    rng: np.random.Generator
    started: bool = False


class DE:
    """DE/rand/1/bin, one generation at a time."""

    name = "de"
    Params = DEParams
    fewest = 4  # a target and three others

    @staticmethod
    def init(params: DEParams, population: Array, box: Box, horizon: int, rng: np.random.Generator) -> DEState:
        return DEState(params, population.copy(), np.full(len(population), np.inf), rng)

    @staticmethod
    def ask(state: DEState) -> tuple[Array, DEState]:
        return (_build_trials(state) if state.started else state.population.copy()), state

    @staticmethod
    def tell(state: DEState, X: Array, fitness: Array) -> DEState:
        loss = as_loss(fitness)
        chosen = loss < state.fitness if state.params.reading == "text" and state.started else loss <= state.fitness
        np.copyto(state.population, X, where=chosen[:, None])
        np.copyto(state.fitness, loss, where=chosen)
        state.started = True
        return state

    @staticmethod
    def incumbent(state: DEState) -> tuple[Array, float]:
        best = state.fitness.argmin()
        return state.population[best].copy(), float(state.fitness[best])

    @staticmethod
    def finished(state: DEState) -> bool:
        return False


def _build_trials(state: DEState) -> Array:
    """Trials u = v or x of all targets (n, d), with v = x_r1 + F (x_r2 - x_r3)."""
    X, params = state.population, state.params
    if params.reading == "program":
        return _build_turned_trials(state)
    r1, r2, r3 = distinct_others(len(X), state.rng)
    mutants: Array = X.take(r2, axis=0)  # faster than X[r2]
    mutants -= X.take(r3, axis=0)
    mutants *= params.scaling_factor
    mutants += X.take(r1, axis=0)
    rand, forced = state.rng.random(X.shape), state.rng.random(len(X))
    if params.crossover_rate == 1:  # every coordinate is crossed
        return mutants
    crossed = rand < params.crossover_rate
    crossed[np.arange(len(X)), (forced * X.shape[1]).astype(np.intp)] = True
    return np.where(crossed, mutants, X)


def _build_turned_trials(state: DEState) -> Array:
    """Trials of the authors' program (n, d): one random order of the population, turned twice."""
    X, params, rng = state.population, state.params, state.rng
    places = np.arange(len(X))
    turns = rng.permutation(4)[:2] + 1
    first = rng.permutation(len(X))
    second = first[(places + turns[0]) % len(X)]
    third = second[(places + turns[1]) % len(X)]
    mutants = X[third] + params.scaling_factor * (X[first] - X[second])
    return np.where(rng.random(X.shape) < params.crossover_rate, mutants, X)


def distinct_others(n: int, rng: np.random.Generator) -> NDArray[np.intp]:
    """For each of n rows three different rows other than itself, all choices equally likely, (3, n).

    Steps ahead in the ring of rows, drawn without replacement from 1 ... n - 1: the second and third draw
    come from what is left, and skip what is taken.
    """
    steps = (rng.random((3, n)) * np.arange(n - 1, n - 4, -1)[:, None]).astype(np.intp)
    first, second, third = steps
    second += second >= first
    third += third >= np.minimum(first, second)
    third += third >= np.maximum(first, second)
    steps += np.arange(1, n + 1)
    steps %= n
    return steps
