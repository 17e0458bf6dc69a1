"""Friction that grows with the torque that the gear transmits."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from diagnosis.effects.contract import Scene, Value
from diagnosis.effects.direction import direction
from diagnosis.effects.term import EveryJoint, Term, number
from problem.arm import Arm
from recordings.run import Array


@dataclass(frozen=True)
class LoadFriction(Term):
    """coefficient |tau_rigid| sgn(qd): the load is what the links need, from the model, never measured."""

    effect = "load_dependent_friction"
    names = ("coefficient",)
    follows_model = True

    def columns(self, scene: Scene) -> Array:
        """The load with the sign of motion."""
        load = np.abs(scene.rigid_torque[:, self.own])
        return self._stacked(load * direction(scene, self.own))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """The coefficient."""
        return {"coefficient": float(coefficients[0])}

    def equation(self, coefficients: Array) -> str:
        """The law with its number."""
        own = self.joint
        return f"tau_{own} += {number(coefficients[0])} |tau_rigid_{own}| sgn(qd_{own})"

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect with a coefficient."""
        return cls.at(arm, joints[0]), np.array([parameters["coefficient"]])


LOAD_DEPENDENT = EveryJoint("load_dependent_friction", (LoadFriction,))
