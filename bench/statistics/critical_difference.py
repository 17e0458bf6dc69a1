"""Average ranks over many problems, and groups of algorithms without a significant difference."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pandas as pd
from scipy.stats import friedmanchisquare, rankdata

from armlab.common.arrays import Array
from armlab.common.statistics import adjust_by_holm
from bench.statistics.pairwise import paired_losses, signed_rank_p
from bench.statistics.superiority import superiority

Pair = tuple[str, str]
ERROR_RATE = 0.05


@dataclass(frozen=True)
class CriticalDifference:
    """Average ranks, best first; groups: the longest runs of neighbours of which no two differ significantly.

    p: of every pair, after Holm's correction over all `tests`. friedman_p: that all are equal, NaN for fewer than three
    algorithms.
    """

    ranks: dict[str, float]
    p: dict[Pair, float]
    groups: tuple[tuple[str, ...], ...]
    friedman_p: float
    blocks: int
    tests: int

    @property
    def has_too_few_blocks(self) -> bool:
        """Whether no pair can differ significantly: even the smallest possible p-value is too large."""
        return self.tests * 2.0 ** (1 - self.blocks) > ERROR_RATE


def critical_difference(losses: pd.DataFrame, rate: float = ERROR_RATE) -> CriticalDifference:
    """From finite losses: one row a block (a problem, or a repetition of one problem), one column an algorithm.

    A block that an algorithm lacks (NaN) is left out of the ranks, and of the tests of this algorithm.
    """
    complete = losses.dropna()
    ranks = average_ranks(complete)
    pairs = list(combinations(ranks, 2))
    raw = np.array([signed_rank_p(*paired_losses(losses, a, b)) for a, b in pairs])
    p = dict(zip(pairs, adjust_by_holm(raw).tolist(), strict=True))
    groups = indistinguishable_groups(list(ranks), p, rate)
    return CriticalDifference(ranks, p, groups, _friedman_p(complete), len(complete), len(pairs))


def paired_ranking(losses: Sequence[pd.DataFrame], rate: float = ERROR_RATE) -> CriticalDifference:
    """The ranking on these problems alone, from the paired runs within each; losses: of each, as `log_losses` gives.

    Ranks are averaged over all repetitions of all problems. Two algorithms differ where a test tells them apart on a
    problem and none tells the opposite on another; Holm's correction is over all pairs of all problems. blocks: the
    least number of complete repetitions of a problem.
    """
    blocks = paired_blocks(losses)
    ranks = average_ranks(blocks)
    pairs = list(combinations(ranks, 2))
    paired = [[paired_losses(one, *pair) for pair in pairs] for one in losses]
    raw = np.array([signed_rank_p(*both) for row in paired for both in row])
    adjusted = adjust_by_holm(raw).reshape(len(losses), len(pairs))
    signs = np.array([[np.sign(superiority(*both)[0] - 0.5) for both in row] for row in paired])
    told = np.where(adjusted <= rate, signs, 0.0)
    opposed = (told > 0).any(axis=0) & (told < 0).any(axis=0)
    p = dict(zip(pairs, np.where(opposed, 1.0, adjusted.min(axis=0)).tolist(), strict=True))
    groups = indistinguishable_groups(list(ranks), p, rate)
    least = min(len(one.dropna()) for one in losses)
    return CriticalDifference(ranks, p, groups, _friedman_p(blocks), least, len(raw))


def paired_blocks(losses: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """The complete repetitions of all problems, one below the other; only their ranks within a row mean something."""
    return pd.concat([one.dropna() for one in losses], ignore_index=True)


def block_losses(losses: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """Losses to rank, from those of each problem as `log_losses` gives them.

    One row a problem, medians; with one problem only, one row a repetition.
    """
    if len(losses) == 1:
        return losses[0]
    return pd.DataFrame([one.median() for one in losses])


def average_ranks(losses: pd.DataFrame) -> dict[str, float]:
    """Mean rank over the rows, best first; rank 1 is the smallest loss of a row, ties share their mean.

    Without a row all are equal: the mean of all ranks.
    """
    count = losses.shape[1]
    means = rankdata(losses.to_numpy(), axis=1).mean(axis=0) if len(losses) else np.full(count, (count + 1) / 2)
    order = np.argsort(means, kind="stable")
    return {str(losses.columns[k]): float(means[k]) for k in order}


def indistinguishable_groups(names: list[str], p: dict[Pair, float], rate: float) -> tuple[tuple[str, ...], ...]:
    """Runs of neighbours in the ranking of which no pair differs; none lies within another."""
    found: list[tuple[int, int]] = []
    for first in range(len(names)):
        last = first
        while last + 1 < len(names) and all(p[names[k], names[last + 1]] > rate for k in range(first, last + 1)):
            last += 1
        if last > first and (not found or last > found[-1][1]):
            found.append((first, last))
    return tuple(tuple(names[first : last + 1]) for first, last in found)


def _friedman_p(losses: pd.DataFrame) -> float:
    columns: Array = losses.to_numpy().T
    if len(columns) < 3 or not len(losses) or np.ptp(columns, axis=0).max() == 0:
        return float("nan")
    return float(friedmanchisquare(*columns).pvalue)
