"""Torque that depends on a joint's position: ripple, springs, cables and what carries gravity."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from armlab.common.arrays import Array
from armlab.effects.contract import (
    ANGLE,
    HALF_CIRCLE,
    STIFFNESS,
    TORQUE,
    Candidate,
    Effect,
    Parameter,
    Range,
    Scene,
    Value,
)
from armlab.effects.term import (
    SIGN_SIGMAS,
    EveryJoint,
    Term,
    TermFamily,
    format_number,
    format_sum,
    joint_moves,
)
from problem.arm import Arm
from problem.motion import Motion
from problem.regressor import rigid_body_torque

RESTS_SEEN = Range(
    (-2 * np.pi, 2 * np.pi),
    "a turn to each side, the range of the joints of the UR arms: a pull that ends beyond it is nearly constant",
    (-np.inf, np.inf),
)

TORQUE_RIPPLE_FACTS = Effect(
    "torque_ripple",
    "torque that waves with the joint angle",
    (
        Parameter("order", "1/rev", positive=True),
        Parameter("amplitude", TORQUE, positive=True),
        Parameter("phase", "rad", max_width=HALF_CIRCLE),
    ),
    law=r"\Delta\tau_j = \text{amplitude} \; \sin(\text{order} \; q_j + \text{phase})",
    scanned=True,
    axis="cycle",
    experiment="turn the joint slowly at constant speed, sampled well above the ripple",
    figures="{amplitude} at {order}",
)
GRAVITY_COMPENSATOR_FACTS = Effect(
    "gravity_compensator",
    "a spring, linkage or gas cylinder against gravity",
    (
        STIFFNESS,
        Parameter("rest", ANGLE),
        Parameter("amplitude", TORQUE),
        Parameter("phase", "rad", max_width=HALF_CIRCLE),
    ),
    sentence="A gravity compensator that {model} does not have acts on {place}",
    law=r"\Delta\tau_j = \text{amplitude} \; \sin(q_j + \text{phase})",
    contains=("torque_offset",),
    axis="position",
    origin="gravity and springs",
    experiment="record two payloads over the full range of the joint",
)
CABLE_STIFFNESS_FACTS = Effect(
    "cable_stiffness",
    "hoses and cables that pull the joint to a rest position",
    (STIFFNESS, Parameter("rest", ANGLE, plausible=RESTS_SEEN)),
    law=r"\Delta\tau_j = \text{stiffness} \; (q_j - \text{rest})",
    contains=("torque_offset",),
    axis="position",
    origin="gravity and springs",
    experiment="move the joint slowly over its full range in both directions",
    figures="{stiffness}",
)

MIN_ORDER = 6.0  # cycles a turn, of a motor with three slots and two poles (Zhu 2000); slower waves are other physics
MAX_ORDER = 400.0
GRID_ORDERS = 150  # of a plain grid
BINS_PER_CYCLE = 8  # positions a cycle of the highest order, where a scan averages what is left
KEPT_PEAKS = 3  # peaks of a scan


@dataclass(frozen=True)
class TorqueRipple(Term):
    """amplitude sin(order q + phase); shape: the order, cycles a turn (rad/m)."""

    facts = TORQUE_RIPPLE_FACTS
    names = ("order", "amplitude", "phase")
    size = 2

    def columns(self, scene: Scene) -> Array:
        angle = self.shape[0] * scene.motion.position[:, self.own]
        return self._stacked(np.sin(angle), np.cos(angle))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        amplitude, phase = amplitude_and_phase(coefficients)
        return {"order": self.shape[0], "amplitude": amplitude, "phase": phase}

    def unit(self, name: str) -> str:
        """Unit of a parameter: along a sliding joint there are no turns."""
        return "rad/m" if name == "order" and self.kind == "prismatic" else super().unit(name)

    def equation(self, coefficients: Array) -> str:
        amplitude, phase = amplitude_and_phase(coefficients)
        sign = "-" if phase < 0 else "+"
        inner = f"{format_number(self.shape[0])} q_{self.joint} {sign} {format_number(abs(phase))}"
        return f"tau_{self.joint} += {format_number(amplitude)} sin({inner})"

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        order = float(parameters["order"])
        ripple = cls.at(arm, joints[0], shape=(order,), bounds=((order - 1, order + 1),))
        return ripple, sine_and_cosine(float(parameters["amplitude"]), float(parameters["phase"]))


def amplitude_and_phase(coefficients: Array) -> tuple[float, float]:
    """Amplitude and phase of a sin + b cos."""
    return float(np.hypot(*coefficients)), float(np.arctan2(coefficients[1], coefficients[0]))


def sine_and_cosine(amplitude: float, phase: float) -> Array:
    """Coefficients of amplitude sin(. + phase)."""
    return amplitude * np.array([np.cos(phase), np.sin(phase)])


@dataclass(frozen=True)
class RippleFamily(TermFamily):
    """Orders that the motion can separate, up to where it passes them faster than the samples follow."""

    facts: Effect = TORQUE_RIPPLE_FACTS
    terms: tuple[type[Term], ...] = (TorqueRipple,)

    def candidates(self, arm: Arm, scenes: Sequence[Scene]) -> list[list[Candidate]]:
        """At most ORDERS orders a joint, coarser where there would be more: use `scan` for all of them."""
        found: list[list[Candidate]] = []
        for joint in (joint for joint in range(1, len(arm) + 1) if joint_moves(scenes, joint)):
            step, highest = order_resolution(scenes, joint)
            count = min(GRID_ORDERS, int((highest - MIN_ORDER) / step) + 1)
            if count > 1:
                orders = np.linspace(MIN_ORDER, highest, count).tolist()
                found.append(
                    [_ripple_of_order(arm, joint, order, max(step, orders[1] - orders[0])) for order in orders]
                )
        return found

    def scan(self, arm: Arm, scenes: Sequence[Scene], residuals: Sequence[Array]) -> list[list[Candidate]]:
        """The highest peaks of a spectrum over position: what is left, averaged in narrow bins of position."""
        found: list[list[Candidate]] = []
        for joint in (joint for joint in range(1, len(arm) + 1) if joint_moves(scenes, joint)):
            step, highest = order_resolution(scenes, joint)
            if highest > MIN_ORDER + step:
                orders, power = _spectrum(scenes, residuals, joint, step / 2, highest)
                peaks = _peaks(power, 2)
                found.append(
                    [
                        replace(_ripple_of_order(arm, joint, float(orders[peak]), step), looks=len(orders))
                        for peak in peaks
                    ]
                )
        return found


def order_resolution(scenes: Sequence[Scene], joint: int) -> tuple[float, float]:
    """Step between orders that the motion can separate, and the highest that it can show."""
    travel = max(float(np.ptp(scene.motion.position[:, joint - 1])) for scene in scenes)
    # half of the time of the slowest run the joint is slower than this: there a wave has eight samples
    pace = min(float(np.median(np.abs(scene.motion.velocity[:, joint - 1])) * scene.step) for scene in scenes)
    return np.pi / travel, MAX_ORDER if pace <= 0 else min(MAX_ORDER, 2 * np.pi / (8 * pace))


def _ripple_of_order(arm: Arm, joint: int, order: float, step: float) -> TorqueRipple:
    return TorqueRipple.at(arm, joint, shape=(order,), bounds=((max(order - step, MIN_ORDER), order + step),))


def _spectrum(
    scenes: Sequence[Scene], residuals: Sequence[Array], joint: int, step: float, highest: float
) -> tuple[Array, Array]:
    """Orders, and the power of what is left at each."""
    place = np.concatenate([scene.motion.position[:, joint - 1] for scene in scenes])
    left = np.concatenate([residual[:, joint - 1] for residual in residuals])
    known = np.isfinite(left)
    place, left = place[known], left[known] - left[known].mean()
    width = 2 * np.pi / (highest * BINS_PER_CYCLE)
    count = int(np.ceil(2 * np.pi / (step * width)))
    bins = ((place - place.min()) / width).astype(int) % count
    spectrum = np.abs(np.fft.rfft(np.bincount(bins, left, count))) ** 2
    orders = 2 * np.pi / (count * width) * np.arange(len(spectrum), dtype=np.float64)
    chosen = (orders >= MIN_ORDER) & (orders <= highest)
    return orders[chosen], spectrum[chosen]


def _peaks(power: Array, apart: int) -> list[int]:
    """The KEPT highest peaks, at least so many places apart."""
    peaks: list[int] = []
    for index in np.argsort(power)[::-1].tolist():
        if all(abs(index - other) > apart for other in peaks):
            peaks.append(index)
        if len(peaks) == KEPT_PEAKS:
            break
    return peaks


TORQUE_RIPPLE = RippleFamily()


COMPENSATOR_SHARE = 0.5  # of the scatter of the joint's gravity torque: a spring that carries more is no cable
REST_POSITIONS = (0.25, 0.5, 0.75)  # of the travel: rest positions of a first look


@dataclass(frozen=True)
class LinearSpring(Term):
    """stiffness (q - rest), fitted as a q + b."""

    facts = CABLE_STIFFNESS_FACTS
    form = "linear"
    names = ("stiffness", "rest")
    size = 2
    identical = ("gravity_compensator",)

    def first_name(self, coefficients: Array, scenes: Sequence[Scene]) -> Candidate:
        """A spring that carries a good part of gravity is a compensator: no cable does."""
        if not feels_gravity(scenes[0].arm, self.joints[0]):
            return self
        springs, weights = [], []
        for scene in scenes:
            position = scene.motion.position
            still = Motion(position, np.zeros_like(position), np.zeros_like(position))
            springs.append(self.columns(scene)[:, 0] @ coefficients)
            weights.append(rigid_body_torque(scene.arm, still, scene.inertial)[:, self.own])
        spring, weight = np.concatenate(springs), np.concatenate(weights)
        carries = float(np.std(spring)) > COMPENSATOR_SHARE * float(np.std(weight))
        against = float(np.mean(spring * weight)) < 0
        joint = self.joints[0]
        return SpringCompensator.at(scenes[0].arm, joint) if carries and against else self

    def columns(self, scene: Scene) -> Array:
        """Position and a constant: neither alone is a spring."""
        return self._stacked(scene.motion.position[:, self.own], np.ones(len(scene.time)))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        slope, constant = (float(value) for value in coefficients)
        return {"stiffness": slope, "rest": -constant / slope if slope else 0.0}

    def joint_fields(self, coefficients: Array) -> dict[str, float]:
        """`stiffness` and `springref` of a simulator's joint, for a spring that pushes back."""
        named = self.parameters(coefficients)
        stiffness, rest = (float(np.sum(named[name])) for name in self.names)
        return {"stiffness": stiffness, "springref": rest} if stiffness > 0 else {}

    def equation(self, coefficients: Array) -> str:
        named = self.parameters(coefficients)
        rest = float(np.asarray(named["rest"]))
        sign = "+" if rest < 0 else "-"
        return (
            f"tau_{self.joint} += {format_number(coefficients[0])} (q_{self.joint} {sign} {format_number(abs(rest))})"
        )

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        stiffness, rest = float(parameters["stiffness"]), float(parameters["rest"])
        return cls.at(arm, joints[0]), np.array([stiffness, -stiffness * rest])


