"""Writes a model as a file of a simulator: URDF, with an SRDF beside it, or MJCF.

Both write the model as a chain of bodies on joints that turn about or slide along z. URDF has no place for the
armature, which goes to the SRDF that Pinocchio reads (`loadRotorParameters`), and takes gravity as -z of the root: a
fixed first joint turns the arm into it. MJCF, the format of MuJoCo, holds armature, damping and frictionloss.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.identification.model import Model
from armlab.identification.torque_model import TorqueModel
from problem.inertia import pseudo_inertia_of, transform_pseudo_inertia
from problem.pseudo_inertia import link_of
from problem.transforms import inverse, turn_z_to

MIN_EXTENT_SHARE = 1e-12  # of a body's size: simulators refuse points, rods and plates
EXPORTED_EFFECTS = {"viscous_friction": "damping", "coulomb_friction": "friction", "rotor_inertia": "armature"}


@dataclass(frozen=True, eq=False)
class Body:
    """One moving body and its joint, in SI units.

    origin: pose (4, 4) of the joint in the frame of the body before. centre: (3,), inertia: (3, 3) about it,
    in the body's frame, whose z is the joint's axis.
    """

    name: str
    kind: str
    origin: Array
    mass: float
    centre: Array
    inertia: Array
    limits: tuple[float, float]
    velocity: float
    effort: float
    damping: float
    friction: float
    armature: float


def bodies(model: TorqueModel) -> tuple[Body, ...]:
    """The bodies of a model; InputError where it has no links or one that no simulator takes."""
    if model.inertial is None:
        raise InputError("the model has base parameters only: identify it with --method physical to export links")
    origin, out = np.eye(4), []
    own = joint_values(model)
    for index, (joint, ten) in enumerate(zip(model.arm.joints, model.inertial.reshape(-1, 10), strict=True)):
        pseudo = transform_pseudo_inertia(pseudo_inertia_of(link_of(ten)), joint.after)
        if np.linalg.eigvalsh(pseudo)[0] <= MIN_EXTENT_SHARE * np.trace(pseudo):
            raise InputError(f"link {index + 1} is no body with extent in space: identify with --method physical")
        centre = pseudo[:3, 3] / pseudo[3, 3]
        spread = pseudo[:3, :3] - pseudo[3, 3] * np.outer(centre, centre)
        inertia = np.trace(spread) * np.eye(3) - spread
        limits = joint.limits
        out.append(
            Body(
                joint.name,
                joint.kind,
                origin @ joint.before,
                float(pseudo[3, 3]),
                centre,
                inertia,
                limits.position,
                limits.velocity,
                limits.torque,
                **{name: float(values[index]) for name, values in own.items()},
            )
        )
        origin = joint.after
    return tuple(out)


def joint_values(model: TorqueModel) -> dict[str, Array]:
    """damping, friction and armature of each joint, (joints,)."""
    values = {name: np.zeros(len(model.arm)) for name in EXPORTED_EFFECTS.values()}
    for part, place in zip(model.structure.components, model.structure.slices, strict=True):
        if part.effect in EXPORTED_EFFECTS:
            values[EXPORTED_EFFECTS[part.effect]][part.joint - 1] += model.values[place][0]
    return values


def unsupported_components(model: TorqueModel) -> tuple[str, ...]:
    """Components for which these formats have no place."""
    return tuple(part.label for part in model.structure.components if part.effect not in EXPORTED_EFFECTS)


def format_numbers(values: Array | tuple[float, ...]) -> str:
    """Numbers to their last digit."""
    return " ".join(repr(float(value)) for value in values)


def srdf_document(model: TorqueModel) -> str:
    """Rotor inertias on the joint side: `mass` is the format's word for the inertia of a rotor, kg m2 (kg)."""
    root = ElementTree.Element("robot", name=model.arm.name)
    rotors = ElementTree.SubElement(root, "rotor_params")
    for joint, inertia in zip(model.arm.joints, joint_values(model)["armature"].tolist(), strict=True):
        ElementTree.SubElement(rotors, "joint", name=joint.name, mass=repr(inertia), gear_ratio="1.0")
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


MIN_PITCH_COSINE = 1e-12  # cosine of the pitch, below which roll and yaw are one turn
UNLIMITED = 1e9  # what a reader takes for no limit, where the format wants a number


def urdf_document(model: TorqueModel) -> str:
    """The model as a URDF document; InputError for a model without links."""
    root = ElementTree.Element("robot", name=model.arm.name)
    ElementTree.SubElement(root, "link", name="world")
    ElementTree.SubElement(root, "link", name="base")
    mount = ElementTree.SubElement(root, "joint", name="mount", type="fixed")
    _add_ends(mount, "world", "base", _rotation_to_upright(model.arm.gravity))
    previous = "base"
    for index, body in enumerate(bodies(model)):
        previous = _add_link(root, body, previous, f"link{index + 1}")
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _rotation_to_upright(gravity: tuple[float, float, float]) -> Array:
    """The turn that brings gravity to -z."""
    return inverse(turn_z_to(-np.array(gravity))) if np.any(gravity) else np.eye(4)


