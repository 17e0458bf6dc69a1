"""MJCF, the format of MuJoCo, which Pinocchio reads too: rigid bodies, armature, damping, frictionloss."""

import xml.etree.ElementTree as ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from identification.export.chain import Body, bodies, numbers
from identification.torque_model import TorqueModel

KINDS = {"revolute": "hinge", "prismatic": "slide"}


def mjcf(model: TorqueModel) -> str:
    """The model as an MJCF document; InputError for a model without links."""
    root = ElementTree.Element("mujoco", model=model.arm.name)
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="true")
    ElementTree.SubElement(root, "option", gravity=numbers(model.arm.gravity))
    parent = ElementTree.SubElement(root, "worldbody")
    for index, body in enumerate(bodies(model)):
        parent = _body(parent, body, index + 1)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _body(parent: ElementTree.Element, body: Body, number: int) -> ElementTree.Element:
    quaternion = Rotation.from_matrix(body.origin[:3, :3]).as_quat(scalar_first=True)
    pose = {"pos": numbers(body.origin[:3, 3]), "quat": numbers(quaternion)}
    node = ElementTree.SubElement(parent, "body", {"name": f"link{number}", **pose})
    entries = body.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    inertial = {"pos": numbers(body.centre), "mass": numbers((body.mass,)), "fullinertia": numbers(entries)}
    ElementTree.SubElement(node, "inertial", inertial)
    joint = {"name": body.name, "type": KINDS[body.kind], "axis": "0 0 1"}
    joint |= {"armature": repr(body.armature), "damping": repr(body.damping), "frictionloss": repr(body.friction)}
    if np.all(np.isfinite(body.limits)):
        joint["range"] = numbers(body.limits)
    ElementTree.SubElement(node, "joint", joint)
    return node
