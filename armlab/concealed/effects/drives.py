"""Effects between motor and link, and effects that couple joints."""

from collections.abc import Sequence
from typing import ClassVar, Self

import numpy as np

from armlab.common.arrays import Array
from armlab.concealed.arms import Machine, with_rotor
from armlab.concealed.effects.hidden import HiddenEffect, ParameterValues, smooth_sign, torque_share
from armlab.concealed.engine import Parts, Spring, Track
from problem.arm import Arm


class Rotor(HiddenEffect):
    """Inertia behind the gear that the simulation does not know, kg m2."""

    effect, forms = "rotor_inertia", ("armature",)
    units: ClassVar = {"inertia": "kg.m2"}

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        """Up to the rotor inertia that is known."""
        known = (machine.arm.rotor_inertia or (0.1,) * machine.joints)[joint]
        return cls(joint, 0.2 * known, 1.5 * known, cls.draw_form(rng))

    def parameters(self) -> ParameterValues:
        """The inertia that is added."""
        return {"inertia": self.size}

    def arm(self, arm: Arm) -> Arm:
        """A heavier rotor."""
        return with_rotor(arm, self.joint, self.size)


class Elasticity(HiddenEffect):
    """A spring in the drive train, encoder at the motor; other form: it hardens. size: compliance, rad/(N m)."""

    effect, forms = "joint_elasticity", ("linear", "hardening")
    units: ClassVar = {"stiffness": "N.m/rad"}

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        """Stiffness of small gears."""
        compliance = float(1 / torque_share(120, machine, joint))
        return cls(joint, compliance, 10 * compliance, cls.draw_form(rng), {"damping": float(rng.uniform(1e-4, 4e-4))})

    def parameters(self) -> ParameterValues:
        """The stiffness."""
        return {"stiffness": 1 / self.size}

    def parts(self) -> Parts:
        """A joint between motor and link."""
        stiffness = 1 / self.size
        hardening = stiffness * 5e4 if self.form == "hardening" else 0.0
        return Parts((Spring(self.joint, stiffness, stiffness * self.shape["damping"], hardening),))


class Backlash(HiddenEffect):
    """Play between motor and link; other form: a soft play, a spring whose stiffness grows. size: gap, rad."""

    effect, forms = "backlash", ("gap", "soft")
    units: ClassVar = {"gap": "rad"}

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        """Walls on both sides of the play so stiff that they are no elasticity to speak of."""
        shape = {"hz": float(rng.uniform(60, 110)), "stiffness": torque_share(300, machine, joint)}
        return cls(joint, 1e-3, 2e-2, cls.draw_form(rng), shape)

    def parameters(self) -> ParameterValues:
        """The gap."""
        return {"gap": self.size}

    def parts(self) -> Parts:
        """A joint with play between motor and link."""
        pitch, wall = 2 * np.pi * self.shape["hz"], self.shape["stiffness"]
        if self.form == "gap":
            return Parts((Spring(self.joint, pitch**2, 2 * pitch, gap=self.size),))
        return Parts((Spring(self.joint, 0.02 * wall, 1e-4 * wall, wall / (self.size / 2) ** 2),))


class Coupling(HiddenEffect):
    """Torque at a wrist joint from its neighbour's motion: friction of a shared motor; other form: its inertia too.

    size: viscous coefficient, N m s/rad.
    """

    effect, forms = "joint_coupling", ("friction", "friction and inertia")
    where = "coupling"
    units: ClassVar = {"coefficient": "N.m.s/rad", "level": "N.m", "inertia": "kg.m2"}

    @classmethod
    def places(cls, machine: Machine) -> Sequence[int]:
        """The last two joints, in both directions."""
        return range(machine.joints - 2, machine.joints)

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        """Coulomb level and inertia in proportion to the viscous part."""
        pair = 2 * machine.joints - 3 - joint
        shape = {"from": float(pair), "level": float(rng.uniform(0.3, 1.2)), "inertia": float(rng.uniform(0.05, 0.2))}
        coefficient = torque_share(0.02, machine, joint)
        return cls(joint, coefficient, 8 * coefficient, cls.draw_form(rng), shape)

    @property
    def joints(self) -> tuple[int, ...]:
        """Where the torque appears, and where the motion is."""
        return (self.joint + 1, int(self.shape["from"]) + 1)

    def parameters(self) -> ParameterValues:
        """Viscous, Coulomb and inertial part."""
        inertia = self.size * self.shape["inertia"] if self.form == self.forms[1] else 0.0
        return {"coefficient": self.size, "level": self.size * self.shape["level"], "inertia": inertia}

    def torque(self, track: Track, run: int) -> Array:
        """From the other joint's motion."""
        other = int(self.shape["from"])
        velocity = track.velocity[:, other]
        torque = self.size * (velocity + self.shape["level"] * smooth_sign(velocity))
        if self.form == self.forms[1]:
            torque = torque + self.size * self.shape["inertia"] * track.acceleration[:, other]
        return np.asarray(torque)
