"""Percentile bootstrap intervals of quantiles, also where ends are infinite, which scipy's bootstrap refuses."""

import numpy as np
from numpy.typing import NDArray

from algorithms.contract import Array
from bench.seeds import named_generator
from bench.statistics.ends import quantile, row_quantiles

RESAMPLES = 2000
LEVEL = 0.95


def resamples(n: int, *names: str) -> NDArray[np.int64]:
    """Rows of indices drawn with replacement, (RESAMPLES, n); always the same ones for an n and names."""
    return named_generator("bootstrap", *names, n).integers(n, size=(RESAMPLES, n))


def quantile_interval(values: Array, share: float = 0.5) -> tuple[float, float]:
    """95 % interval of a quantile of values (n,)."""
    return percentiles(row_quantiles(values[resamples(len(values))], share))


def percentiles(resampled: Array) -> tuple[float, float]:
    """The middle 95 % of resampled figures (m,)."""
    tail = (1.0 - LEVEL) / 2
    return quantile(resampled, tail), quantile(resampled, 1.0 - tail)
