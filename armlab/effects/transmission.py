"""A drive train that gives: elastic joints and play.

The link's angle is q = theta + twist, theta the recorded angle of the motor. The links ask for the rigid torque at
theta and, to first order, for what it grows with the twist, its speed and its acceleration; the drive train gives the
force of its spring or of its walls: inertia twist'' = -load - load_qd twist' - load_q twist - force(twist, twist'). It
is integrated in time.
"""

from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any, Self

import numpy as np

from armlab.common.arrays import Array
from armlab.effects._drive_train import ffi, lib
from armlab.effects.contract import (
    ANGLE,
    TORQUE,
    Candidate,
    Effect,
    Parameter,
    Range,
    Scene,
    Value,
)
from armlab.effects.friction import mean_within_samples, positions_within_samples
from armlab.effects.sensitivity import smooth_derivative
from armlab.effects.term import EveryJoint, Term, format_number, joint_moves
from problem.arm import Arm
from problem.kernel import pointer

DRIVE_TRAINS_SEEN = Range(
    (20.0, 2e7), "10 to 20 kN m/rad on small arms; servos of toys a thousandth, heavy arms a thousand times"
)
GAPS_SEEN = Range((1e-5, 0.03), "catalogues of gears: some arc seconds to an arc minute, servos of toys one degree")

JOINT_ELASTICITY_FACTS = Effect(
    "joint_elasticity",
    "a spring in the drive train",
    (Parameter("stiffness", f"{TORQUE}/{ANGLE}", positive=True, plausible=DRIVE_TRAINS_SEEN),),
    law=(
        r"q_{\text{link},j} = q_j + \theta_j, \quad M_j \ddot{\theta}_j = -\tau_{\text{load},j} - "
        r"\text{stiffness} \, (\theta_j + T \dot{\theta}_j)"
    ),
    prior_scale=1e-3,
    origin="transmission",
    experiment="excite the joint with a chirp past its resonance, or read an encoder on the link side",
    figures="{stiffness}",
)
BACKLASH_FACTS = Effect(
    "backlash",
    "a dead zone in the drive train",
    (
        Parameter("gap", ANGLE, positive=True, plausible=GAPS_SEEN),
        Parameter("positive", TORQUE, positive=True),
        Parameter("negative", TORQUE, positive=True),
        Parameter("way", ANGLE, positive=True, detail=True),
    ),
    law=r"q_{\text{link},j} = q_j + \theta_j, \quad |\theta_j| \le \text{gap} / 2",
    prior_scale=0.01,
    axis="position",
    origin="transmission",
    experiment="let the load change its sign slowly, or read an encoder on the link side",
    figures="{gap}",
)

PLAYS = (0.03, 0.1)  # of the joint's travel: gaps before friction, for a first look
PLAY_RANGE = (0.02, 0.5)  # a smaller one looks like presliding friction, or like a shift in time of some samples
WAY_RATIOS = (0.1, 0.3, 1.0)  # of the gap: the way over which friction turns behind it, for a first look
WAY_RATIO_RANGE = (0.02, 1.0)
PHASE_STEP = 0.1  # rad of the fastest oscillation a step
WALL_HZ = 80.0  # of the walls of a play, damped so that nothing bounces: stiff gears
MAX_RESONANCE_HZ = 400.0  # of a resonance: stiffer springs follow their load at once, whatever the model's inertia is
MIN_INERTIA_RATIO = 0.01  # of the greatest inertia felt in the run; a wrong model may have less


@dataclass(frozen=True)
class Twist:
    """Stiffness in N m/rad, damping_time in s (damping over stiffness); or a gap in rad."""

    stiffness: float = 0.0
    damping_time: float = 0.0
    gap: float = 0.0


@dataclass(frozen=True, eq=False)
class Load:
    """What a drive train carries, each (samples,). torque: N m (N). inertia: that it feels of the links, its rotor left
    out, kg m2 (kg): above zero. slopes: by how much the torque grows with the twist and with its speed, N m/rad and
    N m s/rad (N/m, N s/m); None for links that could not exist, which may feed a twist with energy. step: s.
    """

    step: float
    torque: Array
    inertia: Array
    slopes: tuple[Array, Array] | None

    def slopes_beside(self, inertia: Array, stiffness: Array | float) -> tuple[Array, Array]:
        """The slopes in an integration with an inertia (samples,) and a stiffness.

        A load undoes no more than half of a spring. Of links that could not exist the change of inertia alone counts.
        """
        if self.slopes is None:
            return np.zeros(len(inertia)), np.gradient(inertia, self.step)
        by_angle, by_speed = self.slopes
        return np.maximum(by_angle, -0.5 * stiffness), by_speed


