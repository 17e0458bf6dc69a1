"""The torque that the drives of an arm give, with all that the file of a simulator says of its joints and bodies.

    tau = W(q, qd, qdd) phi + I qdd + d qd + f sgn(qd) + k (q - q_rest) - g(q)

I are the rotors, d, f, k and q_rest the laws of the joints, and g is what the simulator holds of the links' weight.
"""

import numpy as np

from armlab.common.arrays import Array
from problem.arm import Arm
from problem.coupled_joints import chain_motion, torque_at_leaders
from problem.motion import Motion
from problem.regressor import coupled_links_torque, measured_rows, rigid_body_torque, torque_of_links


def drive_torque(arm: Arm, motion: Motion, parameters: Array | None = None) -> Array:
    """Torque (..., samples, joints) that the drives give, N m (N).

    parameters: (10 * joints,) of the links, the arm's own if left out. ValueError for an arm without links then.
    """
    torque = rigid_body_torque(arm, motion, parameters)
    if arm.rotor_inertia:
        torque = torque + motion.acceleration * np.array(arm.rotor_inertia)
    if arm.joint_laws:
        torque = torque + motion.velocity * np.array([law.damping for law in arm.joint_laws])
        torque = torque + np.sign(motion.velocity) * np.array([law.friction for law in arm.joint_laws])
    return measured_rows(arm, torque + position_torque(arm, motion))


def springs_torque(arm: Arm, motion: Motion) -> Array:
    """Torque (..., samples, joints) that the drives need against the springs of the joints, N m (N)."""
    if not arm.joint_laws:
        return np.zeros(motion.position.shape)
    stiffness, rest = np.array([(law.stiffness, law.rest) for law in arm.joint_laws]).T
    return measured_rows(arm, stiffness * (motion.position - rest))


def compensation_torque(arm: Arm, motion: Motion) -> Array:
    """Torque (..., samples, joints) by which the simulator itself holds the weight of links, N m (N)."""
    still = np.zeros(motion.position.shape)
    if not arm.compensated:
        return still
    at_rest = chain_motion(arm, Motion(motion.position, still, still))
    by_drive = [law.drive_compensates for law in arm.chain.joint_laws]
    carried = np.concatenate([link.parameters for link in arm.chain.compensated])
    weight = torque_of_links(arm.chain, at_rest, carried)
    return measured_rows(arm, torque_at_leaders(arm, np.where(by_drive, 0.0, weight)))


def torque_beside_columns(arm: Arm, motion: Motion) -> Array:
    """What the file of an arm states and no column has, (..., samples, joints), N m (N).

    The links of coupled joints need it, less the weight that the simulator holds.
    """
    return coupled_links_torque(arm, motion) - compensation_torque(arm, motion)


def position_torque(arm: Arm, motion: Motion) -> Array:
    """What springs and compensation add to the torque of the drives, (..., samples, joints), N m (N)."""
    return springs_torque(arm, motion) - compensation_torque(arm, motion)
