"""Writes numbers into the text of an MJCF, so that MuJoCo reads the model that is meant.

Only numbers that MuJoCo reads otherwise are changed, with all digits; comments and spaces stay. What MuJoCo reads from
the text before and after is compared, so defaults, units of angles and options of the compiler count as it has them.
An MJCF whose text lacks an element (a body that `<replicate>` makes) is first written out by MuJoCo.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.xml_text import XmlNode, XmlText, parse_xml_text
from armlab.identification.export import body_numbers, format_numbers, inertia_entries
from problem.mjcf import body_inertia, compile_mjcf_text, import_mujoco, mjcf_spec, written_mjcf
from problem.mjcf_document import (
    UneditableError,
    body_nodes,
    makers_of,
    moved_mjcf,
    named_nodes,
    own_node,
    own_nodes,
    read_mjcf_document,
)
from problem.mjcf_laws import sum_at_joints
from problem.mjcf_tree import MOVING_KINDS

MAX_CHANGE = 1e-9  # of a body's size: less is rounding, and the number stays as it is written
MAX_ERROR = 1e-6  # of a body's size: how far the file that is written may be from what is meant
STICKING = (0.9999, 0.9999, 0.001, 0.5, 2.0)  # solimp of a friction loss that holds at rest; MuJoCo's own slips
ORIENTATIONS = ("quat", "axisangle", "xyaxes", "zaxis", "euler")
KEPT_ARRAYS = (
    *("body_pos", "body_quat", "jnt_type", "jnt_pos", "jnt_axis", "jnt_range", "qpos0", "geom_type", "geom_size"),
    *("geom_pos", "site_pos", "eq_type", "eq_data", "tendon_range", "mesh_vertnum", "sensor_type"),
)
KEPT_OF_SERVO = ("name", "class", "joint", "jointinparent", "group", "user", "armature", "damping")
KEPT_OF_ACTUATORS = ("trntype", "trnid", "gear", "ctrlrange", "forcerange", "gainprm")


@dataclass(frozen=True)
class Drive:
    """A position servo as MuJoCo has it: kp (command - position) - kv velocity, SI units.

    limit: of its torque (force); infinite for none. delay: of the command, s.
    """

    kp: float
    kv: float
    limit: float
    delay: float


@dataclass(frozen=True, eq=False)
class Meant:
    """What MuJoCo should read from a text.

    inertias: pseudo-inertias (4, 4) about the bodies' frames by their numbers, zero for a body without. joints: numbers
    of the joints whose fields are meant. fields: (joints,) each, by their names in MJCF, SI units; rad, also of
    `springref`. gravity: (3,), m/s2. notes: what a person has to know, one line each. drives: of joints, by their
    numbers; their friction loss holds at rest.
    """

    inertias: Mapping[int, Array]
    joints: tuple[int, ...]
    fields: Mapping[str, Array]
    gravity: Array
    notes: tuple[str, ...] = ()
    drives: Mapping[int, Drive] = field(default_factory=dict)


def same_inertia(one: Array, other: Array, tolerance: float) -> bool:
    """Whether two pseudo-inertias (4, 4) agree to a share of the larger one's size."""
    size = max(np.abs(one).max(), np.abs(other).max())
    return bool(np.abs(one - other).max() <= tolerance * size)


def edit_mjcf_file(path: Path, before: Any, meant: Meant) -> tuple[str, tuple[str, ...]]:
    """The text of an MJCF file with what is meant, and what a person has to know of it, one line each.

    before: the mujoco.MjModel of the file. Paths of meshes are those of the file, or absolute. Raises InputError where
    MuJoCo does not read what is meant.
    """
    try:
        document, included = read_mjcf_document(path)
        text = edit_mjcf(document.text(), path, before, meant)
        return text, (f"the file holds what {path.name} includes: {', '.join(included)}",) if included else ()
    except UneditableError as error:
        written = written_mjcf(mjcf_spec(path), path)
        note = f"written by MuJoCo, without comments, with six digits where nothing changes: {error}"
        return edit_mjcf(written, path, before, meant), (note,)


def stated_fields(model: Any, joints: Sequence[int]) -> dict[str, Array]:
    """The fields of joints as MuJoCo has them, (joints,) each, by their names in MJCF; rad, also of `springref`.

    Damping and armature of the actuators of a joint count.
    """
    places = list(joints)
    dofs, positions = model.jnt_dofadr[places], model.jnt_qposadr[places]
    return {
        "damping": np.array(model.dof_damping[dofs]) + sum_at_joints(model, "actuator_damping")[dofs],
        "frictionloss": np.array(model.dof_frictionloss[dofs]),
        "armature": np.array(model.dof_armature[dofs]) + sum_at_joints(model, "actuator_armature")[dofs],
        "stiffness": np.array(model.jnt_stiffness[places]),
        "springref": np.array(model.qpos_spring[positions]),
    }


