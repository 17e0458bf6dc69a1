"""Limits of the arm and of its workspace, and how far a motion exceeds them."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from problem.arm import Arm, Limits, body_points
from problem.drive_torque import drive_torque
from problem.kernel import lib, pointer
from problem.motion import Motion
from problem.trajectories import Excitation


@dataclass(frozen=True)
class Workspace:
    """Where the joints' frames and the tool may be, in the base frame, m.

    reach: largest distance from the origin; floor: lowest height; keep_out: opposite corners of a box.
    """

    reach: float = np.inf
    floor: float = -np.inf
    keep_out: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None
    tool: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def limited(self) -> bool:
        """Whether any limit is finite."""
        return math.isfinite(self.reach) or math.isfinite(self.floor) or self.keep_out is not None

    def excess(self, points: Array) -> Array:
        """How far points (batch, samples, points, 3) leave the workspace at worst, (batch,), m."""
        worst = np.linalg.norm(points, axis=-1).max(axis=(1, 2)) - self.reach
        worst = np.maximum(worst, self.floor - points[..., 2].min(axis=(1, 2)))
        if self.keep_out is not None:
            low, high = np.sort(np.array(self.keep_out), axis=0)
            depth = np.minimum(points - low, high - points).min(axis=-1)
            worst = np.maximum(worst, depth.max(axis=(1, 2)))
        return np.asarray(np.maximum(worst, 0.0))


@dataclass(frozen=True, eq=False)
class Constraints:
    """All limits of one arm; one entry a joint, infinite where there is none.

    lower, upper: position; velocity; acceleration; torque. The violation of each is measured relative to
    the limit (for positions to half their range, for lengths to one metre).
    """

    arm: Arm
    limits: tuple[Limits, ...]
    workspace: Workspace = Workspace()

    def violation(self, excitation: Excitation) -> Array:
        """Sum over all limits of log(1 + relative excess), (points,): 0 where every limit is kept.

        The logarithm keeps a motion near a singularity comparable with the others. For a path out of reach,
        whose joint motion means nothing, only the overreach counts, and it counts more than any limit.
        Infinite for a motion that is not finite.
        """
        violation: Array = np.log1p(self._excesses(excitation.motion)).sum(axis=-1)
        violation[np.isnan(violation)] = np.inf
        beyond = excitation.overreach > 0
        violation[beyond] = 1e3 * (1.0 + excitation.overreach[beyond])
        return violation

    def margins(self, positions: Array) -> Array:
        """What else is kept at positions (samples, joints), negative where it is broken, (rows,): nothing here."""
        return np.empty(0)

    def margin_slopes(self, positions: Array, chosen: NDArray[np.intp]) -> tuple[NDArray[np.intp], Array]:
        """Samples (chosen,) of chosen rows of `margins`, and their derivatives (chosen, joints) along the positions."""
        return np.zeros(0, dtype=np.intp), np.empty((0, positions.shape[1]))

    def _excesses(self, motion: Motion) -> Array:
        """Relative excess of each limit, (points, limits)."""
        found, numbers = peaks(motion), self._numbers
        points, _, joints = found.shape
        excesses = np.empty((points, 4 * joints))
        by_kind = excesses.reshape(points, 4, joints)
        np.subtract(numbers.low, found[:, 0], out=by_kind[:, 0])
        np.subtract(found[:, 1], numbers.high, out=by_kind[:, 1])
        by_kind[:, :2] /= numbers.half_range
        np.divide(found[:, 2:], numbers.rates, out=by_kind[:, 2:])
        by_kind[:, 2:] -= 1.0
        if numbers.torque is not None:
            shares = np.abs(drive_torque(self.arm, motion)).max(axis=1) / numbers.torque
            excesses = np.concatenate([excesses, shares - 1.0], axis=1)
        if self.workspace.limited:
            places = body_points(self.arm, motion.position, np.array(self.workspace.tool))
            excesses = np.concatenate([excesses, self.workspace.excess(places)[:, None]], axis=1)
        return np.maximum(excesses, 0.0)

    @cached_property
    def _numbers(self) -> "_LimitNumbers":
        low, high = np.array([limit.position for limit in self.limits]).T
        torque = np.array([limit.torque for limit in self.limits])
        return _LimitNumbers(
            low=low,
            high=high,
            half_range=np.where(np.isfinite(high - low), (high - low) / 2, 1.0),
            rates=np.array([[limit.velocity, limit.acceleration] for limit in self.limits]).T,
            torque=torque if np.any(np.isfinite(torque)) else None,
        )


@dataclass(frozen=True, eq=False)
class _LimitNumbers:
    """Limits as arrays: low, high, half_range, torque (joints,), rates (2, joints); no torque where none is limited."""

    low: Array
    high: Array
    half_range: Array
    rates: Array
    torque: Array | None


def peaks(motion: Motion) -> Array:
    """Lowest and highest position, largest speed and acceleration, (points, 4, joints).

    motion: (points, samples, joints).
    """
    points, samples, joints = motion.position.shape
    out = np.empty((points, 4, joints))
    position, velocity, acceleration = pointer(motion.position), pointer(motion.velocity), pointer(motion.acceleration)
    lib.peaks(points, samples, joints, position, velocity, acceleration, pointer(out))
    return out