def positive_inertia(inertia: Array) -> Array:
    """Inertia of a run (samples,) where a model has too little of it or none."""
    return np.maximum(inertia, max(MIN_INERTIA_RATIO * float(np.abs(inertia).max()), 1e-9))


def felt_inertia(scene: Scene, joint: int) -> Array:
    """Inertia that a joint (from 0) feels of the links, its rotor left out, (samples,), kg m2 (kg): above zero."""
    return positive_inertia(scene.torque_by_acceleration(joint)[:, joint])


def load_at(scene: Scene, joint: int) -> Load:
    """The load of a joint (from 0)."""
    slopes = None
    if scene.has_bodies:
        by_angle, by_speed = scene.torque_slopes(joint)
        slopes = np.ascontiguousarray(by_angle[:, joint]), np.ascontiguousarray(by_speed[:, joint])
    return Load(scene.step, np.ascontiguousarray(scene.rigid_torque[:, joint]), felt_inertia(scene, joint), slopes)


def integrate_twist(load: Load, law: Twist) -> Array:
    """Twist under a load, its speed and its acceleration, (3, samples); at rest with its load at the start."""
    return np.asarray(integrate_twists(load, [law])[0])


def integrate_twists(load: Load, laws: Sequence[Twist]) -> Array:
    """The same of several gaps, or of one spring, side by side: (laws, 3, samples)."""
    first = laws[0]
    slow = 0.0 if first.gap > 0 else first.stiffness / (2 * np.pi * MAX_RESONANCE_HZ) ** 2
    inertia = np.maximum(load.inertia, slow)
    wall = 2 * np.pi * WALL_HZ
    stiffness, damping = (
        (wall**2, 2 * wall) if first.gap > 0 else (first.stiffness, first.damping_time * first.stiffness)
    )
    trains = ffi.new("DriveTrain[]", [[stiffness, damping, law.gap] for law in laws])
    by_angle, by_speed = load.slopes_beside(inertia, stiffness * inertia if first.gap > 0 else stiffness)
    out = np.empty((len(laws), 3, len(inertia)))
    lib.twists_of_drive_trains(
        len(laws),
        trains,
        len(inertia),
        load.step,
        _half_steps(load.step, first, inertia),
        pointer(load.torque),
        pointer(inertia),
        pointer(by_speed),
        pointer(by_angle),
        pointer(out),
    )
    return out


def _half_steps(step: float, law: Twist, inertia: Array) -> int:
    """Half the steps from sample to sample that follow the fastest oscillation."""
    if law.gap > 0:
        return int(np.ceil(step * 2 * np.pi * WALL_HZ / PHASE_STEP / 2))
    pitch = float(np.sqrt(law.stiffness / inertia.min()))
    return int(np.ceil(step * max(pitch, law.damping_time * pitch**2) / PHASE_STEP / 2))


RIGID_HZ = 200.0  # a resonance that no recording shows: the twist follows the load at once
MIN_RESONANCE_HZ = 3.0
RESONANCES_HZ = (RIGID_HZ, 25.0)  # for a first look
DAMPING_TIME = 3e-4  # s, of steel gears: a fiftieth of the critical damping at 20 Hz
GAPS = (1e-4, 6e-4, 4e-3)  # rad, for a first look
GAP_RANGE = (1e-5, 5e-2)
SCANNED_GAPS = np.geomspace(2e-5, 2e-2, 32)
KEPT_GAPS = 2  # gaps of a scan
LOAD_CHANGE = 1e-6  # of a load, that tells whether a twist is decided by it
LOAD_ERROR = 0.01  # of a load: were all of a twist's torque another one with it, nothing would tell it
SIDE_BY_SIDE = 16  # gaps that are integrated at a time, as many as there are lanes in drive_train.c


