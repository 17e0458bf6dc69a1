"""Statistics that more than one part needs."""

import numpy as np
from scipy.stats import binomtest, rankdata

from armlab.common.arrays import Array


def adjust_by_holm(p_values: Array) -> Array:
    """P-values (..., k) after Holm's correction (1979) along the last axis, in their order; scipy has none.

    The correction is valid however the k comparisons depend on each other.
    """
    order = np.argsort(p_values, axis=-1, kind="stable")
    factors = np.arange(p_values.shape[-1], 0, -1)
    adjusted = np.maximum.accumulate(np.take_along_axis(p_values, order, axis=-1) * factors, axis=-1)
    result = np.empty_like(adjusted)
    np.put_along_axis(result, order, np.minimum(adjusted, 1.0), axis=-1)
    return result


def wilson_interval(hits: int, number: int, level: float = 0.95) -> tuple[float, float]:
    """Wilson's score interval (1927) of the share hits / number; (0, 1) without any trial."""
    if number == 0:
        return 0.0, 1.0
    interval = binomtest(hits, number).proportion_ci(confidence_level=level, method="wilson")
    return float(interval.low), float(interval.high)


def spearman_correlations(one: Array, other: Array) -> Array:
    """Spearman's correlations (a, b) between columns of (n, a) and of (n, b); NaN for a column that is constant."""
    return np.asarray(standard_ranks(one).T @ standard_ranks(other))


def standard_ranks(values: Array) -> Array:
    """Ranks of each column (n, k), centred and of unit length; NaN for a column that is constant."""
    ranks = rankdata(values, axis=0)
    centred = ranks - ranks.mean(axis=0)
    lengths = np.linalg.norm(centred, axis=0)
    return np.asarray(centred / np.where(lengths > 0, lengths, np.nan))
