"""Our arms in two independent engines, Pinocchio and MuJoCo, built from the transforms of `Arm` alone."""

from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from armlab.common.arrays import Array
from problem.arm import Arm, Joint, Link
from problem.motion import Motion
from problem.pseudo_inertia import link_from_pseudo_inertia, pseudo_inertia_of, transform_pseudo_inertia

PINOCCHIO_ORDER = [0, 1, 2, 3, 4, 7, 5, 8, 9, 6]  # m, first moment, Ixx Ixy Iyy Ixz Iyz Izz


def pinocchio_model(arm: Arm) -> Any:
    """The arm with a Pinocchio frame at every joint, before its motion; links too where the arm has them."""
    pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed")
    model = pin.Model()
    model.gravity.linear = np.array(arm.gravity)
    carrier, behind = 0, np.eye(4)
    for index, joint in enumerate(arm.joints):
        kind = pin.JointModelRZ() if joint.kind == "revolute" else pin.JointModelPZ()
        carrier = model.addJoint(carrier, kind, pin.SE3(behind @ joint.before), joint.name)
        if arm.links is not None:
            parameters = _in_joint_frame(arm.links[index], joint).parameters[PINOCCHIO_ORDER]
            model.appendBodyToJoint(carrier, pin.Inertia.FromDynamicParameters(parameters), pin.SE3.Identity())
        behind = joint.after
    return model


def pinocchio_regressor(arm: Arm, motion: Motion) -> Array:
    """Observation matrix (samples * joints, 10 * joints), in our order and about our frames."""
    pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed")
    model = pinocchio_model(arm)
    data = model.createData()
    states = zip(motion.position, motion.velocity, motion.acceleration, strict=True)
    rows = [np.atleast_2d(pin.computeJointTorqueRegressor(model, data, *state)).copy() for state in states]
    return np.concatenate(rows) @ _parameter_map(arm)


def mujoco_torque(arm: Arm, motion: Motion) -> Array:
    """Torques (samples, joints) of MuJoCo's inverse dynamics."""
    return inverse_dynamics(mujoco_model(arm), motion)


def mujoco_model(arm: Arm) -> Any:
    """The arm in MuJoCo: one body and one joint for each of its own."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    return mujoco.MjModel.from_xml_string(_mujoco_xml(arm))


def inverse_dynamics(model: Any, motion: Motion) -> Array:
    """Torques (samples, joints) that a MuJoCo model needs for a motion."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    data = mujoco.MjData(model)
    torques = []
    for data.qpos[:], data.qvel[:], data.qacc[:] in zip(
        motion.position, motion.velocity, motion.acceleration, strict=True
    ):
        mujoco.mj_inverse(model, data)
        torques.append(data.qfrc_inverse.copy())
    return np.array(torques)


def _in_joint_frame(link: Link, joint: Joint) -> Link:
    return link_from_pseudo_inertia(transform_pseudo_inertia(pseudo_inertia_of(link), joint.after))


def _parameter_map(arm: Arm) -> Array:
    """Pinocchio's parameters of all links as a linear function of ours, (10 * joints, 10 * joints)."""
    whole = np.zeros((10 * len(arm), 10 * len(arm)))
    for index, joint in enumerate(arm.joints):
        links = (Link(unit[0], tuple(unit[1:4]), tuple(unit[4:])) for unit in np.eye(10))
        columns = [_in_joint_frame(link, joint).parameters[PINOCCHIO_ORDER] for link in links]
        whole[10 * index : 10 * index + 10, 10 * index : 10 * index + 10] = np.column_stack(columns)
    return whole


def _mujoco_xml(arm: Arm) -> str:
    if arm.links is None:
        raise ValueError("MuJoCo needs links")
    root = ElementTree.Element("mujoco")
    ElementTree.SubElement(root, "compiler", angle="radian")
    ElementTree.SubElement(root, "option", gravity=_text(arm.gravity))
    parent, behind = ElementTree.SubElement(root, "worldbody"), np.eye(4)
    for joint, link in zip(arm.joints, arm.links, strict=True):
        pose = behind @ joint.before
        parent = ElementTree.SubElement(parent, "body", {"pos": _text(pose[:3, 3]), **_turn(pose[:3, :3])})
        kind = "hinge" if joint.kind == "revolute" else "slide"
        ElementTree.SubElement(parent, "joint", type=kind, axis="0 0 1")
        _add_inertial(parent, _in_joint_frame(link, joint))
        behind = joint.after
    return ElementTree.tostring(root, encoding="unicode")


def _add_inertial(body: ElementTree.Element, link: Link) -> None:
    centre = np.array(link.first_moment) / link.mass
    back = np.eye(4)
    back[:3, 3] = -centre
    xx, yy, zz, xy, xz, yz = link_from_pseudo_inertia(transform_pseudo_inertia(pseudo_inertia_of(link), back)).inertia
    moments, axes = np.linalg.eigh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    axes[:, 2] *= np.linalg.det(axes)
    values = {"mass": repr(link.mass), "diaginertia": _text(moments), "pos": _text(centre), **_turn(axes)}
    ElementTree.SubElement(body, "inertial", values)


def _turn(rotation: Array) -> dict[str, str]:
    """A turn as a quaternion w x y z: the eigenvector of Bar-Itzhack's symmetric matrix for its eigenvalue 1."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    symmetric = np.array(
        [
            [a + e + i, h - f, c - g, d - b],
            [h - f, a - e - i, b + d, c + g],
            [c - g, b + d, e - a - i, f + h],
            [d - b, c + g, f + h, i - a - e],
        ]
    )
    return {"quat": _text(np.linalg.eigh(symmetric)[1][:, -1])}


def _text(numbers: Any) -> str:
    return " ".join(repr(float(number)) for number in numbers)
