"""What a motion keeps beside the limits of its robot: a range, a place to start from, and distances to a floor, to
keep-out boxes and to the arm itself; as rules, and as a constraint of a search. `problem.safety_proof` checks a motion.
"""

from dataclasses import dataclass
from functools import cached_property
from importlib.util import find_spec
from typing import Annotated, Literal, Self

import numpy as np
from annotated_types import Ge, Gt
from numpy.typing import NDArray
from pydantic import model_validator

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.settings import Settings
from problem.arm import Arm, Joint, Limits
from problem.collision import ArmShape, Box, Surroundings, arm_shape
from problem.limits import Constraints
from problem.trajectories import Excitation

RANGE_MARGIN = 0.1  # of a joint's recorded swing: how far beyond each end a motion may go
START_REACH = {"revolute": 0.1, "prismatic": 0.02}  # rad, m: near a pose; also the least margin of a recorded range
SEARCH_POSES = 150  # of a motion in a search
SEARCH_MARGIN = 0.01  # m more than the clearance that a search asks for, since it sees fewer poses
ROUNDING = 1e-6  # m
STRETCH_POSES = 10  # poses of which a search with derivatives sees the closest alone
TOUCH_POSES = 200  # random poses: parts that are too close in all of them touch by their shape

Range = tuple[float, float]


class ClearanceSettings(Settings):
    """What an arm keeps off beside itself, base frame, m.

    floor: its height. keep_out: boxes, each with its lower and its upper corner. clearance: distance to keep. radius:
    of the capsules that stand for a robot without collision geometry.
    """

    floor: float | None = None
    keep_out: tuple[Box, ...] = ()
    clearance: Annotated[float, Ge(0)] = 0.02
    radius: Annotated[float, Gt(0)] | None = None

    @model_validator(mode="after")
    def _corners_in_order(self) -> Self:
        for low, high in self.keep_out:
            for axis, lower, upper in zip("xyz", low, high, strict=True):
                if lower >= upper:
                    raise ValueError(f"keep_out: the lower corner comes first, but {axis} goes from {lower} to {upper}")
        return self


class SafetySettings(ClearanceSettings):
    """What a motion keeps beside the limits of the robot file; rad (m).

    near: the pose near which the motion starts and ends, one number a joint. range: [lower, upper] of each joint, or
    `robot` for that of the robot file; if left out that of a recording, where there is one.
    """

    near: tuple[float, ...] | None = None
    range: Literal["robot"] | tuple[Range, ...] | None = None

    @model_validator(mode="after")
    def _ends_in_order(self) -> Self:
        for low_end, high_end in self.range if isinstance(self.range, tuple) else ():
            if low_end >= high_end:
                raise ValueError(f"range should be lower, upper: not {low_end} to {high_end}")
        return self


@dataclass(frozen=True, eq=False)
class RecordedPlace:
    """Where a recording was: lowest and highest positions and the first pose, (joints,) each, rad or m."""

    lowest: Array
    highest: Array
    start: Array


@dataclass(frozen=True, eq=False)
class SafetyRules:
    """What a motion of an arm has to keep.

    limits: in force, with the range. start: (joints,), None where it may start anywhere. still: (joints,), a pose that
    keeps everything. shape: None where MuJoCo is missing. range_words: whose range it is, None where it is that of the
    limits alone. left_out: pairs of parts that no check looks at, with the reason.
    """

    arm: Arm
    limits: tuple[Limits, ...]
    start: Array | None
    still: Array
    shape: ArmShape | None
    settings: SafetySettings
    range_words: str | None
    left_out: tuple[str, ...]

    @property
    def start_reach(self) -> Array:
        """How far from its start pose each joint may start, (joints,), rad or m."""
        return _start_reach(self.arm)

    def shortfall(self, positions: Array) -> float:
        """Sum over the pairs of how much closer than a search allows they come at positions (samples, joints), m."""
        if self.shape is None or not self.shape.pairs:
            return 0.0
        distances = self.shape.distances(_search_poses(positions), close=self.settings.clearance + SEARCH_MARGIN)
        return float(np.maximum(self._asked - distances.min(axis=0), 0.0).sum())

    def margins(self, positions: Array) -> Array:
        """How much farther apart than a search asks for each pair comes in each stretch of a motion, (rows,), m.

        positions: (samples, joints). Negative where a pair is too close.
        """
        if self.shape is None:
            return np.empty(0)
        distances = self.shape.distances(_search_poses(positions)) - self._asked
        return np.minimum.reduceat(distances, np.arange(0, len(distances), STRETCH_POSES)).ravel()

    def margin_slopes(self, positions: Array, chosen: NDArray[np.intp]) -> tuple[NDArray[np.intp], Array]:
        """The samples (chosen,) at which chosen margins are taken, and their derivatives with respect to the positions
        there, (chosen, joints), m per rad (m per m).
        """
        if self.shape is None or not len(chosen):
            return np.zeros(0, dtype=np.intp), np.empty((0, positions.shape[1]))
        stretches, pairs = np.divmod(chosen, len(self.shape.pairs))
        distances = self.shape.distances(_search_poses(positions))
        nearest = [
            first + np.argmin(distances[first : first + STRETCH_POSES, pair])
            for first, pair in zip((stretches * STRETCH_POSES).tolist(), pairs.tolist(), strict=True)
        ]
        samples = np.array(nearest, dtype=np.intp) * _search_stride(len(positions))
        return samples, self.shape.distance_slopes(positions, samples, pairs)

    @cached_property
    def _asked(self) -> Array:
        """What a search asks of each pair, (pairs,), m: no more than the safe pose has."""
        if self.shape is None:
            return np.empty(0)
        kept = self.settings.clearance
        has = self.shape.distances(self.still[None])[0]
        return np.asarray(np.clip(has - ROUNDING, kept, kept + SEARCH_MARGIN))


