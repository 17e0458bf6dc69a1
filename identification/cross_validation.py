"""Blocked cross-validation: stretches of time are held out, with a gap that the filter cannot bridge."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from identification.estimators.estimate import Estimator
from identification.regression import Regression

BLOCKS = 6
GAP_PERIODS = 1.0  # of the filter's cut-off, left out on both sides of a held-out block


@dataclass(frozen=True, eq=False)
class Fold:
    """Samples that fit and samples that judge, each (samples,) of truth values."""

    fit: NDArray[np.bool_]
    judge: NDArray[np.bool_]


def folds(data: Regression, blocks: int = BLOCKS) -> Iterator[Fold]:
    """Each block of time once: every run is cut into an equal share of the blocks, at least one."""
    gap = int(np.ceil(GAP_PERIODS * data.correlation_s * data.rate_hz))
    start = 0
    for length in data.lengths:
        parts = max(round(blocks * length / data.samples), 2 if len(data.lengths) == 1 else 1)
        edges = start + np.linspace(0, length, parts + 1).astype(int)
        for first, last in pairwise(edges):
            fit, judge = np.ones(data.samples, dtype=bool), np.zeros(data.samples, dtype=bool)
            fit[max(first - gap, start) : min(last + gap, start + length)] = False
            judge[first:last] = True
            yield Fold(fit, judge)
        start += length


def held_out_error(fit: Regression, judge: Regression, estimator: Estimator, blocks: int = BLOCKS) -> float:
    """||tau - tau_hat|| / ||tau|| over all held-out blocks.

    fit, judge: the same samples; `judge` may hold the torque as recorded where `fit` holds it filtered.
    """
    error, size = 0.0, 0.0
    for fold in folds(fit, blocks):
        values = estimator(fit.rows(fold.fit)).values
        held = judge.rows(fold.judge)
        error += float(np.sum(held.residuals(values) ** 2))
        size += float(np.sum(held.torque**2))
    return float(np.sqrt(error / size))
