"""What every estimator returns, and the linear algebra that they share."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from identification.regression import Regression
from recordings.run import Array

RANK = 1e-7  # of the largest singular value, columns scaled to unit length; its square is near rounding


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


def lengths_of(matrix: Array) -> Array:
    """Column lengths, 1 for a zero column."""
    lengths = np.linalg.norm(matrix, axis=0)
    return np.asarray(np.where(lengths > 0, lengths, 1.0))


def pseudo_inverse(gram: Array) -> Array:
    """Inverse of a symmetric matrix in scaled coordinates; directions without any information get zero."""
    scale = np.sqrt(np.maximum(np.diag(gram), 0))
    scale = np.where(scale > 0, scale, 1.0)
    both = np.outer(scale, scale)
    return np.asarray(np.linalg.pinv(gram / both, rcond=RANK**2, hermitian=True) / both)


def least_squares(matrix: Array, torque: Array) -> Array:
    """Solution of least squares with columns scaled to unit length, (columns,)."""
    lengths = lengths_of(matrix)
    basis, triangle = np.linalg.qr(matrix / lengths)
    return np.asarray(np.linalg.lstsq(triangle, basis.T @ torque, rcond=RANK)[0] / lengths)
