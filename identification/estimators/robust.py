"""Iteratively reweighted least squares: a row that fits badly counts less (Huber 1964, Beaton and Tukey 1974)."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from identification.estimators.estimate import Estimate, least_squares, pseudo_inverse
from identification.regression import Regression
from recordings.run import Array

TUNING = {"huber": 1.345, "tukey": 4.685}  # 95 % efficiency where the errors are normal
NORMAL_MAD = 0.6745
CONVERGED = 1e-8


@dataclass(frozen=True)
class RobustLeastSquares:
    """M-estimator with a scale for each joint, the median absolute deviation."""

    loss: Literal["huber", "tukey"] = "huber"
    rounds: int = 50

    def __call__(self, data: Regression) -> Estimate:
        """The estimate from these data."""
        values = least_squares(data.matrix, data.torque)
        for _ in range(self.rounds):
            scale = _scale(data.residuals(values))
            weights = (self._weight(data.residuals(values) / scale) / scale**2).ravel()
            weighted = data.weighted(np.sqrt(weights))
            previous, values = values, least_squares(weighted.matrix, weighted.torque)
            if np.linalg.norm(values - previous) <= CONVERGED * np.linalg.norm(values):
                break
        slope = (self._slope(data.residuals(values) / scale) / scale**2).ravel()
        bread = pseudo_inverse(data.matrix.T @ (data.matrix * slope[:, None]))
        return Estimate(values, bread, data.matrix * weights[:, None])

    def _weight(self, ratio: Array) -> Array:
        size = np.abs(ratio) / TUNING[self.loss]
        if self.loss == "huber":
            return np.asarray(1 / np.maximum(size, 1))
        return np.asarray(np.maximum(1 - size**2, 0) ** 2)

    def _slope(self, ratio: Array) -> Array:
        """Derivative of weight * residual."""
        size = np.abs(ratio) / TUNING[self.loss]
        if self.loss == "huber":
            return np.asarray((size < 1).astype(float))
        return np.asarray(np.where(size < 1, (1 - size**2) * (1 - 5 * size**2), 0.0))


def _scale(residuals: Array) -> Array:
    deviation = np.median(np.abs(residuals - np.median(residuals, axis=0)), axis=0) / NORMAL_MAD
    return np.asarray(np.maximum(deviation, 1e-9 * max(float(np.abs(residuals).max()), 1e-300)))
