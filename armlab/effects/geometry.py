"""Geometry that is not as the robot file says: the direction of gravity, zeros of joints, lengths of links."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from armlab.common.arrays import Array
from armlab.effects.contract import ANGLE, Candidate, Effect, Parameter, Range, Scene, Value
from armlab.effects.sensitivity import (
    GEOMETRY_STEP,
    geometry_derivative,
    gravity_derivative,
    horizontal_directions,
)
from armlab.effects.term import EveryJoint, Term, TermFamily, format_less, format_number
from problem.arm import Arm, Joint
from problem.motion import Motion
from problem.transforms import rotation_x, translation

LENGTH_ERRORS_SEEN = Range((-0.05, 0.05), "calibrations of arms: millimetres; a tool of another length: centimetres")

BASE_TILT_FACTS = Effect(
    "base_tilt",
    "gravity in another direction",
    (Parameter("gravity", "m/s2"),),
    sentence="Gravity points in another direction than in {model}",
    figures="{gravity}",
    law=(
        r"\Delta\tau = \tau_{\text{rigid}}(q, \dot q, \ddot q; \text{gravity}) - \tau_{\text{rigid}}(q, \dot "
        r"q, \ddot q; g_0)"
    ),
    where="robot",
    prior_scale=0.5,
    origin="geometry",
    experiment="measure the base with a level, or turn joint 1 through its full range",
)
ENCODER_OFFSET_FACTS = Effect(
    "encoder_offset",
    "a joint's zero at another place",
    (Parameter("offset", ANGLE),),
    sentence="The zero position of {place} differs from that in {model}",
    figures="{offset}",
    law=r"\Delta\tau = \tau_{\text{rigid}}(q - \text{offset} \; e_j) - \tau_{\text{rigid}}(q)",
    prior_scale=0.05,
    origin="geometry",
    experiment="check the joint's zero against its calibration mark",
)
GEOMETRY_ERROR_FACTS = Effect(
    "geometry_error",
    "a link of another length",
    (Parameter("offset", "m", plausible=LENGTH_ERRORS_SEEN),),
    sentence="A length or a twist at {place} differs from that in {model}",
    figures="{offset}",
    law=r"\Delta\tau = \tau_{\text{rigid}}(a_j + \text{offset}) - \tau_{\text{rigid}}(a_j)",
    prior_scale=0.02,
    origin="geometry",
    experiment="calibrate the geometry with a measuring arm or a laser tracker",
)

STEEPEST = 20.0  # degrees: more is no tilt but another way to mount the arm


@dataclass(frozen=True)
class BaseTilt(Term):
    """Gravity along two directions across the nominal one.

    nominal: gravity of the robot file, across: the two directions; all in the base frame.
    """

    facts = BASE_TILT_FACTS
    names = ("gravity",)
    size = 2
    follows_model = True
    nominal: tuple[float, ...] = (0.0, 0.0, -9.81)
    across: tuple[tuple[float, ...], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))

    @classmethod
    def at(cls, arm: Arm, joint: int, **details: Any) -> Self:
        first, second = horizontal_directions(np.array(arm.gravity))
        across = (tuple(first.tolist()), tuple(second.tolist()))
        return cls(None, (), tuple(range(len(arm))), nominal=arm.gravity, across=across, **details)

    def columns(self, scene: Scene) -> Array:
        """Torque of one m/s2 along each direction."""
        return np.stack([gravity_derivative(scene, np.array(direction)) for direction in self.across], axis=-1)

    def gravity(self, coefficients: Array) -> Array:
        """Gravity in the base frame, of its nominal strength, (3,), m/s2."""
        nominal, sideways = np.array(self.nominal), coefficients @ np.array(self.across)
        strength = np.linalg.norm(nominal)
        left = np.sqrt(max(1 - float(np.linalg.norm(sideways) / strength) ** 2, 0.0))
        return np.asarray(left * nominal + sideways)

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        return {"gravity": tuple(self.gravity(coefficients).tolist())}

    def changed_gravity(self, coefficients: Array) -> Array:
        return self.gravity(coefficients)

    def equation(self, coefficients: Array) -> str:
        """Gravity, and the angle to the nominal one."""
        place = ", ".join(format_number(value) for value in self.gravity(coefficients))
        return f"gravity = ({place}) m/s2, tilted by {format_number(self.degrees(coefficients))} degrees"

    def degrees(self, coefficients: Array) -> float:
        """The tilt."""
        sine = np.linalg.norm(coefficients) / np.linalg.norm(self.nominal)
        return float(np.degrees(np.arcsin(min(float(sine), 1.0))))

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """A base that would fall over."""
        return f"a tilt of more than {STEEPEST:g} degrees" if self.degrees(coefficients) > STEEPEST else None

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        tilt = cls.at(arm, 0)
        return tilt, np.array(tilt.across) @ np.array(parameters["gravity"], dtype=float)


@dataclass(frozen=True)
class TiltFamily(TermFamily):
    """One place: the whole robot."""

    facts: Effect = BASE_TILT_FACTS
    terms: tuple[type[Term], ...] = (BaseTilt,)

    def candidates(self, arm: Arm, scenes: Sequence[Scene]) -> list[list[Candidate]]:
        return [[BaseTilt.at(arm, 0)]]


BASE_TILT = TiltFamily()


MIN_VISIBLE_TORQUE = 1e-6  # of the rigid torque, a metre: above rounding
PROBE_STATES = 50  # random states that show whether an error changes anything


@dataclass(frozen=True)
class EncoderOffset(Term):
    """recorded = q + offset: first order in the offset; all joints feel it."""

    facts = ENCODER_OFFSET_FACTS
    names = ("offset",)
    follows_model = True

    @classmethod
    def at(cls, arm: Arm, joint: int, **details: Any) -> Self:
        return cls(joint, (joint,), tuple(range(len(arm))), arm.joints[joint - 1].kind, **details)

    def columns(self, scene: Scene) -> Array:
        """Derivative of the rigid torque by what the encoder reads too much."""
        by_angle, _ = scene.torque_slopes(self.joints[0] - 1)
        return -by_angle[:, :, None]

    def equation(self, coefficients: Array) -> str:
        return f"q_{self.joint} = {format_less('recorded', coefficients[0])}"


@dataclass(frozen=True)
class GeometryError(Term):
    """A joint's fixed transforms are not those of the robot file: its link has another length or twist.

    The link's body stays where it is in the link's frame, which moves with the error, as when the number in the
    robot file is put right.
    """

    facts = GEOMETRY_ERROR_FACTS
    names = ("offset",)
    follows_model = True
    what: ClassVar[str]

    @classmethod
    def at(cls, arm: Arm, joint: int, **details: Any) -> Self:
        return cls(joint, (joint,), tuple(range(len(arm))), **details)

    @staticmethod
    @abstractmethod
    def changed(joint: Joint, size: float) -> Joint:
        """The joint with an error of a size, m or rad."""

    def columns(self, scene: Scene) -> Array:
        """Derivative of the rigid torque by the error."""
        return geometry_derivative(scene, self.joints[0] - 1, self.changed)[:, :, None]

    def equation(self, coefficients: Array) -> str:
        return f"{self.what}_{self.joint} += {format_number(coefficients[0])} {self.unit('offset')}"


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
        return "rad"


GEOMETRY_FORMS = (LengthError, HeightError, TwistError, SideError)


@dataclass(frozen=True)
class GeometryFamily(TermFamily):
    """Lengths and twists of each joint but the last, whose own belong to its body."""

    facts: Effect = GEOMETRY_ERROR_FACTS
    terms: tuple[type[Term], ...] = GEOMETRY_FORMS

    def candidates(self, arm: Arm, scenes: Sequence[Scene]) -> list[list[Candidate]]:
        """Those that can change a torque; along y only where the arm has such a length."""
        joints = range(1, len(arm))
        places = [
            (form, joint)
            for form in GEOMETRY_FORMS
            for joint in joints
            if form is not SideError or _has_side_error(arm, joint)
        ]
        return [[form.at(arm, joint)] for form, joint in places if _changes_torque(form.at(arm, joint), arm)]


def _has_side_error(arm: Arm, joint: int) -> bool:
    """Whether the next joint stands to the side of this one."""
    return bool(abs((arm.joints[joint - 1].after @ arm.joints[joint].before)[1, 3]) > GEOMETRY_STEP)


def _changes_torque(candidate: GeometryError, arm: Arm) -> bool:
    """Whether it changes a torque at random states; a shift along the axis of an upright first joint does not."""
    rng = np.random.default_rng(1)
    motion = Motion(*rng.uniform(-2, 2, (3, PROBE_STATES, len(arm))))
    scene = Scene(
        "", np.arange(PROBE_STATES, dtype=float), motion, arm, rng.uniform(0, 1, 10 * len(arm)), motion.position
    )
    return bool(np.abs(candidate.columns(scene)).max() > MIN_VISIBLE_TORQUE * np.abs(scene.rigid_torque).max())


ENCODER_OFFSET = EveryJoint(ENCODER_OFFSET_FACTS, (EncoderOffset,), resting=True)
GEOMETRY_ERROR = GeometryFamily()
