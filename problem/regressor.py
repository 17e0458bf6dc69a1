"""Dynamics that are linear in the inertial parameters: tau = W(q, qd, qdd) phi (eq. 9-41).

The torque is the moment (force) of each link's wrench projected on the joint's own axis. The paper's eq. 39
takes the z-component in the link's frame instead; with standard D-H frames the axis is z of the frame before.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from problem.arm import Arm, Joint
from problem.coupled_joints import chain_motion, torque_at_leaders
from problem.kernel import ffi, lib, pointer
from problem.motion import Motion

MAX_JOINTS, MAX_OWNED = 16, 3  # as in kernel.c


def observation_matrix(arm: Arm, motion: Motion) -> Array:
    """Rows that map the inertial parameters to joint torques, tau = W @ phi (eq. 39-41).

    motion: (..., samples, joints). Returns (..., samples * joints, 10 * joints), the joints of one sample in
    consecutive rows, N m per parameter unit; parameters in the order of eq. 31, link by link. The rows of joints that
    are not measured are zero. Raises ValueError if the joint counts differ.
    """
    joints = _check_joint_count(arm, motion)
    if arm.coupled:
        return _coupled_observation_matrix(arm, motion)
    out = np.zeros((*motion.batch, motion.samples * joints, 10 * joints))
    samples = motion.position.size // joints
    lib.observation_matrices(joints, *_kernel_data(arm), samples, *_motion_pointers(motion), pointer(out))
    _leave_out(arm, out.reshape(*motion.position.shape, 10 * joints))
    return out


def measured_rows(arm: Arm, torque: Array) -> Array:
    """Torque (..., samples, joints) as it can be compared: zeros for joints that are not measured."""
    if not arm.unmeasured:
        return torque
    out = torque.copy()
    out[..., sorted(arm.unmeasured)] = 0.0
    return out


def _leave_out(arm: Arm, rows: Array) -> None:
    """Zeros in the rows (..., samples, joints, columns) of joints that are not measured."""
    rows[..., sorted(arm.unmeasured), :] = 0.0


def _coupled_observation_matrix(arm: Arm, motion: Motion) -> Array:
    """The rows of all joints of the chain, summed as they work at the own joints: the columns of the own links."""
    matrix = arm.coupling[0]
    count, joints = matrix.shape
    whole = observation_matrix(arm.chain, chain_motion(arm, motion))
    by_joint = whole.reshape(*motion.batch, motion.samples, count, count, 10)[..., list(arm.chain_places), :]
    rows = np.einsum("...clp,cj->...jlp", by_joint, matrix)
    _leave_out(arm, rows.reshape(*motion.position.shape, 10 * joints))
    return np.asarray(rows.reshape(*motion.batch, motion.samples * joints, 10 * joints))


def gram_matrix(arm: Arm, motion: Motion, columns: NDArray[np.intp]) -> Array:
    """W.T @ W for chosen columns of the observation matrix, without building it.

    motion: (..., samples, joints); columns: (chosen,), ascending. Returns (..., chosen, chosen).
    Each trajectory's result is the same to the bit in any batch. Raises ValueError if joint counts differ or
    a column does not exist.
    """
    joints = _check_joint_count(arm, motion)
    if arm.coupled or arm.unmeasured:
        matrix = observation_matrix(arm, motion)[..., columns]
        return np.asarray(np.swapaxes(matrix, -1, -2) @ matrix)
    return _sum_products(arm, motion, _layout(columns.tobytes(), columns.dtype.str, joints, 0), ffi.NULL)


def extended_gram_matrix(arm: Arm, motion: Motion, columns: NDArray[np.intp], own: Array) -> Array:
    """The same for [W F], where F has columns of each joint's own, zero in the rows of all other joints.

    own: (..., samples, joints, owned), at most MAX_OWNED a joint: F in the rows of its joints. Returns (..., n, n) with
    n = chosen + joints * owned. Raises ValueError as `gram_matrix` does, and for another shape of `own`.
    """
    joints = _check_joint_count(arm, motion)
    owned = own.shape[-1]
    if own.shape[:-1] != motion.position.shape or owned > MAX_OWNED:
        raise ValueError(f"own columns should have the shape {motion.position.shape} and up to {MAX_OWNED} a joint")
    if arm.coupled or arm.unmeasured:
        rigid = observation_matrix(arm, motion)[..., columns]
        rows = np.zeros((*own.shape[:-1], joints, owned))
        rows[..., np.arange(joints), np.arange(joints), :] = own
        whole = np.concatenate([rigid, rows.reshape(*rigid.shape[:-1], joints * owned)], axis=-1)
        return np.asarray(np.swapaxes(whole, -1, -2) @ whole)
    layout = _layout(columns.tobytes(), columns.dtype.str, joints, owned)
    entries = np.ascontiguousarray(own, dtype=np.float64)
    return _sum_products(arm, motion, layout, pointer(entries))


@dataclass(frozen=True, eq=False)
class _Layout:
    """How the kernel finds the columns of a Gram matrix.

    chosen: columns of the observation matrix, ascending. first: for each joint the first of them that can be non-zero
    in its rows. owned: further columns of each joint. size: of the Gram matrix. scratch: numbers of memory to sum it.
    """

    chosen: object
    first: object
    count: int
    owned: int
    size: int
    scratch: int


@lru_cache(maxsize=64)
def _layout(columns: bytes, kind: str, joints: int, owned: int) -> _Layout:
    """Of columns in memory as numbers of a kind of numpy's; raises ValueError if one does not exist."""
    chosen = np.frombuffer(columns, dtype=kind)
    if np.any(chosen < 0) or np.any(chosen >= 10 * joints) or np.any(np.diff(chosen) <= 0):
        raise ValueError(f"columns should be ascending, from 0 to {10 * joints - 1}, not {chosen.tolist()}")
    first = np.searchsorted(chosen, 10 * np.arange(joints))
    size = len(chosen) + joints * owned
    return _Layout(
        chosen=ffi.new("int[]", chosen.tolist()),
        first=ffi.new("int[]", first.tolist()),
        count=len(chosen),
        owned=owned,
        size=size,
        scratch=lib.gram_scratch(joints, size),
    )


