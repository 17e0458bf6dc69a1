"""The memory of L-SHADE: which scaling factors and crossover rates have led to better points lately."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from algorithms.contract import Array

SPREAD = 0.1  # of both distributions about a memory entry


@dataclass
class SuccessHistory:
    """Entries (H,) each of scaling factors and crossover rates; a rate of NaN is the terminal value: always 0.

    place: the entry that is replaced next.
    """

    scaling: Array
    crossover: Array
    place: int = 0

    def rates(self, n: int, rng: np.random.Generator) -> tuple[Array, Array]:
        """Scaling factors and crossover rates for n points, (n,) each (Tanabe 2013, eq. 8-9)."""
        entry = (rng.random(n) * len(self.scaling)).astype(np.intp)
        rates = self.crossover[entry] + SPREAD * ndtri(rng.random(n))
        return _scaling_factors(self.scaling[entry], rng), np.clip(np.nan_to_num(rates, nan=0.0), 0.0, 1.0)

    def learn(self, scaling: Array, crossover: Array, gain: Array) -> None:
        """Replace an entry by the means of what succeeded, (k,) each, weighted by the gain in fitness."""
        if not len(gain):
            return
        weights = _finite(gain) / _finite(gain).sum()
        ended = np.isnan(self.crossover[self.place]) or crossover.max() == 0.0
        self.crossover[self.place] = np.nan if ended else lehmer_mean(crossover, weights)
        self.scaling[self.place] = lehmer_mean(scaling, weights)
        self.place = (self.place + 1) % len(self.scaling)


def lehmer_mean(values: Array, weights: Array) -> float:
    """Sum of weighted squares over the weighted sum (Tanabe 2014, eq. 7)."""
    return float((weights * values**2).sum() / (weights * values).sum())


def _finite(gain: Array) -> Array:
    """Gains (k,) divided by the largest finite one; a step out of the losses counts as much as that one."""
    finite: NDArray[np.bool_] = np.isfinite(gain)
    largest = gain[finite].max() if finite.any() else 1.0
    return np.where(finite, gain, largest) / largest


def _scaling_factors(centres: Array, rng: np.random.Generator) -> Array:
    """Cauchy about the centres (n,), drawn again where not positive, 1 at most."""
    factors = np.zeros(len(centres))
    while (again := factors <= 0.0).any():
        factors[again] = centres[again] + SPREAD * np.tan(np.pi * (rng.random(int(again.sum())) - 0.5))
    return np.minimum(factors, 1.0)
