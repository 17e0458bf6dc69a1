"""Friction that differs by direction: levels, or slopes.

Levels by direction are Coulomb friction and an offset, exactly; the slopes are what only this effect has.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from diagnosis.effects.contract import Scene, Value
from diagnosis.effects.direction import sides
from diagnosis.effects.term import CERTAIN, EveryJoint, Term, sum_of
from problem.arm import Arm
from recordings.run import Array
from recordings.vocabulary import VISCOUS


@dataclass(frozen=True)
class ByDirection(Term):
    """positive |qd|^exponent where qd > 0, -negative |qd|^exponent where qd < 0."""

    effect = "asymmetric_friction"
    names = ("positive", "negative", "exponent")
    exponent: ClassVar[float]

    def columns(self, scene: Scene) -> Array:
        """The law forwards, and backwards."""
        if not self.exponent:
            return self._stacked(*sides(scene, self.own))
        velocity = scene.motion.velocity[:, self.own]
        return self._stacked(np.maximum(velocity, 0), np.minimum(velocity, 0))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """One value a direction; both positive where they brake."""
        return {"positive": float(coefficients[0]), "negative": float(coefficients[1]), "exponent": self.exponent}

    def unit(self, name: str) -> str:
        """Unit of a level or a slope."""
        if name == "exponent":
            return "1"
        unit = super().unit(name)
        return f"{unit}.s/{'rad' if self.kind == 'revolute' else 'm'}" if self.exponent else unit

    def equation(self, coefficients: Array) -> str:
        """The law with its numbers."""
        what = f"|qd_{self.joint}|" if self.exponent else ""
        forwards, backwards = sum_of((coefficients[0], what)), sum_of((-coefficients[1], what))
        return f"tau_{self.joint} += {forwards} for qd_{self.joint} > 0, {backwards} for qd_{self.joint} < 0"

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """A direction in which it drives."""
        spread = np.zeros(2) if covariance is None else CERTAIN * np.sqrt(np.maximum(np.diag(covariance), 0))
        # an offset of the sensor may exceed friction one way: only a loop that gains energy is impossible
        loop = 0.0 if covariance is None else CERTAIN * float(np.sqrt(max(covariance.sum(), 0.0)))
        if coefficients.sum() + loop < 0:
            return "friction that drives over a loop"
        if self.exponent and np.any(coefficients + spread < 0):
            return "friction that drives in one direction"
        return None

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect with a value a direction; levels or slopes, as the exponent says."""
        form = Levels if float(parameters["exponent"]) == 0 else Slopes
        if form.exponent != float(parameters["exponent"]):
            raise ValueError(f"exponent of asymmetric_friction should be 0 or 1, not {parameters['exponent']}")
        chosen: Any = form.at(arm, joints[0])
        return chosen, np.array([parameters["positive"], parameters["negative"]], dtype=float)


@dataclass(frozen=True)
class Slopes(ByDirection):
    """Viscous friction by direction."""

    form = "slopes"
    exponent = 1.0
    replaces = ("viscous_friction",)


@dataclass(frozen=True)
class Levels(ByDirection):
    """Coulomb friction by direction."""

    form = "levels"
    exponent = 0.0
    replaces = ("coulomb_friction", "torque_offset")


@dataclass(frozen=True)
class LevelsAndSlopes(Term):
    """positive + positive_slope qd where qd > 0, -negative + negative_slope qd where qd < 0."""

    effect = "asymmetric_friction"
    form = "levels and slopes"
    names = ("positive", "negative", "positive_slope", "negative_slope")
    replaces = ("coulomb_friction", "viscous_friction", "torque_offset")

    def columns(self, scene: Scene) -> Array:
        """Both laws forwards and backwards."""
        velocity = scene.motion.velocity[:, self.own]
        forwards, backwards = np.maximum(velocity, 0), np.minimum(velocity, 0)
        return self._stacked(*sides(scene, self.own), forwards, backwards)

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """A level and a slope each direction; positive where they brake."""
        return dict(zip(self.names, coefficients.tolist(), strict=True))

    def unit(self, name: str) -> str:
        """Unit of a level or a slope."""
        if name.endswith("slope"):
            return VISCOUS.unit_for(self.kind)
        return super().unit(name)

    def equation(self, coefficients: Array) -> str:
        """The law with its numbers."""
        own = f"qd_{self.joint}"
        forwards = sum_of((coefficients[0], ""), (coefficients[2], own))
        backwards = sum_of((-coefficients[1], ""), (coefficients[3], own))
        return f"tau_{self.joint} += {forwards} for {own} > 0, {backwards} for {own} < 0"

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """A loop that gains energy at low speed, or at high."""
        for place in (slice(0, 2), slice(2, 4)):
            block = None if covariance is None else covariance[place, place]
            spread = 0.0 if block is None else CERTAIN * float(np.sqrt(max(float(block.sum()), 0.0)))
            if coefficients[place].sum() + spread < 0:
                return "friction that drives over a loop"
        return None

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect with its four parameters."""
        return cls.at(arm, joints[0]), np.array([float(parameters[name]) for name in cls.names])


ASYMMETRIC = EveryJoint("asymmetric_friction", (Levels, Slopes, LevelsAndSlopes))
