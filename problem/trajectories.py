"""Families of excitation trajectories: a point in a box of numbers stands for a motion of the arm.

Finite Fourier series in joint space (Swevers 1997), periodic or from rest to rest, and the paper's trajectory in
Cartesian space, a circle plus a finite Fourier series (eq. 45-48). Both share one Fourier basis.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np

from armlab.common.arrays import Array
from problem.inverse_kinematics import Path, PlanarArm
from problem.kernel import lib, pointer
from problem.motion import Motion


@dataclass(frozen=True, eq=False)
class Excitation:
    """Motions of a population of points.

    motion: (points, samples, joints). overreach: (points,), m: how far a path leaves what the arm can reach;
    where it is positive, the motion is only a stand-in.
    """

    motion: Motion
    overreach: Array


class Trajectory(Protocol):
    """A family of trajectories with `lower` and `upper` (dimension,) bounds of its numbers."""

    @property
    def lower(self) -> Array:
        """Lower bounds of the numbers, (dimension,)."""
        ...

    @property
    def upper(self) -> Array:
        """Upper bounds of the numbers, (dimension,)."""
        ...

    @property
    def names(self) -> tuple[str, ...]:
        """A name for each number."""
        ...

    def motions(self, points: Array, times: Array) -> Excitation:
        """Motions of points (points, dimension) at the given instants (samples,), s."""
        ...


def sample_instants(duration: float, samples: int) -> Array:
    """Evenly spaced instants from 0 to `duration`, both included, s."""
    return np.linspace(0.0, duration, samples)


def series(basis: Array, coefficients: Array) -> Array:
    """Sums of basis functions, the same to the bit in any batch.

    basis: (orders, samples, terms), functions and their derivatives; coefficients: (points, joints, terms).
    Returns (orders, points, samples, joints).
    """
    basis = np.ascontiguousarray(basis)
    coefficients = np.ascontiguousarray(coefficients)
    points, joints, terms = coefficients.shape
    orders, samples, _ = basis.shape
    scratch, out = np.empty(terms * (samples + 2 * _LANES)), np.empty((orders, points, samples, joints))
    arrays = (pointer(array) for array in (basis, coefficients, scratch, out))
    lib.series(orders, points, samples, joints, terms, *arrays)
    return out


_LANES = 4  # as in kernel.c


def fourier_terms(times: Array, duration: float, harmonics: int) -> Array:
    """sin(w k t) / (w k) and -cos(w k t) / (w k) for k = 1 .. harmonics, w = 2 pi / duration.

    (Swevers 1997, eq. 8; the Fourier part of eq. 45-47.) Returns (3, samples, 2 * harmonics): values,
    first and second derivatives; sines first.
    """
    order = 2 * np.pi / duration * np.arange(1, harmonics + 1)
    sine, cosine = np.sin(np.outer(times, order)), np.cos(np.outer(times, order))
    values = np.hstack([sine / order, -cosine / order])
    rates = np.hstack([cosine, sine])
    return np.stack([values, rates, np.hstack([-sine * order, cosine * order])])


def multiply_by_window(terms: Array, window: Array) -> Array:
    """Product of terms (3, samples, n) with a window (3, samples), derivatives by Leibniz' rule."""
    f, df, ddf = terms
    w, dw, ddw = window[0, :, None], window[1, :, None], window[2, :, None]
    return np.stack([f * w, df * w + f * dw, ddf * w + 2 * df * dw + f * ddw])


@dataclass(frozen=True, eq=False)
class JointFourier:
    """q(t) = q0 + sum over k of a_k sin(w k t) / (w k) - b_k cos(w k t) / (w k), for each joint.

    The numbers of a point are, joint by joint: a_1 .. a_N, b_1 .. b_N (rad/s), q0 (rad).
    centre, reach: (joints,), the middle and half width of the box of q0, rad. coefficient_limit: (joints,),
    bound of |a_k| and |b_k|, rad/s. With `rest` a_N and b_N follow from the others, so that speed and
    acceleration vanish at both ends: sum a_k = 0 and sum k b_k = 0.
    """

    duration: float
    harmonics: int
    centre: Array
    reach: Array
    coefficient_limit: Array
    rest: bool = False

    @property
    def free_harmonics(self) -> int:
        """Harmonics whose coefficients are searched."""
        return self.harmonics - self.rest

    @property
    def lower(self) -> Array:
        """Lower bounds, (joints * (2 N + 1),)."""
        return self._box(-1.0)

    @property
    def upper(self) -> Array:
        """Upper bounds, (joints * (2 N + 1),)."""
        return self._box(1.0)

    @property
    def names(self) -> tuple[str, ...]:
        """Names like a1_2 (first harmonic of joint 2) and q0_2."""
        orders = range(1, self.free_harmonics + 1)
        terms = [*(f"a{k}" for k in orders), *(f"b{k}" for k in orders), "q0"]
        return tuple(f"{term}_{joint + 1}" for joint in range(len(self.centre)) for term in terms)

    def motions(self, points: Array, times: Array) -> Excitation:
        """Motions (points, samples, joints) of points (points, dimension) at `times` (samples,), s."""
        basis = self.basis(times)
        coefficients = points.reshape(len(points), len(self.centre), basis.shape[-1])
        position, velocity, acceleration = series(basis, coefficients)
        return Excitation(Motion(position, velocity, acceleration), np.zeros(len(points)))

    def basis(self, times: Array) -> Array:
        """What one joint's numbers are multiplied by: q and its two derivatives at `times`, (3, samples, 2 N + 1)."""
        return _joint_basis(self.duration, self.harmonics, self.rest, times.tobytes())

    def _box(self, sign: float) -> Array:
        rows = np.repeat(self.coefficient_limit[:, None], 2 * self.free_harmonics, axis=1)
        return np.column_stack([sign * rows, self.centre + sign * self.reach]).ravel()


