"""How a trajectory moves with its numbers: exact derivatives of positions, velocities and accelerations.

A joint-space series is linear in its numbers. A Cartesian path is too, and the joints follow it by
dQ = J dq, differentiated twice in time; so no formula of the inverse kinematics is differentiated here.
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from problem.cartesian_fourier import CartesianFourier
from problem.joint_fourier import JointFourier
from problem.motion import Motion
from problem.trajectory import Trajectory
from problem.transforms import Array

Complex = NDArray[np.complex128]


def tangents(trajectory: Trajectory, motion: Motion, point: Array, times: Array) -> Array:
    """Derivatives of a motion with respect to the numbers of its point, (3, dimension, samples, joints).

    motion: (samples, joints), that of the point (dimension,) at `times` (samples,), s. The three are for
    positions, velocities and accelerations. For a Cartesian path they hold within reach and away from
    singular postures. Raises ValueError for another family of trajectories.
    """
    if isinstance(trajectory, JointFourier):
        return _linear(trajectory, times.tobytes())
    if isinstance(trajectory, CartesianFourier):
        return _along_path(trajectory, motion, point, times)
    raise ValueError(f"no derivatives are known for {type(trajectory).__name__}")


@lru_cache(maxsize=8)
def _linear(trajectory: JointFourier, instants: bytes) -> Array:
    times, dimension = np.frombuffer(instants), len(trajectory.lower)
    moved = trajectory.motions(np.eye(dimension), times).motion
    return np.stack([moved.position, moved.velocity, moved.acceleration])


def _along_path(trajectory: CartesianFourier, motion: Motion, point: Array, times: Array) -> Array:
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
    upper, fore = _planar(trajectory, motion, plane)
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


def _planar(trajectory: CartesianFourier, motion: Motion, plane: Sequence[Complex]) -> tuple[list[Array], list[Array]]:
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
    du, df = _split(plane[0], upper[0], fore[0])
    drift = upper[1] * du + fore[1] * df
    du1, df1 = _split(plane[1] - drift, upper[0], fore[0])
    drift = upper[2] * du + 2 * upper[1] * du1 + fore[2] * df + 2 * fore[1] * df1
    du2, df2 = _split(plane[2] - drift, upper[0], fore[0])
    return [du, du1, du2], [df, df1, df2]


def _split(vector: Complex, one: Complex, other: Complex) -> tuple[Array, Array]:
    """Real a and b with vector = a one + b other."""
    area = (one.conj() * other).imag
    return -(other.conj() * vector).imag / area, (one.conj() * vector).imag / area
