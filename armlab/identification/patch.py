"""Writes a model into a copy of the user's own URDF: only the numbers that the model has otherwise change.

A joint may carry several bodies that do not move against each other, or that were locked in the recording. The data
tell their sum alone: the body right after the joint takes what is new, the others keep what they have. Where that would
be no body, it takes what the others on fixed joints had, too; what moves against it always keeps its own inertia.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.report.wording import join_words
from armlab.common.xml_text import XmlNode, read_xml_text
from armlab.identification.export import (
    INERTIA_NAMES,
    SimulatorModel,
    body_numbers,
    format_numbers,
    has_extent,
    inertia_entries,
    link_inertias,
)
from armlab.identification.mjcf_edit import MAX_CHANGE, MAX_ERROR, same_inertia
from problem.arm import Arm, link_poses
from problem.urdf import UrdfChain, chain_of, link_inertia
from problem.urdf_document import UrdfElement, lock_urdf, moved_urdf, parse_urdf_root, read_urdf_root

MAX_FRAME_ERROR = 1e-4  # m, or of a turn: MuJoCo writes six digits


@dataclass(frozen=True)
class Target:
    """A robot file that takes a model. positions: of its joints that the model's robot has locked, rad or m."""

    path: Path
    positions: Mapping[str, float]


@dataclass(frozen=True)
class Patched:
    """A document, and what a person has to know of it, one line each. has_drives: it holds those of the model."""

    text: str
    notes: tuple[str, ...]
    has_drives: bool = False


@dataclass(frozen=True, eq=False)
class Carried:
    """A body that a joint carries. seen: pseudo-inertia (4, 4) about the frame of the first. moves: against that."""

    name: str
    seen: Array
    moves: bool = False


@dataclass(frozen=True, eq=False)
class Shares:
    """What the first body that a joint carries takes, (4, 4), and the places of those that lose their inertia."""

    first: Array
    emptied: tuple[int, ...] = ()

    def note(self, own: Sequence[Carried]) -> list[str]:
        """A line where bodies lose their inertia."""
        if not self.emptied:
            return []
        others = ", ".join(own[place].name for place in self.emptied)
        return [f"{own[0].name} has the whole inertia of what its joint carries; none is left to {others}"]


def share_inertia(total: Array, own: Sequence[Carried], source: Path) -> Shares:
    """Shares of the bodies that a joint carries; total: pseudo-inertia (4, 4) about the frame of the first.

    Raises InputError where the bodies that move against the first have more than the whole. source: for messages.
    """
    rest = total - np.sum([np.zeros((4, 4)), *(each.seen for each in own[1:])], axis=0)
    if has_extent(rest):
        return Shares(rest)
    rest = total - np.sum([np.zeros((4, 4)), *(each.seen for each in own[1:] if each.moves)], axis=0)
    if has_extent(rest):
        return Shares(rest, tuple(place for place, each in enumerate(own) if place and not each.moves))
    moving = join_words([each.name for each in own if each.moves])
    raise InputError(
        f"{source}: {moving} on joints that were locked have more inertia than the model has from {own[0].name} on: "
        "correct their masses there, or export with --into and the robot file of the recording, where they are fixed"
    )


def check_same_arm(simulated: SimulatorModel, arm: Arm, source: Path) -> None:
    """Raises InputError where a file has another arm than the model: joints, or their places."""
    own = simulated.model.arm
    names = [joint.name for joint in own.joints]
    if [joint.name for joint in arm.joints] != names:
        raise InputError(
            f"{source} has the joints {', '.join(joint.name for joint in arm.joints)}, the model {', '.join(names)}"
        )
    for position in np.stack([np.zeros(len(own)), np.linspace(0.3, 1.1, len(own))]):
        poses = zip(names, link_poses(own, position), link_poses(arm, position), strict=True)
        for name, one, other in poses:
            if np.abs(one - other).max() > MAX_FRAME_ERROR:
                raise InputError(f"{source}: joint '{name}' stands or moves otherwise than in the robot of the model")


