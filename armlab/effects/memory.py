"""Friction with a memory: hysteresis after a reversal (Dahl 1968, LuGre 1995), and drift as the joint warms."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from scipy.linalg.lapack import dtbtrs

from armlab.common.arrays import Array
from armlab.common.dahl import dahl_state
from armlab.common.linear_filter import LinearFilter
from armlab.effects.contract import (
    ANGLE,
    COULOMB_LEVEL,
    STIFFNESS,
    TORQUE,
    Candidate,
    Effect,
    Parameter,
    Range,
    Scene,
    Value,
)
from armlab.effects.friction import (
    PARTS_PER_SAMPLE,
    STRIBECK_FACTS,
    STRIBECK_SPEED_RANGE,
    STRIBECK_SPEEDS,
    direction_of_motion,
    mean_within_samples,
    positions_within_samples,
)
from armlab.effects.term import (
    EveryJoint,
    Term,
    TermFamily,
    format_less,
    format_number,
    joint_moves,
    top_speed,
)
from problem.arm import Arm

WARMING_TIMES_SEEN = Range(
    (30.0, 2e4),
    "windings of small motors warm in half a minute, gears in up to hours (Bittencourt and Gunnarsson 2012)",
)

PRESLIDING_FACTS = Effect(
    "presliding_hysteresis",
    "friction that follows the way since a reversal",
    (COULOMB_LEVEL, STIFFNESS),
    law=(
        r"\Delta\tau_j = \text{level} \; z, \quad \frac{dz}{dq_j} = \frac{\text{stiffness}}{\text{level}} \, "
        r"(1 - z \operatorname{sgn} \dot{q}_j)"
    ),
    dissipates=True,
    sticks=True,
    contains=("coulomb_friction", "viscous_friction"),
    one_of="friction laws",
    axis="velocity",
    experiment="record micro-motions about zero velocity, smaller than the presliding range",
)
FRICTION_DRIFT_FACTS = Effect(
    "friction_drift",
    "viscous friction that changes as the joint warms",
    (
        Parameter("initial", f"{TORQUE}.s/{ANGLE}", positive=True),
        Parameter("final", f"{TORQUE}.s/{ANGLE}", positive=True, detail=True),
        Parameter("time_constant", "s", positive=True, plausible=WARMING_TIMES_SEEN, detail=True),
    ),
    law=(
        r"\Delta\tau_j = \left( \text{initial} + (\text{final} - \text{initial}) (1 - e^{-t / \text{time "
        r"constant}}) \right) \dot{q}_j"
    ),
    dissipates=True,
    contains=("coulomb_friction", "viscous_friction"),
    axis="time",
    experiment="record the same loop cold and after half an hour of motion",
)

PRESLIDING_WAYS = (
    1e-3,
    4e-3,
    1.6e-2,
    6e-2,
)  # of the joint's travel: the way over which friction turns, for a first look
PRESLIDING_WAY_RANGE = (2e-4, 0.2)
STATIC_RATIO, STATIC_RATIO_RANGE = 1.4, (1.0, 4.0)  # static over sliding friction


@dataclass(frozen=True)
class DahlFriction(Term):
    """level z with dz/dq = (stiffness / level) (1 - z sgn(qd)); shape: the way level / stiffness, rad (m)."""

    facts = PRESLIDING_FACTS
    form = "Dahl"
    names = ("level", "stiffness")
    of_time = True

    @classmethod
    def initial_shapes(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """Ways from a thousandth of the joint's travel up."""
        travel = max(float(np.ptp(scene.motion.position[:, joint - 1])) for scene in scenes)
        bounds = ((PRESLIDING_WAY_RANGE[0] * travel, PRESLIDING_WAY_RANGE[1] * travel),)
        return [cls.at(arm, joint, shape=(share * travel,), bounds=bounds) for share in PRESLIDING_WAYS]

    def columns(self, scene: Scene) -> Array:
        return self._stacked(mean_within_samples(dahl_state(positions_within_samples(scene, self.own), self.shape[0])))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Sliding level, and stiffness at a reversal from rest."""
        level = float(coefficients[0])
        return {"level": level, "stiffness": level / self.shape[0]}

    def equation(self, coefficients: Array) -> str:
        own = self.joint
        level, way = format_number(coefficients[0]), format_number(self.shape[0])
        return f"tau_{own} += {level} z, dz/dq_{own} = (1 - z sgn(qd_{own}))/{way}"

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        level = float(parameters["level"])
        way = level / float(parameters["stiffness"])
        return cls.at(arm, joints[0], shape=(way,), bounds=((way / 10, way * 10),)), np.array([level])


@dataclass(frozen=True)
class LuGreFriction(Term):
    """level z with dz/d|q| = (sgn(qd) - z / h) / way, h = 1 + (ratio - 1) exp(-(qd / velocity)^2).

    shape: the way level / stiffness, rad (m); the static over the sliding level; Stribeck's velocity, rad/s (m/s).
    """

    facts = PRESLIDING_FACTS
    form = "LuGre"
    names = ("level", "stiffness", "static_level", "velocity")
    of_time = True

    @classmethod
    def initial_shapes(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """Short and longer ways with slow and faster Stribeck velocities."""
        travel = max(float(np.ptp(scene.motion.position[:, joint - 1])) for scene in scenes)
        top = top_speed(scenes, joint)
        ways = tuple(travel * x for x in PRESLIDING_WAY_RANGE)
        speeds = tuple(top * x for x in STRIBECK_SPEED_RANGE)
        shapes = [
            (way * travel, STATIC_RATIO, share * top) for way in PRESLIDING_WAYS[:3] for share in STRIBECK_SPEEDS[1:]
        ]
        return [cls.at(arm, joint, shape=shape, bounds=(ways, STATIC_RATIO_RANGE, speeds)) for shape in shapes]

    def columns(self, scene: Scene) -> Array:
        way, ratio, slow = self.shape
        velocity = scene.motion.velocity[:, self.own]
        curve = 1 + (ratio - 1) * np.exp(-((velocity / slow) ** 2))
        return self._stacked(
            mean_within_samples(
                lugre_state(positions_within_samples(scene, self.own), np.repeat(curve, PARTS_PER_SAMPLE), way)
            )
        )

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Both levels, the stiffness at a reversal, and Stribeck's velocity."""
        level, (way, ratio, slow) = float(coefficients[0]), self.shape
        return {"level": level, "stiffness": level / way, "static_level": ratio * level, "velocity": slow}

    def unit(self, name: str) -> str:
        """Unit of a parameter; what Stribeck friction has, too, has the unit that it has there."""
        if name in ("static_level", "velocity"):
            return STRIBECK_FACTS.parameter(name).unit_for(self.kind)
        return super().unit(name)

    def equation(self, coefficients: Array) -> str:
        own, (way, ratio, slow) = self.joint, self.shape
        curve = f"1 + {format_number(ratio - 1)} exp(-(qd_{own}/{format_number(slow)})^2)"
        level = format_number(coefficients[0])
        return f"tau_{own} += {level} z, dz/d|q_{own}| = (sgn(qd_{own}) - z/({curve}))/{format_number(way)}"

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        level, stiffness, static, slow = (float(parameters[name]) for name in cls.names)
        way = level / stiffness
        bounds = ((way / 10, way * 10), STATIC_RATIO_RANGE, (slow / 10, slow * 10))
        return cls.at(arm, joints[0], shape=(way, static / level, slow), bounds=bounds), np.array([level])