@dataclass(frozen=True)
class Transmission(Term):
    """A twist of the drive train by the load that it carries, per unit of the coefficient; all joints feel it.

    measured: factor of the recorded difference between link and motor, where there is one: then the columns
    follow the difference itself, scaled to the law.
    """

    follows_model = True
    of_time = True
    measured: float | None = None

    @classmethod
    def at(cls, arm: Arm, joint: int, **details: Any) -> Self:
        """The effect at a joint, felt by all."""
        return cls(joint, (joint,), tuple(range(len(arm))), arm.joints[joint - 1].kind, **details)

    @property
    def index(self) -> int:
        """The joint that gives, from 0."""
        return self.joints[0] - 1

    @property
    @abstractmethod
    def law(self) -> tuple[Twist, float]:
        """The drive train of this shape, and the coefficient that it has."""

    def with_recorded(self, scenes: Sequence[Scene]) -> Self:
        """With the coefficient that the recorded differences have over the law; as it is without them."""
        pairs = [(self.twist(scene)[0], recorded_difference(scene, self.index)) for scene in scenes]
        if any(recorded is None for _, recorded in pairs):
            return self
        law = np.concatenate([twist for twist, _ in pairs])
        recorded = np.concatenate([np.asarray(difference) for _, difference in pairs])
        law = law - law.mean()
        factor = float(law @ recorded / (law @ law)) if law.any() else 0.0
        return replace(self, measured=factor or None)

    def twist(self, scene: Scene) -> Array:
        """Twist, its speed and its acceleration for a coefficient of one, (3, samples)."""
        law, coefficient = self.law
        return integrate_twist(load_at(scene, self.index), law) / coefficient

    def columns(self, scene: Scene) -> Array:
        """Derivative of the rigid torque along the change."""
        return self._columns_of(self.twist(scene), scene)

    def _columns_of(self, twist: Array, scene: Scene) -> Array:
        recorded = recorded_difference(scene, self.index)
        if self.measured and recorded is not None:  # zeros of the two encoders may differ
            moved = twist[0].mean() + recorded / self.measured
            twist = np.stack([smooth_derivative(moved, scene.step, derivative) for derivative in range(3)])
        return scene.torque_along(self.index, twist)[:, :, None]


