"""An effect as a package of somebody else would have it: registered by an entry point, unknown to armlab."""

from dataclasses import dataclass

from armlab.common.arrays import Array
from armlab.effects.contract import TORQUE, Effect, Parameter, Scene
from armlab.effects.friction import direction_of_motion
from armlab.effects.term import EveryJoint, Term, format_number

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

    def equation(self, coefficients: Array) -> str:
        speed = f"qd_{self.joint}"
        share = f"{speed}^2 / ({speed}^2 + {FILM_SPEED}^2)"
        return f"tau_{self.joint} += {format_number(coefficients[0])} {share} sgn({speed})"


LIP_SEAL = EveryJoint(LIP_SEAL_FACTS, (LipSealFriction,))
