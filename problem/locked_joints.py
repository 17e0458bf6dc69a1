"""One arm out of a robot file with grippers, mimic fingers or several arms: the other joints are locked."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from armlab.common.errors import InputError
from problem.arm import Arm
from problem.kinematic_tree import KinematicTree
from problem.mjcf import MOVING_KINDS, arm_of, compile_mjcf, import_mujoco, mjcf_tree, written_mjcf
from problem.robot_file import check_arm
from problem.urdf import chain_of
from problem.urdf_document import lock_urdf, move_urdf, read_urdf_root, urdf_text, urdf_tree


@dataclass(frozen=True, eq=False)
class LockedRobot:
    """A robot file with one arm.

    text: of the file, in the format of its source. positions: of the joints that are locked, rad or m; their links
    belong to the link that carries them, so no mass is lost.
    """

    arm: Arm
    text: str
    positions: Mapping[str, float]

    @property
    def words(self) -> str:
        """What is locked, in one line."""
        locked = ", ".join(f"{name} at {position:g}" for name, position in self.positions.items())
        return f"{len(self.arm)} moving joint{'s' * (len(self.arm) > 1)}; locked: {locked or 'none'}"


def lock_joints(path: Path, tip: str | None, given: Mapping[str, float], folder: Path) -> LockedRobot:
    """A URDF or MJCF file with one arm: names, frames, meshes and the drives of moving joints stay.

    tip: the link where the arm ends, so that every joint that is not on the way to it is locked. given: positions of
    joints to lock, rad or m; the others stand at zero, or at the limit next to it. folder: where the file will stand,
    for the paths of its meshes; those of MJCF are made absolute. Without joints to lock the file stays as it is.
    Raises InputError for another kind of file, for unknown names, and where what is left is no single chain.
    """
    if path.suffix == ".urdf":
        return _lock_urdf(path, tip, given, folder)
    if path.suffix == ".xml":
        return _lock_mjcf(path, tip, given)
    raise InputError(f"{path}: only joints of a URDF or MJCF (.xml) file can be locked")


def parse_locks(given: tuple[str, ...]) -> dict[str, float]:
    """Positions by joint from texts such as `finger=0.02`; InputError where one is none."""
    positions: dict[str, float] = {}
    for text in given:
        name, _, value = text.rpartition("=")
        try:
            position = float(value)
        except ValueError:
            position = np.nan
        if not name or not np.isfinite(position):
            raise InputError(f"--lock {text}: should be JOINT=VALUE with a number in rad (m for a sliding joint)")
        if name in positions:
            raise InputError(f"--lock names '{name}' twice")
        positions[name] = position
    return positions


def _lock_urdf(path: Path, tip: str | None, given: Mapping[str, float], folder: Path) -> LockedRobot:
    root = read_urdf_root(path)
    positions = urdf_tree(root, path).locked_positions(tip, given)
    lock_urdf(root, path, positions)
    arm = check_arm(chain_of(root, path).arm, str(path))
    move_urdf(root, path, folder)
    return LockedRobot(arm, urdf_text(root), positions)


def _lock_mjcf(path: Path, tip: str | None, given: Mapping[str, float]) -> LockedRobot:
    model, mujoco = compile_mjcf(path), import_mujoco()
    tree = mjcf_tree(model, path)
    positions = tree.locked_positions(tip, given)
    if not positions and len(mujoco.mju_getXMLDependencies(str(path))) == 1:
        return LockedRobot(check_arm(arm_of(model, path), str(path)), path.read_text(encoding="utf-8"), positions)
    spec = mujoco.MjSpec.from_file(str(path))
    spec.compile()
    _remove_what_names(spec, set(positions))
    _stand_still(spec, model, positions, tree)
    text = written_mjcf(spec, path)
    return LockedRobot(check_arm(arm_of(spec.compile(), path), str(path)), text, positions)


def _stand_still(spec: Any, model: Any, positions: Mapping[str, float], tree: KinematicTree) -> None:
    """Takes joints out of a mujoco.MjSpec; their bodies stand where the joints had them."""
    for name, position in positions.items():
        joint = spec.joint(name)
        if len(joint.parent.joints) > 1:
            raise InputError(
                f"{tree.where}, body '{joint.parent.name}': more than one joint on a body is not supported"
            )
        if int(joint.type) in MOVING_KINDS:
            number = model.joint(name).id
            travel = position - float(model.qpos0[model.jnt_qposadr[number]])
            _move_body(spec, joint.parent, model.jnt_axis[number], model.jnt_pos[number], travel, joint.type)
        spec.delete(joint)


def _move_body(spec: Any, body: Any, axis: Any, anchor: Any, travel: float, kind: Any) -> None:
    """Moves a body within its parent as a joint would. axis, anchor: (3,), in its own frame; travel: rad or m."""
    mujoco, own, turn, turned = import_mujoco(), np.array(body.quat, dtype=float), np.zeros(4), np.zeros(4)
    if body.alt.type != mujoco.mjtOrientation.mjORIENTATION_QUAT:
        given = spec.resolve_orientation(spec.compiler.degree, spec.compiler.eulerseq, body.alt)
        own = np.array(given, dtype=float)
        body.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
    shift, rotated = np.array(axis, dtype=float) * travel, np.zeros(3)
    mujoco.mju_normalize4(own)
    if kind == mujoco.mjtJoint.mjJNT_HINGE:
        mujoco.mju_axisAngle2Quat(turn, axis, travel)
        mujoco.mju_rotVecQuat(rotated, anchor, turn)
        shift = anchor - rotated
        mujoco.mju_mulQuat(turned, own, turn)
        body.quat = turned
    else:
        body.quat = own
    mujoco.mju_rotVecQuat(rotated, shift, own)
    body.pos = np.array(body.pos) + rotated


def _remove_what_names(spec: Any, joints: set[str]) -> None:
    """Removes tendons, drives, sensors and constraints of joints, and all keyframes."""
    mujoco = import_mujoco()
    tendons = [each for each in spec.tendons if any(getattr(wrap.target, "name", "") in joints for wrap in each.path)]
    tendon_names = {each.name for each in tendons}
    of_drive = {mujoco.mjtTrn.mjTRN_JOINT: joints, mujoco.mjtTrn.mjTRN_JOINTINPARENT: joints}
    of_drive[mujoco.mjtTrn.mjTRN_TENDON] = tendon_names
    drives = [each for each in spec.actuators if each.target in of_drive.get(each.trntype, ())]
    kinds = mujoco.mjtObj
    seen = {
        kinds.mjOBJ_JOINT: joints,
        kinds.mjOBJ_TENDON: tendon_names,
        kinds.mjOBJ_ACTUATOR: {each.name for each in drives},
    }
    sensors = [each for each in spec.sensors if each.objname in seen.get(each.objtype, ())]
    tied = {mujoco.mjtEq.mjEQ_JOINT: joints, mujoco.mjtEq.mjEQ_TENDON: tendon_names}
    ties = [each for each in spec.equalities if {each.name1, each.name2} & set(tied.get(each.type, ()))]
    for each in (*sensors, *drives, *ties, *tendons, *spec.keys):
        spec.delete(each)
