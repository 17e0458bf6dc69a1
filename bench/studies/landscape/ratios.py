"""By how much one algorithm ends above another: ratios of medians with intervals, from summary tables."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy.special import ndtri

from armlab.common.arrays import Array
from bench.statistics.ends import INTERVAL_LEVEL, percentile_interval, resamples

LEAST_RESAMPLED = 6  # problems; of fewer, the range is told
_QUARTILE = float(ndtri(0.75))


@dataclass(frozen=True)
class Ratio:
    """Geometric mean of the ratios of medians over problems.

    low, high: 95 % percentile bootstrap over the problems, or the range of the problems where they are few (`ranged`);
    problems: those on which both medians are feasible; without: the others.
    """

    value: float
    low: float
    high: float
    problems: int
    without: int
    ranged: bool

    @property
    def told_apart(self) -> bool:
        """Whether the interval, or range, has no 1 in it."""
        return self.problems > 0 and (self.low > 1 or self.high < 1)

    def text(self) -> str:
        """For a cell of a table."""
        if not self.problems:
            return "-"
        span = f"{self.low:.2f} to {self.high:.2f}"
        return f"{self.value:.2f} ({'range ' if self.ranged else ''}{span})"


def mean_ratio(ours: "pd.Series[float]", theirs: "pd.Series[float]", groups: "pd.Series[Any]") -> Ratio:
    """Of medians by problem; problems of one group (those that differ in their frame alone) count as one."""
    logs = np.log(ours) - np.log(theirs)
    finite = logs[np.isfinite(logs)]
    values: Array = finite.groupby(groups.reindex(finite.index), sort=False).mean().to_numpy()
    if not len(values):
        return Ratio(float("nan"), float("nan"), float("nan"), 0, len(logs), ranged=False)
    ranged = len(values) < LEAST_RESAMPLED
    means = values if ranged else values[resamples(len(values), "ratio")].mean(axis=1)
    low, high = (means.min(), means.max()) if ranged else percentile_interval(means)
    value, low, high = np.exp([values.mean(), low, high])
    return Ratio(float(value), float(low), float(high), len(finite), len(logs) - len(finite), ranged)


def quartile_ratio(ours: Any, theirs: Any, repetitions: int) -> tuple[float, float, float]:
    """Ratio of two medians on one problem with a 95 % interval, from rows of a summary table.

    The standard error of a median is sqrt(pi / 2 n) times the spread, which the quartiles of log values give
    (McGill, Tukey and Larsen 1978). NaN where a median or quartile is not feasible.
    """
    columns = ["lower_quartile", "median", "upper_quartile"]
    logs = np.log([[each[name] for name in columns] for each in (ours, theirs)])
    if not np.isfinite(logs).all():
        return float("nan"), float("nan"), float("nan")
    difference = logs[0, 1] - logs[1, 1]
    spreads = (logs[:, 2] - logs[:, 0]) / (2 * _QUARTILE)
    error = np.sqrt(np.pi / (2 * repetitions)) * np.hypot(*spreads)
    reach = float(ndtri((1 + INTERVAL_LEVEL) / 2)) * error
    value, low, high = np.exp([difference, difference - reach, difference + reach])
    return float(value), float(low), float(high)


def quartile_ratio_text(ours: Any, theirs: Any, repetitions: int) -> str:
    """For a cell of a table."""
    value, low, high = quartile_ratio(ours, theirs, repetitions)
    return "-" if np.isnan(value) else f"{value:.2f} ({low:.2f} to {high:.2f})"
