"""URDF files: the serial chain of moving joints; links at fixed joints become part of the link that carries them."""

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from problem.arm import Arm, Joint, JointLaw, Link
from problem.coupled_joints import couple_joints
from problem.kinematic_tree import KinematicTree
from problem.pseudo_inertia import link_from_pseudo_inertia, pseudo_inertia_of, transform_pseudo_inertia
from problem.transforms import inverse, turn_z_to
from problem.urdf_document import MOVING_KINDS, UrdfElement, joints_of, read_urdf_root, urdf_tree


@dataclass(frozen=True, eq=False)
class CarriedLink:
    """A URDF link that a moving joint carries.

    seen: its pseudo-inertia (4, 4) about the frame of the link right after the joint, which is the first of those.
    """

    node: ElementTree.Element
    seen: Array


@dataclass(frozen=True, eq=False)
class UrdfChain:
    """A URDF document, comments included, and its arm with the links that each joint carries, from the base on.

    carried: by the arm's own joints; coupled: by the joints that they lead.
    """

    root: ElementTree.Element
    arm: Arm
    carried: tuple[tuple[CarriedLink, ...], ...]
    coupled: tuple[tuple[CarriedLink, ...], ...] = ()


def read_urdf(path: Path) -> Arm:
    """The arm of a URDF file; gravity is -9.81 m/s2 along z of the root link.

    Raises InputError for a file that is not URDF and a closed chain; for floating and planar joints and more than one
    branch of moving joints an UndecidedError with the links where an arm may end, if there are any.
    """
    return read_urdf_chain(path).arm


def read_urdf_chain(path: Path) -> UrdfChain:
    """The document of a URDF file with its moving joints; errors as `read_urdf`."""
    return chain_of(read_urdf_root(path), path)


def chain_of(root: ElementTree.Element, path: Path) -> UrdfChain:
    """The moving joints of a URDF document; path: of its file, for messages. Errors as `read_urdf`."""
    links = {
        str(node.get("name")): UrdfElement(node, f"{path}, link '{node.get('name')}'") for node in root.findall("link")
    }
    chain = _assemble(root, path.stem, _order_joints(root, links, path), links)
    follows = {each.name: each.follows for each in urdf_tree(root, path).joints if each.follows is not None}
    arm = couple_joints(chain.arm, follows, str(path))
    own = [joint in arm.joints for joint in chain.arm.joints]
    carried, coupled = (
        tuple(links for links, is_own in zip(chain.carried, own, strict=True) if is_own is wanted)
        for wanted in (True, False)
    )
    return UrdfChain(root, arm, carried, coupled)


def _order_joints(root: ElementTree.Element, links: dict[str, UrdfElement], path: Path) -> list[UrdfElement]:
    """All joints, each after the one that carries it; checks that they form one tree with one moving chain."""
    joints, tree = joints_of(root, path), urdf_tree(root, path)
    children: dict[str, UrdfElement] = {}
    by_parent: dict[str, list[UrdfElement]] = {}
    for joint in joints:
        parent, child = joint.end("parent"), joint.end("child")
        for name in (parent, child):
            if name not in links:
                raise InputError(f"{joint.where}: link '{name}' does not exist")
        if child in children:
            raise InputError(f"{joint.where}: link '{child}' hangs on two joints; closed chains are not supported")
        children[child] = joint
        by_parent.setdefault(parent, []).append(joint)
    roots = [name for name in links if name not in children]
    if len(roots) != 1:
        raise InputError(f"{path}: the links should form one tree with one root; roots found: {sorted(roots)}")
    for joint in joints:
        _refuse_unsupported(joint, tree)
    return _walk_tree(roots[0], by_parent, tree)


def _walk_tree(root: str, by_parent: dict[str, list[UrdfElement]], tree: KinematicTree) -> list[UrdfElement]:
    order, waiting, last_moving = [], [(joint, "") for joint in by_parent.get(root, [])], ""
    while waiting:
        joint, carrier = waiting.pop(0)
        name = carrier
        if joint.kind in MOVING_KINDS:
            if carrier != last_moving:
                raise tree.refuse(f"{joint.where}: a second branch of moving joints")
            name = last_moving = joint.name
        order.append(joint)
        waiting.extend((follower, name) for follower in by_parent.get(joint.end("child"), []))
    if not last_moving:
        raise InputError(f"{tree.where} has no moving joint")
    loop = [joint for joints in by_parent.values() for joint in joints if joint not in order]
    if loop:
        raise InputError(f"{loop[0].where}: not reached from link '{root}'; closed chains are not supported")
    return order


def _refuse_unsupported(joint: UrdfElement, tree: KinematicTree) -> None:
    if joint.kind not in {*MOVING_KINDS, "fixed"}:
        raise tree.refuse(
            f"{joint.where}: type '{joint.node.get('type')}' is not supported: revolute, continuous, prismatic or fixed"
        )


def _assemble(
    root: ElementTree.Element, name: str, chain: list[UrdfElement], links: dict[str, UrdfElement]
) -> UrdfChain:
    """Follows the tree: `pose` of each URDF link in the frame of the moving link that carries it (0: the base)."""
    moving: list[Joint] = []
    laws: list[JointLaw] = []
    groups: list[list[CarriedLink]] = []
    base = next(link for link in links if link not in {joint.end("child") for joint in chain})
    carried: dict[str, tuple[int, Array]] = {base: (0, np.eye(4))}
    for joint in chain:
        carrier, pose = carried[joint.end("parent")]
        origin = pose @ joint.origin()
        child = joint.end("child")
        if joint.kind in MOVING_KINDS:
            moving.append(_joint(joint, origin))
            laws.append(joint.law)
            groups.append([])
            carrier, origin = len(moving), np.eye(4)
        carried[child] = carrier, origin
        if carrier:
            seen = transform_pseudo_inertia(link_inertia(links[child]), origin)
            groups[carrier - 1].append(CarriedLink(links[child].node, seen))
    sums = [np.sum([each.seen for each in own], axis=0) for own in groups]
    known = any(np.any(inertia) for inertia in sums)
    bodies = tuple(link_from_pseudo_inertia(inertia) for inertia in sums) if known else None
    stated = tuple(laws) if any(law != JointLaw() for law in laws) else ()
    arm = Arm(str(root.get("name") or name), tuple(moving), bodies, joint_laws=stated)
    return UrdfChain(root, arm, tuple(tuple(own) for own in groups))


def _joint(joint: UrdfElement, origin: Array) -> Joint:
    turn = turn_z_to(joint.axis)
    kind = MOVING_KINDS[joint.kind]
    return Joint(joint.name, kind, origin @ turn, inverse(turn), joint.limits)  # type: ignore[arg-type]


def link_inertia(link: UrdfElement) -> Array:
    """Pseudo-inertia of a URDF link about its own frame; zero where the file has none.

    Raises InputError for numbers that no body has.
    """
    if link.node.find("inertial") is None:
        return np.zeros((4, 4))
    entries = [
        float(link.numbers("inertial/inertia", f"i{pair}", "", 1)[0]) for pair in ("xx", "yy", "zz", "xy", "xz", "yz")
    ]
    mass = float(link.numbers("inertial/mass", "value", "", 1)[0])
    if mass < 0:
        raise InputError(f"{link.where}: mass {mass:g} should not be negative")
    body = Link(mass, (0.0, 0.0, 0.0), tuple(entries))  # type: ignore[arg-type]
    return transform_pseudo_inertia(pseudo_inertia_of(body), link.origin("inertial/origin"))
