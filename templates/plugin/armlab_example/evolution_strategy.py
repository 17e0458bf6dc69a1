"""A (1 + n) evolution strategy: normal steps about the best point, longer after a success, else shorter.

Form: step length times 1.5 when one of the n points is better, else divided by 1.5^(1/4) (the one-fifth rule
in the form of Kern et al. 2004).
"""

from dataclasses import dataclass

import numpy as np

from algorithms.contract import Box, as_loss
from armlab.common.arrays import Array


@dataclass(frozen=True)
class EvolutionStrategyParams:
    """first_step: standard deviation of the first steps, as a fraction of the width of the box."""

    first_step: float = 0.3


@dataclass
class EvolutionStrategyState:
    population: Array
    width: Array
    step: float
    best: Array
    best_fitness: float
    rng: np.random.Generator
    started: bool = False


class EvolutionStrategy:
    """Everything that changes is in the State; the class only holds functions."""

    name = "evolution-strategy"
    Params = EvolutionStrategyParams

    @staticmethod
    def init(
        params: EvolutionStrategyParams, population: Array, box: Box, horizon: int, rng: np.random.Generator
    ) -> EvolutionStrategyState:
        width = box.upper - box.lower
        return EvolutionStrategyState(population.copy(), width, params.first_step, population[0].copy(), np.inf, rng)

    @staticmethod
    def ask(state: EvolutionStrategyState) -> tuple[Array, EvolutionStrategyState]:
        if not state.started:
            return state.population.copy(), state
        steps = state.rng.standard_normal(state.population.shape)
        return state.best + state.step * state.width * steps, state

    @staticmethod
    def tell(state: EvolutionStrategyState, X: Array, fitness: Array) -> EvolutionStrategyState:
        loss = as_loss(fitness)
        k = int(loss.argmin())
        success = loss[k] < state.best_fitness
        if success:
            state.best, state.best_fitness = X[k].copy(), float(loss[k])
        if state.started:
            state.step *= 1.5 if success else 1.5**-0.25
        state.started = True
        return state

    @staticmethod
    def incumbent(state: EvolutionStrategyState) -> tuple[Array, float]:
        return state.best.copy(), state.best_fitness

    @staticmethod
    def finished(state: EvolutionStrategyState) -> bool:
        return False