def edit_mjcf(text: str, path: Path, before: Any, meant: Meant) -> str:
    """A text with the numbers that are meant. before: the mujoco.MjModel that it stands for.

    path: of its file, for messages and meshes. Raises UneditableError where the text has no element for a number, and
    where MuJoCo does not read what is meant.
    """
    document = parse_xml_text(text, str(path))
    nodes = body_nodes(document, before)
    _set_options(document, before, meant)
    _set_joints(document, nodes, before, meant, path)
    _set_drives(document, nodes, before, meant, path)
    _set_bodies(document, nodes, _compiled(document, path), meant, path)
    _check(_compiled(document, path), before, meant, path)
    return document.text()


def _compiled(document: XmlText, path: Path) -> Any:
    try:
        return compile_mjcf_text(moved_mjcf(document.text(), path, None), path)
    except InputError as error:
        raise UneditableError(str(error)) from None


def _set_options(document: XmlText, before: Any, meant: Meant) -> None:
    """Gravity, and options of the compiler under which bodies do not have the inertia that is stated."""
    for compiler in (child for child in document.root.children if child.tag == "compiler"):
        if compiler.attributes.get("inertiafromgeom") == "true":
            compiler.set({"inertiafromgeom": "auto"})
        if "settotalmass" in compiler.attributes:
            compiler.set({"settotalmass": None})
    if not np.array_equal(before.opt.gravity, meant.gravity):
        options = [child for child in document.root.children if child.tag == "option"]
        option = options[-1] if options else document.root.add("option", {}, first=True)
        option.set({"gravity": format_numbers(meant.gravity)})


def _set_joints(document: XmlText, nodes: Mapping[int, XmlNode], before: Any, meant: Meant, path: Path) -> None:
    stated, degrees = stated_fields(before, meant.joints), _in_degrees(document)
    for place, joint in enumerate(meant.joints):
        values = {name: float(meant.fields[name][place]) for name in stated}
        changed = {name: value for name, value in values.items() if value != stated[name][place]}
        for name in changed.keys() & {"damping", "armature"}:
            changed[name] -= float(sum_at_joints(before, f"actuator_{name}")[before.jnt_dofadr[joint]])
        if not values["stiffness"]:
            changed.pop("springref", None)
        if not changed:
            continue
        node = _joint_node(document, nodes, before, joint, path)
        turns = MOVING_KINDS[int(before.jnt_type[joint])] == "revolute"
        if "springref" in changed and degrees and turns:
            changed["springref"] = float(np.degrees(changed["springref"]))
        higher = {name: _higher_orders(before, name, joint) for name in changed}
        node.set({name: format_numbers((value, *higher[name])) for name, value in changed.items()})
        if changed.keys() & {"damping", "stiffness"}:
            _unset_springdamper(document, node)


def _joint_node(document: XmlText, nodes: Mapping[int, XmlNode], before: Any, joint: int, path: Path) -> XmlNode:
    body = int(before.jnt_bodyid[joint])
    found = [node for node, _ in own_nodes(nodes[body], "joint")] if body in nodes else []
    if len(found) != before.body_jntnum[body]:
        raise UneditableError(_not_in_text(f"joint '{before.joint(joint).name}'", document, path))
    return found[joint - int(before.body_jntadr[body])]


def _set_drives(document: XmlText, nodes: Mapping[int, XmlNode], before: Any, meant: Meant, path: Path) -> None:
    """Gives joints the drives that are meant; one that has none gets a `<position>`."""
    sections = [child for child in document.root.children if child.tag == "actuator"]
    names = [before.actuator(number).name for number in range(before.nu)]
    known = named_nodes([child for section in sections for child in section.children], names)
    for joint, drive in meant.drives.items():
        number, name = find_drive(before, joint), before.joint(joint).name
        if not np.array_equal(before.dof_solimp[before.jnt_dofadr[joint]], STICKING):
            _joint_node(document, nodes, before, joint, path).set({"solimpfriction": format_numbers(STICKING)})
        if number is not None and number not in known:
            raise UneditableError(_not_in_text(f"the actuator of joint '{name}'", document, path))
        if number is None:
            sections = sections or [document.root.add("actuator", {})]
            node = sections[-1].add("position", {"name": f"servo-{name}", "joint": name})
        else:
            node = known[number]
        node.set(_drive_numbers(node, drive, before, number, path))