def _sum_products(arm: Arm, motion: Motion, layout: _Layout, own: object) -> Array:
    """The Gram matrices of a motion; own: what the own columns hold, as a C pointer."""
    *batch, samples, joints = motion.position.shape
    out = np.empty((*batch, layout.size, layout.size))
    scratch = np.empty(layout.scratch)
    lib.gram_matrices(
        joints,
        *_kernel_data(arm),
        math.prod(batch),
        samples,
        *_motion_pointers(motion),
        layout.count,
        layout.chosen,
        layout.first,
        layout.owned,
        own,
        pointer(scratch),
        pointer(out),
    )
    return out


def rigid_body_torque(arm: Arm, motion: Motion, parameters: Array | None = None) -> Array:
    """Joint torques of the rigid links, W @ phi and that of the links of coupled joints, without rotors and friction.

    motion: (..., samples, joints); parameters: (10 * joints,), the arm's own if left out.
    Returns (..., samples, joints), N m (N). Raises ValueError without parameters or if joint counts differ.
    """
    torque = torque_of_links(arm, motion, arm.parameters if parameters is None else parameters)
    return torque + coupled_links_torque(arm, motion) if arm.coupled else torque


def coupled_links_torque(arm: Arm, motion: Motion) -> Array:
    """Joint torques of the links of coupled joints, (..., samples, joints), N m (N); zeros without any."""
    if not arm.coupled:
        return np.zeros(motion.position.shape)
    parameters = arm.chain.parameters.reshape(-1, 10)
    parameters[list(arm.chain_places)] = 0.0
    torque = torque_of_links(arm.chain, chain_motion(arm, motion), parameters.ravel())
    return measured_rows(arm, torque_at_leaders(arm, torque))


def torque_of_links(arm: Arm, motion: Motion, parameters: Array) -> Array:
    """W @ phi, (..., samples, joints), N m (N): linear in the parameters (10 * joints,); errors as above."""
    joints = _check_joint_count(arm, motion)
    if arm.coupled:
        whole = np.zeros((len(arm.chain), 10))
        whole[list(arm.chain_places)] = np.asarray(parameters).reshape(joints, 10)
        torque = torque_of_links(arm.chain, chain_motion(arm, motion), whole.ravel())
        return measured_rows(arm, torque_at_leaders(arm, torque))
    phi = np.ascontiguousarray(parameters, dtype=np.float64)
    if phi.shape != (10 * joints,):
        raise ValueError(f"{arm.name!r} takes {10 * joints} parameters, not an array of shape {phi.shape}")
    out = np.empty(motion.position.shape)
    samples = motion.position.size // joints
    lib.torques(joints, *_kernel_data(arm), samples, *_motion_pointers(motion), pointer(phi), pointer(out))
    return measured_rows(arm, out)


def inertia_column(arm: Arm, position: Array, joint: int, parameters: Array | None = None) -> Array:
    """A column of the links' inertia matrix: torques of a unit acceleration of one joint (from 0), nothing else.

    position: (samples, joints); parameters: as in `rigid_body_torque`. Returns (samples, joints), kg m2 (kg, kg m),
    without rotors. Raises ValueError as `rigid_body_torque` does.
    """
    still, push = np.zeros(position.shape), np.zeros(position.shape)
    push[:, joint] = 1.0
    return rigid_body_torque(replace(arm, gravity=(0.0, 0.0, 0.0)), Motion(position, still, push), parameters)


def _check_joint_count(arm: Arm, motion: Motion) -> int:
    if motion.joints != len(arm):
        raise ValueError(f"the motion has {motion.joints} joints, the arm {arm.name!r} has {len(arm)}")
    if len(arm) > MAX_JOINTS:
        raise ValueError(f"arms of up to {MAX_JOINTS} joints are supported; {arm.name!r} has {len(arm)}")
    return len(arm)


def _motion_pointers(motion: Motion) -> tuple[object, object, object]:
    return pointer(motion.position), pointer(motion.velocity), pointer(motion.acceleration)


@lru_cache(maxsize=64)
def _kernel_data(arm: Arm) -> tuple[object, object]:
    """The arm and its gravity as the C kernel reads them."""
    data = ffi.new("JointData[]", len(arm))
    for entry, joint in zip(data, arm.joints, strict=True):
        _fill_joint_data(entry, joint)
    return data, ffi.new("double[3]", [float(value) for value in arm.gravity])


def _fill_joint_data(entry: object, joint: Joint) -> None:
    rotation = joint.after[:3, :3]
    shift = rotation.T @ joint.after[:3, 3]
    values = {
        "prismatic": int(joint.kind == "prismatic"),
        "shifted_before": int(bool(np.any(joint.before[:3, 3]))),
        "shifted_after": int(bool(np.any(shift))),
        "before_rotation": joint.before[:3, :3].ravel().tolist(),
        "before_shift": joint.before[:3, 3].tolist(),
        "after_rotation": rotation.ravel().tolist(),
        "after_shift": shift.tolist(),
        "axis": rotation[2].tolist(),
    }
    for name, value in values.items():
        setattr(entry, name, value)