def lugre_state(position: Array, curve: Array, way: float) -> Array:
    """Solution of dz/d|q| = (sgn(dq) - z / curve) / way along positions, from z = 0; curve: (samples,).

    Exact while the curve holds from sample to sample.
    """
    steps = np.diff(position, prepend=position[0])
    between = np.append(curve[0], (curve[1:] + curve[:-1]) / 2)
    decay = np.exp(-np.abs(steps) / (way * between))
    bands = np.vstack([np.ones(len(decay)), np.append(-decay[1:], 0.0)])  # z_k - decay_k z_(k-1) = input_k, all at once
    solved, _ = dtbtrs(bands, (np.sign(steps) * between * (1 - decay))[:, None], uplo="L")
    return np.asarray(solved[:, 0])


PRESLIDING = EveryJoint(PRESLIDING_FACTS, (DahlFriction, LuGreFriction))


@dataclass(frozen=True)
class Drift(Term):
    """(initial + (final - initial) w) f(qd), w from 0 cold to 1 warm; f: qd for viscous friction, else sgn qd.

    shape: the time constant, s. began: seconds of motion before each run, by name; a run that is not among
    them follows the others. Empty where each run begins cold.
    """

    facts = FRICTION_DRIFT_FACTS
    names: ClassVar[tuple[str, ...]] = ("initial", "final", "time_constant")
    of_time = True
    size = 2
    coulomb: ClassVar[bool] = False
    began: tuple[tuple[str, float], ...] = ()

    def warmth(self, scene: Scene) -> Array:
        """How far the joint has warmed, (samples,)."""
        before = dict(self.began).get(scene.run, max((seconds for _, seconds in self.began), default=0.0))
        return np.asarray(1 - np.exp(-(scene.time + before) / self.shape[0]))

    def columns(self, scene: Scene) -> Array:
        """Friction, and how it has changed."""
        friction = direction_of_motion(scene, self.own) if self.coulomb else scene.motion.velocity[:, self.own]
        return self._stacked(friction, friction * self.warmth(scene))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Cold and warm friction, and the time constant."""
        cold, change = (float(value) for value in coefficients)
        return {"initial": cold, "final": cold + change, **dict(zip(("time_constant",), self.shape, strict=False))}

    def unit(self, name: str) -> str:
        if self.coulomb and name in ("initial", "final"):
            return "N.m" if self.kind == "revolute" else "N"
        return super().unit(name)

    def equation(self, coefficients: Array) -> str:
        own = self.joint
        friction = f"sgn(qd_{own})" if self.coulomb else f"qd_{own}"
        cold, change = format_number(coefficients[0]), format_number(abs(coefficients[1]))
        sign = "-" if coefficients[1] < 0 else "+"
        return f"tau_{own} += ({cold} {sign} {change} {self._warming()}) {friction}"

    def _warming(self) -> str:
        return f"(1 - exp(-t/{format_number(self.shape[0])}))"

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect with its parameters, for runs that begin cold."""
        constant = float(parameters["time_constant"])
        own = {"power": float(parameters["power"])} if "power" in cls.names else {}
        effect = cls.at(arm, joints[0], shape=(constant,), bounds=((constant / 10, constant * 10),), **own)
        return effect, cold_and_change(parameters)


