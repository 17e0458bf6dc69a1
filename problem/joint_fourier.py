"""Finite Fourier series in joint space (Swevers 1997): periodic, or from rest to rest."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from problem.fourier_basis import fourier_terms
from problem.motion import Motion
from problem.trajectory import Excitation, series
from problem.transforms import Array


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
        basis = _basis(self.duration, self.harmonics, self.rest, times.tobytes())
        coefficients = points.reshape(len(points), len(self.centre), basis.shape[-1])
        motion = Motion(*(series(derivative, coefficients) for derivative in basis))
        return Excitation(motion, np.zeros(len(points)))

    def _box(self, sign: float) -> Array:
        rows = np.repeat(self.coefficient_limit[:, None], 2 * self.free_harmonics, axis=1)
        return np.column_stack([sign * rows, self.centre + sign * self.reach]).ravel()


@lru_cache(maxsize=16)
def _basis(duration: float, harmonics: int, rest: bool, instants: bytes) -> Array:
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
