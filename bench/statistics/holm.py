"""Holm's correction of p-values (Scand. J. Statist. 6, 1979, 65)."""

import numpy as np

from algorithms.contract import Array


def holm(p: Array) -> Array:
    """P-values (..., k) after Holm's correction, valid however the comparisons depend on each other."""
    order = np.argsort(p, axis=-1, kind="stable")
    factors = np.arange(p.shape[-1], 0, -1)
    adjusted = np.maximum.accumulate(np.take_along_axis(p, order, axis=-1) * factors, axis=-1)
    result = np.empty_like(adjusted)
    np.put_along_axis(result, order, np.minimum(adjusted, 1.0), axis=-1)
    return result
