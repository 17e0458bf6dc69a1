"""A model as a file of a simulator: URDF, with an SRDF beside it, or MJCF.

Payloads and link errors go into the links, a tilt of the base into gravity, and laws that a simulator's joint has to
the joints (see `Candidate.joint_fields`); all friction of a joint becomes one line (see `friction_lines`); effects
without a place in the file are listed.

Both formats write the model as a chain of bodies on joints that turn about or slide along z. URDF has no place for the
armature, which goes to the SRDF that Pinocchio reads (`loadRotorParameters`), and takes gravity as -z of the root: a
fixed first joint turns the arm into it. MJCF, the format of MuJoCo, holds armature, damping, frictionloss and springs.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.effects.contract import Candidate
from armlab.effects.model import FittedEffect
from armlab.effects.words import component_in_words
from armlab.identification.friction_lines import FrictionLine, friction_lines
from armlab.identification.structure import Structure
from armlab.identification.torque_model import TorqueModel
from problem.arm import Arm
from problem.coupled_joints import refuse_coupled
from problem.pseudo_inertia import (
    link_of,
    links_of,
    parameters_of,
    pseudo_inertia_of,
    pseudo_inertias,
    regular_nominal,
    transform_pseudo_inertia,
)
from problem.transforms import inverse, turn_z_to

MIN_EXTENT_SHARE = 1e-12  # of a body's size: simulators refuse points, rods and plates
MAX_FLAT_SHARE = 1e-9  # of a link's size: below it a point or a rod cannot be distinguished from rounding
MAX_COUPLED_ROUNDING = 1e-12  # of a field of a joint and of those that it leads: less is rounding
ROUNDING_SHARE = 1e-15  # of the largest of several numbers
SPRING_FIELDS = ("stiffness", "springref")


@dataclass(frozen=True, eq=False)
class SimulatorModel:
    """What a simulator can hold of a model.

    model: links with the bodies that were added, gravity as tilted. fields: of the joints, (joints,) each. missing:
    the named effects without a place, in words. unclaimed: the effects with a place that are no finding, in words; the
    model predicts better with them. thickened_links: links, from 1, that were points or rods, which no
    simulator takes, and have been given a little extent. friction: one line a joint. negative_rotors: joints, from 1,
    with a negative rotor inertia in the model, which is left out.
    """

    model: TorqueModel
    fields: dict[str, Array]
    missing: tuple[str, ...]
    unclaimed: tuple[str, ...] = ()
    thickened_links: tuple[int, ...] = ()
    friction: tuple[FrictionLine, ...] = ()
    negative_rotors: tuple[int, ...] = ()

    def field(self, name: str) -> Array:
        """A field of the joints, (joints,): zero where no effect states it."""
        return self.fields.get(name, np.zeros(len(self.model.arm)))


def has_place_in_simulator(candidate: Candidate, coefficients: Array) -> bool:
    """Whether an MJCF file can hold an effect: in a joint, a link, or gravity."""
    return (
        candidate.is_friction
        or bool(candidate.joint_fields(coefficients))
        or any(
            each is not None for each in (candidate.added_body(coefficients), candidate.changed_gravity(coefficients))
        )
    )


def build_simulator_model(known: TorqueModel) -> SimulatorModel:
    """Sorts the effects of a model into links, gravity and fields of joints; the rest is named as missing."""
    arm, inertial = known.arm, known.inertial
    missing, unclaimed = list[str](), list[str]()
    for number, effect in enumerate(known.effects):
        candidate, values = effect.candidate, _whole_law(known, effect)
        body, gravity = (f(effect.coefficients) for f in (candidate.added_body, candidate.changed_gravity))
        if body is not None and inertial is not None:
            inertial = inertial.copy()
            inertial[10 * candidate.joints[0] - 10 : 10 * candidate.joints[0]] += body
        elif gravity is not None:
            x, y, z = gravity.tolist()
            arm = replace(arm, gravity=(x, y, z))
        words = component_in_words(known.arm, candidate, known.component_parameters(number))
        has_place, is_claimed = has_place_in_simulator(candidate, values), number not in known.unclaimed
        if has_place and not is_claimed:
            unclaimed.append(words)
        elif is_claimed and not has_place:
            missing.append(words)
    thickened: tuple[int, ...] = ()
    if inertial is not None:
        inertial, thickened = _thicken_links(arm, inertial)
    rigid = _model_with_links(known, arm, inertial)
    lines, negative = friction_lines(known), known.rotor_inertia < 0
    return SimulatorModel(
        model=rigid,
        fields=_joint_fields(known, lines),
        missing=tuple(missing),
        unclaimed=tuple(unclaimed),
        thickened_links=thickened,
        friction=lines,
        negative_rotors=tuple((np.flatnonzero(negative) + 1).tolist()),
    )


def _whole_law(model: TorqueModel, effect: FittedEffect) -> Array:
    """Coefficients of a law at its place in a model: of the simulation's own and of what was found beside it."""
    own = effect.candidate
    alike = [each for each in model.effects if each.candidate == own]
    return np.asarray(np.sum([each.coefficients for each in alike], axis=0))