def find_drive(model: Any, joint: int) -> int | None:
    """The first actuator of a joint, both from 0; None where it has none."""
    of_joint = import_mujoco().mjtTrn.mjTRN_JOINT
    found = np.flatnonzero((model.actuator_trnid[:, 0] == joint) & (model.actuator_trntype == of_joint))
    return int(found[0]) if len(found) else None


def _drive_numbers(node: XmlNode, drive: Drive, before: Any, number: int | None, path: Path) -> dict[str, str | None]:
    """Attributes of an actuator's element, as far as MuJoCo reads them otherwise. number: None for a new one."""
    numbers: dict[str, str | None] = {}
    present = None if number is None else _read_drive(before, number)
    has_filter = number is not None and bool(before.actuator_dyntype[number])
    affine = import_mujoco().mjtBias.mjBIAS_AFFINE
    if node.tag == "position":
        without_filter = {"timeconst": "0"} if has_filter else {}
        gains = {"kp": repr(drive.kp), "kv": repr(drive.kv), "dampratio": None, **without_filter}
    elif node.tag == "general" and before.actuator_biastype[number] == affine:
        law = {"gaintype": "fixed", "biastype": "affine"} | ({"dyntype": "none"} if has_filter else {})
        gains = {**law, "gainprm": repr(drive.kp), "biasprm": format_numbers((0.0, -drive.kp, -drive.kv))}
    else:
        gains = _make_servo(node) | {"kp": repr(drive.kp), "kv": repr(drive.kv)}
    if number is not None and before.actuator_gear[number, 0] != 1:
        gains |= _without_gear(before, number)
    if present is None or (present.kp, present.kv) != (drive.kp, drive.kv):
        numbers |= gains
    if present is None or present.limit != drive.limit:
        limited = math.isfinite(drive.limit)
        limits = {"forcelimited": "true", "forcerange": format_numbers((-drive.limit, drive.limit))}
        numbers |= limits if limited else {"forcelimited": "false"} if number is not None else {}
    if drive.delay != (0.0 if present is None else present.delay):
        steps = math.ceil(drive.delay / before.opt.timestep) + 1 if drive.delay else 0
        numbers |= {"delay": repr(drive.delay), "nsample": str(steps)}
    return numbers


def _make_servo(node: XmlNode) -> dict[str, str | None]:
    """Turns an actuator of another kind into a servo of its joint; what it had beside its name and place goes."""
    node.rename("position")
    node.set({key: None for key in node.attributes if key not in KEPT_OF_SERVO})
    return {"ctrllimited": "false", "timeconst": "0"}


def _without_gear(model: Any, number: int) -> dict[str, str | None]:
    """Attributes of an actuator at its joint, whose rotor and damping weigh there as they did behind the gear."""
    gear = float(model.actuator_gear[number, 0])
    own = {name: getattr(model, f"actuator_{name}", None) for name in ("armature", "damping")}
    weights = {name: float(values[number]) for name, values in own.items() if values is not None and values[number]}
    return {"gear": "1", **{name: repr(gear**2 * value) for name, value in weights.items()}}


def _read_drive(model: Any, number: int) -> Drive:
    """An actuator; kp is no number where it has another law than a drive, or a gear other than 1.

    Delays are those of versions of MuJoCo that have them.
    """
    mujoco, gain, bias = import_mujoco(), float(model.actuator_gainprm[number, 0]), model.actuator_biasprm[number]
    kinds = model.actuator_gaintype[number], model.actuator_biastype[number], model.actuator_dyntype[number]
    is_servo = kinds == (mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE, mujoco.mjtDyn.mjDYN_NONE)
    is_servo = is_servo and (bias[0], bias[1], model.actuator_gear[number, 0]) == (0.0, -gain, 1.0)
    low, high = model.actuator_forcerange[number].tolist() if model.actuator_forcelimited[number] else (-np.inf, np.inf)
    delays = getattr(model, "actuator_delay", None)
    return Drive(
        kp=gain if is_servo else np.nan,
        kv=-float(bias[2]),
        limit=high if low == -high else np.nan,
        delay=0.0 if delays is None else float(delays[number]),
    )


def _in_degrees(document: XmlText) -> bool:
    """Whether angles of a document are in degrees, as they are where nothing is said."""
    compilers = [child for child in document.root.children if child.tag == "compiler"]
    return [each.attributes["angle"] for each in compilers if "angle" in each.attributes][-1:] != ["radian"]


