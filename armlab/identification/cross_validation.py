"""Blocked cross-validation: stretches of time are held out, with a gap that the filter cannot bridge.

A regression can be compressed to products of its columns, joint by joint; then a fit of any subset of columns with
any weights is one small solve.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve, pinvh

from armlab.common.arrays import Array
from armlab.identification.estimators.least_squares import Estimator, Prior
from armlab.identification.regression import Regression

FOLD_BLOCKS = 6
GAP_PERIODS = 1.0  # of the filter's cut-off, left out on both sides of a held-out block


@dataclass(frozen=True, eq=False)
class Fold:
    """Samples that fit and samples that judge, each (samples,) of truth values."""

    fit: NDArray[np.bool_]
    judge: NDArray[np.bool_]


def folds(data: Regression, blocks: int = FOLD_BLOCKS) -> Iterator[Fold]:
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


def held_out_errors(data: Regression, estimator: Estimator) -> Array:
    """Rms error of each joint over all held-out blocks, (joints,), N m (N)."""
    squares = np.zeros(data.joints)
    for fold in folds(data):
        values = estimator(data.rows(fold.fit)).values
        squares += np.sum(data.rows(fold.judge).residuals(values) ** 2, axis=0)
    return np.asarray(np.sqrt(squares / data.samples))


GRAM_RIDGE = 1e-9  # of a column's power: above the rounding of the products, below any information


@dataclass(frozen=True, eq=False)
class RowMoments:
    """gram (joints, columns, columns), cross (joints, columns), power (joints,) of rows, samples many."""

    gram: Array
    cross: Array
    power: Array
    samples: int

    def errors(self, values: Array, columns: NDArray[np.intp]) -> Array:
        """Sum of squared residuals of each joint, (joints,)."""
        gram = self.gram[:, columns[:, None], columns]
        quadratic = np.einsum("p,jpq,q->j", values, gram, values)
        return np.asarray(np.maximum(self.power - 2 * self.cross[:, columns] @ values + quadratic, 0))

    def fit(self, columns: NDArray[np.intp], prior: Prior | None, by_joint: bool, rounds: int = 3) -> Array:
        """Parameters of the chosen columns: joints weighted by their errors or not, drawn to a prior or not."""
        joints = len(self.power)
        weights = np.full(joints, self.samples / np.sum(self.power)) * joints
        for _ in range(rounds):
            gram = np.einsum("j,jpq->pq", weights, self.gram[:, columns[:, None], columns])
            cross = weights @ self.cross[:, columns]
            if prior is not None:
                information = prior.information[np.ix_(columns, columns)]
                gram, cross = gram + information, cross + information @ prior.mean[columns]
            values = _solve_scaled(gram, cross)
            variance = np.maximum(self.errors(values, columns), 1e-12 * np.sum(self.power)) / self.samples
            weights = 1 / variance if by_joint else np.full(joints, 1 / variance.mean())
        return np.asarray(values)


def _solve_scaled(gram: Array, cross: Array) -> Array:
    """Solution in scaled coordinates; columns that depend on each other share their part."""
    scale = np.sqrt(np.maximum(np.diag(gram), 0))
    scale = np.where(scale > 0, scale, 1.0)
    scaled = gram / np.outer(scale, scale) + GRAM_RIDGE * np.eye(len(gram))
    try:
        return np.asarray(cho_solve(cho_factor(scaled), cross / scale) / scale)
    except LinAlgError:  # a joint that few rows fit exactly outweighs the others beyond the rounding of the products
        return np.asarray(pinvh((scaled + scaled.T) / 2, rtol=GRAM_RIDGE) @ (cross / scale) / scale)


def regression_moments(data: Regression) -> RowMoments:
    """The moments of all rows."""
    matrix = data.matrix.reshape(data.samples, data.joints, -1)
    gram = np.stack([matrix[:, joint].T @ matrix[:, joint] for joint in range(data.joints)])
    cross = np.einsum("tjp,tj->jp", matrix, data.torques)
    return RowMoments(gram, cross, np.sum(data.torques**2, axis=0), data.samples)


@dataclass(frozen=True, eq=False)
class FoldMoments:
    """Moments of the folds: to fit, and to judge."""

    fit: tuple[RowMoments, ...]
    judge: tuple[RowMoments, ...]

    def held_out_error(self, columns: Sequence[int], prior: Prior | None, by_joint: bool) -> float:
        """||tau - tau_hat|| / ||tau|| over the held-out blocks."""
        chosen = np.asarray(columns, dtype=np.intp)
        error = sum(
            float(np.sum(judge.errors(fit.fit(chosen, prior, by_joint), chosen)))
            for fit, judge in zip(self.fit, self.judge, strict=True)
        )
        return float(np.sqrt(error / sum(float(np.sum(judge.power)) for judge in self.judge)))


def fold_moments(fit: Regression, judge: Regression) -> FoldMoments:
    """Moments of each fold; fit and judge hold the same samples (`judge` perhaps the torque as recorded)."""
    parts = list(folds(fit))
    return FoldMoments(
        tuple(regression_moments(fit.rows(part.fit)) for part in parts),
        tuple(regression_moments(judge.rows(part.judge)) for part in parts),
    )
