"""A search space in which every point keeps the limits of position, velocity and acceleration, at every instant.

A point holds the numbers of a Fourier series. For each joint, with the coefficients u (a_k and b_k, within +-L) and q0,

    n(u) = max |u_k| / L                                     share of the box
    g(u) = max( swing / range, speed / its limit, acceleration / its limit )     share of the limits
    c    = u min(1, n(u) / g(u))                             coefficients of the motion

n and g are gauges: both grow in proportion with u. So a point gives a direction and the share n of the largest scale
that keeps box and limits along it, and a direction that breaks no limit on the wall of the box stays as it is. The
map is a gauge map (Tabas and Zhang 2022) from the box onto the coefficients that keep all limits, one to one.
The share of q0 in its own range is then applied to the room that the swing leaves. Rest at both ends holds in any case:
the coefficients are those of the null space of its conditions (see `JointFourier`).

Peaks hold between samples, too. For a trigonometric polynomial p of degree N and m > 2 N points, evenly spaced over the
period (Ehlich and Zeller 1964),

    max over t |p(t)|  <=  max over the points |p| / cos(pi N / m)

With m = 64 N the bound is at most 0.12 % above the true peak: so much of a limit may stay unused, and none is broken.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from problem.arm import Limits
from problem.kernel import lib, pointer
from problem.trajectories import Excitation, JointFourier

POINTS_PER_HARMONIC = 64  # of the bound between samples; a multiple of the lanes of the kernel
PEAK_FACTOR = 1 / np.cos(np.pi / POINTS_PER_HARMONIC)
ROUNDING_SHARE = 1e-12  # of each limit that is kept free: far above rounding, far below what can be measured


class _Peaks(NamedTuple):
    """Bounds of the peaks of a series without q0, (points, joints) each: of the swing, and of |velocity| and so on."""

    lowest: Array
    highest: Array
    velocity: Array
    acceleration: Array


@dataclass(frozen=True, eq=False)
class FeasibleFourier:
    """The series of `JointFourier` in coordinates whose whole box keeps `limits`, one entry a joint.

    Box and names are the series' own. Torque is not limited here. Raises InputError for a range with one end.
    """

    series: JointFourier
    limits: tuple[Limits, ...]

    def __post_init__(self) -> None:
        """Refuses ranges in which q0 has no middle."""
        for number, limit in enumerate(self.limits, start=1):
            if np.isfinite(limit.position).sum() == 1:
                low, high = limit.position
                raise InputError(
                    f"search_space: feasible needs a range with two ends or none, joint {number} has [{low}, {high}]"
                )

    @property
    def lower(self) -> Array:
        """Lower bounds, (joints * (2 N + 1),)."""
        return self.series.lower

    @property
    def upper(self) -> Array:
        """Upper bounds, (joints * (2 N + 1),)."""
        return self.series.upper

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the series' numbers."""
        return self.series.names

    def motions(self, points: Array, times: Array) -> Excitation:
        """Motions (points, samples, joints) of points (points, dimension) at `times` (samples,), s."""
        return self.series.motions(self.numbers(points), times)

    def numbers(self, points: Array) -> Array:
        """Numbers of the series (points, dimension) that points (points, dimension) of the box stand for."""
        each = self._by_joint(points)
        peaks = self._peaks(each[..., :-1])
        scale = _scale(self._box_share(each[..., :-1]), self._limit_share(peaks))
        lowest, highest = self._room(scale * peaks.lowest, scale * peaks.highest)
        share = (each[..., -1] - self._first) / (self._last - self._first)
        middle = lowest + share * (highest - lowest)
        return np.concatenate([scale[..., None] * each[..., :-1], middle[..., None]], axis=-1).reshape(points.shape)

    def points(self, numbers: Array) -> Array:
        """The inverse of `numbers`: points of the box (points, dimension) for numbers of the series, likewise.

        Numbers that break a limit give the point of the largest motion along them that breaks none.
        """
        each = self._by_joint(numbers)
        peaks = self._peaks(each[..., :-1])
        box, limit = self._box_share(each[..., :-1]), self._limit_share(peaks)
        kept = 1 / np.maximum(1.0, np.maximum(box, limit))
        coefficients = (kept / _scale(box, limit))[..., None] * each[..., :-1]
        lowest, highest = self._room(kept * peaks.lowest, kept * peaks.highest)
        width = highest - lowest
        share = np.divide(each[..., -1] - lowest, width, out=np.full(width.shape, 0.5), where=width > 0)
        middle = self._first + np.clip(share, 0.0, 1.0) * (self._last - self._first)
        inside = np.concatenate([coefficients, middle[..., None]], axis=-1).reshape(numbers.shape)
        return np.asarray(np.clip(inside, self.lower, self.upper))

    def jacobian(self, point: Array) -> Array:
        """Derivatives (joints, terms, terms) of each joint's numbers (rows) along its coordinates, at a point.

        point: (dimension,). Where two peaks are equal, the map has a kink; the derivatives are those of one side.
        """
        each = self._by_joint(point[None])
        u, peaks = each[0, :, :-1], self._peaks(each[..., :-1])
        box, limit = self._box_share(each[..., :-1])[0], self._limit_share(peaks)[0]
        scale = _scale(box, limit)
        swing, rates = self._slopes(u)
        largest = np.argmax(np.abs(u), axis=1)[:, None]
        box_slope = np.zeros(u.shape)
        signs = np.sign(np.take_along_axis(u, largest, axis=1))
        np.put_along_axis(box_slope, largest, signs / self.series.coefficient_limit[:, None], axis=1)
        shrunk = np.where(limit > box, limit, 1.0)[:, None]
        bend = np.where((limit > box)[:, None], (box_slope - scale[:, None] * rates) / shrunk, 0.0)
        coefficients = scale[:, None, None] * np.eye(u.shape[1]) + u[:, :, None] * bend[:, None, :]
        lowest, highest = self._room(scale * peaks.lowest[0], scale * peaks.highest[0])
        width = self._last - self._first
        share = (each[0, :, -1] - self._first) / width
        moved = (share * self._limited)[:, None] * swing[1] + ((1 - share) * self._limited)[:, None] * swing[0]
        out = np.zeros((*u.shape[:1], u.shape[1] + 1, u.shape[1] + 1))
        out[:, :-1, :-1] = coefficients
        out[:, -1, :-1] = -np.einsum("jk,jkl->jl", moved, coefficients)
        out[:, -1, -1] = (highest - lowest) / width
        return out

    def _by_joint(self, points: Array) -> Array:
        return points.reshape(len(points), len(self.limits), -1)

    def _box_share(self, coefficients: Array) -> Array:
        """n(u), (points, joints)."""
        return np.asarray(np.abs(coefficients).max(axis=-1) / self.series.coefficient_limit)

    def _limit_share(self, peaks: _Peaks) -> Array:
        """g(u), (points, joints)."""
        swing = (peaks.highest - peaks.lowest) / self._widths[0]
        return np.asarray(
            np.maximum(swing, np.maximum(peaks.velocity / self._widths[1], peaks.acceleration / self._widths[2]))
        )

    def _peaks(self, coefficients: Array) -> _Peaks:
        """Bounds of the peaks of coefficients (points, joints, terms) over the whole period."""
        coefficients = np.ascontiguousarray(coefficients)
        points, joints, terms = coefficients.shape
        ends = np.empty((3, points, joints, 2))
        for basis, out in zip(self._basis, ends, strict=True):
            samples = basis.shape[1]
            lib.series_extremes(points, samples, joints, terms, pointer(basis), pointer(coefficients), pointer(out))
        low, high = ends[..., 0], ends[..., 1]
        middle, half = (low[0] + high[0]) / 2, PEAK_FACTOR * (high[0] - low[0]) / 2
        velocity, acceleration = PEAK_FACTOR * np.maximum(high[1:], -low[1:])
        return _Peaks(middle - half, middle + half, velocity, acceleration)

    def _slopes(self, coefficients: Array) -> tuple[tuple[Array, Array], Array]:
        """Derivatives along coefficients (joints, terms): of the ends of the swing, and of g; (joints, terms) each."""
        values = np.einsum("okm,jk->ojm", self._basis, coefficients)
        low, high = (np.moveaxis(self._basis[0][:, find(values[0], axis=1)], 0, 1) for find in (np.argmin, np.argmax))
        middle, half = (low + high) / 2, PEAK_FACTOR * (high - low) / 2
        candidates = [2 * half / self._widths[0][:, None]]
        for order in (1, 2):
            at = np.argmax(np.abs(values[order]), axis=1)
            sign = np.sign(np.take_along_axis(values[order], at[:, None], axis=1))
            candidates.append(PEAK_FACTOR * sign * self._basis[order][:, at].T / self._widths[order][:, None])
        shares = np.einsum("cjk,jk->cj", np.stack(candidates), coefficients)
        active = np.argmax(shares, axis=0)
        return (middle - half, middle + half), np.stack(candidates)[active, np.arange(len(active))]

    def _room(self, lowest: Array, highest: Array) -> tuple[Array, Array]:
        """Lowest and highest q0 (.., joints) for the ends of a swing (.., joints)."""
        low, high = self._ranges
        return np.where(self._limited, low - lowest, self._first), np.where(self._limited, high - highest, self._last)

    @cached_property
    def _basis(self) -> Array:
        """Basis functions without the constant at the points of the bound, (3, terms, points)."""
        count = POINTS_PER_HARMONIC * self.series.harmonics
        terms = self.series.basis(self.series.duration * np.linspace(0.0, 1.0, count, endpoint=False))[..., :-1]
        return np.ascontiguousarray(np.swapaxes(terms, 1, 2))

    @cached_property
    def _ranges(self) -> tuple[Array, Array]:
        """Lowest and highest position that is used, (joints,) each; infinite where there is no limit."""
        low, high = np.array([limit.position for limit in self.limits]).T
        spare = np.where(self._limited, ROUNDING_SHARE * (high - low), 0.0)
        return low + spare, high - spare

    @cached_property
    def _limited(self) -> Array:
        """Whether a joint has a range, (joints,)."""
        return np.isfinite([limit.position[0] for limit in self.limits])

    @cached_property
    def _widths(self) -> Array:
        """Range and limits of velocity and acceleration that are used, (3, joints)."""
        low, high = self._ranges
        rates = np.array([[limit.velocity, limit.acceleration] for limit in self.limits]).T
        return np.vstack([high - low, (1 - ROUNDING_SHARE) * rates])

    @cached_property
    def _first(self) -> Array:
        """Lower bounds of q0, (joints,)."""
        return self.series.centre - self.series.reach

    @cached_property
    def _last(self) -> Array:
        """Upper bounds of q0, (joints,)."""
        return self.series.centre + self.series.reach


def _scale(box: Array, limit: Array) -> Array:
    """min(1, n / g): what a direction that breaks limits on the wall of the box is multiplied by."""
    return np.divide(box, limit, out=np.ones(np.shape(box)), where=limit > box)
