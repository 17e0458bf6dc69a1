"""Joints of a chain that others lead: q_all = C q + b, so the torque of the own joints is C' tau_all (virtual work).

Mimic joints of URDF and equality constraints of MJCF that are straight lines are such couplings. A coupling is ideal,
without slack, compliance and friction. The links that coupled joints carry are as the file states them: they have no
columns.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from problem.arm import NO_BODY, Arm, CoupledJoint, JointLaw
from problem.kinematic_tree import Follower
from problem.motion import Motion


def chain_motion(arm: Arm, motion: Motion) -> Motion:
    """The motion (..., samples, chain) of all joints of the chain of an arm; motion: of its own joints."""
    if not arm.coupled:
        return motion
    matrix, offsets = arm.coupling
    return Motion(motion.position @ matrix.T + offsets, motion.velocity @ matrix.T, motion.acceleration @ matrix.T)


def couple_joints(arm: Arm, follows: Mapping[str, Follower], where: str) -> Arm:
    """The arm whose joints that follow others are coupled; arm: the chain of all joints, each as if it were free.

    follows: by the name of the joint. where: the file, for messages. Raises InputError for a leader that is no joint
    before its follower, and for an arm whose links are unknown.
    """
    if not follows:
        return arm
    if arm.links is None:
        raise InputError(f"{where}: joints follow others, but no link has an inertia, which such an arm needs")
    own = [joint.name for joint in arm.joints if joint.name not in follows]
    lines: dict[str, tuple[int, float, float]] = {name: (place, 1.0, 0.0) for place, name in enumerate(own)}
    coupled: list[CoupledJoint] = []
    kept: list[int] = []
    for place, joint in enumerate(arm.joints):
        if joint.name not in follows:
            kept.append(place)
            continue
        line = follows[joint.name]
        if line.leader not in [each.name for each in arm.joints[:place]]:
            raise InputError(
                f"{where}: joint '{joint.name}' follows '{line.leader}', which is no moving joint before it in the arm"
            )
        leader, slope, start = lines[line.leader]
        multiplier, offset = line.multiplier * slope, line.multiplier * start + line.offset
        lines[joint.name] = leader, multiplier, offset
        coupled.append(
            CoupledJoint(
                joint=joint,
                behind=len(kept),
                leader=leader,
                multiplier=multiplier,
                offset=offset,
                link=arm.links[place],
                law=arm.joint_laws[place] if arm.joint_laws else JointLaw(),
                rotor_inertia=arm.rotor_inertia[place] if arm.rotor_inertia else 0.0,
                compensated=arm.compensated[place] if arm.compensated else NO_BODY,
            )
        )
    laws = [arm.joint_laws[place] if arm.joint_laws else JointLaw() for place in kept]
    rotors = np.array([arm.rotor_inertia[place] if arm.rotor_inertia else 0.0 for place in kept])
    for each in coupled:
        laws[each.leader] = _sum_of_laws(laws[each.leader], each)
        rotors[each.leader] += each.multiplier**2 * each.rotor_inertia
    return replace(
        arm,
        joints=tuple(arm.joints[place] for place in kept),
        links=tuple(arm.links[place] for place in kept),
        rotor_inertia=tuple(rotors.tolist()) if arm.rotor_inertia else (),
        joint_laws=tuple(laws) if arm.joint_laws else (),
        compensated=tuple(arm.compensated[place] for place in kept) if arm.compensated else (),
        coupled=tuple(coupled),
    )


def _sum_of_laws(law: JointLaw, coupled: CoupledJoint) -> JointLaw:
    """The law of a leader with that of a joint that it leads: damping and springs grow by the square of the multiplier,
    friction by its size.
    """
    own, slope = coupled.law, coupled.multiplier
    stiffness = law.stiffness + slope**2 * own.stiffness
    moment = law.stiffness * law.rest + slope * own.stiffness * (own.rest - coupled.offset)
    return replace(
        law,
        damping=law.damping + slope**2 * own.damping,
        friction=law.friction + abs(slope) * own.friction,
        stiffness=stiffness,
        rest=moment / stiffness if stiffness else 0.0,
    )


def refuse_coupled(arm: Arm, what: str) -> None:
    """Raises InputError for an arm with coupled joints. what: has no place for them, in words."""
    for each in arm.coupled:
        raise InputError(
            f"{arm.name}: joint '{each.joint.name}' follows '{arm.joints[each.leader].name}', which {what} cannot have"
        )


def torque_at_leaders(arm: Arm, torque: Array) -> Array:
    """Torque (..., samples, joints) of the own joints that works as that of all joints of the chain does."""
    return np.asarray(torque @ arm.coupling[0]) if arm.coupled else torque
