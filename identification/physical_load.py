"""The load that can exist and explains the torques best: its pseudo-inertia is positive semidefinite."""

import numpy as np

from identification.estimators.physical import TYPICAL, solver
from identification.pseudo_inertia import pseudo_inertias
from identification.regression import Regression
from recordings.run import Array

ROUNDING = 1e-12  # of a body: a point mass has eigenvalues of zero


def nearest_physical(data: Regression, free: Array, basis: Array) -> Array:
    """The load's numbers (sought,), which are the last columns of weighted data; the others stay free.

    free: the numbers without the condition, returned where they are physical. basis: (10, sought), parameters of
    each number. Raises InputError without CVXPY, RuntimeError where the solver finds no solution.
    """
    units = pseudo_inertias(basis.T.ravel())
    shapes = units / np.outer(TYPICAL, TYPICAL)  # near the unit matrix for a load of a usual size
    eigenvalues = np.linalg.eigvalsh(np.tensordot(free, shapes, 1))
    if eigenvalues[0] >= -ROUNDING * np.abs(eigenvalues).max():
        return free
    cp = solver()
    triangle = np.linalg.qr(np.column_stack([data.matrix, data.torque]))[1]
    own = slice(data.matrix.shape[1] - len(free), data.matrix.shape[1])
    block, target = triangle[own, own], triangle[own, -1]
    lengths = np.linalg.norm(block, axis=0)
    scaled = cp.Variable(len(free))
    body = sum(scaled[index] * shapes[index] / lengths[index] for index in range(len(free)))
    size = max(float(np.linalg.norm(target)), 1e-300)
    error = cp.sum_squares((block / lengths) @ scaled - target / size)
    task = cp.Problem(cp.Minimize(error), [body >> 0])
    task.solve(solver=cp.CLARABEL)
    if task.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
        raise RuntimeError(f"no load that can exist was found: the solver says '{task.status}'")
    return np.asarray(size * scaled.value / lengths)
