"""Exact derivatives of the singular values of a trajectory's observation matrix.

Two steps: how the motion changes with the numbers of the trajectory, and how the singular values change with the
motion.

A joint-space series is linear in its numbers; the map of the feasible search space in front of it has derivatives of
its own (`problem/feasible.py`). A Cartesian path is linear in its numbers, too, and the joints follow it by
dQ = J dq, differentiated twice in time; so no formula of the inverse kinematics is differentiated here.

Of the friction columns, velocity has the derivative one. The sign of the velocity has the derivative zero almost
everywhere: where a sample's velocity changes its sign, the value jumps, and no derivative tells of that.

The observation matrix is linear in the accelerations, quadratic in the velocities, and in the position of
each joint a trigonometric polynomial of degree two (prismatic: a polynomial of degree two), since a link's
inertia turns with both its indices. So a fixed sum of shifted matrices is its derivative, without any error
of truncation: d sigma_i = u_i' dW v_i gives the rest. There is no second implementation of the dynamics.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from problem.arm import Arm
from problem.base_parameters import BaseParameters
from problem.feasible import FeasibleFourier
from problem.fitness import Criterion
from problem.friction import FRICTION_NAMES, VISCOUS, friction_matrix
from problem.limits import Constraints
from problem.motion import Motion
from problem.regressor import observation_matrix
from problem.trajectories import CartesianFourier, JointFourier, Trajectory


class DifferentiableExcitation(Protocol):
    """What a gradient asks of an excitation problem: `problem.excitation.ExcitationProblem` is one."""

    @property
    def arm(self) -> Arm:
        """The arm that moves."""

    @property
    def base(self) -> BaseParameters:
        """The columns of its observation matrix."""

    @property
    def trajectory(self) -> Trajectory:
        """The family of motions."""

    @property
    def times(self) -> Array:
        """Instants of the samples, s."""

    @property
    def constraints(self) -> Constraints:
        """The limits that it keeps."""

    @property
    def criterion(self) -> Criterion:
        """What is made small."""

    @property
    def unit_columns(self) -> bool:
        """Whether columns are scaled to unit length."""

    @property
    def friction_columns(self) -> bool:
        """Whether there are columns of friction and offset of each joint."""


Complex = NDArray[np.complex128]


def tangents(trajectory: Trajectory, motion: Motion, point: Array, times: Array) -> Array:
    """Derivatives of a motion with respect to the numbers of its point, (3, dimension, samples, joints).

    motion: (samples, joints), that of the point (dimension,) at `times` (samples,), s. The three are for
    positions, velocities and accelerations. In the feasible search space they are those of one side of a kink. For a
    Cartesian path they hold within reach and away from
    singular postures. Raises ValueError for another family of trajectories.
    """
    if isinstance(trajectory, FeasibleFourier):
        return _mapped_tangents(trajectory, point, times)
    if isinstance(trajectory, JointFourier):
        return _linear_tangents(trajectory, times.tobytes())
    if isinstance(trajectory, CartesianFourier):
        return _path_tangents(trajectory, motion, point, times)
    raise ValueError(f"no derivatives are known for {type(trajectory).__name__}")


@lru_cache(maxsize=8)
def _linear_tangents(trajectory: JointFourier, instants: bytes) -> Array:
    times, dimension = np.frombuffer(instants), len(trajectory.lower)
    moved = trajectory.motions(np.eye(dimension), times).motion
    return np.stack([moved.position, moved.velocity, moved.acceleration])


def _mapped_tangents(trajectory: FeasibleFourier, point: Array, times: Array) -> Array:
    straight, slopes = _linear_tangents(trajectory.series, times.tobytes()), trajectory.jacobian(point)
    joints, terms, _ = slopes.shape
    each = straight.reshape(3, joints, terms, len(times), joints)
    return np.asarray(np.einsum("ojktl,jkn->ojntl", each, slopes)).reshape(straight.shape)


def _path_tangents(trajectory: CartesianFourier, motion: Motion, point: Array, times: Array) -> Array:
    at = _complex_path(trajectory, point[None], times)
    still = _complex_path(trajectory, np.zeros((1, len(point))), times)
    change = [
        end - start for end, start in zip(_complex_path(trajectory, np.eye(len(point)), times), still, strict=True)
    ]
    level, height = [part[0] for part in change], [part[1].real for part in change]
    turn = _quotient(level, [part[0] for part in at])  # d log(x + i y) = dr / r + i d azimuth
    radius = [abs(at[0][0]), *_radial_rates([part[0] for part in at])]
    radial = _product(radius, [part.real for part in turn])
    plane = [r + 1j * z for r, z in zip(radial, height, strict=True)]
    upper, fore = _planar_tangents(trajectory, motion, plane)
    first = [part.imag for part in turn]
    second = [-part for part in upper]
    third = [u - f for u, f in zip(upper, fore, strict=True)]
    return np.stack([np.stack(parts, axis=-1) for parts in zip(first, second, third, strict=True)])


def _complex_path(trajectory: CartesianFourier, points: Array, times: Array) -> list[Complex]:
    """The path and two time derivatives as x + i y and z, each (2, points, samples)."""
    path = trajectory.path(points, times)
    return [np.stack([x + 1j * y, z + 0j]) for x, y, z in (path.position, path.velocity, path.acceleration)]


def _radial_rates(level: Sequence[Complex]) -> tuple[Array, Array]:
    """Time derivatives of |x + i y|."""
    place, rate, bend = level
    radius = abs(place)
    first = (rate * place.conj()).real / radius
    second = ((bend * place.conj()).real + abs(rate) ** 2 - first**2) / radius
    return first, second


def _quotient(change: Sequence[Complex], of: Sequence[Complex]) -> list[Complex]:
    """change / of with two time derivatives, by Leibniz' rule."""
    value = change[0] / of[0]
    rate = (change[1] - value * of[1]) / of[0]
    return [value, rate, (change[2] - 2 * rate * of[1] - value * of[2]) / of[0]]


