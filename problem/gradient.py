"""Exact derivatives of what is said of a trajectory's singular values, from a few shifted calls of the kernel.

The observation matrix is linear in the accelerations, quadratic in the velocities, and in the position of
each joint a trigonometric polynomial of degree two (prismatic: a polynomial of degree two), since a link's
inertia turns with both its indices. So a fixed sum of shifted matrices is its derivative, without any error
of truncation: d sigma_i = u_i' dW v_i gives the rest. There is no second implementation of the dynamics.
"""

from collections.abc import Callable

import numpy as np

from problem.arm import Arm
from problem.excitation_problem import ExcitationProblem
from problem.motion import Motion
from problem.regressor import observation_matrix
from problem.tangents import tangents
from problem.transforms import Array

SpectralFunction = Callable[[Array], tuple[float, Array]]
"""Singular values (n,), descending, to a number and its derivatives (n,)."""

# f(x) and f'(x) of a trigonometric polynomial of degree 2: c1 (f(x + pi/4) - f(x - pi/4)) + c3 (f(x + 3 pi/4) - ..),
# with 2 sin(pi/4) (c1 + c3) = 1 from the first harmonic and 2 (c1 - c3) = 2 from the second.
_TURNING = (
    (np.pi / 4, (2 + np.sqrt(2)) / 4),
    (-np.pi / 4, -(2 + np.sqrt(2)) / 4),
    (3 * np.pi / 4, -(2 - np.sqrt(2)) / 4),
    (-3 * np.pi / 4, (2 - np.sqrt(2)) / 4),
)
_QUADRATIC = ((1.0, 0.5), (-1.0, -0.5))  # exact for a polynomial of degree 2, whatever the step


def condition_gradient(problem: ExcitationProblem, point: Array) -> tuple[float, Array]:
    """Condition number of a point (dimension,) and its gradient (dimension,), without weights and penalty.

    Where the largest or the smallest singular value is a multiple one, this is one of several
    subgradients. Raises ValueError for a family of trajectories without known derivatives.
    """
    return spectral_gradient(problem, point, condition)


def condition(values: Array) -> tuple[float, Array]:
    """Condition number of singular values (n,), descending, and its derivatives (n,)."""
    slope = np.zeros(len(values))
    slope[0] += 1 / values[-1]
    slope[-1] -= values[0] / values[-1] ** 2
    return float(values[0] / values[-1]), slope


def spectral_gradient(problem: ExcitationProblem, point: Array, function: SpectralFunction) -> tuple[float, Array]:
    """A function of the singular values of a point's observation matrix, and its gradient (dimension,)."""
    motion = problem.trajectory.motions(point[None], problem.times).motion.select(np.intp(0))
    value, weights = _matrix_weights(problem, motion, function)
    slopes = motion_gradient(problem.arm, motion, weights)
    basis = tangents(problem.trajectory, motion, point, problem.times)
    return value, np.tensordot(basis, slopes, axes=([0, 2, 3], [0, 1, 2]))


def motion_gradient(arm: Arm, motion: Motion, weights: Array) -> Array:
    """Derivatives of sum(weights * W) with respect to the motion, (3, samples, joints): q, qd, qdd.

    motion: (samples, joints); weights: as the observation matrix, (samples * joints, 10 * joints).
    """
    slopes = np.empty((3, motion.samples, motion.joints))
    for index, joint in enumerate(arm.joints):
        stencils = (_TURNING if joint.kind == "revolute" else _QUADRATIC, _QUADRATIC, _QUADRATIC)
        states = np.stack([motion.position, motion.velocity, motion.acceleration])
        shifted = np.repeat(states[None], sum(map(len, stencils)), axis=0)
        combine = np.zeros((3, len(shifted)))
        places = ((kind, step) for kind, stencil in enumerate(stencils) for step in stencil)
        for row, (kind, (offset, factor)) in enumerate(places):
            shifted[row, kind, :, index] += offset
            combine[kind, row] = factor
        matrices = observation_matrix(arm, Motion(*np.moveaxis(shifted, 1, 0)))
        powers = np.einsum("brc,rc->br", matrices, weights).reshape(len(shifted), motion.samples, -1).sum(axis=2)
        slopes[:, :, index] = combine @ powers
    return slopes


def _matrix_weights(problem: ExcitationProblem, motion: Motion, function: SpectralFunction) -> tuple[float, Array]:
    """The function's value and its derivative with respect to each entry of the whole observation matrix."""
    columns = problem.base.columns
    whole = observation_matrix(problem.arm, motion)
    matrix = whole[:, columns]
    lengths = np.linalg.norm(matrix, axis=0) if problem.unit_columns else np.ones(len(columns))
    unit = matrix / lengths
    left, values, right = np.linalg.svd(unit, full_matrices=False)
    value, slope = function(values)
    inner = (left * slope) @ right
    if problem.unit_columns:
        inner = inner - unit * (unit * inner).sum(axis=0)  # a column's length does not matter
    weights = np.zeros_like(whole)
    weights[:, columns] = inner / lengths
    return value, weights
