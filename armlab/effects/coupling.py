"""Torque from the motion of another joint, as motors that turn with two wrist joints have it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import permutations
from typing import Any, ClassVar, Self

import numpy as np

from armlab.common.arrays import Array
from armlab.effects.contract import (
    COULOMB_LEVEL,
    INERTIA,
    VISCOUS_COEFFICIENT,
    Candidate,
    Effect,
    Parameter,
    Scene,
)
from armlab.effects.friction import direction_of_motion
from armlab.effects.term import Term, TermFamily, format_sum, joint_moves
from problem.arm import Arm

JOINT_COUPLING_FACTS = Effect(
    "joint_coupling",
    "torque from the motion of another joint",
    (replace(VISCOUS_COEFFICIENT, detail=True), replace(COULOMB_LEVEL, detail=True), Parameter("inertia", INERTIA)),
    law=(
        r"\Delta\tau_j = \text{coefficient} \; \dot{q}_k + \text{level} \; \operatorname{sgn}(\dot{q}_k + \dot "
        r"q_j) + \text{inertia} \; \ddot{q}_k"
    ),
    where="coupling",
    axis="velocity",
    experiment="move the driving joint alone while the other one rests",
)

WRIST_JOINTS = 3  # joints whose drives may go through one another


@dataclass(frozen=True)
class JointCoupling(Term):
    """coefficient qd_k + level sgn(qd_k + qd_j) + inertia qdd_k: at joint j, from joint k.

    A motor that turns with both joints has its Coulomb friction in the direction of their sum. Where it is the other
    joint's own friction, of which gears carry a share over, it has that joint's direction. with_own: which of these.
    """

    facts = JOINT_COUPLING_FACTS
    names: ClassVar[tuple[str, ...]] = ("coefficient", "level", "inertia")
    with_own: ClassVar[bool] = True

    @classmethod
    def at(cls, arm: Arm, joint: int, **details: Any) -> Self:
        """The effect at a joint from the next one (the one before, at the last joint)."""
        return cls.between(arm, joint, joint + 1 if joint < len(arm) else joint - 1, **details)

    @classmethod
    def between(cls, arm: Arm, joint: int, driver: int, **details: Any) -> Self:
        """The effect at a joint from another one, both from 1."""
        return cls(joint, (joint, driver), (joint - 1,), arm.joints[joint - 1].kind, **details)

    def _parts(self, scene: Scene) -> dict[str, Array]:
        own, other = (joint - 1 for joint in self.joints)
        velocity = scene.motion.velocity
        return {
            "coefficient": velocity[:, other],
            "level": direction_of_motion(scene, other, own) if self.with_own else direction_of_motion(scene, other),
            "inertia": scene.motion.acceleration[:, other],
        }

    def columns(self, scene: Scene) -> Array:
        parts = self._parts(scene)
        return self._stacked(*(parts[name] for name in self.names))

    @property
    def size(self) -> int:
        return len(self.names)

    def equation(self, coefficients: Array) -> str:
        own, other = self.joints
        side = f"sgn(qd_{other} + qd_{own})" if self.with_own else f"sgn(qd_{other})"
        texts = {"coefficient": f"qd_{other}", "level": side, "inertia": f"qdd_{other}"}
        terms = ((value, texts[name]) for name, value in zip(self.names, coefficients.tolist(), strict=True))
        return f"tau_{own} += {format_sum(*terms)}"

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """None: a coupling through gears may have either sign."""
        return None

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect with its parameters, at the first joint from the second."""
        if len(joints) != 2:
            raise ValueError(f"joint_coupling needs two joints, not {list(joints)}")
        return cls.between(arm, *joints), np.array([float(parameters[name]) for name in cls.names])


@dataclass(frozen=True)
class FrictionCoupling(JointCoupling):
    """coefficient qd_k + level sgn(qd_k + qd_j): friction without inertia."""

    form = "friction"
    names = ("coefficient", "level")


@dataclass(frozen=True)
class CarriedCoupling(FrictionCoupling):
    """coefficient qd_k + level sgn(qd_k): the other joint's own friction.

    Its inertia is left out: it would resemble that of a shared motor.
    """

    form = "carried"
    with_own = False


@dataclass(frozen=True)
class ViscousCoupling(JointCoupling):
    """coefficient qd_k."""

    form = "viscous"
    names = ("coefficient",)


@dataclass(frozen=True)
class CoulombCoupling(JointCoupling):
    """level sgn(qd_k + qd_j)."""

    form = "Coulomb"
    names = ("level",)


@dataclass(frozen=True)
class InertiaCoupling(JointCoupling):
    """inertia qdd_k."""

    form = "inertia"
    names = ("inertia",)


COUPLING_FORMS = (ViscousCoupling, CoulombCoupling, InertiaCoupling, FrictionCoupling, CarriedCoupling, JointCoupling)


@dataclass(frozen=True)
class CouplingFamily(TermFamily):
    """Neighbours both ways, and all pairs of a wrist."""

    facts: Effect = JOINT_COUPLING_FACTS
    terms: tuple[type[Term], ...] = COUPLING_FORMS

    def candidates(self, arm: Arm, scenes: Sequence[Scene]) -> list[list[Candidate]]:
        """Each term alone and their groups, for each pair of which the driving joint moves."""
        pairs = [(own, other) for own, other in neighbour_pairs(len(arm)) if joint_moves(scenes, other)]
        return [[form.between(arm, own, other)] for own, other in pairs for form in COUPLING_FORMS]


def neighbour_pairs(joints: int) -> list[tuple[int, int]]:
    """Ordered pairs, from 1, whose drives may touch."""
    wrist = range(joints - WRIST_JOINTS + 1, joints + 1) if joints >= 2 * WRIST_JOINTS else ()
    near = [pair for pair in permutations(range(1, joints + 1), 2) if abs(pair[0] - pair[1]) == 1]
    return near + [pair for pair in permutations(wrist, 2) if pair not in near]


JOINT_COUPLING = CouplingFamily()
