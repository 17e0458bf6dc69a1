"""How good an excitation is: condition number, eq. 44, D- and E-optimality of its observation matrix."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from problem.arm import Arm
from problem.friction import friction_entries, friction_matrix
from problem.motion import Motion
from problem.regressor import extended_gram_matrix, gram_matrix, observation_matrix

MAX_GRAM_CONDITION = 1e4
"""Largest condition number taken from the Gram matrix: its square loses 2e-16 * cond^2 of relative accuracy,
here at most 1e-7; beyond it the singular values come from the observation matrix itself."""


@dataclass(frozen=True)
class Criterion:
    """What is minimised for a trajectory within all limits.

    `eq44`: cond + weight_smallest / sigma_min + weight_largest * sigma_max (eq. 44; the paper gives neither
    the value of its one weight nor its place). `d_optimality`: -2 sum(log sigma) / n, that is -log det of the
    information matrix per parameter. `e_optimality`: -sigma_min.
    """

    kind: Literal["eq44", "d_optimality", "e_optimality"] = "eq44"
    weight_smallest: float = 0.0
    weight_largest: float = 0.0

    def value(self, singular_values: Array) -> Array:
        """Criterion (points,) of singular values (points, n), descending."""
        largest, smallest = singular_values[:, 0], singular_values[:, -1]
        if self.kind == "e_optimality":
            return -smallest
        with np.errstate(divide="ignore", invalid="ignore"):
            if self.kind == "d_optimality":
                return np.asarray(-2.0 * np.log(singular_values).mean(axis=1))
            merit = condition_number(singular_values) + self.weight_smallest / smallest + self.weight_largest * largest
        return np.where(smallest > 0, merit, np.inf)  # 0 / 0 where a weight is 0 too


def condition_number(singular_values: Array) -> Array:
    """Ratio of the largest to the smallest of singular values (points, n), descending; infinite at rank loss."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = singular_values[:, 0] / singular_values[:, -1]
    return np.where(np.isnan(ratio), np.inf, ratio)


def singular_values(
    arm: Arm, motion: Motion, columns: NDArray[np.intp], unit_columns: bool, friction_columns: bool = False
) -> Array:
    """Singular values (points, chosen), descending, of chosen columns of the observation matrix.

    motion: (points, samples, joints). unit_columns: scale each column to unit length first. friction_columns: with
    those of `problem.friction` behind the chosen ones, three more a joint.
    Taken from the Gram matrix where that is accurate (see MAX_GRAM_CONDITION), else from the matrix itself.
    """
    if friction_columns:
        gram = extended_gram_matrix(arm, motion, columns, friction_entries(motion))
    else:
        gram = gram_matrix(arm, motion, columns)
    if unit_columns:
        lengths = np.sqrt(np.diagonal(gram, axis1=1, axis2=2))
        lengths = np.where(lengths > 0, lengths, 1.0)
        gram = gram / (lengths[:, :, None] * lengths[:, None, :])
    if not math.isfinite(gram.sum()):  # rare, so the points are not looked at one by one before
        finite = np.asarray(np.isfinite(gram.sum(axis=(1, 2))))
        gram = np.where(finite[:, None, None], gram, 0.0)
    values: Array = np.sqrt(np.maximum(np.linalg.eigvalsh(gram)[:, ::-1], 0.0))
    for point in np.flatnonzero(values[:, 0] > MAX_GRAM_CONDITION * values[:, -1]):
        values[point] = _singular_values_of_matrix(arm, motion.select(point), columns, unit_columns, friction_columns)
    return values


def _singular_values_of_matrix(
    arm: Arm, motion: Motion, columns: NDArray[np.intp], unit_columns: bool, friction_columns: bool
) -> Array:
    matrix = observation_matrix(arm, motion)[:, columns]
    if friction_columns:
        matrix = np.hstack([matrix, friction_matrix(motion)])
    if unit_columns:
        lengths = np.linalg.norm(matrix, axis=0)
        matrix = matrix / np.where(lengths > 0, lengths, 1.0)
    return np.asarray(np.linalg.svd(matrix, compute_uv=False))
