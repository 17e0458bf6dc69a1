"""An arm whose shape is not the simulation's: zeros of its encoders, lengths and angles between its joints."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from diagnosis.effects.contract import Candidate, Family, Scene, Value
from diagnosis.effects.sensitivity import GEOMETRY_STEP, along, by_geometry
from diagnosis.effects.term import EveryJoint, Term, number, restored_by
from problem.arm import Arm, Joint
from problem.motion import Motion
from problem.transforms import rotation_x, translation
from recordings.run import Array

UNSEEN = 1e-6  # of the rigid torque, a metre: above rounding
FEW = 50  # random states that show whether an error changes anything


@dataclass(frozen=True)
class EncoderOffset(Term):
    """recorded = q + offset: first order in the offset; all joints feel it."""

    effect = "encoder_offset"
    names = ("offset",)
    follows_model = True

    @classmethod
    def at(cls, arm: Arm, joint: int, **details: Any) -> Self:
        """The effect at a joint."""
        return cls(joint, (joint,), tuple(range(len(arm))), arm.joints[joint - 1].kind, **details)

    def columns(self, scene: Scene) -> Array:
        """Derivative of the rigid torque by what the encoder reads too much."""
        change = np.zeros((3, *scene.motion.position.shape))
        change[0, :, self.joints[0] - 1] = -1.0
        return along(scene, Motion(*change))[:, :, None]

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """The offset."""
        return {"offset": float(coefficients[0])}

    def equation(self, coefficients: Array) -> str:
        """The law with its number."""
        return f"q_{self.joint} = recorded - {number(coefficients[0])}"

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect with an offset."""
        return cls.at(arm, joints[0]), np.array([parameters["offset"]])


@dataclass(frozen=True)
class GeometryError(Term):
    """A joint's fixed transforms are not those of the robot file: its link has another length or twist.

    The link's body stays where it is in the link's frame, which moves with the error, as when the number in the
    robot file is put right.
    """

    effect = "geometry_error"
    names = ("offset",)
    follows_model = True
    what: ClassVar[str]

    @classmethod
    def at(cls, arm: Arm, joint: int, **details: Any) -> Self:
        """The error at a joint, from 1."""
        return cls(joint, (joint,), tuple(range(len(arm))), **details)

    @staticmethod
    @abstractmethod
    def changed(joint: Joint, size: float) -> Joint:
        """The joint with an error of a size, m or rad."""

    def columns(self, scene: Scene) -> Array:
        """Derivative of the rigid torque by the error."""
        return by_geometry(scene, self.joints[0] - 1, self.changed)[:, :, None]

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """The error."""
        return {"offset": float(coefficients[0])}

    def equation(self, coefficients: Array) -> str:
        """The error with its number."""
        return f"{self.what}_{self.joint} += {number(coefficients[0])} {self.unit('offset')}"

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The error with its size."""
        return cls.at(arm, joints[0]), np.array([parameters["offset"]])


@dataclass(frozen=True)
class LengthError(GeometryError):
    """A longer a: everything behind the joint's motion moves along x."""

    form = "a"
    what = "a"

    @staticmethod
    def changed(joint: Joint, size: float) -> Joint:
        """The joint with a longer a."""
        return replace(joint, after=translation(size, 0, 0) @ joint.after)


@dataclass(frozen=True)
class SideError(GeometryError):
    """Along y, a length that D-H frames do not have."""

    form = "y"
    what = "y"

    @staticmethod
    def changed(joint: Joint, size: float) -> Joint:
        """The joint with a link that is longer along y."""
        return replace(joint, after=translation(0, size, 0) @ joint.after)


@dataclass(frozen=True)
class HeightError(GeometryError):
    """A longer d: everything behind the joint moves along its axis."""

    form = "d"
    what = "d"

    @staticmethod
    def changed(joint: Joint, size: float) -> Joint:
        """The joint with a longer d."""
        return replace(joint, before=joint.before @ translation(0, 0, size))


@dataclass(frozen=True)
class TwistError(GeometryError):
    """Another alpha: the next axis is turned about x."""

    form = "alpha"
    what = "alpha"

    @staticmethod
    def changed(joint: Joint, size: float) -> Joint:
        """The joint with another alpha."""
        return replace(joint, after=joint.after @ rotation_x(size))

    def unit(self, name: str) -> str:
        """Radians."""
        return "rad"


ERRORS = (LengthError, HeightError, TwistError, SideError)


@dataclass(frozen=True)
class GeometryFamily(Family):
    """Lengths and twists of each joint but the last, whose own belong to its body."""

    effect: str = "geometry_error"

    def candidates(self, arm: Arm, scenes: Sequence[Scene]) -> list[list[Candidate]]:
        """Those that can change a torque; along y only where the arm has such a length."""
        joints = range(1, len(arm))
        places = [
            (form, joint) for form in ERRORS for joint in joints if form is not SideError or _sideways(arm, joint)
        ]
        return [[form.at(arm, joint)] for form, joint in places if _felt(form.at(arm, joint), arm)]

    def restored(
        self, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Value], form: str = ""
    ) -> tuple[Candidate, Array]:
        """The error with its size."""
        return restored_by(ERRORS, arm, joints, parameters, form)


def _sideways(arm: Arm, joint: int) -> bool:
    """Whether the next joint stands to the side of this one."""
    return bool(abs((arm.joints[joint - 1].after @ arm.joints[joint].before)[1, 3]) > GEOMETRY_STEP)


def _felt(candidate: GeometryError, arm: Arm) -> bool:
    """Whether it changes a torque at random states; a shift along the axis of an upright first joint does not."""
    rng = np.random.default_rng(1)
    motion = Motion(*rng.uniform(-2, 2, (3, FEW, len(arm))))
    scene = Scene("", np.arange(FEW, dtype=float), motion, arm, rng.uniform(0, 1, 10 * len(arm)), motion.position)
    return bool(np.abs(candidate.columns(scene)).max() > UNSEEN * np.abs(scene.rigid_torque).max())


ENCODER_OFFSET = EveryJoint("encoder_offset", (EncoderOffset,), resting=True)
GEOMETRY_ERROR = GeometryFamily()
