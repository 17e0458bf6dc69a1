"""The base class of hidden effects: what an effect may change between the mechanism and the recording.

Symbols in the docstrings of the effects: q, v, a are position, velocity and acceleration of the effect's joint (rad,
s); q_j, v_j, a_j are those of another joint; tau is the torque that the motor gives on top of what moves the mechanism
(N m); sgn changes its sign within 0.5 mrad/s.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar, Literal, Self

import numpy as np

from armlab.common.arrays import Array
from armlab.proof.blind.arms import Machine
from armlab.proof.blind.engine import Parts, Track
from problem.arm import Arm

OTHER_FORM_SHARE = 0.4  # share of the draws whose law is not the obvious one
SIGN_WIDTH = 5e-4  # rad/s: Coulomb friction changes its sign within this
ParameterValues = dict[str, float | list[float]]
Where = Literal["joint", "coupling", "link", "robot"]


@dataclass(frozen=True)
class HiddenEffect:
    """An effect at a joint or link (from 0) with one size and a shape.

    Of the class. effect: its id. forms: its laws, the obvious one first. where: at one joint; at two joints, where the
    torque of one follows the motion of the other; at a link; or in the whole robot. units: unit of each parameter at
    a joint that turns. companions: plain friction of the same joint that the oracle fits beside it. blurred:
    parameters that cannot be separated from the plain friction of a background. takes_energy: friction, of which a
    negative size is no law. is_outside: whether the library of the diagnosis has no name for it.

    size: what grows until the effect is as visible as wanted; in the unit of its main parameter. max_size: the size
    beyond which the effect would be absurd. form: which law. shape: the other numbers of the law.
    """

    effect: ClassVar[str]
    forms: ClassVar[tuple[str, ...]]
    where: ClassVar[Where] = "joint"
    units: ClassVar[Mapping[str, str]] = {}
    companions: ClassVar[tuple[str, ...]] = ()
    blurred: ClassVar[tuple[str, ...]] = ()
    takes_energy: ClassVar[bool] = False
    is_outside: ClassVar[bool] = False
    joint: int
    size: float
    max_size: float
    form: str
    shape: dict[str, float] = field(default_factory=dict)

    @classmethod
    def places(cls, machine: Machine) -> Sequence[int]:
        """Joints (links) where the effect makes sense."""
        return range(machine.joints)

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        """The effect at a joint with a usual size and random other numbers."""
        raise NotImplementedError

    @classmethod
    def draw_form(cls, rng: np.random.Generator) -> str:
        """The obvious form, or one of the others."""
        other = len(cls.forms) > 1 and rng.random() < OTHER_FORM_SHARE
        return str(rng.choice(cls.forms[1:])) if other else cls.forms[0]

    def sized(self, size: float) -> Self:
        """The same effect with another size, at most its largest."""
        return replace(self, size=float(min(size, self.max_size)))

    @property
    def place(self) -> int | None:
        """Joint or link from 1; None for an effect of the whole robot."""
        return None if self.where == "robot" else self.joint + 1

    @property
    def joints(self) -> tuple[int, ...]:
        """Where the torque appears, and where the motion is, from 1; none for an effect of the whole robot."""
        if self.where == "robot":
            return ()
        return (self.joint + 1, *([int(self.shape["from"]) + 1] if "from" in self.shape else []))

    @property
    def comparable(self) -> tuple[str, ...]:
        """Parameters that mean the same in the fitted law: those of the obvious form."""
        return tuple(self.parameters()) if self.form == self.forms[0] else ()

    @property
    def equivalent(self) -> tuple[str, ...]:
        """Effects that, found together at the same joint, describe this one as well."""
        return ()

    def parameters(self) -> ParameterValues:
        """Parameters by name, in the units of `units`."""
        return {}

    def with_peak_torque(self, peak: Array) -> Self:
        """The effect adapted to the largest torque of each joint without it, (joints,), N m."""
        return self

    def arm(self, arm: Arm) -> Arm:
        """The nominal arm with the changes of the effect."""
        return arm

    def parts(self) -> Parts:
        """Parts of the mechanism with degrees of freedom of their own."""
        return Parts()

    def torque(self, track: Track, run: int) -> Array | None:
        """Torque that the motor of the effect's joint gives on top, (steps,), N m; None for an effect without a law.

        run: from 0, the identification runs first.
        """
        return None

    @property
    def has_parts(self) -> bool:
        """True if the effect needs degrees of freedom of its own."""
        return self.parts() != Parts()

    def lag(self, joints: int) -> Array:
        """How much later each torque channel is stamped, (joints,), s."""
        return np.zeros(joints)

    def read(self, torque: Array) -> Array:
        """Torque channels (samples, joints) as they are read."""
        return torque

    def shift(self, joints: int) -> Array:
        """What is added to each position channel, (joints,), rad."""
        return np.zeros(joints)


def smooth_sign(velocity: Array, width: float = SIGN_WIDTH) -> Array:
    """Sign of a velocity that changes within a width, rad/s."""
    return np.asarray(np.tanh(velocity / width))


def torque_share(share: float, machine: Machine, joint: int) -> float:
    """A share of the joint's rated torque, N m."""
    return float(share * machine.rating[joint])
