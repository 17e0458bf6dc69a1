"""Friction that falls as slow motion gets faster (Stribeck 1902; the form of Bo and Pavelescu 1982)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from diagnosis.effects.contract import Scene, Value
from diagnosis.effects.direction import direction
from diagnosis.effects.term import CERTAIN, EveryJoint, Term, number, sum_of, top_speed
from problem.arm import Arm
from recordings.run import Array

OF_TOP_SPEED = (0.01, 0.03, 0.1)  # Stribeck velocities of a first look
SPEED_RANGE = (0.002, 0.3)  # of the top speed
EXPONENTS = (1.0, 2.0)  # Tustin's, and the Gaussian
EXPONENT_RANGE = (0.5, 2.5)


@dataclass(frozen=True)
class StribeckFriction(Term):
    """(level + (static_level - level) exp(-(|qd| / velocity)^exponent)) sgn(qd); shape: velocity, exponent."""

    effect = "stribeck_friction"
    names = ("level", "static_level", "velocity", "exponent")
    replaces = ("coulomb_friction",)

    @classmethod
    def first_looks(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """Velocities from a hundredth of the top speed up, with both usual exponents."""
        top = top_speed(scenes, joint)
        bounds = ((SPEED_RANGE[0] * top, SPEED_RANGE[1] * top), EXPONENT_RANGE)
        shapes = [(share * top, exponent) for share in OF_TOP_SPEED for exponent in EXPONENTS]
        return [cls.at(arm, joint, shape=shape, bounds=bounds) for shape in shapes]

    def columns(self, scene: Scene) -> Array:
        """Coulomb's column, and what static friction adds to it near rest."""
        velocity = scene.motion.velocity[:, self.own]
        side = direction(scene, self.own)
        return self._stacked(side, side * self._rise(velocity))

    def _rise(self, velocity: Array) -> Array:
        scale, exponent = self.shape
        return np.asarray(np.exp(-((np.abs(velocity) / scale) ** exponent)))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Both levels, velocity and exponent."""
        level, rise = (float(value) for value in coefficients)
        return {"level": level, "static_level": level + rise, "velocity": self.shape[0], "exponent": self.shape[1]}

    def equation(self, coefficients: Array) -> str:
        """The law with its numbers."""
        own, (scale, exponent) = self.joint, self.shape
        inner = f"exp(-(|qd_{own}|/{number(scale)})^{number(exponent)})"
        return f"tau_{own} += ({sum_of((coefficients[0], ''), (coefficients[1], inner))}) sgn(qd_{own})"

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """Friction that feeds energy in, or that rises from rest."""
        spread = 0.0 if covariance is None else CERTAIN * float(np.sqrt(max(covariance[1, 1], 0.0)))
        if coefficients[1] + spread < 0:
            return "static friction below sliding friction"
        return super().objection(coefficients, covariance)

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect with its four parameters."""
        level, static, scale, exponent = (float(parameters[name]) for name in cls.names)
        bounds = ((scale / 10, scale * 10), EXPONENT_RANGE)
        return cls.at(arm, joints[0], shape=(scale, exponent), bounds=bounds), np.array([level, static - level])


STRIBECK = EveryJoint("stribeck_friction", (StribeckFriction,))
