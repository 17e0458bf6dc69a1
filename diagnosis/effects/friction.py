"""Friction that depends on the present velocity alone: Coulomb, viscous, and powers of velocity."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from diagnosis.effects.contract import Scene, Value
from diagnosis.effects.direction import direction
from diagnosis.effects.term import EveryJoint, Term, number
from problem.arm import Arm
from recordings.run import Array

EXPONENTS = (0.3, 0.5, 0.7, 1.5, 2.0, 3.0)
EXPONENT_RANGE = (0.25, 4.0)


@dataclass(frozen=True)
class CoulombFriction(Term):
    """level sgn(qd)."""

    effect = "coulomb_friction"
    names = ("level",)

    def columns(self, scene: Scene) -> Array:
        """The direction of motion."""
        return self._stacked(direction(scene, self.own))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """The level."""
        return {"level": float(coefficients[0])}

    def equation(self, coefficients: Array) -> str:
        """The law with its number."""
        return f"tau_{self.joint} += {number(coefficients[0])} sgn(qd_{self.joint})"

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect with a level."""
        return cls.at(arm, joints[0]), np.array([parameters["level"]])


@dataclass(frozen=True)
class ViscousFriction(Term):
    """coefficient qd."""

    effect = "viscous_friction"
    names = ("coefficient",)

    def columns(self, scene: Scene) -> Array:
        """The velocity."""
        return self._stacked(scene.motion.velocity[:, self.own])

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """The coefficient."""
        return {"coefficient": float(coefficients[0])}

    def equation(self, coefficients: Array) -> str:
        """The law with its number."""
        return f"tau_{self.joint} += {number(coefficients[0])} qd_{self.joint}"

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect with a coefficient."""
        return cls.at(arm, joints[0]), np.array([parameters["coefficient"]])


@dataclass(frozen=True)
class PowerFriction(Term):
    """coefficient |qd|^exponent sgn(qd); shape: the exponent."""

    effect = "nonlinear_viscous_friction"
    names = ("coefficient", "exponent")

    @classmethod
    def first_looks(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """Root, quadratic and cubic friction, and between."""
        return [cls.at(arm, joint, shape=(exponent,), bounds=(EXPONENT_RANGE,)) for exponent in EXPONENTS]

    def columns(self, scene: Scene) -> Array:
        """The power of velocity with its sign."""
        return self._stacked(power(scene.motion.velocity[:, self.own], self.shape[0]))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Coefficient and exponent."""
        return {"coefficient": float(coefficients[0]), "exponent": self.shape[0]}

    def equation(self, coefficients: Array) -> str:
        """The law with its numbers."""
        own = self.joint
        return f"tau_{own} += {number(coefficients[0])} |qd_{own}|^{number(self.shape[0])} sgn(qd_{own})"

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect with a coefficient and an exponent."""
        shape = (float(parameters["exponent"]),)
        return cls.at(arm, joints[0], shape=shape, bounds=(EXPONENT_RANGE,)), np.array([parameters["coefficient"]])


def power(velocity: Array, exponent: float) -> Array:
    """|velocity|^exponent with the sign of velocity."""
    return np.asarray(np.sign(velocity) * np.abs(velocity) ** exponent)


COULOMB = EveryJoint("coulomb_friction", (CoulombFriction,))
VISCOUS = EveryJoint("viscous_friction", (ViscousFriction,))
NONLINEAR_VISCOUS = EveryJoint("nonlinear_viscous_friction", (PowerFriction,))
