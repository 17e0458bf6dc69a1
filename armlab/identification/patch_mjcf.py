"""Writes a model into the text of the user's own MJCF, or into the MJCF that MuJoCo makes of a URDF.

Only numbers that the model has otherwise are changed, with all digits; comments and spaces stay. What MuJoCo reads from
the text before and after is compared, so defaults, units of angles and options of the compiler count as it has them.
An MJCF whose text lacks an element (a body that `<replicate>` makes) is first written out by MuJoCo.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.xml_text import XmlNode, XmlText, parse_xml_text
from armlab.identification.export import SimulatorModel, body_numbers, format_numbers, inertia_entries, link_inertias
from armlab.identification.patch import (
    MAX_CHANGE,
    MAX_ERROR,
    Carried,
    Patched,
    Target,
    check_same_arm,
    same_inertia,
    share_inertia,
)
from problem.locked_joints import lock_spec
from problem.mjcf import (
    MOVING_KINDS,
    arm_of,
    body_inertia,
    carried_bodies,
    compile_mjcf,
    compile_mjcf_text,
    import_mujoco,
    written_mjcf,
)
from problem.mjcf_document import (
    UneditableError,
    body_nodes,
    makers_of,
    moved_mjcf,
    own_node,
    read_mjcf_document,
)
from problem.urdf_document import read_urdf_root

MESH_SUFFIXES = (".stl", ".obj", ".msh")  # that MuJoCo reads
ORIENTATIONS = ("quat", "axisangle", "xyaxes", "zaxis", "euler")
KEPT_ARRAYS = (
    *("body_pos", "body_quat", "jnt_type", "jnt_pos", "jnt_axis", "jnt_range", "qpos0", "geom_type", "geom_size"),
    *("geom_pos", "site_pos", "actuator_trnid", "actuator_gear", "actuator_ctrlrange", "actuator_forcerange"),
    *("actuator_gainprm", "eq_type", "eq_data", "tendon_range", "key_qpos", "mesh_vertnum", "sensor_type"),
)


class UnreadableError(InputError):
    """MuJoCo is missing, or refuses a URDF."""


@dataclass(frozen=True, eq=False)
class Meant:
    """What MuJoCo should read from the text that is written.

    inertias: pseudo-inertias (4, 4) about the bodies' frames by their numbers, zero for a body without. joints: numbers
    of the joints of the arm, in its order. fields: of those joints, (joints,) each, as in `SimulatorModel`.
    """

    inertias: Mapping[int, Array]
    joints: tuple[int, ...]
    fields: Mapping[str, Array]
    gravity: Array
    notes: tuple[str, ...] = field(default=())


def patched_mjcf(simulated: SimulatorModel, target: Target, folder: Path) -> Patched:
    """An MJCF with the links, gravity and joint fields of a model.

    target: an MJCF, or a URDF, which MuJoCo reads. folder: where the text will stand, for the paths of its meshes.
    Raises InputError where the file has another arm than the model, where the model has no links, or where MuJoCo
    refuses the result; UnreadableError where it refuses a URDF.
    """
    if target.path.suffix == ".urdf":
        return _patched_from_urdf(simulated, target)
    before = compile_mjcf(target.path)
    meant = _meant(simulated, before, import_mujoco().MjSpec.from_file(str(target.path)), target)
    try:
        document, included = read_mjcf_document(target.path)
        text = _edited(document.text(), before, meant, target)
        notes = [f"the file holds what {target.path.name} includes: {', '.join(included)}"] if included else []
        return Patched(moved_mjcf(text, target.path, folder), (*notes, *meant.notes))
    except UneditableError as error:
        written = written_mjcf(import_mujoco().MjSpec.from_file(str(target.path)), target.path)
        note = f"written by MuJoCo, without comments, with six digits where nothing changes: {error}"
        return Patched(_edited(written, before, meant, target), (note, *meant.notes))


def _patched_from_urdf(simulated: SimulatorModel, target: Target) -> Patched:
    spec, notes = _spec_of_urdf(target.path)
    before = spec.compile()
    spec.compiler.inertiafromgeom = import_mujoco().mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    text = written_mjcf(spec, target.path)
    meant = _meant(simulated, before, spec, target)
    document = parse_xml_text(text, str(target.path))
    _write_frames(document, before)
    return Patched(_edited(document.text(), before, meant, target), (*notes, *meant.notes))


def _meant(simulated: SimulatorModel, before: Any, spec: Any, target: Target) -> Meant:
    """What the file should hold. before: the mujoco.MjModel of the file; spec: the same, which is used up."""
    locked = lock_spec(spec, target.path, target.positions)
    check_same_arm(simulated, arm_of(locked, target.path), target.path)
    inertias = {number: body_inertia(before, number) for number in range(1, before.nbody)}
    groups, notes = carried_bodies(locked), list[str]()
    for group, total in zip(groups, link_inertias(simulated), strict=True):
        first = group[0].number
        own = [Carried(before.body(e.number).name, e.seen, _moves_against(before, e.number, first)) for e in group]
        shares = share_inertia(total, own, target.path)
        if not same_inertia(own[0].seen, shares.first, MAX_CHANGE):
            inertias[first] = shares.first
        inertias |= {group[place].number: np.zeros((4, 4)) for place in shares.emptied}
        notes += shares.note(own)
    joints = tuple(int(before.body_jntadr[group[0].number]) for group in groups)
    fields = {name: simulated.field(name) for name in _stated_fields(before, joints)}
    return Meant(inertias, joints, fields, np.asarray(simulated.model.arm.gravity), tuple(notes))


def _moves_against(model: Any, body: int, first: int) -> bool:
    """Whether one of the bodies from a body to another one before it, without that one, has a joint."""
    while body != first:
        if model.body_jntnum[body]:
            return True
        body = int(model.body_parentid[body])
    return False


def _stated_fields(model: Any, joints: Sequence[int]) -> dict[str, Array]:
    """The fields of joints as MuJoCo has them, (joints,) each, by their names in MJCF; rad, also of `springref`."""
    places = list(joints)
    dofs, positions = model.jnt_dofadr[places], model.jnt_qposadr[places]
    return {
        "damping": np.array(model.dof_damping[dofs]),
        "frictionloss": np.array(model.dof_frictionloss[dofs]),
        "armature": np.array(model.dof_armature[dofs]),
        "stiffness": np.array(model.jnt_stiffness[places]),
        "springref": np.array(model.qpos_spring[positions]),
    }


def _edited(text: str, before: Any, meant: Meant, target: Target) -> str:
    """The text with the numbers that are meant. before: the mujoco.MjModel that it stands for."""
    path = target.path
    document = parse_xml_text(text, str(path))
    nodes = body_nodes(document, before)
    _set_options(document, before, meant)
    _set_joints(document, nodes, before, meant, path)
    _set_bodies(document, nodes, compile_mjcf_text(moved_mjcf(document.text(), path, None), path), meant, path)
    text = document.text()
    _check(compile_mjcf_text(moved_mjcf(text, path, None), path), before, meant, path)
    return text


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
    stated, degrees = _stated_fields(before, meant.joints), _in_degrees(document)
    for place, joint in enumerate(meant.joints):
        values = {name: float(meant.fields[name][place]) for name in stated}
        changed = {name: value for name, value in values.items() if value != stated[name][place]}
        if not values["stiffness"]:
            changed.pop("springref", None)
        if not changed:
            continue
        body = int(before.jnt_bodyid[joint])
        found = own_node(nodes[body], "joint") if body in nodes else None
        if found is None:
            raise UneditableError(_not_in_text(f"joint '{before.joint(joint).name}'", document, path))
        turns = MOVING_KINDS[int(before.jnt_type[joint])] == "revolute"
        if "springref" in changed and degrees and turns:
            changed["springref"] = float(np.degrees(changed["springref"]))
        higher = {name: _higher_orders(before, name, joint) for name in changed}
        found[0].set({name: format_numbers((value, *higher[name])) for name, value in changed.items()})
        if changed.keys() & {"damping", "stiffness"}:
            _unset_springdamper(document, found[0])


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
        inertial.set({**dict.fromkeys(ORIENTATIONS), **_inertial_numbers(pseudo)})


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
    stated = _stated_fields(after, meant.joints)
    for name, values in meant.fields.items():
        matters = meant.fields["stiffness"] != 0 if name == "springref" else np.ones(len(meant.joints), dtype=bool)
        if not np.allclose(stated[name][matters], values[matters], rtol=MAX_ERROR, atol=0):
            raise UneditableError(f"{path.name}: {name} of the joints is not what their elements state")
    if not np.allclose(after.opt.gravity, meant.gravity, rtol=MAX_ERROR):
        raise UneditableError(f"{path.name}: gravity is not what <option> states")


def _write_frames(document: XmlText, model: Any) -> None:
    """Gives the frames of bodies and joints all digits, in a text that MuJoCo has written of a URDF."""
    for number, body in body_nodes(document, model).items():
        pose = {"pos": format_numbers(model.body_pos[number]), "quat": format_numbers(model.body_quat[number])}
        body.set({**dict.fromkeys(ORIENTATIONS), **pose})
        joint, found = int(model.body_jntadr[number]), body.find("joint")
        if found is not None:
            found.set({"axis": format_numbers(model.jnt_axis[joint])})


def _spec_of_urdf(source: Path) -> tuple[Any, list[str]]:
    """A mujoco.MjSpec of a URDF with the frames of fixed joints, and what a person has to know of it.

    Meshes that are not at hand, or that MuJoCo cannot read, are left out. Raises UnreadableError.
    """
    root, left_out = read_urdf_root(source), list[str]()
    for link in root.findall("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            mesh = shape.find("geometry/mesh")
            if mesh is None:
                continue
            path = _mesh_path(str(mesh.get("filename")), source)
            if path is None:
                left_out.append(str(mesh.get("filename")))
                link.remove(shape)
            else:
                mesh.set("filename", str(path))
    for own in root.findall("mujoco"):
        root.remove(own)
    keep = dict.fromkeys(("strippath", "fusestatic", "discardvisual", "inertiafromgeom"), "false")
    ElementTree.SubElement(ElementTree.SubElement(root, "mujoco"), "compiler", {**keep, "balanceinertia": "true"})
    try:
        spec = import_mujoco().MjSpec.from_string(ElementTree.tostring(root, encoding="unicode"))
        spec.compile()
    except (InputError, ValueError) as error:
        raise UnreadableError(f"MuJoCo cannot read {source.name}: {' '.join(str(error).split())}") from None
    names = ", ".join(sorted(set(left_out)))
    return spec, [f"left out, since they are not at hand as STL or OBJ: {names}"] if names else []


def _mesh_path(name: str, source: Path) -> Path | None:
    """The file of a mesh as a URDF names it; packages are looked for in the folders above the URDF."""
    package, mark, inner = name.removeprefix("file://").partition("package://")
    choices = [folder / inner for folder in source.resolve().parents] if mark else [source.resolve().parent / package]
    found = [path for path in choices if path.is_file() and path.suffix.lower() in MESH_SUFFIXES]
    return found[0] if found else None
