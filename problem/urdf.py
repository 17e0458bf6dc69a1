"""URDF files: the serial chain of moving joints; links at fixed joints become part of the link that carries them."""

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from problem.arm import Arm, Joint, Limits, Link
from problem.pseudo_inertia import link_from_pseudo_inertia, pseudo_inertia_of, transform_pseudo_inertia
from problem.transforms import inverse, roll_pitch_yaw, turn_z_to

MOVING_KINDS = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic"}
MAX_URDF_BYTES = 10_000_000


@dataclass(frozen=True)
class _Element:
    """One XML element, with errors that name the file and the place."""

    node: ElementTree.Element
    where: str

    def numbers(self, path: str, key: str, default: str, count: int) -> Array:
        child = self.node.find(path)
        text = default if child is None else child.get(key, default)
        try:
            values = np.array([float(word) for word in text.split()])
        except ValueError:
            values = np.array([])
        if values.shape != (count,) or not np.all(np.isfinite(values)):
            raise InputError(f"{self.where}: {path} {key}='{text}' should hold {count} finite number(s)")
        return values

    def origin(self, path: str = "origin") -> Array:
        pose = roll_pitch_yaw(*self.numbers(path, "rpy", "0 0 0", 3).tolist())
        pose[:3, 3] = self.numbers(path, "xyz", "0 0 0", 3)
        return pose

    def end(self, path: str) -> str:
        child = self.node.find(path)
        if child is None or not child.get("link"):
            raise InputError(f"{self.where}: <{path} link=...> is missing")
        return str(child.get("link"))


@dataclass(frozen=True, eq=False)
class CarriedLink:
    """A URDF link that a moving joint carries.

    seen: its pseudo-inertia (4, 4) about the frame of the link right after the joint, which is the first of those.
    """

    node: ElementTree.Element
    seen: Array


@dataclass(frozen=True, eq=False)
class UrdfChain:
    """A URDF document, comments included, and its moving joints from the base on, with the links that each carries."""

    root: ElementTree.Element
    arm: Arm
    joints: tuple[ElementTree.Element, ...]
    carried: tuple[tuple[CarriedLink, ...], ...]


def read_urdf(path: Path) -> Arm:
    """The arm of a URDF file; gravity is -9.81 m/s2 along z of the root link.

    Raises InputError for a file that is not URDF, for mimic, floating and planar joints, and for a tree with
    more than one branch of moving joints or a closed chain.
    """
    return read_urdf_chain(path).arm


def read_urdf_chain(path: Path) -> UrdfChain:
    """The document of a URDF file with its moving joints; errors as `read_urdf`."""
    root = _read_root(path)
    joints = [_Element(node, f"{path}, joint '{node.get('name')}'") for node in root.findall("joint")]
    links = {
        str(node.get("name")): _Element(node, f"{path}, link '{node.get('name')}'") for node in root.findall("link")
    }
    return _assemble(root, path.stem, _order_joints(joints, links, path), links)


def _read_root(path: Path) -> ElementTree.Element:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None
    if len(content) > MAX_URDF_BYTES or b"<!ENTITY" in content.replace(b"\0", b""):  # also in UTF-16
        raise InputError(f"{path}: too large, or with XML entities, for a URDF file")
    try:
        parser = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))
        root = ElementTree.fromstring(content, parser)
    except ElementTree.ParseError as error:
        raise InputError(f"{path} is not valid XML: {error}") from None
    if root.tag != "robot":
        raise InputError(f"{path}: the outermost element should be <robot>, not <{root.tag}>")
    return root


def _order_joints(joints: list[_Element], links: dict[str, _Element], path: Path) -> list[_Element]:
    """All joints, each after the one that carries it; checks that they form one tree with one moving chain."""
    children: dict[str, _Element] = {}
    by_parent: dict[str, list[_Element]] = {}
    for joint in joints:
        _refuse_unsupported(joint)
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
    return _walk_tree(roots[0], by_parent, path)


