"""The logarithm of a condition number without its kinks, which are where singular values meet."""

import numpy as np

from problem.gradient import SpectralFunction
from problem.transforms import Array


def smooth_log_condition(power: float) -> SpectralFunction:
    """log of the p-norms of sigma and of 1 / sigma: above log(cond) by at most 2 log(n) / p.

    At a good trajectory several singular values meet at either end, and the condition number has no gradient;
    this function of the whole spectrum has one, and its limit for large p is the condition number.
    """

    def function(values: Array) -> tuple[float, Array]:
        large, small = (values / values[0]) ** power, (values[-1] / values) ** power
        value = np.log(values[0] / values[-1]) + (np.log(large.sum()) + np.log(small.sum())) / power
        return float(value), (large / large.sum() - small / small.sum()) / values

    return function
