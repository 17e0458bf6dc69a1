"""A drive train that gives: the link is not where the motor's encoder says.

The link's angle is q = theta + delta, theta the recorded one. To first order the torque changes along delta;
its velocity and acceleration count, too, and the other joints feel it through the links.
"""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from scipy.ndimage import gaussian_filter1d

from diagnosis.effects.contract import Scene, Value
from diagnosis.effects.sensitivity import along, change_of_joint
from diagnosis.effects.term import EveryJoint, Term, number
from problem.arm import Arm
from recordings.run import Array

CROSSINGS = (0.005, 0.02, 0.06)  # s that the bodies take to cross a gap, for a first look
CROSSING_RANGE = (0.002, 0.15)


@dataclass(frozen=True)
class Transmission(Term):
    """delta = coefficient x `give`, a law of the load that the drive train carries; all joints feel it.

    measured: factor of the recorded difference between link and motor, where there is one: then the columns
    follow the difference itself, scaled to the law.
    """

    follows_model = True
    measured: float | None = None

    @classmethod
    def at(cls, arm: Arm, joint: int, **details: Any) -> Self:
        """The effect at a joint, felt by all."""
        return cls(joint, (joint,), tuple(range(len(arm))), arm.joints[joint - 1].kind, **details)

    @property
    def index(self) -> int:
        """The joint that gives, from 0."""
        return self.joints[0] - 1

    @abstractmethod
    def give(self, scene: Scene) -> Array:
        """Change of the link's angle for a coefficient of one, (samples,)."""

    def columns(self, scene: Scene) -> Array:
        """Derivative of the rigid torque along the change."""
        change = self.give(scene)
        recorded = recorded_difference(scene, self.index)
        if self.measured and recorded is not None:
            change = change.mean() + recorded / self.measured  # zeros of the two encoders may differ
        return along(scene, change_of_joint(scene, self.index, change))[:, :, None]

    @classmethod
    def factor(cls, candidate: Self, scenes: Sequence[Scene]) -> float | None:
        """Coefficient that the recorded differences have over the law, and a constant; None without them."""
        pairs = [(candidate.give(scene), recorded_difference(scene, candidate.index)) for scene in scenes]
        if any(recorded is None for _, recorded in pairs):
            return None
        law, recorded = (np.concatenate([np.asarray(pair[side]) for pair in pairs]) for side in (0, 1))
        law = law - law.mean()
        factor = float(law @ recorded / (law @ law)) if law.any() else 0.0
        return factor or None


@dataclass(frozen=True)
class JointElasticity(Transmission):
    """delta = -tau_rigid / stiffness (Spong 1987)."""

    effect = "joint_elasticity"
    names = ("stiffness",)

    @classmethod
    def first_looks(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """One candidate, by the recorded difference where there is one."""
        return [cls.at(arm, joint, measured=cls.factor(cls.at(arm, joint), scenes))]

    def give(self, scene: Scene) -> Array:
        """The twist of a spring of one N m/rad."""
        return -scene.rigid_torque[:, self.index]

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """The stiffness: the coefficient is its inverse."""
        return {"stiffness": float(1 / coefficients[0]) if coefficients[0] else float("inf")}

    def equation(self, coefficients: Array) -> str:
        """The law with its number."""
        stiffness = number(1 / coefficients[0] if coefficients[0] else np.inf)
        return f"q_{self.joint} = theta_{self.joint} - tau_{self.joint} / {stiffness}"

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect with a stiffness."""
        return cls.at(arm, joints[0]), np.array([1 / float(parameters["stiffness"])])


@dataclass(frozen=True)
class Backlash(Transmission):
    """delta = -gap / 2 sgn(load), smoothed over the time that the bodies take to cross; shape: that time, s."""

    effect = "backlash"
    names = ("gap",)

    @classmethod
    def first_looks(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """Quick and slow crossings."""
        looks = [cls.at(arm, joint, shape=(time,), bounds=(CROSSING_RANGE,)) for time in CROSSINGS]
        return [cls.at(arm, joint, shape=x.shape, bounds=x.bounds, measured=cls.factor(x, scenes)) for x in looks]

    def give(self, scene: Scene) -> Array:
        """Half a gap towards the side that carries the load."""
        side = np.sign(scene.rigid_torque[:, self.index])
        return np.asarray(-0.5 * gaussian_filter1d(side, max(self.shape[0] / scene.step, 0.5), mode="nearest"))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """The whole gap."""
        return {"gap": float(coefficients[0])}

    def equation(self, coefficients: Array) -> str:
        """The law with its number."""
        own = self.joint
        return f"q_{own} = theta_{own} - {number(coefficients[0])}/2 sgn(tau_{own})"

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect with a gap that is crossed in a middling time."""
        return cls.at(arm, joints[0], shape=(CROSSINGS[1],), bounds=(CROSSING_RANGE,)), np.array([parameters["gap"]])


def recorded_difference(scene: Scene, joint: int) -> Array | None:
    """Link angle less motor angle, (samples,), less their mean; None where it was not recorded."""
    if scene.link_position is None:
        return None
    difference = scene.link_position[:, joint] - scene.motion.position[:, joint]
    return None if np.isnan(difference).any() else np.asarray(difference - difference.mean())


JOINT_ELASTICITY = EveryJoint("joint_elasticity", (JointElasticity,))
BACKLASH = EveryJoint("backlash", (Backlash,))
