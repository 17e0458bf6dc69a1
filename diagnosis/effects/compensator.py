"""What carries a part of gravity: springs, counterweights, linkages, gas cylinders."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from diagnosis.effects.contract import Scene, Value
from diagnosis.effects.ripple import unwave, wave
from diagnosis.effects.spring import LinearSpring
from diagnosis.effects.term import CERTAIN, EveryJoint, Term, number, sum_of
from problem.arm import Arm
from problem.motion import Motion
from problem.regressor import rigid_body_torque
from recordings.run import Array

PHASES = tuple((np.pi / 4 * np.arange(-3, 5)).tolist())  # of a first look
PROBES, ROUNDING = 20, 1e-9  # random poses that show whether gravity acts
RATIO, RATIO_RANGE = 0.6, (0.05, 0.98)


@dataclass(frozen=True)
class SpringCompensator(LinearSpring):
    """A linear spring."""

    effect = "gravity_compensator"
    form = "linear spring"

    @classmethod
    def first_looks(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """One candidate, where gravity pulls at the joint."""
        return [cls.at(arm, joint)] if feels_gravity(arm, joint) else []


@dataclass(frozen=True)
class Compensator(Term):
    """A law of the joint's angle that should act against gravity.

    gravity: sine and cosine part of the model's gravity torque over this angle, N m; zeros where unknown.
    """

    effect = "gravity_compensator"
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
            spread = CERTAIN * float(np.sqrt(max(slopes @ covariance @ slopes, 0.0)))
        adds = float(self._wave(coefficients) @ gravity) - spread
        return "adds to gravity instead of carrying it" if adds > 0 else None


@dataclass(frozen=True)
class SineCompensator(Compensator):
    """amplitude sin(q + phase): a counterweight, or an ideal spring over a linkage."""

    form = "sine"
    names = ("amplitude", "phase")

    @classmethod
    def first_looks(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """One candidate that knows which way gravity pulls."""
        return [cls.at(arm, joint, gravity=gravity_wave(scenes, joint))] if _turns(arm, joint) else []

    def columns(self, scene: Scene) -> Array:
        """Sine and cosine."""
        angle = scene.motion.position[:, self.own]
        return self._stacked(np.sin(angle), np.cos(angle))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Amplitude and phase."""
        amplitude, phase = wave(coefficients)
        return {"amplitude": amplitude, "phase": phase}

    def equation(self, coefficients: Array) -> str:
        """The law with its numbers."""
        amplitude, phase = wave(coefficients)
        sign = "-" if phase < 0 else "+"
        return f"tau_{self.joint} += {number(amplitude)} sin(q_{self.joint} {sign} {number(abs(phase))})"

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect with amplitude and phase."""
        return cls.at(arm, joints[0]), unwave(float(parameters["amplitude"]), float(parameters["phase"]))


@dataclass(frozen=True)
class LinkageCompensator(Compensator):
    """amplitude sin x + force sin x / sqrt(1 - ratio cos x), x = q + phase; shape: phase and ratio.

    A cylinder between two pins at distances a and b from the joint has the length sqrt(a2 + b2 - 2 a b cos x)
    and the lever a b sin x / length. The first term is a spring through zero length, the second a force that
    does not change: a gas cylinder, or a spring's preload. ratio is 2 a b / (a2 + b2).
    """

    form = "linkage"
    names = ("amplitude", "force", "phase", "ratio")

    @classmethod
    def first_looks(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """Pins all around, at one ratio of their distances."""
        if not _turns(arm, joint):
            return []
        bounds = ((-np.pi, np.pi), RATIO_RANGE)
        first = cls.at(arm, joint, gravity=gravity_wave(scenes, joint), bounds=bounds)
        return [replace(first, shape=(phase, RATIO)) for phase in PHASES]

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
        """Unit of a parameter."""
        torque = "N.m" if self.kind == "revolute" else "N"
        return {"force": torque, "ratio": "1"}.get(name) or super().unit(name)

    def equation(self, coefficients: Array) -> str:
        """The law with its numbers."""
        phase, ratio = self.shape
        terms = sum_of((coefficients[0], ""), (coefficients[1], f"/ sqrt(1 - {number(ratio)} cos x)"))
        return f"tau_{self.joint} += ({terms}) sin x, x = q_{self.joint} + ({number(phase)})"

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect with its four parameters."""
        shape = (float(parameters["phase"]), float(parameters["ratio"]))
        linkage = cls.at(arm, joints[0], shape=shape, bounds=((-np.pi, np.pi), RATIO_RANGE))
        return linkage, np.array([parameters["amplitude"], parameters["force"]], dtype=float)


def _turns(arm: Arm, joint: int) -> bool:
    """Whether a joint turns against gravity: along a sliding one gravity's lever does not wave."""
    return arm.joints[joint - 1].kind == "revolute" and feels_gravity(arm, joint)


def feels_gravity(arm: Arm, joint: int) -> bool:
    """Whether gravity can pull at a joint (from 1); at an upright first joint it cannot."""
    rng = np.random.default_rng(1)
    places, still = rng.uniform(-2, 2, (PROBES, len(arm))), np.zeros((PROBES, len(arm)))
    torque = rigid_body_torque(arm, Motion(places, still, still), rng.uniform(0, 1, 10 * len(arm)))
    return bool(np.abs(torque[:, joint - 1]).max() > ROUNDING * np.linalg.norm(arm.gravity))


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


GRAVITY_COMPENSATOR = EveryJoint("gravity_compensator", (SineCompensator, LinkageCompensator, SpringCompensator))
