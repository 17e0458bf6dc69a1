"""SRDF beside a URDF: rotor inertias, for which URDF has no place. Pinocchio reads it (`loadRotorParameters`)."""

import xml.etree.ElementTree as ElementTree

from identification.export.chain import joint_values
from identification.torque_model import TorqueModel


def srdf(model: TorqueModel) -> str:
    """Rotor inertias on the joint side: `mass` is the format's word for the inertia of a rotor, kg m2 (kg)."""
    root = ElementTree.Element("robot", name=model.arm.name)
    rotors = ElementTree.SubElement(root, "rotor_params")
    for joint, inertia in zip(model.arm.joints, joint_values(model)["armature"].tolist(), strict=True):
        ElementTree.SubElement(rotors, "joint", name=joint.name, mass=repr(inertia), gear_ratio="1.0")
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"
