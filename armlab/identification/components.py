"""The components that identification usually fits beside the links: laws of the library at joints of an arm."""

from typing import Any

import numpy as np

from armlab.common.arrays import Array
from armlab.effects.contract import Candidate
from armlab.effects.coupling import JointCoupling
from armlab.effects.drive import RotorInertia, TorqueOffset
from armlab.effects.friction import CoulombFriction, SmoothCoulombFriction, ViscousFriction
from armlab.effects.springs import LinearSpring
from armlab.effects.term import Term
from armlab.recordings.plain_least_squares import COULOMB_WIDTH
from problem.arm import Arm


def every_joint(arm: Arm, law: type[Term], **details: Any) -> tuple[Candidate, ...]:
    """A law at each joint with torque. details: as `law.at` takes them, such as the shape of a power of velocity."""
    return tuple(law.at(arm, joint + 1, **details) for joint in arm.measured)


def wrist_couplings(arm: Arm) -> tuple[Candidate, ...]:
    """Couplings between the last two joints both ways, as motors that turn with two wrist joints have them."""
    last = len(arm)
    return JointCoupling.between(arm, last - 1, last), JointCoupling.between(arm, last, last - 1)


def usual_components(arm: Arm, top_speed: Array | None = None) -> tuple[Candidate, ...]:
    """What every real arm has (friction, rotor inertia, offset), and springs where the file of the arm has them.

    top_speed: (joints,), rad/s (m/s); Coulomb friction turns smoothly then, by a share of it.
    """
    stiff = [joint for joint in arm.measured if arm.joint_laws and arm.joint_laws[joint].stiffness]
    springs = (LinearSpring.at(arm, joint + 1) for joint in stiff)
    coulomb = every_joint(arm, CoulombFriction)
    if top_speed is not None:
        widths = COULOMB_WIDTH * np.where(top_speed > 0, top_speed, 1.0)
        coulomb = tuple(
            SmoothCoulombFriction.at(arm, joint, turning=float(width)) for joint, width in enumerate(widths, 1)
        )
    return (
        *springs,
        *every_joint(arm, ViscousFriction),
        *coulomb,
        *every_joint(arm, RotorInertia),
        *every_joint(arm, TorqueOffset),
    )  # a spring takes the offset of its joint