def _higher_orders(model: Any, name: str, joint: int) -> tuple[float, ...]:
    """Coefficients of higher orders of damping or stiffness, which newer versions of MuJoCo have; none if zero."""
    array, place = {
        "damping": (getattr(model, "dof_dampingpoly", None), int(model.jnt_dofadr[joint])),
        "stiffness": (getattr(model, "jnt_stiffnesspoly", None), joint),
    }.get(name, (None, 0))
    return () if array is None or not np.any(array[place]) else tuple(np.ravel(array[place]).tolist())


def _unset_springdamper(document: XmlText, joint: XmlNode) -> None:
    """`springdamper`, of the joint or a default, would go before damping and stiffness."""
    if any("springdamper" in node.attributes for node in document.root.walk() if node.tag == "joint"):
        joint.set({"springdamper": "0 0"})


def _set_bodies(document: XmlText, nodes: Mapping[int, XmlNode], present: Any, meant: Meant, path: Path) -> None:
    """States the inertia of bodies that have another one. present: the mujoco.MjModel of the text as it is."""
    for number, pseudo in meant.inertias.items():
        if same_inertia(body_inertia(present, number), pseudo, MAX_CHANGE):
            continue
        if number not in nodes:
            raise UneditableError(_not_in_text(f"body '{present.body(number).name}'", document, path))
        body = nodes[number]
        found = own_node(body, "inertial")
        if found is not None and found[1] is not body:
            found[1].remove(found[0])  # in a frame, which would move it
            found = None
        inertial = body.add("inertial", {}, first=True) if found is None else found[0]
        inertial.set_numbers({**dict.fromkeys(ORIENTATIONS), **_inertial_numbers(pseudo)})


def _inertial_numbers(pseudo: Array) -> dict[str, str | None]:
    """Attributes of `<inertial>`; a body without mass has a diagonal, since MuJoCo refuses a full matrix of zeros."""
    if not np.any(pseudo):
        return {"pos": "0 0 0", "mass": "0", "diaginertia": "0 0 0", "fullinertia": None}
    mass, centre, inertia = body_numbers(pseudo)
    entries = format_numbers(inertia_entries(inertia))
    return {"pos": format_numbers(centre), "mass": repr(mass), "diaginertia": None, "fullinertia": entries}


def _not_in_text(what: str, document: XmlText, path: Path) -> str:
    makers = ", ".join(makers_of(document))
    return f"{path.name} has no element of its own for {what}" + (f", which {makers} may make" if makers else "")


def _check(after: Any, before: Any, meant: Meant, path: Path) -> None:
    """Raises UneditableError where MuJoCo reads another model than what is meant."""
    for name in KEPT_ARRAYS:
        one, other = np.asarray(getattr(before, name)), np.asarray(getattr(after, name))
        if one.shape != other.shape or not np.allclose(one, other, rtol=1e-5, atol=1e-5):
            raise UneditableError(f"{path.name}: {name} of the model would change with the text")
    for number, pseudo in meant.inertias.items():
        if not same_inertia(body_inertia(after, number), pseudo, MAX_ERROR):
            raise UneditableError(f"{path.name}: body '{after.body(number).name}' does not take the inertia stated")
    stated = stated_fields(after, meant.joints)
    for name, values in meant.fields.items():
        matters = meant.fields["stiffness"] != 0 if name == "springref" else np.ones(len(meant.joints), dtype=bool)
        if not np.allclose(stated[name][matters], values[matters], rtol=MAX_ERROR, atol=0):
            raise UneditableError(f"{path.name}: {name} of the joints is not what their elements state")
    _check_drives(after, before, meant, path)
    if not np.allclose(after.opt.gravity, meant.gravity, rtol=MAX_ERROR):
        raise UneditableError(f"{path.name}: gravity is not what <option> states")


def _check_drives(after: Any, before: Any, meant: Meant, path: Path) -> None:
    changed = {find_drive(before, joint) for joint in meant.drives}
    kept = [number for number in range(before.nu) if number not in changed]
    for name in KEPT_OF_ACTUATORS:
        one, other = (getattr(model, f"actuator_{name}") for model in (before, after))
        if len(other) < len(one) or not np.allclose(one[kept], other[kept], rtol=1e-5, atol=1e-5):
            raise UneditableError(f"{path.name}: {name} of the actuators would change with the text")
    for joint, drive in meant.drives.items():
        number = find_drive(after, joint)
        numbers = None if number is None else vars(_read_drive(after, number))
        if numbers is None or not all(np.isclose(numbers[key], value) for key, value in vars(drive).items()):
            name = after.joint(joint).name
            raise UneditableError(
                f"{path.name}: the actuator of joint '{name}' does not take the drive of the model: it should be a "
                "position servo with gear 1, and default classes should leave its numbers free"
            )