def _add_link(root: ElementTree.Element, body: Body, parent: str, name: str) -> str:
    link = ElementTree.SubElement(root, "link", name=name)
    inertial = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(inertial, "origin", xyz=format_numbers(body.centre), rpy="0 0 0")
    ElementTree.SubElement(inertial, "mass", value=repr(body.mass))
    entries = body.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    ElementTree.SubElement(inertial, "inertia", dict(zip(names, map(repr, entries.tolist()), strict=True)))
    limited = bool(np.all(np.isfinite(body.limits)))
    kind = "continuous" if body.kind == "revolute" and not limited else body.kind
    joint = ElementTree.SubElement(root, "joint", name=body.name, type=kind)
    _add_ends(joint, parent, name, body.origin)
    ElementTree.SubElement(joint, "axis", xyz="0 0 1")
    ElementTree.SubElement(joint, "dynamics", damping=repr(body.damping), friction=repr(body.friction))
    limit = {"effort": _format_finite(body.effort), "velocity": _format_finite(body.velocity)}
    if kind != "continuous":
        limit |= {"lower": _format_finite(body.limits[0]), "upper": _format_finite(body.limits[1])}
    ElementTree.SubElement(joint, "limit", limit)
    return name


def _add_ends(joint: ElementTree.Element, parent: str, child: str, pose: Array) -> None:
    ElementTree.SubElement(joint, "parent", link=parent)
    ElementTree.SubElement(joint, "child", link=child)
    ElementTree.SubElement(
        joint, "origin", xyz=format_numbers(pose[:3, 3]), rpy=format_numbers(_roll_pitch_yaw(pose[:3, :3]))
    )


def _roll_pitch_yaw(rotation: Array) -> tuple[float, float, float]:
    """Angles about the fixed axes x, y, z; where pitch is a quarter turn, the whole rest is roll."""
    level = float(np.hypot(rotation[0, 0], rotation[1, 0]))
    pitch = float(np.arctan2(-rotation[2, 0], level))
    if level < MIN_PITCH_COSINE:
        return float(np.arctan2(-rotation[1, 2], rotation[1, 1])), pitch, 0.0
    roll = float(np.arctan2(rotation[2, 1], rotation[2, 2]))
    return roll, pitch, float(np.arctan2(rotation[1, 0], rotation[0, 0]))


def _format_finite(value: float) -> str:
    return repr(float(np.clip(value, -UNLIMITED, UNLIMITED)))


MJCF_JOINT_TYPES = {"revolute": "hinge", "prismatic": "slide"}


def mjcf_document(model: TorqueModel) -> str:
    """The model as an MJCF document; InputError for a model without links."""
    root = ElementTree.Element("mujoco", model=model.arm.name)
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="true")
    ElementTree.SubElement(root, "option", gravity=format_numbers(model.arm.gravity))
    parent = ElementTree.SubElement(root, "worldbody")
    for index, body in enumerate(bodies(model)):
        parent = _add_body(parent, body, index + 1)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _add_body(parent: ElementTree.Element, body: Body, number: int) -> ElementTree.Element:
    quaternion = Rotation.from_matrix(body.origin[:3, :3]).as_quat(scalar_first=True)
    pose = {"pos": format_numbers(body.origin[:3, 3]), "quat": format_numbers(quaternion)}
    node = ElementTree.SubElement(parent, "body", {"name": f"link{number}", **pose})
    entries = body.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    inertial = {
        "pos": format_numbers(body.centre),
        "mass": format_numbers((body.mass,)),
        "fullinertia": format_numbers(entries),
    }
    ElementTree.SubElement(node, "inertial", inertial)
    joint = {"name": body.name, "type": MJCF_JOINT_TYPES[body.kind], "axis": "0 0 1"}
    joint |= {"armature": repr(body.armature), "damping": repr(body.damping), "frictionloss": repr(body.friction)}
    if np.all(np.isfinite(body.limits)):
        joint["range"] = format_numbers(body.limits)
    ElementTree.SubElement(node, "joint", joint)
    return node


WRITERS = {".urdf": urdf_document, ".xml": mjcf_document}


def export_model(path: Path, out: Path) -> Iterator[str]:
    """Writes the file and tells what it does not hold; InputError where the ending or the model does not fit."""
    check_ending(out)
    model = Model.load(path)
    yield from write_files(model, out, WRITERS[out.suffix](model), unsupported_components(model))


def check_ending(out: Path) -> None:
    """InputError for a file of another format."""
    if out.suffix not in WRITERS:
        raise InputError(f"{out}: the file should end in .urdf or .xml (MJCF)")


def write_files(model: TorqueModel, out: Path, text: str, missing: Sequence[str]) -> Iterator[str]:
    """Writes the text of a model, and rotor inertias beside a URDF. missing: what the file does not hold."""
    yield from _write_text(out, text)
    if out.suffix == ".urdf" and joint_values(model)["armature"].any():
        yield from _write_text(out.with_suffix(".srdf"), srdf_document(model))
        yield "rotor inertias stand in the .srdf, which Pinocchio reads: URDF has no place for them, MJCF has"
    if missing:
        yield "not in the file: " + "; ".join(missing)


def _write_text(path: Path, text: str) -> Iterator[str]:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from None
    yield str(path)
