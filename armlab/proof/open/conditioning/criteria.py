"""The criteria by which excitations are chosen, for the observation matrix of a window; the smaller, the better."""

import numpy as np

from armlab.common.arrays import Array
from armlab.identification.estimators.least_squares import RANK_TOLERANCE, column_lengths
from problem.fitness import Criterion
from problem.spectrum import Spectrum

SPECTRAL_CRITERIA = ("cond", "d_optimality", "e_optimality")
SCALINGS = ("si", "unit")  # of the columns: SI units; unit length in the window
MATRICES = ("fitted", "links")  # every column that is fitted; the columns of the base parameters alone
PREDICTION_CRITERION = "v_optimality"
CRITERIA = (
    *(f"{matrix}_{name}_{scaling}" for matrix in MATRICES for name in SPECTRAL_CRITERIA for scaling in SCALINGS),
    PREDICTION_CRITERION,
)


def window_criteria(triangle: Array, base: int, judged: Array) -> dict[str, float]:
    """Every criterion of a window, by name as in CRITERIA.

    triangle: (columns, columns), R of the QR decomposition of its observation matrix, which has the same singular
    values. base: how many of the first columns are those of the base parameters. judged: (rows, columns), the matrix
    of the motion whose torque will be predicted, or its R.
    """
    values = {}
    for matrix, part in zip(MATRICES, (triangle, triangle[:, :base]), strict=True):
        for scaling, scaled in zip(SCALINGS, (part, part / column_lengths(part)), strict=True):
            for name, value in _spectral_criteria(scaled).items():
                values[f"{matrix}_{name}_{scaling}"] = value
    values[PREDICTION_CRITERION] = prediction_criterion(triangle, judged)
    return {name: values[name] for name in CRITERIA}


def prediction_criterion(triangle: Array, judged: Array) -> float:
    """V-optimality, trace(Z (W'W)^-1 Z'): the power of the predicted torque's error under white noise of unit power.

    triangle: R of the observation matrix W. judged: Z, the matrix of the motion that is predicted, or its R. Directions
    that least squares leaves out do not count.
    """
    lengths = column_lengths(triangle)
    inverse = np.linalg.pinv(triangle / lengths, rcond=RANK_TOLERANCE)
    return float(np.sum((judged / lengths @ inverse) ** 2))


def _spectral_criteria(matrix: Array) -> dict[str, float]:
    spectrum = Spectrum.of(np.asarray(np.linalg.svd(matrix, compute_uv=False)[None], dtype=np.float64))
    values = (
        spectrum.condition_number,
        Criterion("d_optimality").value(spectrum),
        Criterion("e_optimality").value(spectrum),
    )
    return {name: float(value[0]) for name, value in zip(SPECTRAL_CRITERIA, values, strict=True)}
