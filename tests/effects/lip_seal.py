"""An effect as a package of somebody else would have it: registered by an entry point, unknown to armlab."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from armlab.common.arrays import Array
from armlab.effects.contract import TORQUE, Effect, Parameter, Scene, Value
from armlab.effects.friction import direction_of_motion
from armlab.effects.term import EveryJoint, Term, format_number
from problem.arm import Arm

FILM_SPEED = 0.5  # rad/s: below it the film of oil carries the seal

LIP_SEAL_FACTS = Effect(
    "lip_seal_friction",
    "friction of a seal that a film of oil carries at low speed",
    (Parameter("level", TORQUE, positive=True),),
    title="lip-seal friction",
    dissipates=True,
    contains=("coulomb_friction", "viscous_friction"),
    one_of="friction laws",
    axis="velocity",
    experiment="record slow motion with the seal in place and without it",
)


@dataclass(frozen=True)
class LipSealFriction(Term):
    """level qd^2 / (qd^2 + FILM_SPEED^2) sgn(qd)."""

    facts = LIP_SEAL_FACTS
    names = ("level",)

    def columns(self, scene: Scene) -> Array:
        square = scene.motion.velocity[:, self.own] ** 2
        return self._stacked(square / (square + FILM_SPEED**2) * direction_of_motion(scene, self.own))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        return {"level": float(coefficients[0])}

    def equation(self, coefficients: Array) -> str:
        speed = f"qd_{self.joint}"
        share = f"{speed}^2 / ({speed}^2 + {FILM_SPEED}^2)"
        return f"tau_{self.joint} += {format_number(coefficients[0])} {share} sgn({speed})"

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        return cls.at(arm, joints[0]), np.array([parameters["level"]])


LIP_SEAL = EveryJoint(LIP_SEAL_FACTS, (LipSealFriction,))
