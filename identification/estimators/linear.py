"""Least squares: ordinary, weighted by joint, and drawn to a prior."""

from dataclasses import dataclass

import numpy as np

from identification.estimators.estimate import Estimate, least_squares, pseudo_inverse
from identification.regression import Regression
from recordings.run import Array


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
    """Joints weighted by their residuals' deviation (Gautier 1997): a small motor's N m counts for more."""

    rounds: int = 2

    def __call__(self, data: Regression) -> Estimate:
        """The estimate from these data."""
        values = least_squares(data.matrix, data.torque)
        for _ in range(self.rounds):
            weights = joint_weights(data, values)
            weighted = data.weighted(weights)
            values = least_squares(weighted.matrix, weighted.torque)
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