@dataclass(frozen=True, eq=False, kw_only=True)
class SafeConstraints(Constraints):
    """The limits of an arm and its safety rules."""

    rules: SafetyRules

    def violation(self, excitation: Excitation) -> Array:
        """Sum over all limits and pairs of parts, (points,): 0 where everything is kept."""
        short = [self.rules.shortfall(each) for each in excitation.motion.position]
        return np.asarray(super().violation(excitation) + np.log1p(short))

    def margins(self, positions: Array) -> Array:
        """How far each pair is from being too close in each stretch of positions (samples, joints), m, (rows,)."""
        return self.rules.margins(positions)

    def margin_slopes(self, positions: Array, chosen: NDArray[np.intp]) -> tuple[NDArray[np.intp], Array]:
        """Samples (chosen,) of chosen rows of `margins`, and their derivatives (chosen, joints) along the positions."""
        return self.rules.margin_slopes(positions, chosen)


def _search_stride(samples: int) -> int:
    return max(1, samples // SEARCH_POSES)


def _search_poses(positions: Array) -> Array:
    """The positions (samples, joints) that a search looks at."""
    return positions[:: _search_stride(len(positions))]


def safety_rules(
    arm: Arm, robot: str, limits: tuple[Limits, ...], settings: SafetySettings, recorded: RecordedPlace | None
) -> SafetyRules:
    """The rules for an arm that was read from `robot`, a file or a built-in name.

    Raises InputError, in one line, where the pose, the range, the floor or the boxes leave no room, and where MuJoCo
    is missing but needed.
    """
    narrowed, words = _narrow_limits(arm, limits, settings, recorded)
    start = _start_pose(arm, narrowed, settings, recorded)
    shape = _shape(arm, robot, narrowed, settings)
    poses = _random_poses(narrowed)
    still = _middle(narrowed) if start is None else start
    if shape is None:
        return SafetyRules(arm, narrowed, start, still, None, settings, words, ())
    kept = settings.clearance
    shape, touching = _without_touching(shape, poses, kept)
    left_out = [f"{each}: they are closer than {kept:g} m in every pose" for each in touching]
    if start is None:
        still = _clear_pose(shape, np.concatenate([still[None], poses]), kept)
    else:
        if settings.near is None:
            shape, touching = _without_touching(shape, start[None], kept, "the arm itself")
            left_out += [f"{each}: they are closer than {kept:g} m where the recording starts" for each in touching]
        _check_start(shape, start, kept)
    return SafetyRules(arm, narrowed, start, still, shape, settings, words, tuple(left_out))


def _narrow_limits(
    arm: Arm, limits: tuple[Limits, ...], settings: SafetySettings, recorded: RecordedPlace | None
) -> tuple[tuple[Limits, ...], str | None]:
    """The limits with the range that a motion may use, and whose range it is."""
    if settings.range == "robot":
        return limits, None
    if isinstance(settings.range, tuple):
        _check_count(arm, "range", len(settings.range))
        return tuple(map(_narrow, arm.joints, limits, settings.range)), "the given range"
    if recorded is None:
        return limits, None
    margin = np.maximum(RANGE_MARGIN * (recorded.highest - recorded.lowest), _start_reach(arm))
    wanted = zip((recorded.lowest - margin).tolist(), (recorded.highest + margin).tolist(), strict=True)
    return tuple(map(_narrow, arm.joints, limits, wanted)), "the range of the first recording, a little wider"


def _start_reach(arm: Arm) -> Array:
    return np.array([START_REACH[joint.kind] for joint in arm.joints])


def _narrow(joint: Joint, limits: Limits, wanted: Range) -> Limits:
    low, high = max(limits.position[0], wanted[0]), min(limits.position[1], wanted[1])
    if low >= high:
        raise InputError(
            f"range of {joint.name}: {wanted[0]:.4g} to {wanted[1]:.4g} is outside its limits, "
            f"{limits.position[0]:.4g} to {limits.position[1]:.4g}"
        )
    return Limits((low, high), limits.velocity, limits.acceleration, limits.torque)


def _start_pose(
    arm: Arm, limits: tuple[Limits, ...], settings: SafetySettings, recorded: RecordedPlace | None
) -> Array | None:
    low, high = np.array([each.position for each in limits]).T
    if settings.near is None:
        return None if recorded is None else np.clip(recorded.start, low, high)
    _check_count(arm, "near", len(settings.near))
    for joint, place, lowest, highest in zip(arm.joints, settings.near, low, high, strict=True):
        if not lowest <= place <= highest:
            raise InputError(
                f"near: {joint.name} at {place:.4g} is outside its range, {lowest:.4g} to {highest:.4g} "
                f"{'rad' if joint.kind == 'revolute' else 'm'}"
            )
    return np.array(settings.near)


def _check_count(arm: Arm, name: str, given: int) -> None:
    if given != len(arm):
        raise InputError(f"{name} should have {len(arm)} entries, one a joint of '{arm.name}', has {given}")


def _shape(arm: Arm, robot: str, limits: tuple[Limits, ...], settings: SafetySettings) -> ArmShape | None:
    surroundings = Surroundings(settings.floor, settings.keep_out)
    if find_spec("mujoco") is None and settings.floor is None and not settings.keep_out:
        return None
    return arm_shape(arm, robot, surroundings, limits, settings.radius)


def _middle(limits: tuple[Limits, ...]) -> Array:
    low, high = _finite_range(limits)
    return np.asarray((low + high) / 2)


def _finite_range(limits: tuple[Limits, ...]) -> tuple[Array, Array]:
    """Lowest and highest positions (joints,); a whole turn where a joint has no range."""
    low, high = np.array([each.position for each in limits]).T
    return np.where(np.isfinite(low), low, -np.pi), np.where(np.isfinite(high), high, np.pi)


def _random_poses(limits: tuple[Limits, ...]) -> Array:
    low, high = _finite_range(limits)
    return np.asarray(np.random.default_rng(0).uniform(low, high, (TOUCH_POSES, len(limits))))


def _without_touching(
    shape: ArmShape, poses: Array, kept: float, kind: str | None = None
) -> tuple[ArmShape, tuple[str, ...]]:
    """The shape without the pairs that are too close in all poses (poses, joints), and the names of those pairs."""
    touching = (shape.distances(poses, close=kept) < kept).all(axis=0)
    touching &= np.array([kind in (None, pair.kind) for pair in shape.pairs], dtype=bool)
    names = tuple(
        f"{pair.names[0]} and {pair.names[1]}" for pair, each in zip(shape.pairs, touching, strict=True) if each
    )
    _refuse_touching_surroundings(shape, touching)
    return shape.keeping(~touching), names


def _refuse_touching_surroundings(shape: ArmShape, touching: NDArray[np.bool_]) -> None:
    for pair, each in zip(shape.pairs, touching, strict=True):
        if each and pair.kind != "the arm itself":
            raise InputError(f"{pair.names[1]} is too close to {pair.names[0]} in every pose of its range")


def _clear_pose(shape: ArmShape, poses: Array, kept: float) -> Array:
    clear = (shape.distances(poses, close=kept) >= kept).all(axis=1)
    if not clear.any():
        raise InputError(
            f"none of {len(poses)} poses in the range keeps {kept:g} m from floor, boxes and the arm itself; "
            "name one with --near"
        )
    return np.asarray(poses[np.argmax(clear)])


def _check_start(shape: ArmShape, start: Array, kept: float) -> None:
    distances = shape.distances(start[None], close=kept)[0]
    if len(distances) and distances.min() < kept:
        pair = shape.pairs[int(np.argmin(distances))]
        found = describe_distance(pair.names, float(distances.min()))
        raise InputError(
            f"the pose where the motion starts ({describe_pose(start)}) has {found}; {kept:g} m are to be kept"
        )


def describe_pose(pose: Array) -> str:
    """A pose (joints,) as text."""
    return ", ".join(f"{each:.3g}" for each in pose)


def describe_distance(names: tuple[str, str], distance: float) -> str:
    """How far the second part is from the first one, m."""
    if distance < 0:
        return f"{names[1]} {-distance:.3f} m inside {names[0]}"
    return f"{names[1]} {distance:.3f} m from {names[0]}"
