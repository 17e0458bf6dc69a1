"""The tree of joints of an MJCF, and which of them others lead: before it is an arm."""

from pathlib import Path
from typing import Any

import numpy as np

from armlab.common.errors import InputError
from problem.kinematic_tree import Follower, KinematicTree, TreeJoint
from problem.mjcf_laws import is_disabled
from problem.mjcf_names import body_name, joint_name

MOVING_KINDS = {2: "prismatic", 3: "revolute"}  # mjJNT_SLIDE, mjJNT_HINGE


def read_couplings(model: Any, path: Path) -> dict[str, Follower]:
    """What joints follow by the active equality constraints; InputError for those that are no line between joints."""
    out: dict[str, Follower] = {}
    if is_disabled(model, "EQUALITY", "CONSTRAINT"):
        return out
    import mujoco

    kinds = mujoco.mjtEq
    for number in np.flatnonzero(model.eq_active0).tolist():
        name, kind = model.equality(number).name, int(model.eq_type[number])
        what = f"{path}, equality constraint {repr(name) if name else number + 1}"
        tree = mjcf_tree(model, path)
        if kind in (kinds.mjEQ_CONNECT, kinds.mjEQ_WELD):
            one, other = (body_name(model, body) for body in _tied_bodies(model, number))
            if tree.is_rigid(one, other):
                continue
            raise tree.refuse(f"{what}: closed chains are not supported", (one, other))
        if kind != kinds.mjEQ_JOINT:
            raise InputError(f"{what}: only joints may be coupled, no tendons and no flexible bodies")
        tied = joint_name(model, int(model.eq_obj1id[number]))
        if int(model.eq_obj2id[number]) < 0:
            raise InputError(f"{what}: it holds joint '{tied}' still: use --lock of `armlab recording import` instead")
        if model.eq_data[number, 2:5].any():
            raise tree.refuse(f"{what}: joint '{tied}' follows a curve, only a straight line is supported")
        joint, line = _line(model, number)
        follower = joint_name(model, joint)
        if follower in out:
            raise tree.refuse(
                f"{what}: joint '{joint_name(model, joint)}' follows two joints: closed chains are not supported"
            )
        out[joint_name(model, joint)] = line
    return out


def _tied_bodies(model: Any, equality: int) -> list[int]:
    """The two bodies that a constraint holds together, which may name sites of them."""
    import mujoco

    ends = [int(model.eq_obj1id[equality]), int(model.eq_obj2id[equality])]
    of_sites = int(model.eq_objtype[equality]) == int(mujoco.mjtObj.mjOBJ_SITE)
    return [int(model.site_bodyid[end]) for end in ends] if of_sites else ends


def mjcf_tree(model: Any, path: Path) -> KinematicTree:
    """All joints and fixed bodies of a mujoco.MjModel, also of one that is no chain; path: for messages."""
    joints: list[TreeJoint] = []
    for body in range(1, model.nbody):
        name, link = body_name(model, body), body_name(model, int(model.body_parentid[body]))
        own = joints_of_body(model, body)
        for joint in own:
            child = name if joint == own[-1] else f"{name}, joint {joint}"
            joints.append(_tree_joint(model, joint, link, child))
            link = child
        if not own:
            joints.append(TreeJoint(name, link, name, moves=False))
    return KinematicTree(str(path), tuple(joints))


def _tree_joint(model: Any, joint: int, parent: str, child: str) -> TreeJoint:
    """A joint of the tree; one whose kind no arm has can only be locked at zero."""
    kind = int(model.jnt_type[joint])
    low, high = model.jnt_range[joint].tolist() if model.jnt_limited[joint] else (-np.inf, np.inf)
    limits = (float(low), float(high)) if kind in MOVING_KINDS else (0.0, 0.0)
    return TreeJoint(joint_name(model, joint), parent, child, True, limits, _follower(model, joint))


def _follower(model: Any, joint: int) -> Follower | None:
    """What a joint follows by an equality constraint that is a straight line."""
    import mujoco

    kind = mujoco.mjtEq.mjEQ_JOINT
    for equality in range(model.neq):
        straight, led = not model.eq_data[equality, 2:5].any(), int(model.eq_obj2id[equality]) >= 0
        if model.eq_type[equality] == kind and led and straight:
            tied, line = _line(model, equality)
            if tied == joint:
                return line
    return None


def _line(model: Any, equality: int) -> tuple[int, Follower]:
    """The joint that follows by an equality constraint, and its line, which the file counts from reference positions.

    Such a constraint ties both joints alike. Where one lies behind the other, it is the one that follows.
    """
    joint, leader = int(model.eq_obj1id[equality]), int(model.eq_obj2id[equality])
    start, slope = model.eq_data[equality, :2].tolist()
    zero, leader_zero = (float(model.qpos0[model.jnt_qposadr[each]]) for each in (joint, leader))
    offset = zero + start - slope * leader_zero
    if slope and _lies_behind(model, leader, joint):
        return leader, Follower(joint_name(model, joint), 1 / slope, -offset / slope)
    return joint, Follower(joint_name(model, leader), slope, offset)


def _lies_behind(model: Any, joint: int, other: int) -> bool:
    """Whether a joint moves on what another one moves."""
    body, wanted = int(model.jnt_bodyid[joint]), int(model.jnt_bodyid[other])
    while body and body != wanted:
        body = int(model.body_parentid[body])
    return body == wanted and joint > other


def joints_of_body(model: Any, body: int) -> range:
    """The numbers of the joints of a body."""
    first = int(model.body_jntadr[body])
    return range(first, first + int(model.body_jntnum[body]))
