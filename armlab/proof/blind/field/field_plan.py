"""The plan of a field case: robot, motions, physics, drives and logging, drawn from its seed and number alone."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from armlab.common.arrays import Array
from armlab.proof.blind.arms import Machine
from armlab.proof.blind.field.drive_log import DriveLog, draw_drive_log
from armlab.proof.blind.field.field_friction import JointFriction, draw_friction
from armlab.proof.blind.field.field_motions import FIELD_FAMILIES, Style, draw_style
from armlab.proof.blind.field.field_robots import draw_machine, with_field_links
from armlab.proof.blind.field.rest import JointRest, draw_rest
from armlab.proof.blind.plan import RunPlan, random_stream
from problem.arm import Arm

FieldKind = Literal["null", "hidden", "mistake", "pair null", "pair changed"]
LARGE_SHARE = 0.48  # of the cases: more than three joints, or more than 20 s
MIN_SAMPLES = 150  # of a run: who records slowly records longer


@dataclass(frozen=True)
class FieldSettings:
    """What a field case is drawn from.

    link_error: relative errors of links. no_links_share: cases whose robot file has no links. offset_share: torque
    offset over the rating. gain_error: largest relative error of the torque of a joint. rest_share: rest over the
    torque's spread, of the joints of a case; rest_scatter: of its logarithm from joint to joint. presliding_share:
    cases with a noticeable way of presliding. soft_share, play_share: joints with a soft drive, or with play. twist: of
    a soft drive at its rating, rad. gap: play, rad. length_s, large_length_s: of all runs together; long_exponent: of a
    share of the range, so that long ones are more usual than short ones.
    """

    link_error: tuple[float, float] = (0.1, 0.6)
    no_links_share: float = 0.4
    offset_share: float = 0.02
    gain_error: float = 0.15
    rest_share: tuple[float, float] = (0.03, 0.3)
    rest_scatter: float = 0.35
    presliding_share: float = 0.3
    soft_share: float = 0.15
    play_share: float = 0.15
    twist: tuple[float, float] = (5e-4, 5e-3)
    gap: tuple[float, float] = (2e-4, 3e-3)
    length_s: tuple[float, float] = (4.0, 20.0)
    large_length_s: tuple[float, float] = (15.0, 60.0)
    long_exponent: float = 0.5


FIELD = FieldSettings()


@dataclass(frozen=True)
class Drive:
    """Between motor and link of a joint, and what its torque is read from.

    twist: rad per N m of a soft drive. gap: rad, play. gain: torque as read over torque. offset: N m.
    """

    twist: float
    gap: float
    gain: float
    offset: float


@dataclass(frozen=True, eq=False)
class FieldPlan:
    """One case, or one side of a pair. true_arm: links as they are. link_errors: of each link, relative; empty where
    the robot file has no links. cut: whether all runs are pieces of one motion. still: (joints,), held in all runs.
    """

    seed: int
    index: int
    kind: FieldKind
    machine: Machine
    true_arm: Arm
    link_errors: tuple[float, ...]
    runs: tuple[RunPlan, ...]
    cut: bool
    still: tuple[bool, ...]
    style: Style
    friction: tuple[JointFriction, ...]
    rest: tuple[JointRest, ...]
    drives: tuple[Drive, ...]
    log: DriveLog
    side: str = ""
    same_motion: bool = False

    @property
    def name(self) -> str:
        """A random name, which says nothing about the case."""
        return random_stream("field name", self.seed, self.kind, self.index).bytes(6).hex()

    @property
    def has_links(self) -> bool:
        """Whether the robot file has links."""
        return bool(self.link_errors)

    @property
    def half_turns(self) -> Array:
        """Way of each joint that counts as half a turn, (joints,), rad (m)."""
        low, high = self.machine.range
        slides = np.array([joint.type == "prismatic" for joint in self.machine.file.joints])
        return np.where(slides, (high - low) / 2, np.pi)

    def stream(self, what: str) -> np.random.Generator:
        """Random numbers for one purpose; both sides of a pair may have the same motions."""
        shared = self.same_motion and what.startswith("motion")
        return random_stream("field", "" if shared else self.side, what, self.seed, self.kind, self.index)


def draw_field_plan(seed: int, index: int, kind: FieldKind) -> FieldPlan:
    """The plan of a case; of a pair, that of its old side."""
    rng = random_stream("field plan", seed, kind, index)
    large = _is_large(seed, index, kind)
    many = large and rng.random() < 0.75
    machine = draw_machine(rng, many)
    true_arm, errors = with_field_links(rng, machine.arm, FIELD.link_error)
    has_links = rng.random() >= FIELD.no_links_share
    joints = machine.joints
    log = draw_drive_log(rng, joints)
    share = float(np.exp(rng.uniform(*np.log(FIELD.rest_share))))
    presliding = rng.random() < FIELD.presliding_share
    friction = tuple(
        draw_friction(rng, float(machine.rating[joint]), float(machine.speed[joint]), presliding)
        for joint in range(joints)
    )
    return FieldPlan(
        seed=seed,
        index=index,
        kind=kind,
        machine=machine,
        true_arm=true_arm,
        link_errors=errors if has_links else (),
        runs=_draw_runs(rng, large, log.rate_hz),
        cut=bool(rng.random() < 0.4),
        still=_draw_still(rng, joints),
        style=draw_style(rng, joints),
        friction=friction,
        rest=tuple(draw_rest(rng, share * float(np.exp(rng.normal(0, FIELD.rest_scatter)))) for _ in range(joints)),
        drives=tuple(_draw_drive(rng, float(machine.rating[joint])) for joint in range(joints)),
        log=log,
        side="old" if kind.startswith("pair") else "",
        same_motion=bool(rng.random() < 0.5),
    )


def new_side(plan: FieldPlan) -> FieldPlan:
    """The new recording of a pair: the same robot on another day, warmer or colder, other runs unless the same."""
    rng = random_stream("field new side", plan.seed, plan.kind, plan.index)
    warmth = float(rng.uniform(0, 300))
    friction = tuple(replace(each, running_s=warmth) for each in plan.friction)
    return replace(plan, side="new", friction=friction)


def _is_large(seed: int, index: int, kind: FieldKind) -> bool:
    """Spread evenly over the cases of a set."""
    golden = (np.sqrt(5) - 1) / 2
    return bool((random_stream("field large", seed, kind).random() + golden * index) % 1 < LARGE_SHARE)


def _draw_runs(rng: np.random.Generator, large: bool, rate_hz: int) -> tuple[RunPlan, ...]:
    low, high = FIELD.large_length_s if large else FIELD.length_s
    number = int(rng.integers(2, 4))
    low = max(low, number * MIN_SAMPLES / 0.5 / rate_hz)
    total = float(low + (high - low) * rng.random() ** FIELD.long_exponent)  # long ones more often than short ones
    shares = rng.uniform(0.6, 1.4, number)
    lengths = total * shares / shares.sum()
    families = [str(rng.choice(list(FIELD_FAMILIES))) for _ in range(number)]
    if rng.random() < 0.5:
        families = [families[0]] * number
    return tuple(
        RunPlan(family, float(length), "validate" if place == number - 1 else "identify")
        for place, (family, length) in enumerate(zip(families, lengths, strict=True))
    )


def _draw_still(rng: np.random.Generator, joints: int) -> tuple[bool, ...]:
    """In some cases, joints that never move; one moves always."""
    if joints == 1 or rng.random() > 0.15:
        return (False,) * joints
    moving = int(rng.integers(joints))
    return tuple(bool(joint != moving and rng.random() < 0.5) for joint in range(joints))


def _draw_drive(rng: np.random.Generator, rating: float) -> Drive:
    soft, loose = rng.random() < FIELD.soft_share, rng.random() < FIELD.play_share
    return Drive(
        twist=float(np.exp(rng.uniform(*np.log(FIELD.twist)))) / rating if soft else 0.0,
        gap=float(np.exp(rng.uniform(*np.log(FIELD.gap)))) if loose else 0.0,
        gain=1 + float(rng.uniform(-FIELD.gain_error, FIELD.gain_error)),
        offset=rating * float(rng.normal(0, FIELD.offset_share)),
    )