@lru_cache(maxsize=16)
def _joint_basis(duration: float, harmonics: int, rest: bool, instants: bytes) -> Array:
    """Basis functions of one joint and their derivatives, (3, samples, terms)."""
    times = np.frombuffer(instants)
    terms = fourier_terms(times, duration, harmonics)
    if rest:
        orders = np.arange(1, harmonics)
        sines, cosines = terms[..., :harmonics], terms[..., harmonics:]
        sines = sines[..., :-1] - sines[..., -1:]
        cosines = cosines[..., :-1] - cosines[..., -1:] * (orders / harmonics)
        terms = np.concatenate([sines, cosines], axis=-1)
    constant = np.zeros((3, len(times), 1))
    constant[0] = 1.0
    return np.concatenate([terms, constant], axis=-1)


@dataclass(frozen=True, eq=False)
class CartesianFourier:
    """Q = centre + (r cos P + F, r sin P + F, F), with r = a_1 + .. + a_N and F the Fourier part.

    The numbers of a point are a_1 .. a_N (m), b_1 .. b_N and c (m/s): one c for all harmonics as in the
    published optimum, or one each. P runs from 0 to 2 pi along a polynomial that rests at both ends. With
    `rest` the Fourier part is multiplied by a window that vanishes at both ends with its first and second
    derivatives (eq. 48); without, eq. 45-47 are taken literally and the arm starts in motion.
    """

    arm: PlanarArm
    duration: float
    harmonics: int
    centre: tuple[float, float, float]
    radius_limit: float
    coefficient_limit: float
    one_c: bool = True
    rest: bool = True
    elbow_up: bool = True

    @property
    def lower(self) -> Array:
        """Lower bounds, (dimension,)."""
        return -self.upper

    @property
    def upper(self) -> Array:
        """Upper bounds, (dimension,)."""
        free = self.harmonics + (1 if self.one_c else self.harmonics)
        return np.array([self.radius_limit] * self.harmonics + [self.coefficient_limit] * free)

    @property
    def names(self) -> tuple[str, ...]:
        """Names a1 .. b1 .. and c, or c1 .. ."""
        orders = range(1, self.harmonics + 1)
        cosines = ["c"] if self.one_c else [f"c{k}" for k in orders]
        return (*(f"a{k}" for k in orders), *(f"b{k}" for k in orders), *cosines)

    def motions(self, points: Array, times: Array) -> Excitation:
        """Motions (points, samples, 3) of points (points, dimension) at `times` (samples,), s."""
        return Excitation(*self.arm.joint_motion(self.path(points, times), self.elbow_up))

    def path(self, points: Array, times: Array) -> Path:
        """The path of the tool point in the base frame, arrays (points, samples)."""
        circle, terms = _cartesian_basis(self.duration, self.harmonics, self.rest, times.tobytes())
        radius = points[:, : self.harmonics].sum(axis=1)[:, None]
        coefficients = np.empty((len(points), 1, 2 * self.harmonics))
        coefficients[:, 0, : self.harmonics] = points[:, self.harmonics : 2 * self.harmonics]
        coefficients[:, 0, self.harmonics :] = points[:, 2 * self.harmonics :]  # one for all harmonics, or one each
        waves = series(terms, coefficients)
        x, y, z = _add_circle_and_series(radius, circle[0], waves[0])
        return Path(
            position=(x + self.centre[0], y + self.centre[1], z + self.centre[2]),
            velocity=_add_circle_and_series(radius, circle[1], waves[1]),
            acceleration=_add_circle_and_series(radius, circle[2], waves[2]),
        )


def _add_circle_and_series(radius: Array, circle: Array, wave: Array) -> tuple[Array, Array, Array]:
    """Coordinates x, y, z, (points, samples) each, of a circle in the plane and a series on all coordinates.

    radius: (points, 1). circle: (2, samples), cosine and sine. wave: (points, samples, 1).
    """
    height = wave[..., 0]
    return radius * circle[0] + height, radius * circle[1] + height, height


@lru_cache(maxsize=16)
def _cartesian_basis(duration: float, harmonics: int, rest: bool, instants: bytes) -> tuple[Array, Array]:
    """cos P and sin P, (3, 2, samples), and the Fourier terms, (3, samples, terms), with derivatives."""
    times = np.frombuffer(instants)
    terms = fourier_terms(times, duration, harmonics)
    if rest:
        window = np.polynomial.Polynomial([0, 0, 0, 64, -192, 192, -64])  # 64 s^3 (1 - s)^3
        terms = multiply_by_window(terms, _polynomial_in_time(window, times, duration))
    quintic = np.polynomial.Polynomial([0, 0, 0, 10, -15, 6]) * (2 * np.pi)
    return _circle_in_time(*_polynomial_in_time(quintic, times, duration)), terms


def _polynomial_in_time(of_share: np.polynomial.Polynomial, times: Array, duration: float) -> Array:
    """A polynomial of t / duration with its first two time derivatives, (3, samples)."""
    share = times / duration
    return np.stack([of_share.deriv(order)(share) / duration**order for order in range(3)])


def _circle_in_time(phase: Array, rate: Array, bend: Array) -> Array:
    """Cosine and sine of a phase with their time derivatives, (3, 2, samples)."""
    cosine, sine = np.cos(phase), np.sin(phase)
    first = [-sine * rate, cosine * rate]
    second = [-cosine * rate**2 - sine * bend, -sine * rate**2 + cosine * bend]
    return np.array([[cosine, sine], first, second])
