"""The proof that one motion keeps its safety rules at all instants, and what is said of it.

The proof is conservative advancement (Mirtich 1996). Two parts are a distance d0 apart at one pose and d1 at the next,
and between them no point of one moves more than m as seen from the other. Then at every instant between them

    distance >= (d0 + d1 - m) / 2

Where this is less than what has to be kept, the pose halfway is looked at, too. m is the sum over the joints of reach
times speed times step; the speed between two poses exceeds that at the nearer one by at most half a step times the
largest acceleration.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.packages import install_line
from problem.collision import ArmShape
from problem.motion import Motion
from problem.safe_motion import SafetyRules, describe_distance, describe_pose
from problem.trajectories import Trajectory, sample_instants

PROOF_TOLERANCE = 0.001  # m: how much less than the clearance is proven between poses
PROOF_HZ = 50.0  # poses of the proof before any is added
MAX_PROOF_POSES = 300_000
PEAK_INSTANTS = 4001  # instants at which the largest acceleration is looked for
PEAK_FACTOR = 1.02  # on it: it may lie between two instants (Ehlich and Zeller 1964, 200 harmonics)


class UnsafeMotionError(InputError):
    """A motion that does not keep its rules."""


@dataclass(frozen=True)
class SafetyReport:
    """What was checked of a motion and what was not, in plain words, and the numbers.

    least: by kind of what is kept off, the smallest distance at a pose that was checked, m. poses: how many were.
    steps: longest and shortest time between two of them, s. movement: the most that a point moves between two, m.
    """

    checked: tuple[str, ...]
    not_checked: tuple[str, ...]
    least: dict[str, float]
    poses: int
    steps: tuple[float, float]
    movement: float

    def lines(self) -> Iterator[str]:
        """The report as lines."""
        yield from (f"checked: {each}" for each in self.checked)
        yield from (f"not checked: {each}" for each in self.not_checked)

    def content(self) -> dict[str, Any]:
        """The report as plain data."""
        return {
            "checked": list(self.checked),
            "not_checked": list(self.not_checked),
            "least_distance_m": self.least,
            "poses": self.poses,
            "step_s": {"longest": self.steps[0], "shortest": self.steps[1]},
            "largest_movement_between_poses_m": self.movement,
        }


@dataclass(frozen=True, eq=False)
class _Proof:
    """least: of each pair, (pairs,), m."""

    least: Array
    poses: int
    steps: tuple[float, float]
    movement: float


def check_motion(rules: SafetyRules, trajectory: Trajectory, point: Array, duration: float) -> SafetyReport:
    """What is safe about the motion of a point (dimension,); UnsafeMotionError, in one line, where it breaks a rule.

    duration: s. Limits of speed, acceleration and torque are checked elsewhere.
    """

    def motion_at(times: Array) -> Motion:
        return trajectory.motions(point[None], times).motion.select(np.intp(0))

    motion = motion_at(sample_instants(duration, PEAK_INSTANTS))
    _check_range(rules, motion)
    _check_ends(rules, motion)
    shape = rules.shape
    if shape is None or not shape.pairs:
        proof = _Proof(np.empty(0), PEAK_INSTANTS, (duration / (PEAK_INSTANTS - 1),) * 2, 0.0)
    else:
        peak = PEAK_FACTOR * np.abs(motion.acceleration).max(axis=0)
        proof = _prove_clear(shape, rules.settings.clearance, motion_at, duration, peak)
    kinds = [pair.kind for pair in shape.pairs] if shape is not None else []
    least = {
        kind: float(min(each for name, each in zip(kinds, proof.least, strict=True) if name == kind))
        for kind in dict.fromkeys(kinds)
    }
    checked, not_checked = tuple(_checked(rules, proof, least)), tuple(_not_checked(rules))
    return SafetyReport(checked, not_checked, least, proof.poses, proof.steps, proof.movement)


def _check_range(rules: SafetyRules, motion: Motion) -> None:
    if rules.range_words is None:
        return  # limits are checked elsewhere, by what has set them
    for joint, limit, places in zip(rules.arm.joints, rules.limits, motion.position.T, strict=True):
        low, high = limit.position
        if places.min() < low or places.max() > high:
            raise UnsafeMotionError(
                f"{joint.name} moves from {places.min():.4g} to {places.max():.4g}, outside {rules.range_words}, "
                f"{low:.4g} to {high:.4g}"
            )


def _check_ends(rules: SafetyRules, motion: Motion) -> None:
    if rules.start is None:
        return
    far = np.abs(motion.position[[0, -1]] - rules.start).max(axis=0) - rules.start_reach
    if far.max() > 0:
        worst = int(np.argmax(far))
        raise UnsafeMotionError(
            f"{rules.arm.joints[worst].name} starts or ends at {motion.position[0, worst]:.4g}, "
            f"not within {rules.start_reach[worst]:g} of {rules.start[worst]:.4g}"
        )


def _prove_clear(
    shape: ArmShape, kept: float, motion_at: Callable[[Array], Motion], duration: float, peak: Array
) -> _Proof:
    """Shows that all pairs keep their distance at every instant; UnsafeMotionError where they do not.

    peak: (joints,), largest acceleration of each joint.
    """
    times = sample_instants(duration, round(duration * PROOF_HZ) + 1)
    distances, speeds = _look(shape, kept, motion_at, times)
    ends = (times[:-1], times[1:])
    near, fast = (distances[:-1], distances[1:]), (speeds[:-1], speeds[1:])
    least, poses, longest, shortest, movement = distances.min(axis=0), len(times), 0.0, np.inf, 0.0
    while len(ends[0]):
        step = ends[1] - ends[0]
        speed = np.maximum(*fast) + peak * step[:, None] / 2
        moved = (speed * step[:, None]) @ shape.reach.T
        open_ = np.asarray(((near[0] + near[1] - moved) / 2 < kept - PROOF_TOLERANCE).any(axis=1))
        if not open_.all():
            done = ~open_
            longest, shortest = max(longest, float(step[done].max())), min(shortest, float(step[done].min()))
            movement = max(movement, float(moved[done].max()))
        if not open_.any():
            break
        middle = (ends[0] + ends[1])[open_] / 2
        poses += len(middle)
        if poses > MAX_PROOF_POSES:
            raise UnsafeMotionError(f"{MAX_PROOF_POSES} poses do not show that the motion keeps {kept:g} m")
        distances, speeds = _look(shape, kept, motion_at, middle)
        least = np.minimum(least, distances.min(axis=0))
        ends = _halves(ends, middle, open_)
        near, fast = _halves(near, distances, open_), _halves(fast, speeds, open_)
    return _Proof(least, poses, (longest, shortest), movement)


def _halves(both: tuple[Array, Array], middle: Array, chosen: NDArray[np.bool_]) -> tuple[Array, Array]:
    """The values at both ends of the two halves of the chosen intervals."""
    return np.concatenate([both[0][chosen], middle]), np.concatenate([middle, both[1][chosen]])


def _look(shape: ArmShape, kept: float, motion_at: Callable[[Array], Motion], times: Array) -> tuple[Array, Array]:
    """Distances (samples, pairs) and speeds (samples, joints); UnsafeMotionError where a distance is too small."""
    motion = motion_at(times)
    distances = shape.distances(motion.position)
    if distances.min() < kept:
        sample, pair = np.unravel_index(int(np.argmin(distances)), distances.shape)
        place = describe_distance(shape.pairs[pair].names, float(distances[sample, pair]))
        raise UnsafeMotionError(f"at {times[sample]:.3f} s the motion has {place}; {kept:g} m are to be kept")
    return distances, np.abs(motion.velocity)


def _checked(rules: SafetyRules, proof: _Proof, least: dict[str, float]) -> Iterator[str]:
    settings = rules.settings
    yield f"positions within {rules.range_words or 'the joint limits'}: {_ranges_text(rules)}"
    if rules.start is not None:
        yield f"starts and ends at rest near the pose {describe_pose(rules.start)}"
    for kind, distance in least.items():
        place = {"the floor": f" at {settings.floor} m", "the boxes": f" ({len(settings.keep_out)})"}.get(kind, "")
        yield f"{kind}{place}: {settings.clearance:g} m are to be kept, {distance:.3f} m or more are at all poses"
    if least and rules.shape is not None:
        longest, shortest = proof.steps
        yield f"the arm is {rules.shape.words}"
        yield (
            f"at every instant: {proof.poses} poses, {1000 * shortest:.3g} to {1000 * longest:.3g} ms apart, between "
            f"which no point moves more than {1000 * proof.movement:.0f} mm, less where parts are close; so "
            f"{1000 * max(settings.clearance - PROOF_TOLERANCE, 0):.0f} mm are kept between them, too"
        )


def _not_checked(rules: SafetyRules) -> Iterator[str]:
    settings = rules.settings
    if settings.floor is None:
        yield "a floor: none is given (--floor)"
    if not settings.keep_out:
        yield "things around the arm: no box is given (--keep-out)"
    if rules.shape is None:
        yield f"the arm itself: MuJoCo is missing ({install_line('motion')})"
    elif len(rules.arm) > 1:
        yield "neighbouring links against each other: their joint range keeps them apart"
    yield from rules.left_out
    yield "what is not in the robot file: payload, tool, cables; the way to the start; errors of the controller"


def _ranges_text(rules: SafetyRules) -> str:
    return ", ".join(
        f"{joint.name} {limit.position[0]:.2f} to {limit.position[1]:.2f} {'rad' if joint.kind == 'revolute' else 'm'}"
        for joint, limit in zip(rules.arm.joints, rules.limits, strict=True)
    )