def _joint_fields(model: TorqueModel, friction: tuple[FrictionLine, ...]) -> dict[str, Array]:
    """What a simulator's joints hold of a model, (joints,) a field; no damping, friction or rotor is negative."""
    out: dict[str, Array] = {}
    laws = {each.candidate: _whole_law(model, each) for each in model.effects if not each.candidate.is_friction}
    for candidate, coefficients in laws.items():
        for name, value in candidate.joint_fields(coefficients).items():
            out.setdefault(name, np.zeros(len(model.arm)))[candidate.rows[0]] += value
    out |= {
        "armature": np.maximum(model.rotor_inertia, 0.0),
        "damping": np.array([line.slope for line in friction]),
        "frictionloss": np.array([line.level for line in friction]),
    }
    return _without_coupled(model.arm, out) if model.arm.coupled else out


def _without_coupled(arm: Arm, fields: Mapping[str, Array]) -> dict[str, Array]:
    """Fields of the joints without those of the joints that they lead, which stay as the file has them.

    Raises InputError where those have more than the model has for both.
    """
    out = {name: np.array(values) for name, values in fields.items()}
    stiffness, rest = (out.setdefault(name, np.zeros(len(arm))) for name in SPRING_FIELDS)
    moment = stiffness * rest
    for each in arm.coupled:
        own, slope, leader = each.law, each.multiplier, each.leader
        out["armature"][leader] -= slope**2 * each.rotor_inertia
        out["damping"][leader] -= slope**2 * own.damping
        out["frictionloss"][leader] -= abs(slope) * own.friction
        stiffness[leader] -= slope**2 * own.stiffness
        moment[leader] -= slope * own.stiffness * (own.rest - each.offset)
    for name in ("armature", "damping", "frictionloss"):
        rounding = MAX_COUPLED_ROUNDING * np.abs(fields[name])
        for joint in np.flatnonzero(out[name] < -rounding).tolist():
            raise InputError(
                f"the joints that {arm.joints[joint].name} leads have more {name} than the model has for all of them: "
                "lower theirs in the robot file first"
            )
        out[name] = np.where(np.abs(out[name]) <= rounding, 0.0, _without_last_digits(out[name]))
    stiffness = np.where(np.abs(stiffness) <= MAX_COUPLED_ROUNDING * np.abs(fields.get("stiffness", 0.0)), 0, stiffness)
    rest = np.divide(moment, stiffness, out=np.zeros(len(arm)), where=stiffness != 0)
    return out | {"stiffness": _without_last_digits(stiffness), "springref": _without_last_digits(rest)}


def _without_last_digits(values: Array) -> Array:
    """Values as they were before something was added and taken away again."""
    return np.array([float(f"{value:.13g}") for value in values.tolist()])


def _thicken_links(arm: Arm, inertial: Array) -> tuple[Array, tuple[int, ...]]:
    """Links with extent in space, and which of them (from 1) had none; what no body could have stays as it is."""
    pseudos = pseudo_inertias(inertial)
    lowest = np.linalg.eigvalsh(pseudos)[:, 0] / np.maximum(np.trace(pseudos, axis1=1, axis2=2), 1e-300)
    flat = np.abs(lowest) <= MAX_FLAT_SHARE
    raised = regular_nominal(replace(arm, links=links_of(inertial)))
    whole = parameters_of(np.where(flat[:, None, None], raised, pseudos))
    return whole, tuple((np.flatnonzero(flat) + 1).tolist())


def _model_with_links(known: TorqueModel, arm: Arm, inertial: Array | None) -> TorqueModel:
    """The model with other links and gravity: another gravity may have other base parameters."""
    if inertial is None:
        return known
    structure = Structure(arm)
    return TorqueModel(known.robot, structure, structure.base.values(inertial), inertial=inertial)


@dataclass(frozen=True, eq=False)
class ExportedBody:
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


