"""Inverses and solutions of the symmetric matrices that a search asks for thousands of times."""

import numpy as np
from scipy.linalg.lapack import dpocon, dposv, dpotrf, dpotri

from armlab.common.arrays import Array

LEAST_RATIO = 1e-12  # of a matrix's smallest to its largest eigenvalue: below it is rounding


def inverse_of(matrix: Array) -> Array:
    """The inverse of a symmetric positive definite matrix. Raises LinAlgError where it is none."""
    factor, failed = dpotrf(matrix, lower=1)
    if failed:
        raise np.linalg.LinAlgError("the matrix is not positive definite")
    return _inverse_from(factor)


def pseudo_inverse_of(matrix: Array) -> Array:
    """The inverse of a symmetric positive semidefinite matrix without the directions that are rounding.

    No eigenvalue is rounding where the condition in the 1-norm, which is no better than that of the eigenvalues, says
    so; an eigendecomposition takes five times as long.
    """
    if not len(matrix):
        return matrix
    factor, failed = dpotrf(matrix, lower=1)
    if not failed and dpocon(factor, np.linalg.norm(matrix, 1), uplo="L")[0] > LEAST_RATIO:
        return _inverse_from(factor)
    return np.asarray(np.linalg.pinv(matrix, rcond=LEAST_RATIO, hermitian=True))


def solve_positive(matrix: Array, towards: Array) -> Array:
    """The solution of a symmetric positive definite system of equations; the shortest one where it is singular."""
    if not len(matrix):
        return towards
    _, solved, failed = dposv(matrix, towards, lower=1)
    return np.asarray(np.linalg.lstsq(matrix, towards)[0] if failed else solved)


def _inverse_from(factor: Array) -> Array:
    """From a lower Cholesky factor."""
    half = dpotri(factor, lower=1, overwrite_c=1)[0]
    whole = half + half.T
    whole.flat[:: len(whole) + 1] /= 2
    return np.asarray(whole)