@dataclass(frozen=True)
class HardeningSpring(Term):
    """stiffness x + cubic x^3 + offset, x = q - rest; shape: the rest position.

    A torque offset moves the rest position of a linear spring. Here the cube fixes the rest position, and the offset
    is a coefficient of its own.
    """

    facts = CABLE_STIFFNESS_FACTS
    form = "cubic"
    names = ("stiffness", "rest", "cubic", "offset")
    size = 3

    @classmethod
    def initial_shapes(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """Rest positions over the travel."""
        low = min(float(scene.motion.position[:, joint - 1].min()) for scene in scenes)
        high = max(float(scene.motion.position[:, joint - 1].max()) for scene in scenes)
        bounds = ((low - 0.5 * (high - low), high + 0.5 * (high - low)),)
        return [cls.at(arm, joint, shape=(low + share * (high - low),), bounds=bounds) for share in REST_POSITIONS]

    def columns(self, scene: Scene) -> Array:
        """The bend, its cube, and a constant."""
        bend = scene.motion.position[:, self.own] - self.shape[0]
        return self._stacked(bend, bend**3, np.ones_like(bend))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Stiffness at rest, rest position, what the cube adds, and the torque at rest."""
        stiffness, cubic, offset = (float(value) for value in coefficients)
        return {"stiffness": stiffness, "rest": self.shape[0], "cubic": cubic, "offset": offset}

    def unit(self, name: str) -> str:
        torque, angle = ("N.m", "rad") if self.kind == "revolute" else ("N", "m")
        own = {"cubic": f"{torque}/{angle}3", "offset": torque}
        return own.get(name) or super().unit(name)

    def equation(self, coefficients: Array) -> str:
        terms = format_sum(*zip(coefficients, ("x", "x^3", ""), strict=True))
        return f"tau_{self.joint} += {terms}, x = q_{self.joint} - ({format_number(self.shape[0])})"

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """A cable that pushes, or gets softer."""
        spread = np.zeros(3) if covariance is None else SIGN_SIGMAS * np.sqrt(np.maximum(np.diag(covariance), 0))
        return "a stiffness below zero" if np.any((coefficients + spread)[:2] < 0) else None

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        rest = float(parameters["rest"])
        spring = cls.at(arm, joints[0], shape=(rest,), bounds=((rest - 1, rest + 1),))
        values = [parameters["stiffness"], parameters["cubic"], parameters.get("offset", 0.0)]
        return spring, np.array(values, dtype=float)


CABLE_STIFFNESS = EveryJoint(CABLE_STIFFNESS_FACTS, (LinearSpring, HardeningSpring))


LINKAGE_PHASES = tuple((np.pi / 4 * np.arange(-3, 5)).tolist())  # of a first look
GRAVITY_PROBES, GRAVITY_ROUNDING = 20, 1e-9  # random poses that show whether gravity acts
LINKAGE_RATIO, LINKAGE_RATIO_RANGE = 0.6, (0.05, 0.98)


@dataclass(frozen=True)
class SpringCompensator(LinearSpring):
    """stiffness (q - rest): a linear spring that carries gravity."""

    facts = GRAVITY_COMPENSATOR_FACTS
    form = "linear spring"
    identical = ("cable_stiffness",)
    second_name = True

    def first_name(self, coefficients: Array, scenes: Sequence[Scene]) -> Candidate:
        """Itself: it has its name already."""
        return self

    @classmethod
    def initial_shapes(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """One candidate, where gravity pulls at the joint."""
        return [cls.at(arm, joint)] if feels_gravity(arm, joint) else []


@dataclass(frozen=True)
class Compensator(Term):
    """A law of the joint's angle that should act against gravity.

    gravity: sine and cosine part of the model's gravity torque over this angle, N m; zeros where unknown.
    """

    facts = GRAVITY_COMPENSATOR_FACTS
    gravity: tuple[float, float] = (0.0, 0.0)

    def _wave(self, coefficients: Array) -> Array:
        """Sine and cosine part of the law, (2,)."""
        return coefficients

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """A law that adds to gravity instead of carrying it."""
        gravity = np.array(self.gravity)
        spread = 0.0
        if covariance is not None:
            slopes = np.array([self._wave(unit) @ gravity for unit in np.eye(len(coefficients))])
            spread = SIGN_SIGMAS * float(np.sqrt(max(slopes @ covariance @ slopes, 0.0)))
        adds = float(self._wave(coefficients) @ gravity) - spread
        return "adds to gravity instead of carrying it" if adds > 0 else None


@dataclass(frozen=True)
class SineCompensator(Compensator):
    """amplitude sin(q + phase): a counterweight, or an ideal spring over a linkage."""

    form = "sine"
    names = ("amplitude", "phase")
    size = 2

    @classmethod
    def initial_shapes(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """One candidate that knows which way gravity pulls."""
        return [cls.at(arm, joint, gravity=gravity_wave(scenes, joint))] if _turns_against_gravity(arm, joint) else []

    def columns(self, scene: Scene) -> Array:
        angle = scene.motion.position[:, self.own]
        return self._stacked(np.sin(angle), np.cos(angle))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        amplitude, phase = amplitude_and_phase(coefficients)
        return {"amplitude": amplitude, "phase": phase}

    def equation(self, coefficients: Array) -> str:
        amplitude, phase = amplitude_and_phase(coefficients)
        sign = "-" if phase < 0 else "+"
        return f"tau_{self.joint} += {format_number(amplitude)} sin(q_{self.joint} {sign} {format_number(abs(phase))})"

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        return cls.at(arm, joints[0]), sine_and_cosine(float(parameters["amplitude"]), float(parameters["phase"]))


@dataclass(frozen=True)
class LinkageCompensator(Compensator):
    """amplitude sin x + force sin x / sqrt(1 - ratio cos x), x = q + phase; shape: phase and ratio.

    A cylinder between two pins at distances a and b from the joint has the length sqrt(a2 + b2 - 2 a b cos x)
    and the lever a b sin x / length. The first term is a spring through zero length, the second a force that
    does not change: a gas cylinder, or a spring's preload. ratio is 2 a b / (a2 + b2).
    """

    form = "linkage"
    names = ("amplitude", "force", "phase", "ratio")
    size = 2

    @classmethod
    def initial_shapes(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """Pins all around, at one ratio of their distances."""
        if not _turns_against_gravity(arm, joint):
            return []
        bounds = ((-np.pi, np.pi), LINKAGE_RATIO_RANGE)
        first = cls.at(arm, joint, gravity=gravity_wave(scenes, joint), bounds=bounds)
        return [replace(first, shape=(phase, LINKAGE_RATIO)) for phase in LINKAGE_PHASES]

    def columns(self, scene: Scene) -> Array:
        """A spring of no length, and a constant force."""
        phase, ratio = self.shape
        angle = scene.motion.position[:, self.own] + phase
        return self._stacked(np.sin(angle), np.sin(angle) / np.sqrt(1 - ratio * np.cos(angle)))

    def _wave(self, coefficients: Array) -> Array:
        """Its direction: both terms pull along the sine."""
        return float(np.sum(coefficients)) * np.array([np.cos(self.shape[0]), np.sin(self.shape[0])])

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Torques of both terms, and the linkage."""
        phase, ratio = self.shape
        return {
            "amplitude": float(coefficients[0]),
            "force": float(coefficients[1]),
            "phase": phase,
            "ratio": ratio,
        }

    def unit(self, name: str) -> str:
        torque = "N.m" if self.kind == "revolute" else "N"
        return {"force": torque, "ratio": "1"}.get(name) or super().unit(name)

    def equation(self, coefficients: Array) -> str:
        phase, ratio = self.shape
        terms = format_sum((coefficients[0], ""), (coefficients[1], f"/ sqrt(1 - {format_number(ratio)} cos x)"))
        return f"tau_{self.joint} += ({terms}) sin x, x = q_{self.joint} + ({format_number(phase)})"

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        shape = (float(parameters["phase"]), float(parameters["ratio"]))
        linkage = cls.at(arm, joints[0], shape=shape, bounds=((-np.pi, np.pi), LINKAGE_RATIO_RANGE))
        return linkage, np.array([parameters["amplitude"], parameters["force"]], dtype=float)


def _turns_against_gravity(arm: Arm, joint: int) -> bool:
    """Whether a joint turns against gravity: along a sliding one gravity's lever does not wave."""
    return arm.joints[joint - 1].kind == "revolute" and feels_gravity(arm, joint)


def feels_gravity(arm: Arm, joint: int) -> bool:
    """Whether gravity can pull at a joint (from 1); at an upright first joint it cannot."""
    rng = np.random.default_rng(1)
    places, still = rng.uniform(-2, 2, (GRAVITY_PROBES, len(arm))), np.zeros((GRAVITY_PROBES, len(arm)))
    torque = rigid_body_torque(arm, Motion(places, still, still), rng.uniform(0, 1, 10 * len(arm)))
    return bool(np.abs(torque[:, joint - 1]).max() > GRAVITY_ROUNDING * np.linalg.norm(arm.gravity))


def gravity_wave(scenes: Sequence[Scene], joint: int) -> tuple[float, float]:
    """Sine and cosine part of the model's gravity torque over a joint's angle, by least squares, N m."""
    angles, torques = [], []
    for scene in scenes:
        position = scene.motion.position
        still = Motion(position, np.zeros_like(position), np.zeros_like(position))
        angles.append(position[:, joint - 1])
        torques.append(rigid_body_torque(scene.arm, still, scene.inertial)[:, joint - 1])
    angle = np.concatenate(angles)
    parts = np.column_stack([np.sin(angle), np.cos(angle), np.ones_like(angle)])
    sine, cosine, _ = np.linalg.lstsq(parts, np.concatenate(torques))[0].tolist()
    return sine, cosine


GRAVITY_COMPENSATOR = EveryJoint(GRAVITY_COMPENSATOR_FACTS, (SineCompensator, LinkageCompensator, SpringCompensator))
