"""The best points seen so far, which several algorithms follow."""

from dataclasses import dataclass

import numpy as np

from algorithms.contract import as_loss
from armlab.common.arrays import Array


@dataclass
class Leaders:
    """The k best points (k, d) in order, with their fitness (k,); +inf stands for none yet."""

    position: Array
    fitness: Array


def no_leaders(population: Array, k: int) -> Leaders:
    """The first k points with fitness +inf, so that there is a point to follow even if every fitness is a loss."""
    return Leaders(population[np.arange(k) % len(population)], np.full(k, np.inf))


def promote(leaders: Leaders, X: Array, fitness: Array) -> None:
    """Keep the k best of leaders and X (n, d), in order; of equals the older one stays."""
    candidates = np.concatenate((leaders.fitness, as_loss(fitness)))
    order = candidates.argsort(kind="stable")[: len(leaders.fitness)]
    leaders.fitness = candidates[order]
    leaders.position = np.concatenate((leaders.position, X))[order]


def leader(leaders: Leaders) -> tuple[Array, float]:
    """The best point (d,), as a copy, and its fitness."""
    return leaders.position[0].copy(), float(leaders.fitness[0])
