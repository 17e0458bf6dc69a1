"""Whether two result sets say the same, algorithm by algorithm and problem by problem."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass

import numpy as np
import pandas as pd

from algorithms.contract import Array
from bench.regression.comparison import location_p_value
from bench.sharing.result_set import CELL, ResultSet
from bench.statistics import is_feasible, quantile
from bench.statistics.holm import holm
from bench.statistics.paired import log_losses, signed_rank_p, superiority, superiority_unpaired


@dataclass(frozen=True)
class Comparison:
    """One algorithm on one problem in both sets; medians of the value, an infeasible end counting as infinite.

    superiority: chance that an end of the second set is better than one of the first (A12), with a 95 % interval.
    p: of equality, two-sided, after Holm over all comparisons.
    """

    problem: str
    algorithm: str
    first_count: int
    second_count: int
    first_median: float
    second_median: float
    superiority: float
    low: float
    high: float
    p: float

    def change(self, rate: float = 0.05) -> str:
        """What became of the algorithm from the first set to the second."""
        if self.p > rate:
            return "="
        return "better" if self.superiority > 0.5 else "worse"


def are_paired(first: ResultSet, second: ResultSet) -> bool:
    """Whether equal repetitions began with equal populations: the same seed gives them."""
    return first.seed == second.seed


def changed_problems(first: ResultSet, second: ResultSet) -> list[str]:
    """Labels of problems that have other settings in the second set."""
    ours, theirs = first.problems, second.problems
    return [label for label in ours if label in theirs and ours[label] != theirs[label]]


def compare(first: ResultSet, second: ResultSet) -> pd.DataFrame:
    """One row a `Comparison` with its `change`, for all that both sets have; empty if they have nothing in common."""
    raw = [_compare(*shared, paired=are_paired(first, second)) for shared in _shared(first, second)]
    adjusted = holm(np.array([comparison.p for comparison in raw]))
    found = [Comparison(**{**asdict(c), "p": float(p)}) for c, p in zip(raw, adjusted, strict=True)]
    columns = [*Comparison.__dataclass_fields__, "change"]
    return pd.DataFrame([asdict(c) | {"change": c.change()} for c in found], columns=columns)


def _shared(first: ResultSet, second: ResultSet) -> Iterator[tuple[str, str, pd.DataFrame, pd.DataFrame]]:
    """Problem, algorithm and the trials of both sets, for what stands in both under the same labels and budget."""
    theirs = dict(list(second.trials.groupby([*CELL, "algorithm"], sort=False)))
    for label, trials in first.ends():
        for key, rows in trials.groupby([*CELL, "algorithm"], sort=False):
            if key in theirs:
                yield label, str(rows["algorithm"].iloc[0]), rows, theirs[key]


def _compare(problem: str, algorithm: str, first: pd.DataFrame, second: pd.DataFrame, paired: bool) -> Comparison:
    effect, p = _test(first, second, paired)
    counts = len(first), len(second)
    return Comparison(problem, algorithm, *counts, _median(first), _median(second), *effect, p)


def _test(first: pd.DataFrame, second: pd.DataFrame, paired: bool) -> tuple[tuple[float, float, float], float]:
    both = [first.assign(algorithm="first"), second.assign(algorithm="second")]
    losses = log_losses(pd.concat(both, ignore_index=True))
    old, new = losses["first"], losses["second"]
    if paired and sorted(first["repetition"]) == sorted(second["repetition"]):
        return superiority(new, old), signed_rank_p(new, old)
    return superiority_unpaired(new, old), float(location_p_value(old, new)) if np.ptp(np.append(old, new)) else 1.0


def _median(trials: pd.DataFrame) -> float:
    values: Array = trials["value"].to_numpy()
    return quantile(np.where(is_feasible(values, trials["violation"].to_numpy()), values, np.inf), 0.5)
