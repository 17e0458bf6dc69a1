"""One arm out of a robot file with grippers, mimic fingers or several arms: the other joints are locked."""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from armlab.common.errors import InputError
from armlab.common.xml_text import parse_xml_text, read_xml_text
from problem.arm import Arm
from problem.kinematic_tree import KinematicTree
from problem.mjcf import (
    arm_of,
    compile_mjcf,
    compile_mjcf_text,
    import_mujoco,
    mjcf_spec,
    written_mjcf,
)
from problem.mjcf_document import UneditableError, moved_mjcf
from problem.mjcf_meshes import text_with_inertia
from problem.mjcf_tree import MOVING_KINDS, mjcf_tree
from problem.robot_file import check_arm
from problem.urdf import chain_of
from problem.urdf_document import lock_urdf, moved_urdf, read_urdf_root, urdf_text, urdf_tree

RECORD_MARK = "armlab: locked joints"
MINUS = "\\u002d"  # in JSON: an XML comment has no two hyphens in a row
_RECORD = re.compile(rf"\s*<!-- {RECORD_MARK} (\{{.*?\}}) -->", re.DOTALL)


@dataclass(frozen=True)
class LockRecord:
    """What a file with locked joints says of itself: the whole robot's file, and positions by joint, rad or m."""

    original: Path
    positions: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class LockedRobot:
    """A robot file with one arm.

    document: its text, in the format of its source. positions: of the joints that are locked, rad or m; their links
    belong to the link that carries them, so no mass is lost. original: the file of the whole robot.
    """

    arm: Arm
    document: str
    positions: Mapping[str, float]
    original: Path

    @property
    def words(self) -> str:
        """What is locked, in one line."""
        locked = ", ".join(f"{name} at {position:g}" for name, position in self.positions.items())
        return f"{len(self.arm)} moving joint{'s' * (len(self.arm) > 1)}; locked: {locked or 'none'}"

    def text(self, original: str) -> str:
        """The document with a comment that says what is locked. original: the whole robot's file beside this text."""
        if not self.positions:
            return self.document
        record = json.dumps({"original": original, "positions": dict(self.positions)})
        document = parse_xml_text(self.document, str(self.original))
        comment = f"<!-- {RECORD_MARK} {record.replace('--', MINUS * 2)} -->"
        document.root.pieces.insert(0, f"\n  {comment}")
        return document.text()


def read_lock_record(path: Path) -> LockRecord | None:
    """What a robot file says of its locked joints; None where it says nothing. InputError for a damaged comment."""
    try:
        found = _RECORD.search(path.read_text(encoding="utf-8", errors="replace"))
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None
    if found is None:
        return None
    try:
        content = json.loads(found[1])
        positions = {str(name): float(position) for name, position in content["positions"].items()}
        original = path.parent / str(content["original"])
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        raise InputError(f"{path}: the comment '{RECORD_MARK}' is damaged: lock the joints again") from None
    if not np.isfinite(list(positions.values())).all():
        raise InputError(f"{path}: the comment '{RECORD_MARK}' should hold finite positions")
    return LockRecord(original, positions)


def lock_joints(path: Path, tip: str | None, given: Mapping[str, float], folder: Path) -> LockedRobot:
    """A URDF or MJCF file with one arm: names, frames, meshes and the drives of moving joints stay.

    tip: the link where the arm ends, so that every joint that is not on the way to it is locked. given: positions of
    joints to lock, rad or m; the others stand at zero, or at the limit next to it. folder: where the file will stand,
    for the paths of its meshes; those of an MJCF with locked joints are made absolute. Joints that the file names as
    locked already are locked in what is made of it. Raises InputError for another kind of file, for unknown names, and
    where what is left is no single chain.
    """
    if path.suffix not in (".urdf", ".xml"):
        raise InputError(f"{path}: only joints of a URDF or MJCF (.xml) file can be locked")
    arm, text, positions = (_lock_urdf if path.suffix == ".urdf" else _lock_mjcf)(path, tip, given, folder)
    record = read_lock_record(path)
    if record is None:
        return LockedRobot(arm, text, positions, path)
    return LockedRobot(arm, _RECORD.sub("", text), {**record.positions, **positions}, record.original)


def robot_text(path: Path, folder: Path) -> str:
    """The text of a URDF or MJCF file as it is to stand in another folder, with what it includes.

    The paths of meshes lead from there, and the inertia that MuJoCo computes of meshes is stated, so that the text can
    be read without them. An MJCF that is no well-formed XML is written by MuJoCo.
    """
    if path.suffix == ".urdf":
        return moved_urdf(read_xml_text(path).text(), path, folder)
    try:
        return moved_mjcf(text_with_inertia(path, compile_mjcf(path), compile_mjcf_text), path, folder)
    except UneditableError:
        return written_mjcf(mjcf_spec(path), path)


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


def _lock_urdf(
    path: Path, tip: str | None, given: Mapping[str, float], folder: Path
) -> tuple[Arm, str, dict[str, float]]:
    root = read_urdf_root(path)
    positions = urdf_tree(root, path).locked_positions(tip, given)
    lock_urdf(root, path, positions)
    arm = check_arm(chain_of(root, path).arm, str(path))
    return arm, moved_urdf(urdf_text(root), path, folder) if positions else robot_text(path, folder), positions


def _lock_mjcf(
    path: Path, tip: str | None, given: Mapping[str, float], folder: Path
) -> tuple[Arm, str, dict[str, float]]:
    model = compile_mjcf(path)
    positions = mjcf_tree(model, path).locked_positions(tip, given)
    if not positions:
        return check_arm(arm_of(model, path), str(path)), robot_text(path, folder), positions
    spec = mjcf_spec(path)
    locked = lock_spec(spec, path, positions)
    text = written_mjcf(spec, path)
    return check_arm(arm_of(locked, path), str(path)), text, positions


def lock_spec(spec: Any, path: Path, positions: Mapping[str, float]) -> Any:
    """The mujoco.MjModel of a mujoco.MjSpec with joints at positions (rad or m); takes them out of the spec.

    What names them (tendons, drives, sensors, constraints, keyframes) goes. Bodies keep their numbers. path: of the
    file, for messages.
    """
    model = spec.compile()
    _remove_what_names(spec, set(positions))
    _stand_still(spec, model, positions, mjcf_tree(model, path))
    return spec.compile()


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
