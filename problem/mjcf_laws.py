"""What an MJCF says of its joints beside bodies: damping, friction loss, springs, and what actuators add to them."""

from pathlib import Path
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from problem.arm import JointLaw
from problem.mjcf_names import joint_name


def is_disabled(model: Any, *flags: str) -> bool:
    """Whether an option of the file switches one of these parts of MuJoCo off."""
    import mujoco

    return any(model.opt.disableflags & int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag}", 0)) for flag in flags)


def read_joint_laws(model: Any, path: Path) -> tuple[JointLaw, ...]:
    """The laws of all joints of a mujoco.MjModel that has hinges and slides alone; path: of its file, for messages.

    Raises InputError, in one line, for laws that are not linear and for tendons that act on joints.
    """
    for joint in range(model.njnt):
        _refuse_nonlinear(model, joint, path)
    _refuse_tendons(model, path)
    damping = model.dof_damping + sum_at_joints(model, "actuator_damping")
    damping = np.zeros(model.nv) if is_disabled(model, "DAMPER", "PASSIVE") else damping
    friction = np.zeros(model.nv) if is_disabled(model, "FRICTIONLOSS", "CONSTRAINT") else model.dof_frictionloss
    stiffness = np.zeros(model.njnt) if is_disabled(model, "SPRING", "PASSIVE") else model.jnt_stiffness
    return tuple(
        JointLaw(
            damping=float(damping[joint]),
            friction=float(friction[joint]),
            stiffness=float(stiffness[joint]),
            rest=float(model.qpos_spring[joint]) if stiffness[joint] else 0.0,
            drive_compensates=bool(model.jnt_actgravcomp[joint]),
        )
        for joint in range(model.njnt)
    )


def read_rotors(model: Any) -> tuple[float, ...]:
    """Inertia of the rotors of all joints on the joint side, those of actuators included, kg m2 (kg)."""
    return tuple((model.dof_armature + sum_at_joints(model, "actuator_armature")).tolist())


def sum_at_joints(model: Any, name: str) -> Array:
    """A field of the actuators, which newer versions of MuJoCo have, times the square of the gear, (joints,)."""
    out, values = np.zeros(model.nv), getattr(model, name, None)
    if values is None:
        return out
    for number in np.flatnonzero(values).tolist():
        if is_joint_drive(model, number):
            out[model.jnt_dofadr[model.actuator_trnid[number, 0]]] += (
                values[number] * model.actuator_gear[number, 0] ** 2
            )
    return out


def is_joint_drive(model: Any, actuator: int) -> bool:
    """Whether an actuator acts on a joint itself, not by a tendon, a site or a crank."""
    import mujoco

    return int(model.actuator_trntype[actuator]) in (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)


def _refuse_nonlinear(model: Any, joint: int, path: Path) -> None:
    """Raises InputError for damping and springs of newer versions of MuJoCo that are no lines."""
    dof = int(model.jnt_dofadr[joint])
    for name, values in (
        ("damping", getattr(model, "dof_dampingpoly", np.zeros((model.nv, 1)))[dof]),
        ("stiffness", getattr(model, "jnt_stiffnesspoly", np.zeros((model.njnt, 1)))[joint]),
        ("springyield", np.atleast_1d(getattr(model, "jnt_springyield", np.zeros(model.njnt))[joint])),
    ):
        if np.any(values):
            raise InputError(
                f"{path}, joint '{joint_name(model, joint)}': {name} is no straight line, which is not supported"
            )


def _refuse_tendons(model: Any, path: Path) -> None:
    """Raises InputError for a tendon that pulls, brakes or has inertia."""
    for number in range(model.ntendon):
        acts = [
            name
            for name in ("stiffness", "damping", "frictionloss", "armature")
            if np.any(getattr(model, f"tendon_{name}", np.zeros(model.ntendon))[number])
        ]
        if acts:
            raise InputError(f"{path}, tendon '{model.tendon(number).name}': {acts[0]} of tendons is not supported")
