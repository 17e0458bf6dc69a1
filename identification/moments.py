"""A regression compressed to products of its columns, joint by joint: any subset and weighting is one small solve."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from identification.cross_validation import BLOCKS, folds
from identification.estimators.linear import Prior
from identification.regression import Regression
from recordings.run import Array

RIDGE = 1e-9  # of a column's power: above the rounding of the products, below any information


@dataclass(frozen=True, eq=False)
class Moments:
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
            values = _solved(gram, cross)
            variance = np.maximum(self.errors(values, columns), 1e-12 * np.sum(self.power)) / self.samples
            weights = 1 / variance if by_joint else np.full(joints, 1 / variance.mean())
        return np.asarray(values)


def _solved(gram: Array, cross: Array) -> Array:
    """Solution in scaled coordinates; columns that depend on each other share their part."""
    scale = np.sqrt(np.maximum(np.diag(gram), 0))
    scale = np.where(scale > 0, scale, 1.0)
    scaled = gram / np.outer(scale, scale) + RIDGE * np.eye(len(gram))
    return np.asarray(cho_solve(cho_factor(scaled), cross / scale) / scale)


def moments(data: Regression) -> Moments:
    """The moments of all rows."""
    matrix = data.matrix.reshape(data.samples, data.joints, -1)
    gram = np.stack([matrix[:, joint].T @ matrix[:, joint] for joint in range(data.joints)])
    cross = np.einsum("tjp,tj->jp", matrix, data.torques)
    return Moments(gram, cross, np.sum(data.torques**2, axis=0), data.samples)


@dataclass(frozen=True, eq=False)
class Split:
    """Moments of the folds: to fit, and to judge."""

    fit: tuple[Moments, ...]
    judge: tuple[Moments, ...]

    def held_out_error(self, columns: Sequence[int], prior: Prior | None, by_joint: bool) -> float:
        """||tau - tau_hat|| / ||tau|| over the held-out blocks."""
        chosen = np.asarray(columns, dtype=np.intp)
        error = sum(
            float(np.sum(judge.errors(fit.fit(chosen, prior, by_joint), chosen)))
            for fit, judge in zip(self.fit, self.judge, strict=True)
        )
        return float(np.sqrt(error / sum(float(np.sum(judge.power)) for judge in self.judge)))


def split(fit: Regression, judge: Regression, blocks: int = BLOCKS) -> Split:
    """Moments of each fold; fit and judge hold the same samples (`judge` perhaps the torque as recorded)."""
    parts = list(folds(fit, blocks))
    return Split(
        tuple(moments(fit.rows(part.fit)) for part in parts), tuple(moments(judge.rows(part.judge)) for part in parts)
    )
