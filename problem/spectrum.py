"""Both ends of the spectrum of an observation matrix.

They come from the Gram matrix where that is accurate, by `spectra.c` for four trajectories at once, else from the
matrix itself.
"""

from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from problem._spectra import lib
from problem.arm import Arm
from problem.friction import friction_entries, friction_matrix
from problem.kernel import pointer
from problem.motion import Motion
from problem.regressor import extended_gram_matrix, gram_matrix, observation_matrix

MAX_GRAM_CONDITION = 1e4
"""Largest condition number taken from the Gram matrix: its square loses 2e-16 * cond^2 of relative accuracy,
here at most 1e-7; beyond it the singular values come from the observation matrix itself."""


class Spectrum(NamedTuple):
    """What is asked of the singular values of some matrices, (points,) each.

    smallest, largest: of each matrix. condition_number: their ratio, infinite at rank loss. mean_logarithm: the mean of
    the logarithms of all, minus infinity at rank loss.
    """

    smallest: Array
    largest: Array
    condition_number: Array
    mean_logarithm: Array

    @classmethod
    def of(cls, singular_values: Array) -> Self:
        """The spectrum of singular values (points, n), descending."""
        largest, smallest = singular_values[:, 0], singular_values[:, -1]
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(smallest > 0, largest / smallest, np.inf)
            return cls(smallest, largest, ratio, np.log(singular_values).mean(axis=1))


def find_spectrum(
    arm: Arm, motion: Motion, columns: NDArray[np.intp], unit_columns: bool, friction_columns: bool = False
) -> Spectrum:
    """The spectrum of chosen columns of the observation matrix of each trajectory.

    motion: (points, samples, joints). unit_columns: scale each column to unit length first. friction_columns: with
    those of `problem.friction` behind the chosen ones, three more a joint.
    Taken from the Gram matrix where that is accurate (see MAX_GRAM_CONDITION), else from the matrix itself; zeros for a
    motion that is not finite.
    """
    if friction_columns:
        gram = extended_gram_matrix(arm, motion, columns, friction_entries(motion))
    else:
        gram = gram_matrix(arm, motion, columns)
    if unit_columns:
        lengths = np.sqrt(np.diagonal(gram, axis1=1, axis2=2))
        lengths = np.where(lengths > 0, lengths, 1.0)
        gram = gram / (lengths[:, :, None] * lengths[:, None, :])
    found, unknown = spectra_of_gram_matrices(gram)
    if unknown:
        for point in np.flatnonzero(np.isnan(found.smallest)):
            values = np.zeros(gram.shape[-1])
            if np.isfinite(gram[point]).all():
                values = _singular_values(arm, motion.select(point), columns, unit_columns, friction_columns)
            for entries, entry in zip(found, Spectrum.of(values[None]), strict=True):
                entries[point] = entry[0]
    return found


def spectra_of_gram_matrices(gram: Array) -> tuple[Spectrum, int]:
    """The spectra of matrices W whose Gram matrices W' W are given, (points, n, n), and how many are not known.

    These are not numbers: where a Gram matrix is not positive definite, or the condition number above
    MAX_GRAM_CONDITION. Raises ValueError for more than MAX_COLUMNS columns, or none.
    """
    points, size, _ = gram.shape
    if not 0 < size <= MAX_COLUMNS:
        raise ValueError(f"a Gram matrix should have 1 to {MAX_COLUMNS} columns, not {size}")
    scratch, out = np.empty(_LANES * (size**2 + 1)), np.empty((4, points))
    unknown = lib.spectra(points, size, pointer(gram), MAX_GRAM_CONDITION, pointer(scratch), pointer(out))
    return Spectrum(out[0], out[1], out[2], out[3]), unknown


MAX_COLUMNS, _LANES = 208, 4  # as in spectra.c


def _singular_values(
    arm: Arm, motion: Motion, columns: NDArray[np.intp], unit_columns: bool, friction_columns: bool
) -> Array:
    """Singular values (n,), descending, of the matrix of one trajectory."""
    matrix = observation_matrix(arm, motion)[:, columns]
    if friction_columns:
        matrix = np.hstack([matrix, friction_matrix(motion)])
    if unit_columns:
        lengths = np.linalg.norm(matrix, axis=0)
        matrix = matrix / np.where(lengths > 0, lengths, 1.0)
    return np.asarray(np.linalg.svd(matrix, compute_uv=False))
