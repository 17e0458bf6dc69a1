"""URDF: rigid bodies, damping and friction. It has no place for the armature, which goes to an SRDF beside it.

URDF takes gravity as -z of the root: a fixed first joint turns the arm into it.
"""

import xml.etree.ElementTree as ElementTree

import numpy as np

from identification.export.chain import Body, bodies, numbers
from identification.torque_model import TorqueModel
from problem.transforms import inverse, turn_z_to
from recordings.run import Array

UPRIGHT = 1e-12  # cosine of the pitch, below which roll and yaw are one turn
UNLIMITED = 1e9  # what a reader takes for no limit, where the format wants a number


def urdf(model: TorqueModel) -> str:
    """The model as a URDF document; InputError for a model without links."""
    root = ElementTree.Element("robot", name=model.arm.name)
    ElementTree.SubElement(root, "link", name="world")
    ElementTree.SubElement(root, "link", name="base")
    mount = ElementTree.SubElement(root, "joint", name="mount", type="fixed")
    _ends(mount, "world", "base", _upright(model.arm.gravity))
    previous = "base"
    for index, body in enumerate(bodies(model)):
        previous = _add(root, body, previous, f"link{index + 1}")
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _upright(gravity: tuple[float, float, float]) -> Array:
    """The turn that brings gravity to -z."""
    return inverse(turn_z_to(-np.array(gravity))) if np.any(gravity) else np.eye(4)


def _add(root: ElementTree.Element, body: Body, parent: str, name: str) -> str:
    link = ElementTree.SubElement(root, "link", name=name)
    inertial = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(inertial, "origin", xyz=numbers(body.centre), rpy="0 0 0")
    ElementTree.SubElement(inertial, "mass", value=repr(body.mass))
    entries = body.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    ElementTree.SubElement(inertial, "inertia", dict(zip(names, map(repr, entries.tolist()), strict=True)))
    limited = bool(np.all(np.isfinite(body.limits)))
    kind = "continuous" if body.kind == "revolute" and not limited else body.kind
    joint = ElementTree.SubElement(root, "joint", name=body.name, type=kind)
    _ends(joint, parent, name, body.origin)
    ElementTree.SubElement(joint, "axis", xyz="0 0 1")
    ElementTree.SubElement(joint, "dynamics", damping=repr(body.damping), friction=repr(body.friction))
    limit = {"effort": _finite(body.effort), "velocity": _finite(body.velocity)}
    if kind != "continuous":
        limit |= {"lower": _finite(body.limits[0]), "upper": _finite(body.limits[1])}
    ElementTree.SubElement(joint, "limit", limit)
    return name


def _ends(joint: ElementTree.Element, parent: str, child: str, pose: Array) -> None:
    ElementTree.SubElement(joint, "parent", link=parent)
    ElementTree.SubElement(joint, "child", link=child)
    ElementTree.SubElement(joint, "origin", xyz=numbers(pose[:3, 3]), rpy=numbers(_roll_pitch_yaw(pose[:3, :3])))


def _roll_pitch_yaw(rotation: Array) -> tuple[float, float, float]:
    """Angles about the fixed axes x, y, z; where pitch is a quarter turn, the whole rest is roll."""
    level = float(np.hypot(rotation[0, 0], rotation[1, 0]))
    pitch = float(np.arctan2(-rotation[2, 0], level))
    if level < UPRIGHT:
        return float(np.arctan2(-rotation[1, 2], rotation[1, 1])), pitch, 0.0
    roll = float(np.arctan2(rotation[2, 1], rotation[2, 2]))
    return roll, pitch, float(np.arctan2(rotation[1, 0], rotation[0, 0]))


def _finite(value: float) -> str:
    return repr(float(np.clip(value, -UNLIMITED, UNLIMITED)))