@dataclass(frozen=True)
class ViscousDrift(Drift):
    """(initial + (final - initial) w) qd, w = 1 - exp(-t / time_constant)."""

    form = "viscous over time"
    replaces = ("viscous_friction",)


@dataclass(frozen=True)
class CoulombDrift(Drift):
    """(initial + (final - initial) w) sgn(qd), w = 1 - exp(-t / time_constant)."""

    form = "Coulomb over time"
    coulomb = True
    replaces = ("coulomb_friction",)


def cold_and_change(parameters: Mapping[str, Any]) -> Array:
    """Coefficients of cold and warm friction."""
    cold, warm = float(parameters["initial"]), float(parameters["final"])
    return np.array([cold, warm - cold])


@dataclass(frozen=True)
class HeatedFriction(Drift):
    """Viscous friction that follows the power which velocity dissipates, through a first order lag.

    power: mean of the squared speed over the recording, (rad/s)^2, at which w ends up at 1.
    """

    form = "viscous over heat"
    names = ("initial", "final", "time_constant", "power")
    replaces = ("viscous_friction",)
    power: float = 1.0

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Cold and warm friction, the time constant, and the power that keeps it warm."""
        return {**super().parameters(coefficients), "power": self.power}

    def unit(self, name: str) -> str:
        speed = "rad" if self.kind == "revolute" else "m"
        return f"{speed}2/s2" if name == "power" else super().unit(name)

    def warmth(self, scene: Scene) -> Array:
        """Lagged power, from the heat that earlier runs have left, at their mean power."""
        decay = float(np.exp(-scene.step / self.shape[0]))
        power = scene.motion.velocity[:, self.own] ** 2 / self.power
        between = np.append(power[0], (power[1:] + power[:-1]) / 2)
        before = dict(self.began).get(scene.run, max((seconds for _, seconds in self.began), default=0.0))
        start = 1 - np.exp(-before / self.shape[0])
        return LinearFilter.first_order_lag(decay).forwards(between, np.array([[decay * start, 0.0]]))

    def _warming(self) -> str:
        return f"w, {format_number(self.shape[0])} dw/dt = qd_{self.joint}^2/{format_number(self.power)} - w"


@dataclass(frozen=True)
class ThermometerFriction(Drift):
    """Viscous friction that follows a thermometer; sensor: from 0. span: lowest and highest temperature."""

    form = "viscous over temperature"
    names = ("initial", "final", "sensor", "coldest", "warmest")
    replaces = ("viscous_friction",)
    sensor: int = 0
    span: tuple[float, float] = (20.0, 40.0)

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Friction at both ends of the span, and which thermometer shows it (from 1)."""
        levels = super().parameters(coefficients)
        return levels | {"sensor": float(self.sensor + 1), "coldest": self.span[0], "warmest": self.span[1]}

    def unit(self, name: str) -> str:
        return {"sensor": "1", "coldest": "degC", "warmest": "degC"}.get(name) or super().unit(name)

    def warmth(self, scene: Scene) -> Array:
        """Where the temperature stands in its span; zero in a run without thermometer."""
        if scene.temperature is None:
            return np.zeros(len(scene.time))
        low, high = self.span
        return np.asarray((scene.temperature[:, self.sensor] - low) / (high - low))

    def _warming(self) -> str:
        low, high = self.span
        return f"({format_less('T', low)})/{format_number(high - low)}"

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        span = (float(parameters["coldest"]), float(parameters["warmest"]))
        return cls.at(arm, joints[0], sensor=int(parameters["sensor"]) - 1, span=span), cold_and_change(parameters)