def _walk_tree(root: str, by_parent: dict[str, list[_Element]], path: Path) -> list[_Element]:
    order, waiting, last_moving = [], [(joint, "") for joint in by_parent.get(root, [])], ""
    while waiting:
        joint, carrier = waiting.pop(0)
        name = carrier
        if joint.node.get("type") in MOVING_KINDS:
            if carrier != last_moving:
                raise InputError(f"{joint.where}: a second branch of moving joints; cut the file down to one arm")
            name = last_moving = str(joint.node.get("name"))
        order.append(joint)
        waiting.extend((follower, name) for follower in by_parent.get(joint.end("child"), []))
    if not last_moving:
        raise InputError(f"{path} has no moving joint")
    loop = [joint for joints in by_parent.values() for joint in joints if joint not in order]
    if loop:
        raise InputError(f"{loop[0].where}: not reached from link '{root}'; closed chains are not supported")
    return order


def _refuse_unsupported(joint: _Element) -> None:
    if joint.node.find("mimic") is not None:
        raise InputError(f"{joint.where}: mimic joints are not supported; lock it (type='fixed') or leave it out")
    if joint.node.get("type") not in {*MOVING_KINDS, "fixed"}:
        raise InputError(
            f"{joint.where}: type '{joint.node.get('type')}' is not supported: revolute, continuous, prismatic or fixed"
        )


def _assemble(root: ElementTree.Element, name: str, chain: list[_Element], links: dict[str, _Element]) -> UrdfChain:
    """Follows the tree: `pose` of each URDF link in the frame of the moving link that carries it (0: the base)."""
    moving: list[Joint] = []
    nodes: list[ElementTree.Element] = []
    groups: list[list[CarriedLink]] = []
    base = next(link for link in links if link not in {joint.end("child") for joint in chain})
    carried: dict[str, tuple[int, Array]] = {base: (0, np.eye(4))}
    for joint in chain:
        carrier, pose = carried[joint.end("parent")]
        origin = pose @ joint.origin()
        child = joint.end("child")
        if joint.node.get("type") in MOVING_KINDS:
            moving.append(_joint(joint, origin))
            nodes.append(joint.node)
            groups.append([])
            carrier, origin = len(moving), np.eye(4)
        carried[child] = carrier, origin
        if carrier:
            seen = transform_pseudo_inertia(_inertia(links[child]), origin)
            groups[carrier - 1].append(CarriedLink(links[child].node, seen))
    sums = [np.sum([each.seen for each in own], axis=0) for own in groups]
    known = any(np.any(inertia) for inertia in sums)
    bodies = tuple(link_from_pseudo_inertia(inertia) for inertia in sums) if known else None
    arm = Arm(str(root.get("name") or name), tuple(moving), bodies)
    return UrdfChain(root, arm, tuple(nodes), tuple(tuple(own) for own in groups))


def _joint(joint: _Element, origin: Array) -> Joint:
    axis = joint.numbers("axis", "xyz", "1 0 0", 3)
    if not np.any(axis):
        raise InputError(f"{joint.where}: axis xyz should not be zero")
    turn = turn_z_to(axis)
    kind = MOVING_KINDS[str(joint.node.get("type"))]
    name = str(joint.node.get("name"))
    return Joint(name, kind, origin @ turn, inverse(turn), _limits(joint))  # type: ignore[arg-type]


def _limits(joint: _Element) -> Limits:
    """The limits given; those that are left out or 0, as exporters write unknown ones, are infinite."""
    limit = joint.node.find("limit")
    if limit is None:
        return Limits()
    given = {key: float(joint.numbers("limit", key, "0", 1)[0]) for key in ("lower", "upper", "velocity", "effort")}
    for key in ("velocity", "effort"):
        if given[key] < 0:
            raise InputError(f"{joint.where}: limit {key}={given[key]} should not be negative")
    free = joint.node.get("type") == "continuous" or given["lower"] == given["upper"] == 0
    if not free and given["lower"] >= given["upper"]:
        raise InputError(f"{joint.where}: limit lower={given['lower']} should be below upper={given['upper']}")
    position = (-np.inf, np.inf) if free else (given["lower"], given["upper"])
    return Limits(position, given["velocity"] or np.inf, np.inf, given["effort"] or np.inf)


def _inertia(link: _Element) -> Array:
    """Pseudo-inertia of a URDF link about its own frame; zero where the file has none."""
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
