"""Rank correlations over windows that share blocks: p-values by permuting blocks, intervals by leaving blocks out."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from armlab.common.arrays import Array
from armlab.common.statistics import spearman_correlations, standard_ranks
from armlab.proof.open.conditioning.windows import RunWindows

PERMUTATIONS = 4999
LEVEL = 0.95
MAX_CORRELATION = 1 - 1e-9  # whose Fisher transform is finite


@dataclass(frozen=True, eq=False)
class BlockCorrelation:
    """Spearman's correlation of each criterion with the error.

    value, error, low, high, p: (criteria,); error is the standard error; NaN for a criterion that is the same in all
    windows. permuted: (permutations, criteria), the correlations after permutations of the blocks.
    """

    value: Array
    error: Array
    low: Array
    high: Array
    p: Array
    permuted: Array


def correlate(windows: RunWindows, criteria: Array, errors: Array, rng: np.random.Generator) -> BlockCorrelation:
    """Correlations over all windows of criteria (windows, criteria) with errors (windows,).

    p: the share of permutations of the blocks that give a correlation at least as large in size, the data included.
    Under the hypothesis that what a block does for the criterion has nothing to do with what it does for the error,
    the blocks of the error can be exchanged (Krackhardt 1988, for the pairs of a network). Intervals are jackknife
    intervals over the blocks on Fisher's scale (Tukey 1958), with Student's factor.
    """
    value = spearman_correlations(criteria, errors[:, None])[:, 0]
    given, promised = standard_ranks(errors[:, None])[:, 0], standard_ranks(criteria)
    orders = (rng.permutation(windows.blocks) for _ in range(PERMUTATIONS))
    permuted = np.array([given[windows.permuted(order)] @ promised for order in orders])
    left_out = np.array(
        [
            spearman_correlations(criteria[kept], errors[kept, None])[:, 0]
            for kept in (windows.without(block) for block in range(windows.blocks))
        ]
    )
    centre, spread = _fisher(value), _jackknife_error(_fisher(left_out))
    half = student.ppf((1 + LEVEL) / 2, windows.blocks - 1) * spread
    return BlockCorrelation(
        value,
        _jackknife_error(left_out),
        np.tanh(centre - half),
        np.tanh(centre + half),
        permutation_p(value, permuted),
        permuted,
    )


def average(correlations: Sequence[BlockCorrelation], windows: RunWindows) -> BlockCorrelation:
    """The mean over arms, whose blocks are permuted independently; an arm without a value takes no part.

    The interval holds for the mean of these arms, not for arms in general. NaN where no arm has a value.
    """
    values = np.array([each.value for each in correlations])
    count = count_of_values(values)
    mean = np.nansum(values, axis=0) / count
    error = np.sqrt(np.nansum([each.error**2 for each in correlations], axis=0)) / count
    permuted = np.nansum([each.permuted for each in correlations], axis=0) / count
    half = student.ppf((1 + LEVEL) / 2, windows.blocks - 1) * error
    return BlockCorrelation(mean, error, mean - half, mean + half, permutation_p(mean, permuted), permuted)


def count_of_values(values: Array) -> Array:
    """How many of the first axis are not NaN; NaN where none is."""
    count = np.sum(~np.isnan(values), axis=0)
    return np.where(count > 0, count, np.nan)


def permutation_p(value: Array, permuted: Array) -> Array:
    """Two-sided p-values (criteria,) of values under permutations (permutations, criteria); NaN without a value."""
    beyond = np.sum(np.abs(permuted) >= np.abs(value) - 1e-12, axis=0)
    return np.where(np.isnan(value), np.nan, (1 + beyond) / (1 + len(permuted)))


def _jackknife_error(left_out: Array) -> Array:
    """Standard errors (k,) of a statistic whose values without each block are (blocks, k)."""
    blocks = len(left_out)
    return np.asarray(np.sqrt((blocks - 1) * np.mean((left_out - left_out.mean(axis=0)) ** 2, axis=0)))


def _fisher(correlation: Array) -> Array:
    return np.arctanh(np.clip(correlation, -MAX_CORRELATION, MAX_CORRELATION))