@dataclass(frozen=True)
class JointElasticity(Transmission):
    """q = theta + twist, stiffness twist = -load: a spring (Spong 1987). Coefficient: the compliance, 1 / stiffness.

    shape: the stiffness that its resonance has, N m/rad.
    """

    facts = JOINT_ELASTICITY_FACTS
    names = ("stiffness",)

    @property
    def law(self) -> tuple[Twist, float]:
        """The spring, and its compliance."""
        return Twist(self.shape[0], DAMPING_TIME), 1 / self.shape[0]

    @classmethod
    def initial_shapes(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """Resonances beyond and within what a recording shows, by the recorded difference where there is one."""
        inertia = float(np.mean([felt_inertia(scene, joint - 1).mean() for scene in scenes]))
        lowest, *looks = (inertia * (2 * np.pi * hertz) ** 2 for hertz in (MIN_RESONANCE_HZ, *RESONANCES_HZ))
        bounds = ((lowest, looks[0]),)
        return [cls.at(arm, joint, shape=(each,), bounds=bounds).with_recorded(scenes) for each in looks]

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """The stiffness: the coefficient is its inverse."""
        stiffness = float(1 / coefficients[0]) if coefficients[0] else float("inf")
        return {"stiffness": stiffness, "resonant_stiffness": self.shape[0]}

    def unit(self, name: str) -> str:
        """Unit of a parameter: both are stiffnesses."""
        return super().unit("stiffness")

    def equation(self, coefficients: Array) -> str:
        stiffness = format_number(1 / coefficients[0] if coefficients[0] else np.inf)
        return f"q_{self.joint} = theta_{self.joint} - tau_{self.joint} / {stiffness}"

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The spring with these parameters; its resonance follows its stiffness where no other is known."""
        stiffness = float(parameters["stiffness"])
        resonant = float(parameters.get("resonant_stiffness", stiffness))
        spring = cls.at(arm, joints[0], shape=(resonant,), bounds=((resonant / 2, resonant * 2),))
        return spring, np.array([1 / stiffness])


@dataclass(frozen=True)
class Backlash(Transmission):
    """q = theta + twist, |twist| <= gap / 2: play between walls that do not bounce. Coefficient: the gap.

    shape: the gap that is crossed, rad.
    """

    facts = BACKLASH_FACTS
    names = ("gap",)
    follows_closely = True

    @property
    def law(self) -> tuple[Twist, float]:
        """The play, and its gap."""
        return Twist(gap=self.shape[0]), self.shape[0]

    @classmethod
    def columns_together(cls, candidates: Sequence[Candidate], scene: Scene) -> list[Array]:
        """Those of gaps of a joint: all are integrated side by side."""
        gaps = [each for each in candidates if isinstance(each, cls)]
        out: dict[Candidate, Array] = {}
        for index in sorted({each.index for each in gaps}):
            own = [each for each in gaps if each.index == index]
            twists = _integrate_side_by_side(load_at(scene, index), [each.law[0] for each in own])
            columns = (each._columns_of(twist / each.law[1], scene) for each, twist in zip(own, twists, strict=True))
            out |= zip(own, columns, strict=True)
        return [out[each] for each in candidates]

    @classmethod
    def initial_shapes(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """A few gaps, by the recorded difference where there is one."""
        return [each.with_recorded(scenes) for each in cls._gaps(arm, joint, GAPS)]

    @classmethod
    def from_scan(cls, arm: Arm, joint: int, scenes: Sequence[Scene], residuals: Sequence[Array]) -> list[Self]:
        """The gaps whose torque at the joint resembles most what is left there; first looks with a recorded one.

        Of the gaps whose twist the recording decides.
        """
        looks = cls.initial_shapes(arm, joint, scenes)
        if looks[0].measured is not None:
            return looks
        gaps = cls._gaps(arm, joint, SCANNED_GAPS.tolist())
        alike = _resemblance(gaps, scenes, residuals, joint - 1)
        decided = cls.decided_by([gaps[place] for place in np.argsort(-alike)], scenes)
        return [replace(each, looks=len(gaps)) for each in islice(decided, KEPT_GAPS)]

    @classmethod
    def decided_by(cls, gaps: Sequence[Self], scenes: Sequence[Scene]) -> Iterator[Self]:
        """Those gaps of a joint of which the recording tells the twist, some at a time.

        Where it rattles, the least error of the load grows to another twist.
        """
        loads = [load_at(scene, gaps[0].index) for scene in scenes]
        for start in range(0, len(gaps), SIDE_BY_SIDE):
            some = gaps[start : start + SIDE_BY_SIDE]
            change, size = np.zeros(len(some)), np.zeros(len(some))
            for load in loads:
                more = replace(load, torque=(1 + LOAD_CHANGE) * load.torque)
                torque, other = (
                    integrate_twists(each, [gap.law[0] for gap in some])[:, 2] * load.inertia for each in (load, more)
                )
                change += np.sum((other - torque) ** 2, axis=1)
                size += np.sum(torque**2, axis=1)
            tells = change <= (LOAD_CHANGE / LOAD_ERROR) ** 2 * size
            yield from (gap for gap, told in zip(some, tells, strict=True) if told)

    @classmethod
    def _gaps(cls, arm: Arm, joint: int, gaps: Sequence[float]) -> list[Self]:
        return [cls.at(arm, joint, shape=(gap,), bounds=(GAP_RANGE,)) for gap in gaps]

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """The whole gap."""
        return {"gap": float(coefficients[0]), "crossed_gap": self.shape[0]}

    def unit(self, name: str) -> str:
        """Unit of a parameter: both are gaps."""
        return super().unit("gap")

    def equation(self, coefficients: Array) -> str:
        own = self.joint
        return f"q_{own} = theta_{own} - {format_number(coefficients[0])}/2 sgn(tau_{own})"

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        gap = float(parameters["gap"])
        crossed = float(parameters.get("crossed_gap", gap))
        return cls.at(arm, joints[0], shape=(crossed,), bounds=(GAP_RANGE,)), np.array([gap])


@dataclass(frozen=True)
class FrictionBehindPlay(Term):
    """positive max(z, 0) + negative min(z, 0), z = sgn(d) max(|d| - gap / 2, 0) / way: friction behind play.

    d follows the way of the joint and stops at gap / 2 + way, where the friction slides: after a reversal the torque
    falls to zero within the way, stays there for the gap, and comes back within another way. The friction is grounded,
    so what is left in the gap is the joint's other friction alone. shape: the gap, rad (m), and the way as a share of
    it: with a way that is longer than the gap it is presliding friction. coefficients: a level for each direction.
    """

    facts = BACKLASH_FACTS
    form = "friction behind play"
    names = ("gap", "positive", "negative", "way")
    size = 2
    is_friction = True
    of_time = True
    replaces = ("presliding_hysteresis",)

    @classmethod
    def initial_shapes(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """Gaps from a hundredth of the joint's travel up."""
        travel = max(float(np.ptp(scene.motion.position[:, joint - 1])) for scene in scenes)
        bounds = ((PLAY_RANGE[0] * travel, PLAY_RANGE[1] * travel), WAY_RATIO_RANGE)
        shapes = [(share * travel, ratio) for share in PLAYS for ratio in WAY_RATIOS]
        return [cls.at(arm, joint, shape=shape, bounds=bounds) for shape in shapes]

    def columns(self, scene: Scene) -> Array:
        gap, ratio = self.shape
        way = ratio * gap
        lag = way_within_limits(positions_within_samples(scene, self.own), gap / 2 + way)
        engaged = np.sign(lag) * np.maximum(np.abs(lag) - gap / 2, 0) / way
        return self._stacked(*(mean_within_samples(way(engaged, 0)) for way in (np.maximum, np.minimum)))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """The whole gap, the level of each direction behind it, and the way on which the torque reaches that level."""
        gap, ratio = self.shape
        positive, negative = coefficients.tolist()
        return {"gap": gap, "positive": positive, "negative": negative, "way": ratio * gap}

    def equation(self, coefficients: Array) -> str:
        own, gap = self.joint, format_number(self.shape[0])
        positive, negative = (format_number(each) for each in coefficients)
        law = f"{positive} max(z, 0) + {negative} min(z, 0)"
        return f"tau_{own} += {law}, z zero for {gap} after each reversal of qd_{own}"

    def prior_scale(self, inertial: Array | None) -> float:
        """The coefficients are levels, of which nothing is known."""
        return float("inf")

    def absurdity(self, coefficients: Array) -> str | None:
        """The scale of the effect is that of a gap, not of a level."""
        return None

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        gap, levels = float(parameters["gap"]), np.array([parameters["positive"], parameters["negative"]], dtype=float)
        ratio = float(parameters["way"]) / gap
        bounds = ((gap / 10, gap * 10), (ratio / 10, ratio * 10))
        return cls.at(arm, joints[0], shape=(gap, ratio), bounds=bounds), levels


def way_within_limits(position: Array, limit: float) -> Array:
    """What a slider is behind a joint at `position` (samples,) that drags it along beyond `limit`, (samples,)."""
    moving = np.flatnonzero(np.diff(position))  # where it stands still it does not turn
    steps = np.sign(np.diff(position)[moving])
    ends = moving[np.flatnonzero(steps[1:] != steps[:-1]) + 1]
    out, start = np.zeros(len(position)), 0
    for end in [*ends.tolist(), len(position) - 1]:
        moved = position[start : end + 1] - position[start]
        out[start : end + 1] = np.clip(out[start] + moved, -limit, limit)
        start = end
    return out


@dataclass(frozen=True)
class BacklashFamily(EveryJoint):
    """Play at every joint: inside the drive train, its gap by a scan of what is left, and before a joint's friction."""

    facts: Effect = BACKLASH_FACTS
    terms: tuple[type[Term], ...] = (Backlash, FrictionBehindPlay)

    def scan(self, arm: Arm, scenes: Sequence[Scene], residuals: Sequence[Array]) -> list[list[Candidate]]:
        """The best gaps of a fine grid at each joint that moves."""
        joints = [joint for joint in range(1, len(arm) + 1) if joint_moves(scenes, joint)]
        return [
            [
                *Backlash.from_scan(arm, joint, scenes, residuals),
                *FrictionBehindPlay.initial_shapes(arm, joint, scenes),
            ]
            for joint in joints
        ]


def _integrate_side_by_side(load: Load, laws: Sequence[Twist]) -> Iterator[Array]:
    """Twists of gaps, (3, samples) each: some at a time."""
    for start in range(0, len(laws), SIDE_BY_SIDE):
        yield from integrate_twists(load, laws[start : start + SIDE_BY_SIDE])


def recorded_difference(scene: Scene, joint: int) -> Array | None:
    """Link angle less motor angle, (samples,), less their mean; None where it was not recorded."""
    if scene.link_position is None:
        return None
    difference = scene.link_position[:, joint] - scene.motion.position[:, joint]
    return None if np.isnan(difference).any() else np.asarray(difference - difference.mean())


def _resemblance(shapes: Sequence[Backlash], scenes: Sequence[Scene], residuals: Sequence[Array], joint: int) -> Array:
    """Share of what is left at a joint (from 0) that each shape explains there, by the inertia of the twist alone."""
    products = np.zeros((3, len(shapes)))
    for scene, residual in zip(scenes, residuals, strict=True):
        rows = np.flatnonzero(np.isfinite(residual[:, joint]))
        left, load = residual[rows, joint], load_at(scene, joint)
        width = max(int(np.median(np.diff(rows))), 1) if len(rows) > 1 else 1
        laws, gaps = zip(*(shape.law for shape in shapes), strict=True)
        for place, (twist, gap) in enumerate(zip(_integrate_side_by_side(load, laws), gaps, strict=True)):
            torque = np.convolve(load.inertia * (twist[2] / gap), np.full(width, 1 / width), "same")[rows]
            products[:, place] += torque @ left, torque @ torque, left @ left
    return np.asarray(np.maximum(products[0], 0) ** 2 / np.maximum(products[1] * products[2], 1e-300))


JOINT_ELASTICITY = EveryJoint(JOINT_ELASTICITY_FACTS, (JointElasticity,))
BACKLASH = BacklashFamily()
