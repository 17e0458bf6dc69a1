"""`armlab model export`: a model in the user's own URDF or MJCF, or as a chain of its own."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from armlab.common.documents import ResultLines
from armlab.common.errors import InputError
from armlab.common.files import refuse_existing, write_texts
from armlab.identification.export import (
    SimulatorModel,
    build_simulator_model,
    mjcf_document,
    srdf_document,
    unstated_limits,
    urdf_document,
)
from armlab.identification.friction_lines import line_in_words
from armlab.identification.mjcf_edit import Drive
from armlab.identification.model_file import model_of, read_model_file
from armlab.identification.patch import Patched, Target, patched_urdf
from armlab.identification.patch_mjcf import UnreadableError, patched_mjcf
from armlab.recordings.recording_file import ControllerEntry
from problem.arm import Arm
from problem.joint_words import joint_in_words, joints_in_words
from problem.kinematic_tree import KinematicTree
from problem.locked_joints import read_lock_record
from problem.mjcf import compile_mjcf
from problem.mjcf_tree import mjcf_tree
from problem.urdf_document import read_urdf_root, urdf_tree

FORMATS = (".urdf", ".xml")
# What no actuator of MJCF has.
DRIVE_WORDS = {
    "ki": "integral gain",
    "ki_speed": "integral of the velocity",
    "offset": "offset of the command",
    "dead_band": "dead band",
    "limit_slope": "fall of the torque limit with speed",
}


def export_model(
    path: Path, out: Path, into: Path | None = None, locks: Mapping[str, float] | None = None
) -> ResultLines:
    """Writes the file and says what it does not hold.

    A model of a URDF becomes that URDF with other numbers, or an MJCF as MuJoCo reads the URDF; a model of an MJCF
    becomes that MJCF; any other one becomes a chain of bodies without meshes. Where joints of the robot are locked, the
    file of the whole robot takes the numbers.

    into: another robot file that takes them. locks: positions, rad or m, of joints that move in that file alone, where
    the model's robot does not say them. Raises InputError where the ending or the model does not fit.
    """
    if out.suffix not in FORMATS:
        raise InputError(f"{out}: the file should end in .urdf or .xml (MJCF)")
    if into is not None and into.suffix not in FORMATS:
        raise InputError(f"--into {into}: the file should be a .urdf or .xml (MJCF) file")
    file = read_model_file(path)
    model = model_of(file, path)
    simulated = build_simulator_model(model)
    drives = {} if file.controller is None else _drives_of(file.controller, len(model.arm))
    patched = _document(simulated, into, locks or {}, out, drives)
    texts = {out.name: patched.text}
    missing, notes = list(simulated.missing), [*patched.notes, *_friction_notes(simulated, model.arm)]
    if out.suffix == ".urdf":
        missing = [
            f"spring of {joint_in_words(model.arm, number)}"
            for number, each in enumerate(simulated.field("stiffness"), 1)
            if each
        ]
        missing += simulated.missing
        if simulated.field("armature").any():
            texts[out.with_suffix(".srdf").name] = srdf_document(simulated)
            notes.append(
                "rotor inertias stand in the .srdf, which Pinocchio reads: URDF has no place for them, MJCF has"
            )
    if file.controller is not None:
        missing += _missing_of_drives(file.controller, model.arm, patched.has_drives)
    refuse_existing(out.parent / name for name in texts)
    written = write_texts(texts, out.parent)
    yield from map(str, written)
    yield from notes
    if missing:
        yield "not in the file: " + "; ".join(missing)
    if simulated.unclaimed:
        parts = "; ".join(simulated.unclaimed)
        yield f"in the model because it predicts better with them, but not named by the verdict: {parts}"
    if simulated.thickened_links:
        yield f"given a little extent, as simulators want it: link {', '.join(map(str, simulated.thickened_links))}"
    return {
        "files": written,
        "not_in_the_file": missing,
        "unclaimed": simulated.unclaimed,
        "thickened_links": simulated.thickened_links,
        "notes": notes,
    }


def _friction_notes(simulated: SimulatorModel, arm: Arm) -> Iterator[str]:
    """Which lines stand for friction that is no line, and where a rotor's inertia is left out."""
    yield from (line_in_words(arm, line) for line in simulated.friction if line.laws)
    if simulated.negative_rotors:
        joints = joints_in_words(arm, simulated.negative_rotors)
        yield f"the rotor inertia of {joints} is negative in the model, which no simulator takes: the file has none"