def _product(one: Sequence[Array], other: Sequence[Array]) -> list[Array]:
    """Product with two time derivatives."""
    return [
        one[0] * other[0],
        one[1] * other[0] + one[0] * other[1],
        one[2] * other[0] + 2 * one[1] * other[1] + one[0] * other[2],
    ]


def _planar_tangents(
    trajectory: CartesianFourier, motion: Motion, plane: Sequence[Complex]
) -> tuple[list[Array], list[Array]]:
    """Changes of the angles of upper arm and forearm, with two time derivatives, from those of the tip.

    The tip is U exp(i u) + F exp(i f), so its change is i U exp(i u) du + i F exp(i f) df.
    """
    arm = trajectory.arm
    bars = []
    for length, zero, joints in ((arm.upper_length, arm.upper_angle, [1]), (arm.fore_length, arm.fore_angle, [1, 2])):
        angle = zero - motion.position[:, joints].sum(axis=1)
        rate, bend = -motion.velocity[:, joints].sum(axis=1), -motion.acceleration[:, joints].sum(axis=1)
        lever = 1j * length * np.exp(1j * angle)
        bars.append([lever, 1j * rate * lever, (1j * bend - rate**2) * lever])
    upper, fore = bars
    du, df = _decompose(plane[0], upper[0], fore[0])
    drift = upper[1] * du + fore[1] * df
    du1, df1 = _decompose(plane[1] - drift, upper[0], fore[0])
    drift = upper[2] * du + 2 * upper[1] * du1 + fore[2] * df + 2 * fore[1] * df1
    du2, df2 = _decompose(plane[2] - drift, upper[0], fore[0])
    return [du, du1, du2], [df, df1, df2]


def _decompose(vector: Complex, one: Complex, other: Complex) -> tuple[Array, Array]:
    """Real a and b with vector = a one + b other."""
    area = (one.conj() * other).imag
    return -(other.conj() * vector).imag / area, (one.conj() * vector).imag / area


SpectralFunction = Callable[[Array], tuple[float, Array]]
"""Singular values (n,), descending, to a number and its derivatives (n,)."""

# f(x) and f'(x) of a trigonometric polynomial of degree 2: c1 (f(x + pi/4) - f(x - pi/4)) + c3 (f(x + 3 pi/4) - ..),
# with 2 sin(pi/4) (c1 + c3) = 1 from the first harmonic and 2 (c1 - c3) = 2 from the second.
_TRIGONOMETRIC_STENCIL = (
    (np.pi / 4, (2 + np.sqrt(2)) / 4),
    (-np.pi / 4, -(2 + np.sqrt(2)) / 4),
    (3 * np.pi / 4, -(2 - np.sqrt(2)) / 4),
    (-3 * np.pi / 4, (2 - np.sqrt(2)) / 4),
)
_QUADRATIC_STENCIL = ((1.0, 0.5), (-1.0, -0.5))  # exact for a polynomial of degree 2, whatever the step