def bodies(simulated: SimulatorModel) -> tuple[ExportedBody, ...]:
    """The bodies of a model; InputError where it has no links or one that no simulator takes, or coupled joints."""
    refuse_coupled(simulated.model.arm, "a chain of bodies alone")
    origin, out = np.eye(4), []
    for index, (joint, total) in enumerate(zip(simulated.model.arm.joints, link_inertias(simulated), strict=True)):
        mass, centre, inertia = body_numbers(transform_pseudo_inertia(total, joint.after))
        limits = joint.limits
        out.append(
            ExportedBody(
                joint.name,
                joint.kind,
                origin @ joint.before,
                mass,
                centre,
                inertia,
                limits.position,
                limits.velocity,
                limits.torque,
                *(float(simulated.field(name)[index]) for name in ("damping", "frictionloss", "armature")),
            )
        )
        origin = joint.after
    return tuple(out)


def link_inertias(simulated: SimulatorModel) -> list[Array]:
    """The links' pseudo-inertias (4, 4), each about its frame; InputError where a simulator would not take them."""
    model = simulated.model
    if model.inertial is None:
        raise InputError("the model has base parameters only: identify it with --method physical to export links")
    out = [pseudo_inertia_of(link_of(ten)) for ten in model.inertial.reshape(-1, 10)]
    for number, pseudo in enumerate(out, 1):
        if not has_extent(pseudo):
            raise InputError(f"link {number} is no body with extent in space: identify with --method physical")
    return out


def has_extent(pseudo: Array) -> bool:
    """Whether a pseudo-inertia (4, 4) is that of a body with extent in all directions."""
    return bool(np.linalg.eigvalsh(pseudo)[0] > MIN_EXTENT_SHARE * np.trace(pseudo))


def body_numbers(pseudo: Array) -> tuple[float, Array, Array]:
    """Mass, centre (3,) and inertia (3, 3) about it, in the frame of a pseudo-inertia (4, 4).

    What is only rounding beside the largest number is zero.
    """
    mass = float(pseudo[3, 3])
    centre = pseudo[:3, 3] / mass
    spread = pseudo[:3, :3] - mass * np.outer(centre, centre)
    return mass, _without_rounding(centre), _without_rounding(np.trace(spread) * np.eye(3) - spread)


def _without_rounding(values: Array) -> Array:
    return np.where(np.abs(values) > ROUNDING_SHARE * np.abs(values).max(), values, 0.0)


def inertia_entries(inertia: Array) -> Array:
    """Entries xx, yy, zz, xy, xz, yz of an inertia (3, 3)."""
    return np.asarray(inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])


def format_numbers(values: Array | tuple[float, ...]) -> str:
    """Numbers to their last digit."""
    return " ".join(repr(float(value)) for value in values)


def srdf_document(simulated: SimulatorModel) -> str:
    """Rotor inertias on the joint side: `mass` is the format's word for the inertia of a rotor, kg m2 (kg)."""
    arm = simulated.model.arm
    root = ElementTree.Element("robot", name=arm.name)
    rotors = ElementTree.SubElement(root, "rotor_params")
    for joint, inertia in zip(arm.joints, simulated.fields["armature"].tolist(), strict=True):
        ElementTree.SubElement(rotors, "joint", name=joint.name, mass=repr(inertia), gear_ratio="1.0")
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


INERTIA_NAMES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
MIN_PITCH_COSINE = 1e-12  # cosine of the pitch, below which roll and yaw are one turn
UNLIMITED = 1e9  # what a reader takes for no limit, where the format wants a number


def urdf_document(simulated: SimulatorModel) -> str:
    """The model as a URDF document; InputError for a model without links."""
    root = ElementTree.Element("robot", name=simulated.model.arm.name)
    ElementTree.SubElement(root, "link", name="world")
    ElementTree.SubElement(root, "link", name="base")
    mount = ElementTree.SubElement(root, "joint", name="mount", type="fixed")
    _add_ends(mount, "world", "base", _rotation_to_upright(simulated.model.arm.gravity))
    previous = "base"
    for index, body in enumerate(bodies(simulated)):
        previous = _add_link(root, body, previous, f"link{index + 1}")
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _rotation_to_upright(gravity: tuple[float, float, float]) -> Array:
    """The turn that brings gravity to -z."""
    return inverse(turn_z_to(-np.array(gravity))) if np.any(gravity) else np.eye(4)


