"""Writes a model into the text of the user's own MJCF, or into the MJCF that MuJoCo makes of a URDF."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from armlab.common.errors import InputError, in_one_line
from armlab.common.report.wording import join_words
from armlab.common.xml_text import XmlText, parse_xml_text
from armlab.identification.export import SimulatorModel, format_numbers, link_inertias
from armlab.identification.mjcf_edit import (
    MAX_CHANGE,
    ORIENTATIONS,
    Drive,
    Meant,
    edit_mjcf,
    edit_mjcf_file,
    same_inertia,
    stated_fields,
)
from armlab.identification.patch import Carried, Patched, Target, check_same_arm, share_inertia
from problem.locked_joints import lock_spec
from problem.mjcf import (
    arm_of,
    body_inertia,
    carried_bodies,
    compile_mjcf,
    import_mujoco,
    mjcf_spec,
    written_mjcf,
)
from problem.mjcf_document import body_nodes, moved_mjcf
from problem.mjcf_tree import joints_of_body
from problem.urdf_document import read_urdf_root

NO_DRIVES: Mapping[int, Drive] = MappingProxyType({})
MAX_NOTHING = 1e-6  # of the largest link: a frame without mass, as simulators want it
MESH_SUFFIXES = (".stl", ".obj", ".msh")  # that MuJoCo reads


class UnreadableError(InputError):
    """MuJoCo is missing, or refuses a URDF."""


def patched_mjcf(
    simulated: SimulatorModel, target: Target, folder: Path, drives: Mapping[int, Drive] = NO_DRIVES
) -> Patched:
    """An MJCF with the links, gravity and joint fields of a model.

    target: an MJCF, or a URDF, which MuJoCo reads. folder: where the text will stand, for the paths of its meshes.
    drives: of joints of the model, from 0.
    Raises InputError where the file has another arm than the model, where the model has no links, or where MuJoCo
    refuses the result; UnreadableError where it refuses a URDF.
    """
    if target.path.suffix == ".urdf":
        return _patched_from_urdf(simulated, target, drives)
    before = compile_mjcf(target.path)
    meant = _meant(simulated, before, mjcf_spec(target.path), target, drives)
    text, notes = edit_mjcf_file(target.path, before, meant)
    return Patched(moved_mjcf(text, target.path, folder), (*notes, *meant.notes), bool(drives))


def _patched_from_urdf(simulated: SimulatorModel, target: Target, drives: Mapping[int, Drive]) -> Patched:
    spec, notes = _spec_of_urdf(target.path)
    before = spec.compile()
    spec.compiler.inertiafromgeom = import_mujoco().mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    text = written_mjcf(spec, target.path)
    meant = _meant(simulated, before, spec, target, drives)
    document = parse_xml_text(text, str(target.path))
    _write_frames(document, before)
    return Patched(edit_mjcf(document.text(), target.path, before, meant), (*notes, *meant.notes), bool(drives))


def _meant(simulated: SimulatorModel, before: Any, spec: Any, target: Target, drives: Mapping[int, Drive]) -> Meant:
    """What the file should hold. before: the mujoco.MjModel of the file; spec: the same, which is used up."""
    locked = lock_spec(spec, target.path, target.positions)
    arm = arm_of(locked, target.path)
    check_same_arm(simulated, arm, target.path)
    inertias = {number: body_inertia(before, number) for number in range(1, before.nbody)}
    groups, totals, notes = carried_bodies(locked), link_inertias(simulated), list[str]()
    moved = [joint for group in groups if group for joint in joints_of_body(before, group[0].number)]
    joints = tuple(moved[place] for place in arm.chain_places)
    largest = max(float(np.trace(total)) for total in totals)
    for place, joint, total in zip(arm.chain_places, joints, totals, strict=True):
        group = groups[place]
        if not group:
            if np.trace(total) > MAX_NOTHING * largest:
                raise InputError(
                    f"{target.path}: joint '{before.joint(joint).name}' and the next one turn the same body, so the "
                    "file has no place for the body that the model has between them: export with --into another file"
                )
            continue
        first = group[0].number
        own = [Carried(before.body(e.number).name, e.seen, _moves_against(before, e.number, first)) for e in group]
        shares = share_inertia(total, own, target.path)
        if not same_inertia(own[0].seen, shares.first, MAX_CHANGE):
            inertias[first] = shares.first
        inertias |= {group[place].number: np.zeros((4, 4)) for place in shares.emptied}
        notes += shares.note(own)
    held = [
        before.body(number).name
        for number, pseudo in inertias.items()
        if before.body_gravcomp[number] and not same_inertia(body_inertia(before, number), pseudo, MAX_CHANGE)
    ]
    if held:
        notes.append(f"gravcomp of {join_words(held)} holds the changed weight, too; the recorded drives did not")
    return Meant(
        inertias=inertias,
        joints=joints,
        fields={name: simulated.field(name) for name in stated_fields(before, joints)},
        gravity=np.asarray(simulated.model.arm.gravity),
        notes=tuple(notes),
        drives={joints[place]: drive for place, drive in drives.items()},
    )


def _moves_against(model: Any, body: int, first: int) -> bool:
    """Whether one of the bodies from a body to another one before it, without that one, has a joint."""
    while body != first:
        if model.body_jntnum[body]:
            return True
        body = int(model.body_parentid[body])
    return False


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
        raise UnreadableError(f"MuJoCo cannot read {source.name}: {in_one_line(error)}") from None
    names = ", ".join(sorted(set(left_out)))
    return spec, [f"left out, since they are not at hand as STL or OBJ: {names}"] if names else []


def _mesh_path(name: str, source: Path) -> Path | None:
    """The file of a mesh as a URDF names it; packages are looked for in the folders above the URDF."""
    package, mark, inner = name.removeprefix("file://").partition("package://")
    choices = [folder / inner for folder in source.resolve().parents] if mark else [source.resolve().parent / package]
    found = [path for path in choices if path.is_file() and path.suffix.lower() in MESH_SUFFIXES]
    return found[0] if found else None
