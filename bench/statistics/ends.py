"""Summaries of the ends of runs, some of them infeasible, and percentile bootstrap intervals of their quantiles, which
may be infinite.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.streams import named_generator


@dataclass(frozen=True)
class Summary:
    """Minimum, average and sample standard deviation (n - 1) of the feasible ends; NaN if there are none.

    Median and quartiles are of all ends; an infeasible end counts as infinite.
    """

    minimum: float
    average: float
    standard_deviation: float
    median: float
    lower_quartile: float
    upper_quartile: float
    feasible_share: float


def summarise(values: Array, violations: Array) -> Summary:
    """The summary of ends with values (n,) and violations (n,), n >= 1; a violation of 0 is feasible."""
    feasible = is_feasible(values, violations)
    good = values[feasible]
    ends = np.where(feasible, values, np.inf)
    return Summary(
        minimum=float(good.min()) if len(good) else math.nan,
        average=float(good.mean()) if len(good) else math.nan,
        standard_deviation=float(good.std(ddof=1)) if len(good) > 1 else math.nan,
        median=quantile(ends, 0.5),
        lower_quartile=quantile(ends, 0.25),
        upper_quartile=quantile(ends, 0.75),
        feasible_share=float(feasible.mean()),
    )


def is_feasible(values: Array, violations: Array) -> NDArray[np.bool_]:
    """Where a value is finite and nothing is violated."""
    return np.asarray(np.isfinite(values) & (violations == 0))


def quantile(values: Array, share: float) -> float:
    """Linear interpolation as in numpy, but correct for infinite values, where numpy returns NaN."""
    return float(row_quantiles(values[None], share)[0])


def row_quantiles(rows: Array, share: float) -> Array:
    """`quantile` of each row: (m, n) -> (m,)."""
    ordered = np.sort(rows, axis=1)
    place = share * (rows.shape[1] - 1)
    below = math.floor(place)
    weight = place - below
    if weight == 0:
        return ordered[:, below]
    return np.asarray((1 - weight) * ordered[:, below] + weight * ordered[:, below + 1])


BOOTSTRAP_RESAMPLES = 2000
INTERVAL_LEVEL = 0.95


def resamples(n: int, *names: str) -> NDArray[np.int64]:
    """Rows of indices drawn with replacement, (BOOTSTRAP_RESAMPLES, n); the same ones for the same n and names."""
    return named_generator("bootstrap", *names, n).integers(n, size=(BOOTSTRAP_RESAMPLES, n))


def quantile_interval(values: Array, share: float = 0.5) -> tuple[float, float]:
    """95 % interval of a quantile of values (n,)."""
    return percentile_interval(row_quantiles(values[resamples(len(values))], share))


def percentile_interval(resampled: Array) -> tuple[float, float]:
    """The middle 95 % of resampled figures (m,)."""
    tail = (1.0 - INTERVAL_LEVEL) / 2
    return quantile(resampled, tail), quantile(resampled, 1.0 - tail)


def place_of_zero(values: Array) -> float | None:
    """Where 0 stands on a logarithmic axis: a decade below the least positive value; None where no value is 0."""
    if not (values == 0).any():
        return None
    positive = values[(values > 0) & np.isfinite(values)]
    return float(positive.min()) / 10 if len(positive) else 1.0
