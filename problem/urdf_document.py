"""URDF documents as XML: elements with clear errors, the tree of joints, locking joints, and writing."""

import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.xml_text import parse_xml_text
from problem.arm import JointLaw, Limits
from problem.kinematic_tree import Follower, KinematicTree, TreeJoint
from problem.transforms import inverse, roll_pitch_yaw, rotation_z, translation, turn_z_to

MOVING_KINDS = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic"}
MAX_URDF_BYTES = 10_000_000
_MIMIC_NUMBERS = {"multiplier": "1", "offset": "0"}  # as URDF has them where they are left out


@dataclass(frozen=True)
class UrdfElement:
    """One XML element, with errors that name the file and the place."""

    node: ElementTree.Element
    where: str

    def numbers(self, path: str, key: str, default: str, count: int) -> Array:
        """The numbers of an attribute of a child, (count,); InputError where they are others."""
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
        """The pose (4, 4) that a child gives, m and rad; the unit matrix without it."""
        pose = roll_pitch_yaw(*self.numbers(path, "rpy", "0 0 0", 3).tolist())
        pose[:3, 3] = self.numbers(path, "xyz", "0 0 0", 3)
        return pose

    def end(self, path: str) -> str:
        """The link that a child, <parent> or <child>, names; InputError where it is missing."""
        child = self.node.find(path)
        if child is None or not child.get("link"):
            raise InputError(f"{self.where}: <{path} link=...> is missing")
        return str(child.get("link"))

    @property
    def name(self) -> str:
        """The name in the file."""
        return str(self.node.get("name"))

    @property
    def kind(self) -> str:
        """The type of a joint."""
        return str(self.node.get("type"))

    @property
    def axis(self) -> Array:
        """The axis of a joint, (3,); InputError where it is zero."""
        axis = self.numbers("axis", "xyz", "1 0 0", 3)
        if not np.any(axis):
            raise InputError(f"{self.where}: axis xyz should not be zero")
        return axis

    @property
    def law(self) -> JointLaw:
        """Damping and friction of a joint; InputError for numbers that are negative."""
        damping, friction = (float(self.numbers("dynamics", key, "0", 1)[0]) for key in ("damping", "friction"))
        for key, value in (("damping", damping), ("friction", friction)):
            if value < 0:
                raise InputError(f"{self.where}: dynamics {key}={value:g} should not be negative")
        return JointLaw(damping, friction)

    @property
    def limits(self) -> Limits:
        """The limits given of a joint; those that are left out or 0, as exporters write unknown ones, are infinite."""
        limit = self.node.find("limit")
        if limit is None:
            return Limits()
        given = {key: float(self.numbers("limit", key, "0", 1)[0]) for key in ("lower", "upper", "velocity", "effort")}
        for key in ("velocity", "effort"):
            if given[key] < 0:
                raise InputError(f"{self.where}: limit {key}={given[key]} should not be negative")
        free = self.kind == "continuous" or given["lower"] == given["upper"] == 0
        if not free and given["lower"] >= given["upper"]:
            raise InputError(f"{self.where}: limit lower={given['lower']} should be below upper={given['upper']}")
        position = (-np.inf, np.inf) if free else (given["lower"], given["upper"])
        return Limits(position, given["velocity"] or np.inf, np.inf, given["effort"] or np.inf)