def _add_link(root: ElementTree.Element, body: ExportedBody, parent: str, name: str) -> str:
    link = ElementTree.SubElement(root, "link", name=name)
    link.append(inertial_element(body.mass, body.centre, body.inertia))
    limited = bool(np.all(np.isfinite(body.limits)))
    kind = "continuous" if body.kind == "revolute" and not limited else body.kind
    joint = ElementTree.SubElement(root, "joint", name=body.name, type=kind)
    _add_ends(joint, parent, name, body.origin)
    ElementTree.SubElement(joint, "axis", xyz="0 0 1")
    ElementTree.SubElement(joint, "dynamics", damping=repr(body.damping), friction=repr(body.friction))
    limit = {"effort": body.effort, "velocity": body.velocity}
    if kind != "continuous":
        limit |= {"lower": body.limits[0], "upper": body.limits[1]}
    if kind != "continuous" or np.any(np.isfinite(list(limit.values()))):
        ElementTree.SubElement(joint, "limit", {key: _format_finite(value) for key, value in limit.items()})
    return name


def unstated_limits(arm: Arm) -> list[str]:
    """Limits for which a URDF of an arm has a number that the arm does not have, one line each.

    urdfdom, which ROS and Pinocchio use, refuses a joint between two positions, and a limit, without torque or speed.
    A joint that turns freely needs no limit: it has none where nothing is known of it.
    """
    missing: dict[str, list[str]] = {"torque": [], "speed": [], "positions": []}
    for joint in arm.joints:
        limits = joint.limits
        positions = bool(np.all(np.isfinite(limits.position)))
        known = {"torque": np.isfinite(limits.torque), "speed": np.isfinite(limits.velocity)}
        if joint.kind == "prismatic":
            known["positions"] = positions
        elif not positions and not any(known.values()):
            continue
        for name, has in known.items():
            if not has:
                missing[name].append(joint.name)
    return [
        f"the robot has no limit of {name} for {', '.join(joints)}: URDF wants one, {UNLIMITED:g} stands for none"
        for name, joints in missing.items()
        if joints
    ]


def inertial_element(mass: float, centre: Array, inertia: Array) -> ElementTree.Element:
    """The URDF element of a body: kg, m, kg m2 about the centre."""
    element = ElementTree.Element("inertial")
    ElementTree.SubElement(element, "origin", xyz=format_numbers(centre), rpy="0 0 0")
    ElementTree.SubElement(element, "mass", value=repr(mass))
    entries = map(repr, inertia_entries(inertia).tolist())
    ElementTree.SubElement(element, "inertia", dict(zip(INERTIA_NAMES, entries, strict=True)))
    return element


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


def mjcf_document(simulated: SimulatorModel) -> str:
    """The model as an MJCF document; InputError for a model without links."""
    root = ElementTree.Element("mujoco", model=simulated.model.arm.name)
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="true")
    ElementTree.SubElement(root, "option", gravity=format_numbers(simulated.model.arm.gravity))
    parent = ElementTree.SubElement(root, "worldbody")
    for index, body in enumerate(bodies(simulated)):
        parent = _add_body(parent, body, index + 1)
    _set_springs(root, simulated)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _add_body(parent: ElementTree.Element, body: ExportedBody, number: int) -> ElementTree.Element:
    quaternion = Rotation.from_matrix(body.origin[:3, :3]).as_quat(scalar_first=True)
    pose = {"pos": format_numbers(body.origin[:3, 3]), "quat": format_numbers(quaternion)}
    node = ElementTree.SubElement(parent, "body", {"name": f"link{number}", **pose})
    inertial = {
        "pos": format_numbers(body.centre),
        "mass": format_numbers((body.mass,)),
        "fullinertia": format_numbers(inertia_entries(body.inertia)),
    }
    ElementTree.SubElement(node, "inertial", inertial)
    joint = {"name": body.name, "type": MJCF_JOINT_TYPES[body.kind], "axis": "0 0 1"}
    joint |= {"armature": repr(body.armature), "damping": repr(body.damping), "frictionloss": repr(body.friction)}
    if np.all(np.isfinite(body.limits)):
        joint["range"] = format_numbers(body.limits)
    ElementTree.SubElement(node, "joint", joint)
    return node


def _set_springs(root: ElementTree.Element, simulated: SimulatorModel) -> None:
    joints = {node.get("name", ""): node for node in root.iter("joint")}
    for number, joint in enumerate(simulated.model.arm.joints):
        if "stiffness" in simulated.fields and simulated.fields["stiffness"][number]:
            for name in SPRING_FIELDS:
                joints[joint.name].set(name, format_numbers((simulated.fields[name][number],)))
