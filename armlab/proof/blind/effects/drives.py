"""Effects between motor and link, and effects that couple joints."""

from collections.abc import Sequence
from typing import ClassVar, Self

import numpy as np

from armlab.common.arrays import Array
from armlab.proof.blind.arms import Machine, with_rotor
from armlab.proof.blind.effects.hidden import HiddenEffect, ParameterValues, smooth_sign, torque_share
from armlab.proof.blind.engine import Parts, Spring, Track
from problem.arm import Arm


class Rotor(HiddenEffect):
    """tau = I a: inertia behind the gear that the simulation does not know. size: I, kg m2."""

    effect, forms = "rotor_inertia", ("armature",)
    units: ClassVar = {"inertia": "kg.m2"}

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        known = (machine.arm.rotor_inertia or (0.1,) * machine.joints)[joint]
        return cls(joint, 0.2 * known, 1.5 * known, cls.draw_form(rng))

    def parameters(self) -> ParameterValues:
        return {"inertia": self.size}

    def arm(self, arm: Arm) -> Arm:
        return with_rotor(arm, self.joint, self.size)


class Elasticity(HiddenEffect):
    """A spring between motor and link, encoder at the motor; other form: it hardens. size: compliance, rad/(N m)."""

    effect, forms = "joint_elasticity", ("linear", "hardening")
    units: ClassVar = {"stiffness": "N.m/rad"}

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        compliance = float(1 / torque_share(120, machine, joint))
        return cls(joint, compliance, 10 * compliance, cls.draw_form(rng), {"damping": float(rng.uniform(1e-4, 4e-4))})

    def parameters(self) -> ParameterValues:
        return {"stiffness": 1 / self.size}

    def parts(self) -> Parts:
        stiffness = 1 / self.size
        hardening = stiffness * 5e4 if self.form == "hardening" else 0.0
        return Parts((Spring(self.joint, stiffness, stiffness * self.shape["damping"], hardening),))


class Backlash(HiddenEffect):
    """A gap between motor and link; other form: a spring whose stiffness grows with its twist. size: gap, rad."""

    effect, forms = "backlash", ("gap", "soft")
    units: ClassVar = {"gap": "rad"}

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        """The walls are so stiff that their own elasticity is small."""
        shape = {"hz": float(rng.uniform(60, 110)), "stiffness": torque_share(300, machine, joint)}
        return cls(joint, 1e-3, 2e-2, cls.draw_form(rng), shape)

    def parameters(self) -> ParameterValues:
        return {"gap": self.size}

    def parts(self) -> Parts:
        """A critically damped wall on each side, or a spring that hardens over the gap."""
        pitch, wall = 2 * np.pi * self.shape["hz"], self.shape["stiffness"]
        if self.form == "gap":
            return Parts((Spring(self.joint, pitch**2, 2 * pitch, gap=self.size),))
        return Parts((Spring(self.joint, 0.02 * wall, 1e-4 * wall, wall / (self.size / 2) ** 2),))


class Coupling(HiddenEffect):
    """tau_i = c (v_j + F sgn(v_j)): friction of a motor that two wrist joints share.

    Other form: + c I a_j, its inertia too. size: c, N m s/rad.
    """

    effect, forms = "joint_coupling", ("friction", "friction and inertia")
    where = "coupling"
    units: ClassVar = {"coefficient": "N.m.s/rad", "level": "N.m", "inertia": "kg.m2"}

    @classmethod
    def places(cls, machine: Machine) -> Sequence[int]:
        """The last two joints; each follows the other."""
        return range(machine.joints - 2, machine.joints)

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        pair = 2 * machine.joints - 3 - joint
        shape = {"from": float(pair), "level": float(rng.uniform(0.3, 1.2)), "inertia": float(rng.uniform(0.05, 0.2))}
        coefficient = torque_share(0.02, machine, joint)
        return cls(joint, coefficient, 8 * coefficient, cls.draw_form(rng), shape)

    def parameters(self) -> ParameterValues:
        inertia = self.size * self.shape["inertia"] if self.form == self.forms[1] else 0.0
        return {"coefficient": self.size, "level": self.size * self.shape["level"], "inertia": inertia}

    def torque(self, track: Track, run: int) -> Array:
        other = int(self.shape["from"])
        velocity = track.velocity[:, other]
        torque = self.size * (velocity + self.shape["level"] * smooth_sign(velocity))
        if self.form == self.forms[1]:
            torque = torque + self.size * self.shape["inertia"] * track.acceleration[:, other]
        return np.asarray(torque)