def _drives_of(controller: ControllerEntry, joints: int) -> dict[int, Drive]:
    """The drives of the joints, from 0, as MuJoCo has them; none where the controller is that of some joints only."""
    if len(controller.kp) != joints or len(controller.kd) != joints:
        return {}
    limits = controller.torque_limit or (None,) * joints
    delays = np.broadcast_to(np.asarray(controller.delay, dtype=float), (joints,)).tolist()
    return {
        joint: Drive(kp, kd or 0.0, np.inf if limit is None else limit, delay)
        for joint, (kp, kd, limit, delay) in enumerate(zip(controller.kp, controller.kd, limits, delays, strict=True))
        if kp is not None
    }


def _missing_of_drives(controller: ControllerEntry, arm: Arm, has_drives: bool) -> list[str]:
    """What the file does not hold of the drives, in words; their numbers stand in the model."""
    if not has_drives:
        return ["the gains of the drives"]
    out = []
    for name, words in DRIVE_WORDS.items():
        values = getattr(controller, name) or ()
        joints = [joint for joint, value in enumerate(values, 1) if value]
        if joints:
            out.append(f"{words} of {joints_in_words(arm, joints)}")
    return out


def _document(
    simulated: SimulatorModel, into: Path | None, locks: Mapping[str, float], out: Path, drives: Mapping[int, Drive]
) -> Patched:
    robot = Path(simulated.model.robot)
    if into is None and robot.suffix not in FORMATS:
        if locks:
            raise InputError(f"--lock needs a robot file that has {', '.join(locks)}: give it with --into")
        return _chain(simulated, out)
    target, lock_notes = _choose_target(simulated, robot, into, locks)
    source = target.path
    if source.suffix == ".xml" and out.suffix == ".urdf":
        keeps = f"a chain of bodies without meshes: only an .xml file keeps what {source.name} has"
        return _chain(simulated, out, keeps)
    try:
        if out.suffix == ".urdf":
            made = patched_urdf(simulated, target, out.parent)
        else:
            made = patched_mjcf(simulated, target, out.parent, drives)
    except UnreadableError as error:
        return _chain(simulated, out, f"a chain of bodies without meshes: {error}")
    stays = f"{source.name} with other numbers: its names, frames and meshes stay"
    return replace(made, notes=(stays, *lock_notes, *made.notes))


def _choose_target(
    simulated: SimulatorModel, robot: Path, into: Path | None, locks: Mapping[str, float]
) -> tuple[Target, tuple[str, ...]]:
    """The file that takes the model, and a line on its locked joints where there are any."""
    record = read_lock_record(robot) if robot.suffix in FORMATS else None
    if into is None and record is not None and not record.original.is_file():
        raise InputError(
            f"{robot} has locked joints ({', '.join(record.positions)}), and the file of the whole robot, "
            f"{record.original}, is not there: give it with --into, or --into {robot} to leave the joints fixed"
        )
    source = into or (record.original if record else robot)
    tree = _read_tree(source)
    moving = [joint.name for joint in tree.joints if joint.moves]
    known = {} if record is None else {name: value for name, value in record.positions.items() if name in moving}
    positions = {**known, **tree.locked_positions(None, locks)}
    own = {joint.name for joint in simulated.model.arm.chain.joints}
    moved = [name for name in locks if name in own]
    if moved:
        raise InputError(
            f"--lock names {', '.join(moved)}, which the model moves: it is for joints that it does not have"
        )
    extra = [name for name in moving if name not in own and name not in positions]
    if extra:
        raise InputError(
            f"{source} has joints that the model does not have, {', '.join(extra)}: say with --lock JOINT=VALUE where "
            "they stood in the recording"
        )
    target = Target(source, positions)
    if positions:
        return target, (f"locked in the recording, free to move in this file: {', '.join(positions)}",)
    if record is not None:
        return target, (f"fixed in this file, as in the recording: {', '.join(record.positions)}",)
    return target, ()


def _read_tree(path: Path) -> KinematicTree:
    if path.suffix == ".urdf":
        return urdf_tree(read_urdf_root(path), path)
    return mjcf_tree(compile_mjcf(path), path)


def _chain(simulated: SimulatorModel, out: Path, *notes: str) -> Patched:
    if out.suffix == ".xml":
        return Patched(mjcf_document(simulated), notes)
    return Patched(urdf_document(simulated), (*notes, *unstated_limits(simulated.model.arm)))
