"""How fast runs reach targets.

Running times, expected running time and their distribution (COCO), the area under the convergence curve, and
performance profiles (Dolan and Moré 2002, doi 10.1007/s101070100263).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from armlab.common.arrays import Array


@dataclass(frozen=True, eq=False)
class Run:
    """Best value so far (k,), infinite while nothing feasible is found, after so many evaluations (k,)."""

    evaluations: Array
    best: Array


def targets_between(easy: float, hard: float, count: int = 51, exact: bool = False) -> Array:
    """Targets (count,) from easy to hard, evenly spaced in the logarithm; both positive. exact: the last one is 0."""
    targets = np.asarray(np.geomspace(easy, hard, count))
    return np.append(targets[:-1], 0.0) if exact else targets


def running_times(run: Run, targets: Array) -> Array:
    """Evaluations until each target is reached (targets,), infinite for those that never are."""
    reached = run.best[:, None] <= targets[None, :]
    first = reached.argmax(axis=0)
    return np.where(reached.any(axis=0), run.evaluations[first], np.inf)


def expected_running_time(times: Array, spent: Array) -> Array:
    """Evaluations until a target is reached if a failed run is followed by another, (targets,).

    times: (runs, targets), infinite for failures. spent: evaluations of each run (runs,). Infinite without a success.
    """
    success = np.isfinite(times)
    used = np.where(success, times, spent[:, None]).sum(axis=0)
    count = success.sum(axis=0)
    return np.asarray(np.divide(used, count, out=np.full(len(count), np.inf), where=count > 0))


@dataclass(frozen=True, eq=False)
class CondensedTimes:
    """Running times of many runs and targets, condensed, so that a thousand runs take no more memory than ten.

    times: the distinct finite ones in ascending order (k,); counts: how many are no later (k,); of: the number of all.
    """

    times: Array
    counts: NDArray[np.intp]
    of: int


def condense_times(times: Array) -> CondensedTimes:
    """Condensed running times from an array of any shape."""
    once, counts = np.unique(times[np.isfinite(times)], return_counts=True)
    return CondensedTimes(once, counts.cumsum(), times.size)


def share_reached(found: Sequence[CondensedTimes], evaluations: Array) -> Array:
    """The share of all times, over runs, problems and targets, within each number of evaluations (k,)."""
    reached = [np.append(0, one.counts)[np.searchsorted(one.times, evaluations, side="right")] for one in found]
    return np.asarray(np.sum(reached, axis=0) / sum(one.of for one in found))


def area_under_curve(run: Run, best: float, worst: float, budget: int) -> float:
    """Mean over the evaluations of log10 of the best so far, scaled to 0 at `best` and 1 at `worst`.

    Smaller is better; 1 minus the area is IOHprofiler's area over the convergence curve. Values beyond the two limits,
    as 0 is, count as the limits; evaluations before the first known value count as `worst`.
    """
    level = np.append(1.0, _scale_log(run.best, best, worst))
    ends = np.concatenate([[0.0], np.minimum(run.evaluations, budget), [float(budget)]])
    return float((level * np.diff(ends)).sum() / budget)


def _scale_log(values: Array, best: float, worst: float) -> Array:
    low, high = np.log10(best), np.log10(worst)
    with np.errstate(divide="ignore"):
        logs = np.log10(values)
    if high <= low:
        return np.where(logs <= low, 0.0, 1.0)
    return np.asarray(np.clip((logs - low) / (high - low), 0.0, 1.0))


def performance_ratios(costs: pd.DataFrame) -> pd.DataFrame:
    """Costs, one row a problem and one column an algorithm, divided by the least of the row; 0 / 0 is 1.

    An infinite cost is a failure; if all algorithms fail, all ratios are infinite.
    """
    least = costs.min(axis=1)
    ratios = costs.div(least.where(np.isfinite(least), 1.0), axis=0)
    return ratios.where(costs.ne(0.0), 1.0).astype(float)


def performance_profile(costs: pd.DataFrame, factors: Array) -> pd.DataFrame:
    """For each algorithm (column) the share of problems that it solves within each factor of the least cost (row)."""
    ratios = performance_ratios(costs)
    shares = {name: (ratios[name].to_numpy()[None, :] <= factors[:, None]).mean(axis=1) for name in ratios}
    return pd.DataFrame(shares, index=pd.Index(factors, name="factor"))
