"""Fourier series from rest to rest that keep the limits of joint motion by themselves: none is wasted on a penalty."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from problem.arm import Limits
from problem.joint_fourier import JointFourier
from problem.motion import Motion
from problem.trajectory import Excitation, instants
from problem.transforms import Array

MARGIN = 0.995  # of each limit is used: peaks may lie between the instants at which they are looked for
INSIDE = 0.97  # of the range: where q0 may be, so that there is room for a swing
PEAKS = 801  # instants


@dataclass(frozen=True, eq=False)
class WithinLimits:
    """A series whose swing about q0 shrinks, joint by joint, until position, speed and acceleration are allowed.

    A point whose swing is small stays small: slow motions are worth finding, too.
    """

    series: JointFourier
    limits: tuple[Limits, ...]

    @property
    def lower(self) -> Array:
        """Lower bounds, (dimension,)."""
        return self.series.lower

    @property
    def upper(self) -> Array:
        """Upper bounds, (dimension,)."""
        return self.series.upper

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the series' numbers."""
        return self.series.names

    def motions(self, points: Array, times: Array) -> Excitation:
        """Motions (points, samples, joints) of points (points, dimension) at `times` (samples,), s."""
        rest = self._places(points)[:, None]
        scale = self._scale(points, rest)
        found = self.series.motions(points, times).motion
        moved = Motion(rest + scale * (found.position - rest), scale * found.velocity, scale * found.acceleration)
        return Excitation(moved, np.zeros(len(points)))

    def _places(self, points: Array) -> Array:
        """q0 of each joint, (points, joints), inside the limits."""
        low, high = self._range
        every = points.reshape(len(points), len(self.limits), -1)[:, :, -1]
        room = (1 - INSIDE) * (high - low) / 2
        return np.asarray(np.clip(every, low + room, high - room))

    @property
    def _range(self) -> tuple[Array, Array]:
        """Lowest and highest position that are used, (joints,) each."""
        low, high = (np.array(side) for side in zip(*(each.position for each in self.limits), strict=True))
        spared = (1 - MARGIN) * (high - low) / 2
        return low + spared, high - spared

    def _scale(self, points: Array, rest: Array) -> Array:
        """Share of the swing that the limits allow, (points, 1, joints)."""
        motion = self.series.motions(points, self._instants).motion
        swing = motion.position - points.reshape(len(points), len(self.limits), -1)[:, None, :, -1]
        shares = [np.ones(rest.shape)]
        with np.errstate(divide="ignore", invalid="ignore"):
            for each, room in self._rooms(swing, motion, rest):
                shares.append(np.where(each > 0, room / each, np.inf))
        return np.asarray(np.min(shares, axis=0))

    def _rooms(self, swing: Array, motion: Motion, rest: Array) -> list[tuple[Array, Array]]:
        """What is used of each limit at a swing of one, and what there is of it: (points, 1, joints)."""
        low, high = self._range
        speed, acceleration = (
            MARGIN * np.array([getattr(each, name) for each in self.limits]) for name in ("velocity", "acceleration")
        )
        return [
            (swing.max(axis=1, keepdims=True), high - rest),
            (-swing.min(axis=1, keepdims=True), rest - low),
            (np.abs(motion.velocity).max(axis=1, keepdims=True), np.broadcast_to(speed, rest.shape)),
            (np.abs(motion.acceleration).max(axis=1, keepdims=True), np.broadcast_to(acceleration, rest.shape)),
        ]

    @cached_property
    def _instants(self) -> Array:
        return instants(self.series.duration, PEAKS)


def fourier_within(limits: tuple[Limits, ...], duration: float, harmonics: int) -> WithinLimits:
    """The series of an arm with these limits, from rest to rest; ValueError where a speed or a range is not limited."""
    low, high = (np.array(side) for side in zip(*(each.position for each in limits), strict=True))
    speed = np.array([each.velocity for each in limits])
    if not np.all(np.isfinite([low, high, speed])):
        raise ValueError("a motion can only be designed for joints with limits of position and speed")
    coefficients = speed / np.sqrt(harmonics)
    return WithinLimits(
        JointFourier(duration, harmonics, (low + high) / 2, (high - low) / 2, coefficients, True), limits
    )
