"""The torque of an arm against that of the simulator whose file it was read from: MuJoCo's inverse dynamics."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from problem.arm import Arm
from problem.coupled_joints import chain_motion, torque_at_leaders
from problem.drive_torque import drive_torque
from problem.mjcf import arm_of, compile_mjcf, import_mujoco
from problem.mjcf_laws import is_joint_drive
from problem.mjcf_names import actuator_name
from problem.motion import Motion
from problem.urdf_document import read_urdf_root

STATES = 50  # random states within the limits
MAX_SPEED, MAX_ACCELERATION = 3.0, 10.0  # rad/s, rad/s2 (m): as fast as arms move
UNLIMITED_REACH = {"revolute": np.pi, "prismatic": 0.5}  # rad, m: positions of a joint without limits
TOLERANCE = 1e-9  # of the largest torque: more is no rounding


@dataclass(frozen=True)
class SimulatorCheck:
    """An arm beside MuJoCo.

    difference: the largest of the torques, over the largest torque; friction loss, contacts, limits and equality
    constraints are switched off in both. left_out: what the file has and the arm does not, in words.
    """

    difference: float
    left_out: tuple[str, ...]

    @property
    def agrees(self) -> bool:
        """Whether the two are the same but for rounding."""
        return self.difference <= TOLERANCE


def check_with_mujoco(path: Path, with_actuators: bool) -> SimulatorCheck:
    """The arm of an MJCF file beside MuJoCo. with_actuators: whether the actuators of the file are the drives.

    Raises InputError where the file is no arm.
    """
    model = compile_mjcf(path)
    arm, left_out = arm_of(model, path), tuple(_left_out(model, with_actuators))  # before drag is switched off
    motion = random_states(arm, np.random.default_rng(0))
    without_loss = replace(arm, joint_laws=tuple(replace(law, friction=0.0) for law in arm.joint_laws))
    simulated = torque_at_leaders(arm, mujoco_torque(model, chain_motion(arm, motion)))
    worst = np.abs(drive_torque(without_loss, motion) - simulated).max() / max(np.abs(simulated).max(), 1e-300)
    return SimulatorCheck(float(worst), left_out)


def random_states(arm: Arm, rng: np.random.Generator) -> Motion:
    """States within the limits of an arm, (STATES, joints)."""
    limits = np.array([joint.limits.position for joint in arm.joints])
    reach = np.array([UNLIMITED_REACH[joint.kind] for joint in arm.joints])
    low = np.where(np.isfinite(limits[:, 0]), limits[:, 0], -reach)
    high = np.where(np.isfinite(limits[:, 1]), limits[:, 1], reach)
    size = (STATES, len(arm))
    return Motion(
        rng.uniform(low, high, size),
        rng.uniform(-MAX_SPEED, MAX_SPEED, size),
        rng.uniform(-MAX_ACCELERATION, MAX_ACCELERATION, size),
    )


def mujoco_torque(model: Any, motion: Motion) -> Array:
    """Torque that MuJoCo's inverse dynamics asks of the drives, (samples, joints), N m (N).

    Contacts, limits, friction loss, equality constraints and drag are switched off in the model, which is changed.
    """
    mujoco = import_mujoco()
    bits = mujoco.mjtDisableBit
    model.opt.disableflags |= int(
        bits.mjDSBL_CONTACT | bits.mjDSBL_LIMIT | bits.mjDSBL_FRICTIONLOSS | bits.mjDSBL_EQUALITY
    )
    model.opt.density = model.opt.viscosity = 0.0
    data, out = mujoco.MjData(model), np.empty(motion.position.shape)
    for row, state in enumerate(zip(motion.position, motion.velocity, motion.acceleration, strict=True)):
        data.qpos[:], data.qvel[:], data.qacc[:] = state
        mujoco.mj_inverse(model, data)
        out[row] = data.qfrc_inverse
    return out


def _left_out(model: Any, with_actuators: bool) -> list[str]:
    """What a file says of forces that are no part of the arm; contacts and limits need no word."""
    out = []
    if model.opt.density or model.opt.viscosity:
        out.append("drag of the medium (density, viscosity)")
    others = [each for each in range(model.nu) if not (with_actuators and is_joint_drive(model, each))]
    if others:
        out.append(f"forces of the actuators {', '.join(actuator_name(model, each) for each in others)}")
    if model.nplugin:
        out.append("plugins")
    return out


def left_out_of_urdf(path: Path) -> tuple[str, ...]:
    """Forces that a URDF states for Gazebo alone and that are no part of the arm, in words."""
    out = []
    for node in read_urdf_root(path).iter("gazebo"):
        whose = f"'{node.get('reference')}'"
        out += [f"the spring of joint {whose}" for _ in node.findall("springStiffness")]
        out += [f"the damping of link {whose}" for _ in node.findall("dampingFactor")]
        states = [(each.tag, (each.text or "").strip().lower()) for each in node]
        if {("gravity", "false"), ("gravity", "0"), ("turnGravityOff", "true"), ("turnGravityOff", "1")} & set(states):
            out.append(f"that link {whose} has no weight")
        out += [f"joint '{each.get('name')}', which closes a chain" for each in node.findall("joint")]
    return tuple(out)
