"""Least squares: ordinary, weighted by joint, drawn to a normal prior, and robust; and what every estimator returns.

The robust estimators reweight iteratively: a row that fits badly counts less (Huber 1964, Beaton and Tukey 1974).
"""

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from armlab.common.arrays import Array
from armlab.identification.regression import Regression

EXCITED_TOLERANCE = 1e-3  # the same, of directions that a motion excites: its square is that of plain least squares
RANK_TOLERANCE = 1e-7  # of the largest singular value, columns scaled to unit length; its square is near rounding


@dataclass(frozen=True, eq=False)
class Estimate:
    """Parameters that solve sum(instruments * residuals) = information @ (parameters - mean of the prior).

    values: (columns,). bread: (columns, columns), inverse of the derivative of these equations.
    instruments: (samples * joints, columns). information: (columns, columns) of a prior, None without.
    """

    values: Array
    bread: Array
    instruments: Array
    information: Array | None = None


class Estimator(Protocol):
    """Anything that turns a regression into an estimate."""

    def __call__(self, data: Regression) -> Estimate:
        """The estimate from these data."""
        ...


def column_lengths(matrix: Array) -> Array:
    """Column lengths, 1 for a zero column."""
    lengths = np.linalg.norm(matrix, axis=0)
    return np.asarray(np.where(lengths > 0, lengths, 1.0))


def pseudo_inverse(gram: Array) -> Array:
    """Inverse of a symmetric matrix in scaled coordinates; directions without any information get zero."""
    scale = np.sqrt(np.maximum(np.diag(gram), 0))
    scale = np.where(scale > 0, scale, 1.0)
    both = np.outer(scale, scale)
    return np.asarray(np.linalg.pinv(gram / both, rcond=RANK_TOLERANCE**2, hermitian=True) / both)


def least_squares(matrix: Array, torque: Array, tolerance: float = RANK_TOLERANCE) -> Array:
    """Solution of least squares with columns scaled to unit length, (columns,); (columns, k) for k torques at once.

    tolerance: directions with a smaller singular value, as a share of the largest, stay zero.
    """
    lengths = column_lengths(matrix)
    basis, triangle = np.linalg.qr(matrix / lengths)
    return np.asarray((np.linalg.lstsq(triangle, basis.T @ torque, rcond=tolerance)[0].T / lengths).T)


@dataclass(frozen=True)
class OrdinaryLeastSquares:
    """Every newton metre counts the same."""

    def __call__(self, data: Regression) -> Estimate:
        """The estimate from these data."""
        values = least_squares(data.matrix, data.torque)
        return Estimate(values, pseudo_inverse(data.matrix.T @ data.matrix), data.matrix)


def joint_weights(data: Regression, values: Array) -> Array:
    """One over the standard deviation of each joint's residual, (joints,)."""
    deviation = np.sqrt(np.mean(data.residuals(values) ** 2, axis=0))
    floor = 1e-9 * max(float(deviation.max()), 1e-300)
    return np.asarray(1 / np.maximum(deviation, floor))


@dataclass(frozen=True)
class WeightedLeastSquares:
    """Joints weighted by their residuals' deviation (Gautier 1997): a small motor's N m counts for more.

    tolerance: of `least_squares`. What it leaves at zero has the interval that it would have if it were fitted.
    coordinates: (columns, unknowns), the unknowns whose directions the tolerance judges; the columns' own if left out.
    """

    rounds: int = 2
    tolerance: float = RANK_TOLERANCE
    coordinates: Array | None = None

    def __call__(self, data: Regression) -> Estimate:
        """The estimate from these data."""
        coordinates = np.eye(data.matrix.shape[1]) if self.coordinates is None else self.coordinates
        values = least_squares(data.matrix, data.torque)
        for _ in range(self.rounds):
            weights = joint_weights(data, values)
            weighted = data.weighted(weights)
            values = coordinates @ least_squares(weighted.matrix @ coordinates, weighted.torque, self.tolerance)
        return Estimate(values, pseudo_inverse(weighted.matrix.T @ weighted.matrix), data.weighted(weights**2).matrix)


@dataclass(frozen=True, eq=False)
class Prior:
    """A normal prior: mean (columns,) and information (columns, columns), zero where nothing is known."""

    mean: Array
    information: Array


@dataclass(frozen=True, eq=False)
class BayesianLeastSquares:
    """A normal prior on the parameters (such as CAD values and their tolerance).

    by_joint: joints weighted by their errors, else all alike.
    """

    prior: Prior
    by_joint: bool = True
    rounds: int = 2

    def __call__(self, data: Regression) -> Estimate:
        """The mean of the posterior; its intervals are those of the posterior."""
        mean, information = self.prior.mean, self.prior.information
        weights = np.ones(data.joints) / max(float(np.std(data.torque)), 1e-300)
        for _ in range(self.rounds + 1):
            weighted = data.weighted(weights)
            gram = weighted.matrix.T @ weighted.matrix + information
            step = weighted.matrix.T @ (weighted.torque - weighted.matrix @ mean)
            values = mean + pseudo_inverse(gram) @ step
            used, weights = weights, self._weights(data, values)
        return Estimate(values, pseudo_inverse(gram), data.weighted(used**2).matrix, information)

    def _weights(self, data: Regression, values: Array) -> Array:
        if self.by_joint:
            return joint_weights(data, values)
        return np.full(data.joints, 1 / float(np.sqrt(np.mean(data.residuals(values) ** 2))))


TUNING_CONSTANTS = {"huber": 1.345, "tukey": 4.685}  # 95 % efficiency where the errors are normal
NORMAL_MAD = 0.6745
CONVERGENCE_TOLERANCE = 1e-8


@dataclass(frozen=True)
class RobustLeastSquares:
    """M-estimator with a scale for each joint, the median absolute deviation."""

    loss: Literal["huber", "tukey"] = "huber"
    rounds: int = 50

    def __call__(self, data: Regression) -> Estimate:
        """The estimate from these data."""
        values = least_squares(data.matrix, data.torque)
        for _ in range(self.rounds):
            scale = _robust_scale(data.residuals(values))
            weights = (self._weight(data.residuals(values) / scale) / scale**2).ravel()
            weighted = data.weighted(np.sqrt(weights))
            previous, values = values, least_squares(weighted.matrix, weighted.torque)
            if np.linalg.norm(values - previous) <= CONVERGENCE_TOLERANCE * np.linalg.norm(values):
                break
        slope = (self._slope(data.residuals(values) / scale) / scale**2).ravel()
        bread = pseudo_inverse(data.matrix.T @ (data.matrix * slope[:, None]))
        return Estimate(values, bread, data.matrix * weights[:, None])

    def _weight(self, ratio: Array) -> Array:
        size = np.abs(ratio) / TUNING_CONSTANTS[self.loss]
        if self.loss == "huber":
            return np.asarray(1 / np.maximum(size, 1))
        return np.asarray(np.maximum(1 - size**2, 0) ** 2)

    def _slope(self, ratio: Array) -> Array:
        """Derivative of weight * residual."""
        size = np.abs(ratio) / TUNING_CONSTANTS[self.loss]
        if self.loss == "huber":
            return np.asarray((size < 1).astype(float))
        return np.asarray(np.where(size < 1, (1 - size**2) * (1 - 5 * size**2), 0.0))


def _robust_scale(residuals: Array) -> Array:
    deviation = np.median(np.abs(residuals - np.median(residuals, axis=0)), axis=0) / NORMAL_MAD
    return np.asarray(np.maximum(deviation, 1e-9 * max(float(np.abs(residuals).max()), 1e-300)))