DRIFT_TIMES = (0.1, 0.3, 1.0)  # time constants of a first look
DRIFT_TIME_RANGE = (0.02, 3.0)  # of the whole recording
DRIFT_FORMS = (ViscousDrift, CoulombDrift, HeatedFriction, ThermometerFriction)


@dataclass(frozen=True)
class DriftFamily(TermFamily):
    """Drift by time and heat at each joint, runs cold or following one another; by temperature where recorded."""

    facts: Effect = FRICTION_DRIFT_FACTS
    terms: tuple[type[Term], ...] = DRIFT_FORMS

    def candidates(self, arm: Arm, scenes: Sequence[Scene]) -> list[list[Candidate]]:
        """Several forms a joint."""
        clocks = dict.fromkeys([(), _run_starts(scenes)])
        total = sum(float(scene.time[-1]) for scene in scenes)
        found: list[list[Candidate]] = []
        for joint in (joint for joint in range(1, len(arm) + 1) if joint_moves(scenes, joint)):
            power = float(np.mean([np.mean(scene.motion.velocity[:, joint - 1] ** 2) for scene in scenes]))
            for clock in clocks:
                details = {"bounds": ((DRIFT_TIME_RANGE[0] * total, DRIFT_TIME_RANGE[1] * total),), "began": clock}
                for form, more in ((ViscousDrift, {}), (CoulombDrift, {}), (HeatedFriction, {"power": power})):
                    found.append([form.at(arm, joint, shape=(x * total,), **details, **more) for x in DRIFT_TIMES])
            found += _thermometer_candidates(arm, joint, scenes)
        return found


def _run_starts(scenes: Sequence[Scene]) -> tuple[tuple[str, float], ...]:
    """Seconds before each run, and before one that comes after them; empty for a single run.

    As they are stamped; where stamps overlap, one after the other in the order of their names.
    """
    if len(scenes) == 1:
        return ()
    in_turn = sorted(scenes, key=lambda scene: scene.start)
    starts = [scene.start for scene in in_turn]
    lengths = [float(scene.time[-1] + scene.step) for scene in in_turn]
    if any(after < start + length for start, length, after in zip(starts, lengths, starts[1:], strict=False)):
        in_turn = sorted(scenes, key=lambda scene: _by_number(scene.run))
        lengths = [float(scene.time[-1] + scene.step) for scene in in_turn]
        starts = np.cumsum([0.0, *lengths[:-1]]).tolist()
    names, starts = [*(scene.run for scene in in_turn), ""], [*starts, starts[-1] + lengths[-1]]
    return tuple((name, start - starts[0]) for name, start in zip(names, starts, strict=True))


def _by_number(name: str) -> list[tuple[int, str]]:
    """A key that sorts `run-2` before `run-10`."""
    return [(int(part), "") if part.isdigit() else (0, part) for part in re.split(r"(\d+)", name)]


def _thermometer_candidates(arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[list[Candidate]]:
    """One candidate for each thermometer that changes; every run needs them."""
    channels = [scene.temperature for scene in scenes if scene.temperature is not None]
    if len(channels) < len(scenes):
        return []
    lows = np.array([np.nanmin(each, axis=0) for each in channels])
    highs = np.array([np.nanmax(each, axis=0) for each in channels])
    spans = zip(lows.min(axis=0).tolist(), highs.max(axis=0).tolist(), strict=True)
    return [
        [ThermometerFriction.at(arm, joint, sensor=sensor, span=(low, high))]
        for sensor, (low, high) in enumerate(spans)
        if high > low
    ]


FRICTION_DRIFT = DriftFamily()