def condition_gradient(problem: DifferentiableExcitation, point: Array) -> tuple[float, Array]:
    """Condition number of a point (dimension,) and its gradient (dimension,), without weights and penalty.

    Where the largest or the smallest singular value is a multiple one, this is one of several
    subgradients. Raises ValueError for a family of trajectories without known derivatives.
    """
    return spectral_gradient(problem, point, condition_with_derivatives)


def condition_with_derivatives(values: Array) -> tuple[float, Array]:
    """Condition number of singular values (n,), descending, and its derivatives (n,)."""
    slope = np.zeros(len(values))
    slope[0] += 1 / values[-1]
    slope[-1] -= values[0] / values[-1] ** 2
    return float(values[0] / values[-1]), slope


def motion_of(problem: DifferentiableExcitation, point: Array) -> Motion:
    """The motion (samples, joints) of a point (dimension,)."""
    return problem.trajectory.motions(point[None], problem.times).motion.select(np.intp(0))


def spectral_gradient(
    problem: DifferentiableExcitation, point: Array, function: SpectralFunction
) -> tuple[float, Array]:
    """A function of the singular values of a point's observation matrix, and its gradient (dimension,)."""
    motion = motion_of(problem, point)
    basis = tangents(problem.trajectory, motion, point, problem.times)
    return spectral_gradient_along(problem, motion, basis, function)


def spectral_gradient_along(
    problem: DifferentiableExcitation, motion: Motion, basis: Array, function: SpectralFunction
) -> tuple[float, Array]:
    """The same for a motion (samples, joints) with its tangents (3, dimension, samples, joints)."""
    value, weights = _matrix_weights(problem, motion, function)
    inertial = 10 * motion.joints
    slopes = motion_gradient(problem.arm, motion, weights[:, :inertial])
    if problem.friction_columns:
        slopes[1] += _viscous_weights(weights[:, inertial:], motion)
    return value, np.tensordot(basis, slopes, axes=([0, 2, 3], [0, 1, 2]))


def motion_gradient(arm: Arm, motion: Motion, weights: Array) -> Array:
    """Derivatives of sum(weights * W) with respect to the motion, (3, samples, joints): q, qd, qdd.

    motion: (samples, joints); weights: as the observation matrix, (samples * joints, 10 * joints).
    """
    slopes = np.empty((3, motion.samples, motion.joints))
    for index, joint in enumerate(arm.joints):
        stencils = (
            _TRIGONOMETRIC_STENCIL if joint.kind == "revolute" else _QUADRATIC_STENCIL,
            _QUADRATIC_STENCIL,
            _QUADRATIC_STENCIL,
        )
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


def _viscous_weights(weights: Array, motion: Motion) -> Array:
    """Derivatives with respect to the velocities (samples, joints) through the friction columns.

    weights: derivatives with respect to the entries of these columns, (samples * joints, 3 * joints).
    """
    joints = np.arange(motion.joints)
    by_joint = weights.reshape(motion.samples, motion.joints, motion.joints, len(FRICTION_NAMES))
    return np.asarray(by_joint[:, joints, joints, VISCOUS])


def _matrix_weights(
    problem: DifferentiableExcitation, motion: Motion, function: SpectralFunction
) -> tuple[float, Array]:
    """The function's value and its derivative with respect to each entry of the whole matrix.

    That is the observation matrix, and behind it the friction columns where the problem has them. Infinite, with
    derivatives that are not numbers, for a motion that is not finite.
    """
    columns = problem.base.columns
    whole = observation_matrix(problem.arm, motion)
    if problem.friction_columns:
        friction = len(FRICTION_NAMES) * motion.joints
        columns = np.append(columns, np.arange(whole.shape[1], whole.shape[1] + friction))
        whole = np.hstack([whole, friction_matrix(motion)])
    matrix = whole[:, columns]
    lengths = np.linalg.norm(matrix, axis=0) if problem.unit_columns else np.ones(len(columns))
    unit = matrix / lengths
    if not np.isfinite(unit).all():
        return np.inf, np.full_like(whole, np.nan)
    left, values, right = np.linalg.svd(unit, full_matrices=False)
    value, slope = function(values)
    inner = (left * slope) @ right
    if problem.unit_columns:
        inner = inner - unit * (unit * inner).sum(axis=0)  # a column's length does not matter
    weights = np.zeros_like(whole)
    weights[:, columns] = inner / lengths
    return value, weights