def read_urdf_root(path: Path) -> ElementTree.Element:
    """The outermost element of a URDF file, comments included; InputError where it is none."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None
    return parse_urdf_root(content, path)


def parse_urdf_root(content: str | bytes, path: Path) -> ElementTree.Element:
    """The outermost element of a URDF text, comments included; path: of its file, for messages. Errors as above."""
    content = content.encode() if isinstance(content, str) else content
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


def joints_of(root: ElementTree.Element, path: Path) -> list[UrdfElement]:
    """The joints of a URDF document; path: of its file, for messages."""
    return [UrdfElement(node, f"{path}, joint '{node.get('name')}'") for node in root.findall("joint")]


def _tree_joint(joint: UrdfElement) -> TreeJoint:
    """A joint of the tree; one whose kind no arm has can only be locked at zero."""
    limits = joint.limits.position if joint.kind in MOVING_KINDS else (0.0, 0.0)
    mimic, follows = joint.node.find("mimic"), None
    if mimic is not None:
        factor, offset = (float(joint.numbers("mimic", key, start, 1)[0]) for key, start in _MIMIC_NUMBERS.items())
        follows = Follower(str(mimic.get("joint")), factor, offset)
    return TreeJoint(joint.name, joint.end("parent"), joint.end("child"), joint.kind != "fixed", limits, follows)


def _motion(joint: UrdfElement, position: float) -> Array:
    """The transform of a joint's own motion, (4, 4)."""
    turn = turn_z_to(joint.axis)
    sliding = MOVING_KINDS.get(joint.kind) == "prismatic"
    return turn @ (translation(0, 0, position) if sliding else rotation_z(position)) @ inverse(turn)


def _set_origin(node: ElementTree.Element, pose: Array) -> None:
    origin = node.find("origin")
    if origin is None:
        origin = ElementTree.Element("origin")
        node.insert(0, origin)
    origin.set("xyz", " ".join(repr(float(value)) for value in pose[:3, 3]))
    origin.set("rpy", " ".join(repr(float(value)) for value in _roll_pitch_yaw_of(pose[:3, :3])))


def _roll_pitch_yaw_of(rotation: Array) -> tuple[float, float, float]:
    """The angles of a turn (3, 3) about the fixed axes x, y, z; yaw is zero where pitch is a quarter turn."""
    level = np.hypot(rotation[0, 0], rotation[1, 0])
    pitch = np.arctan2(-rotation[2, 0], level)
    if level < 1e-9:
        return np.arctan2(-rotation[1, 2], rotation[1, 1]), pitch, 0.0
    return np.arctan2(rotation[2, 1], rotation[2, 2]), pitch, np.arctan2(rotation[1, 0], rotation[0, 0])


def urdf_tree(root: ElementTree.Element, path: Path) -> KinematicTree:
    """All joints of a URDF document, also where they are no chain; path: of its file, for messages."""
    return KinematicTree(str(path), tuple(map(_tree_joint, joints_of(root, path))))


def lock_urdf(root: ElementTree.Element, path: Path, positions: Mapping[str, float]) -> None:
    """Turns joints of a URDF document into fixed ones at positions (rad or m); the drives that name them go."""
    for joint in joints_of(root, path):
        position = positions.get(joint.name)
        if position is None:
            continue
        if position:
            _set_origin(joint.node, joint.origin() @ _motion(joint, position))
        joint.node.set("type", "fixed")
        for child in list(joint.node):
            if child.tag not in ("origin", "parent", "child"):
                joint.node.remove(child)
    for drives in (root, *root.iter("ros2_control")):
        for node in list(drives):
            named = node if node.tag == "joint" else node.find("joint")
            of_drive = drives.tag == "ros2_control" or node.tag == "transmission"
            if of_drive and named is not None and named.get("name") in positions:
                drives.remove(node)


def moved_urdf(text: str, source: Path, folder: Path) -> str:
    """The text of a URDF as it is to stand in another folder: relative paths of meshes still lead to their files.

    source: the file that names them.
    """
    document = parse_xml_text(text, str(source))
    for node in document.root.walk():
        name = node.attributes.get("filename")
        if name and "://" not in name and not os.path.isabs(name) and folder.resolve() != source.parent.resolve():
            node.set({"filename": Path(os.path.relpath(source.parent / name, folder)).as_posix()})
    return document.text()


def urdf_text(root: ElementTree.Element) -> str:
    """The text of a URDF document, indented."""
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"
