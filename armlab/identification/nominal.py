"""The model that the file of a simulator is: its links and rotors, and the laws of its joints as components."""

from collections.abc import Iterator

import numpy as np

from armlab.common.arrays import Array
from armlab.effects.contract import Candidate
from armlab.effects.drive import RotorInertia
from armlab.effects.friction import CoulombFriction, ViscousFriction
from armlab.effects.springs import LinearSpring
from armlab.identification.structure import Structure
from armlab.identification.torque_model import TorqueModel
from problem.arm import Arm


def nominal_model(arm: Arm, robot: str) -> TorqueModel | None:
    """The model of an arm whose file states laws of joints or bodies without weight; None where it has links alone.

    robot: the file, as recordings name it. An arm without links has none either: what its file says is no simulation.
    """
    if arm.links is None or not (arm.joint_laws or arm.compensated):
        return None
    parts = list(stated_components(arm))
    structure = Structure(arm, tuple(candidate for candidate, _ in parts), load=arm.parameters)
    values = np.concatenate([structure.base.values(arm.parameters), *(coefficients for _, coefficients in parts)])
    simulated = frozenset(range(len(parts)))
    return TorqueModel(robot, structure, values, inertial=arm.parameters, simulated=simulated)


def stated_components(arm: Arm) -> Iterator[tuple[Candidate, Array]]:
    """The rotors and the laws of joints that the file of an arm states, with their coefficients; none of size zero."""
    for joint, inertia in enumerate(arm.rotor_inertia, 1):
        if inertia:
            yield RotorInertia.at(arm, joint), np.array([inertia])
    for joint, law in enumerate(arm.joint_laws, 1):
        if law.damping:
            yield ViscousFriction.at(arm, joint), np.array([law.damping])
        if law.friction:
            yield CoulombFriction.at(arm, joint), np.array([law.friction])
        if law.stiffness:
            yield LinearSpring.at(arm, joint), law.stiffness * np.array([1.0, -law.rest])