def patched_urdf(simulated: SimulatorModel, target: Target, folder: Path) -> Patched:
    """A URDF with the links and joint dynamics of a model; folder: where it will stand, for the paths of its meshes.

    Raises InputError where the file has another arm than the model, or where the model has no links.
    """
    source = target.path
    chain = _chain(read_urdf_root(source), target)
    check_same_arm(simulated, chain.arm, source)
    document, notes = read_xml_text(source), list[str]()
    links = {child.attributes.get("name"): child for child in document.root.children if child.tag == "link"}
    joints = {child.attributes.get("name"): child for child in document.root.children if child.tag == "joint"}
    joint_before = {end.attributes.get("link"): joint for joint in joints.values() if (end := joint.find("child"))}
    for carried, total in zip(chain.carried, link_inertias(simulated), strict=True):
        names = [str(each.node.get("name")) for each in carried]
        own = [
            Carried(name, each.seen, _moves_against(name, names[0], joint_before, target))
            for name, each in zip(names, carried, strict=True)
        ]
        shares = share_inertia(total, own, source)
        if not same_inertia(own[0].seen, shares.first, MAX_CHANGE):
            _set_inertial(links[own[0].name], shares.first)
        for place in shares.emptied:
            _remove_inertial(links[own[place].name])
        notes += shares.note(own)
    for number, joint in enumerate(simulated.model.arm.joints):
        _set_dynamics(joints[joint.name], simulated, number)
    text = document.text()
    _check_urdf(simulated, text, target)
    gravity = np.asarray(simulated.model.arm.gravity)
    if not np.allclose(gravity, chain.arm.gravity):
        notes.append(f"set gravity to {np.round(gravity, 4).tolist()} m/s2 in your simulator: URDF has no place for it")
    return Patched(moved_urdf(text, source, folder), tuple(notes))


def _chain(root: ElementTree.Element, target: Target) -> UrdfChain:
    """The chain of a URDF with the joints of a target locked."""
    lock_urdf(root, target.path, target.positions)
    return chain_of(root, target.path)


def _moves_against(link: str, first: str, joint_before: Mapping[str | None, XmlNode], target: Target) -> bool:
    """Whether one of the joints from a link to another one before it is locked in the model alone."""
    while link != first:
        joint = joint_before[link]
        if joint.attributes.get("name") in target.positions:
            return True
        parent = joint.find("parent")
        assert parent is not None
        link = parent.attributes["link"]
    return False


def _set_inertial(link: XmlNode, pseudo: Array) -> None:
    mass, centre, inertia = body_numbers(pseudo)
    inertial = link.find("inertial") or link.add("inertial", {}, first=True)
    entries = map(repr, inertia_entries(inertia).tolist())
    for tag, numbers in (
        ("origin", {"xyz": format_numbers(centre), "rpy": "0 0 0"}),
        ("mass", {"value": repr(mass)}),
        ("inertia", dict(zip(INERTIA_NAMES, entries, strict=True))),
    ):
        (inertial.find(tag) or inertial.add(tag, {})).set_numbers(numbers)


def _remove_inertial(link: XmlNode) -> None:
    inertial = link.find("inertial")
    if inertial is not None:
        link.remove(inertial)


def _set_dynamics(joint: XmlNode, simulated: SimulatorModel, number: int) -> None:
    dynamics = joint.find("dynamics")
    for key, name in (("damping", "damping"), ("friction", "frictionloss")):
        wanted = float(simulated.field(name)[number])
        stated = "" if dynamics is None else dynamics.attributes.get(key, "")
        if float(stated or 0) != wanted:
            dynamics = dynamics or joint.add("dynamics", {})
            dynamics.set({key: repr(wanted)})


def _check_urdf(simulated: SimulatorModel, text: str, target: Target) -> None:
    """Raises InputError where a text does not have the links of a model, or another link is no body."""
    root = parse_urdf_root(text, target.path)
    for node in root.findall("link"):
        link_inertia(UrdfElement(node, f"{target.path}, link '{node.get('name')}'"))
    chain = _chain(root, target)
    for carried, total in zip(chain.carried, link_inertias(simulated), strict=True):
        if not same_inertia(np.sum([each.seen for each in carried], axis=0), total, MAX_ERROR):
            name = carried[0].node.get("name")
            raise InputError(f"{target.path}, link '{name}': its inertia cannot be changed in the text of the file")
