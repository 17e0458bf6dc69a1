"""Writes a model into a copy of the user's own URDF or MJCF: names, frames, meshes and actuators stay as they are.

A joint may carry several bodies that do not move against each other. The data tell their sum alone: the body right
after the joint takes what is new, the others keep what they have. Where that would be no body, it takes the whole, and
the others lose their inertia.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.identification.export import (
    SPRING_FIELDS,
    SimulatorModel,
    body_numbers,
    has_extent,
    inertia_entries,
    inertial_element,
    link_inertias,
)
from problem.mjcf import carried_bodies, compile_mjcf, import_mujoco, written_mjcf
from problem.urdf import read_urdf_chain
from problem.urdf_document import move_urdf, read_urdf_root, urdf_text

MESH_SUFFIXES = (".stl", ".obj", ".msh")  # that MuJoCo reads


class UnreadableError(InputError):
    """MuJoCo is missing, or refuses a URDF."""


@dataclass(frozen=True)
class Patched:
    """A document, and what a person has to know of it, one line each."""

    text: str
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Shares:
    """What the first body that a joint carries takes, (4, 4), and whether the others keep theirs."""

    first: Array
    others_stay: bool


def share_inertia(total: Array, seen: Sequence[Array]) -> Shares:
    """Shares of the bodies that a joint carries; total, seen: pseudo-inertias (4, 4) about the frame of the first."""
    own = total - np.sum([np.zeros((4, 4)), *seen[1:]], axis=0)
    return Shares(own, True) if has_extent(own) else Shares(total, False)


def patched_urdf(simulated: SimulatorModel, source: Path, folder: Path) -> Patched:
    """A URDF with the links and joint dynamics of a model; folder: where it will stand, for the paths of its meshes.

    Raises InputError where the file has another arm than the model, or where the model has no links.
    """
    chain, notes = read_urdf_chain(source), list[str]()
    _check_same_arm(simulated, [joint.name for joint in chain.arm.joints], source)
    for own, total in zip(chain.carried, link_inertias(simulated), strict=True):
        shares = share_inertia(total, [each.seen for each in own])
        _set_inertial(own[0].node, shares.first)
        if not shares.others_stay:
            for each in own[1:]:
                _remove(each.node, "inertial")
            notes.append(_lumped_note(str(own[0].node.get("name")), [str(each.node.get("name")) for each in own[1:]]))
    for number, joint in enumerate(chain.joints):
        dynamics = joint.find("dynamics")
        if dynamics is None:
            dynamics = ElementTree.SubElement(joint, "dynamics")
        for key, field in (("damping", "damping"), ("friction", "frictionloss")):
            dynamics.set(key, repr(float(simulated.field(field)[number])))
    move_urdf(chain.root, source, folder)
    gravity = np.asarray(simulated.model.arm.gravity)
    if not np.allclose(gravity, chain.arm.gravity):
        notes.append(f"set gravity to {np.round(gravity, 4).tolist()} m/s2 in your simulator: URDF has no place for it")
    return Patched(urdf_text(chain.root), tuple(notes))


def patched_mjcf(simulated: SimulatorModel, source: Path) -> Patched:
    """An MJCF with the links, gravity and joint fields of a model; paths of meshes are made absolute.

    source: of an MJCF, or of a URDF, which MuJoCo reads. Raises InputError where the file has another arm than the
    model, where the model has no links, or where MuJoCo refuses the result; UnreadableError where it refuses a URDF.
    """
    spec, notes = _spec_of_urdf(source) if source.suffix == ".urdf" else _spec_of_mjcf(source)
    compiled = spec.compile()  # numbers the bodies and joints of the spec, too
    _check_same_arm(simulated, [compiled.joint(number).name for number in range(compiled.njnt)], source)
    bodies = {each.id: each for each in spec.bodies}
    for own, total in zip(carried_bodies(compiled), link_inertias(simulated), strict=True):
        shares = share_inertia(total, [each.seen for each in own])
        _set_body(bodies[own[0].number], shares.first)
        if not shares.others_stay:
            for each in own[1:]:
                _empty_body(bodies[each.number])
            names = [bodies[each.number].name for each in own]
            notes.append(_lumped_note(names[0], names[1:]))
    for joint in spec.joints:
        _set_joint(joint, simulated, spec.compiler.degree)
    spec.option.gravity = simulated.model.arm.gravity
    guess = import_mujoco().mjtInertiaFromGeom
    unstated = guess.mjINERTIAFROMGEOM_FALSE if source.suffix == ".urdf" else guess.mjINERTIAFROMGEOM_AUTO
    spec.compiler.inertiafromgeom = unstated
    spec.compiler.settotalmass = -1
    return Patched(written_mjcf(spec, source), tuple(notes))


def _spec_of_mjcf(source: Path) -> tuple[Any, list[str]]:
    compile_mjcf(source)
    return import_mujoco().MjSpec.from_file(str(source)), []


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


def _check_same_arm(simulated: SimulatorModel, joints: list[str], source: Path) -> None:
    names = [joint.name for joint in simulated.model.arm.joints]
    if joints != names:
        raise InputError(f"{source} has the joints {', '.join(joints)}, the model {', '.join(names)}")


def _lumped_note(first: str, others: list[str]) -> str:
    return f"{first} has the whole inertia of what its joint carries; none is left to {', '.join(others)}"


def _remove(node: ElementTree.Element, tag: str) -> None:
    for child in node.findall(tag):
        node.remove(child)


def _set_inertial(link: ElementTree.Element, pseudo: Array) -> None:
    """Replaces the inertia of a URDF link, at the place that it has in the file."""
    children = list(link)
    place = next((index for index, child in enumerate(children) if child.tag == "inertial"), 0)
    _remove(link, "inertial")
    link.insert(place, inertial_element(*body_numbers(pseudo)))


def _set_body(body: Any, pseudo: Array) -> None:
    mass, centre, inertia = body_numbers(pseudo)
    body.explicitinertial = True
    body.inertia = np.zeros(3)  # MuJoCo takes the diagonal or the full matrix, not both
    body.mass, body.ipos, body.iquat = mass, centre, (1.0, 0.0, 0.0, 0.0)
    body.fullinertia = inertia_entries(inertia)


def _empty_body(body: Any) -> None:
    """A body without inertia; MuJoCo takes that of its geoms where none is stated, so they are made weightless."""
    body.explicitinertial = False
    body.mass, body.inertia, body.fullinertia = 0.0, np.zeros(3), np.full(6, np.nan)
    for geom in body.geoms:
        geom.mass = 0.0


def _set_joint(joint: Any, simulated: SimulatorModel, degrees: bool) -> None:
    number = joint.id
    joint.damping[0] = float(simulated.field("damping")[number])
    joint.frictionloss = float(simulated.field("frictionloss")[number])
    joint.armature = float(simulated.field("armature")[number])
    stiffness, rest = (float(simulated.field(name)[number]) for name in SPRING_FIELDS)
    joint.stiffness[0] = stiffness
    turns = joint.type == import_mujoco().mjtJoint.mjJNT_HINGE
    joint.springref = np.degrees(rest) if degrees and turns else rest
