"""The paper's excitation trajectory in Cartesian space, eq. 45-48: a circle plus a finite Fourier series."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from problem.fourier_basis import fourier_terms, times_window
from problem.inverse_kinematics import Path, PlanarArm
from problem.trajectory import Excitation, series
from problem.transforms import Array


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
        circle, terms = _basis(self.duration, self.harmonics, self.rest, times.tobytes())
        radius = points[:, : self.harmonics].sum(axis=1)[:, None]
        sines, cosines = np.split(points[:, self.harmonics :], [self.harmonics], axis=1)
        cosines = np.broadcast_to(cosines, sines.shape)
        coefficients = np.concatenate([sines, cosines], axis=1)[:, None, :]
        fourier = [series(derivative, coefficients)[..., 0] for derivative in terms]
        centres = (self.centre, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        return Path(
            *(
                (radius * cosine + wave + centre[0], radius * sine + wave + centre[1], wave + centre[2])
                for (cosine, sine), wave, centre in zip(circle, fourier, centres, strict=True)
            )
        )


@lru_cache(maxsize=16)
def _basis(duration: float, harmonics: int, rest: bool, instants: bytes) -> tuple[Array, Array]:
    """cos P and sin P, (3, 2, samples), and the Fourier terms, (3, samples, terms), with derivatives."""
    times = np.frombuffer(instants)
    terms = fourier_terms(times, duration, harmonics)
    if rest:
        window = np.polynomial.Polynomial([0, 0, 0, 64, -192, 192, -64])  # 64 s^3 (1 - s)^3
        terms = times_window(terms, _polynomial(window, times, duration))
    quintic = np.polynomial.Polynomial([0, 0, 0, 10, -15, 6]) * (2 * np.pi)
    return _circle(*_polynomial(quintic, times, duration)), terms


def _polynomial(of_share: np.polynomial.Polynomial, times: Array, duration: float) -> Array:
    """A polynomial of t / duration with its first two time derivatives, (3, samples)."""
    share = times / duration
    return np.stack([of_share.deriv(order)(share) / duration**order for order in range(3)])


def _circle(phase: Array, rate: Array, bend: Array) -> Array:
    """Cosine and sine of a phase with their time derivatives, (3, 2, samples)."""
    cosine, sine = np.cos(phase), np.sin(phase)
    first = [-sine * rate, cosine * rate]
    second = [-cosine * rate**2 - sine * bend, -sine * rate**2 + cosine * bend]
    return np.array([[cosine, sine], first, second])
