"""Robot files: `robot.yaml` with Denavit-Hartenberg parameters, a URDF, an MJCF, or the name of a built-in arm."""

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from annotated_types import Gt, Len
from pydantic import Field, model_validator

from armlab.common.errors import InputError
from armlab.common.settings import Settings, read_yaml, suggest_name, validate
from problem.arm import Arm, Joint, Limits, Link
from problem.mjcf import read_mjcf
from problem.regressor import MAX_JOINTS
from problem.transforms import rotation_x, rotation_z, translation
from problem.urdf import read_urdf

BUILT_IN_FOLDER = Path(__file__).parent / "robots"
Positive = Annotated[float, Gt(0)]
Vector = tuple[float, float, float]


class JointEntry(Settings):
    """One row of the D-H table with its limits; m and rad; `d` is added to the variable of a prismatic joint."""

    name: str
    type: Literal["revolute", "prismatic"]
    a: float
    d: float
    alpha: float
    theta_offset: float = 0.0
    position_limits: tuple[float, float] | None = None
    velocity_limit: Positive | None = None
    acceleration_limit: Positive | None = None
    torque_limit: Positive | None = None

    @model_validator(mode="after")
    def _limits_in_order(self) -> "JointEntry":
        if self.position_limits and self.position_limits[0] >= self.position_limits[1]:
            low, high = self.position_limits
            raise ValueError(f"position_limits of {self.name} should be [lower, upper], so [{high}, {low}]")
        return self

    def limits(self) -> Limits:
        """The limits that are given; the others are infinite."""
        given = {
            "position": self.position_limits,
            "velocity": self.velocity_limit,
            "acceleration": self.acceleration_limit,
            "torque": self.torque_limit,
        }
        return Limits(**{name: value for name, value in given.items() if value is not None})  # type: ignore[arg-type]

    def build(self, convention: str) -> Joint:
        """The joint between its fixed transforms (Denavit 1955; Craig 1989 for `modified`)."""
        own = rotation_z(self.theta_offset) @ translation(0, 0, self.d)
        link = rotation_x(self.alpha) @ translation(self.a, 0, 0)
        still = translation(0, 0, 0)
        before, after = (own, link) if convention == "standard" else (link @ own, still)
        return Joint(self.name, self.type, before, after, self.limits())


class LinkEntry(Settings):
    """Inertial parameters about the origin of the link's D-H frame: kg, kg m, kg m2."""

    mass: float
    first_moment: Vector
    inertia: tuple[float, float, float, float, float, float]

    def build(self) -> Link:
        """The link."""
        return Link(self.mass, self.first_moment, self.inertia)


class RobotFile(Settings):
    """`robot.yaml`; links and rotor inertias are optional."""

    name: str
    dh_convention: Literal["standard", "modified"]
    gravity: Vector = (0.0, 0.0, -9.81)
    joints: Annotated[tuple[JointEntry, ...], Len(min_length=1)]
    links: tuple[LinkEntry, ...] | None = None
    rotor_inertia: tuple[Annotated[float, Field(ge=0)], ...] | None = None

    @model_validator(mode="after")
    def _one_entry_a_joint(self) -> "RobotFile":
        for name in ("links", "rotor_inertia"):
            entries = getattr(self, name)
            if entries is not None and len(entries) != len(self.joints):
                raise ValueError(f"{name} should have {len(self.joints)} entries, one a joint, has {len(entries)}")
        return self

    def build(self) -> Arm:
        """The arm that the file describes."""
        joints = tuple(entry.build(self.dh_convention) for entry in self.joints)
        links = None
        if self.links is not None:
            links = tuple(entry.build() for entry in self.links)
        return Arm(self.name, joints, links, self.gravity, self.rotor_inertia or ())


def built_in_arms() -> list[str]:
    """Names of the arms that come with armlab."""
    return sorted(path.stem for path in BUILT_IN_FOLDER.glob("*.yaml"))


def load_arm(robot: str, beside: Path | None = None) -> Arm:
    """The arm of a robot file, a URDF, an MJCF (.xml), or a built-in name.

    robot: a path (relative to the folder `beside`, else to the working folder) or a built-in name.
    Raises InputError, in one line, for a missing or faulty file and for a chain that is not serial.
    """
    if robot in built_in_arms():
        return _read_yaml_arm(BUILT_IN_FOLDER / f"{robot}.yaml", robot)
    path = (beside or Path()) / robot
    if path.suffix == ".urdf":
        return check_arm(read_urdf(path), str(path))
    if path.suffix == ".xml":
        return check_arm(read_mjcf(path), str(path))
    if path.suffix in (".yaml", ".yml"):
        return check_arm(_read_yaml_arm(path, str(path)), str(path))
    raise InputError(
        f"unknown robot {robot!r}, neither a .yaml, .urdf or .xml (MJCF) file nor a built-in arm: "
        f"{suggest_name(robot, built_in_arms())}"
    )


MAX_LINK_PARAMETER = 1e6  # kg, kg m, kg m2: no link of an arm is heavier
MAX_LENGTH = 1e3  # m, from joint to joint


def check_arm(arm: Arm, where: str) -> Arm:
    """The arm; InputError for more joints than can be computed, joints of one name, and numbers that no arm has."""
    if len(arm.chain) > MAX_JOINTS:
        raise InputError(f"{where} has {len(arm.chain)} moving joints; at most {MAX_JOINTS} are supported")
    names = [joint.name for joint in arm.chain.joints]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"{where}: two joints are called '{twice[0]}'; give each a name of its own")
    for number, link in enumerate(arm.links or (), 1):
        if np.abs(link.parameters).max() > MAX_LINK_PARAMETER:
            raise InputError(f"{where}: link {number} has {_largest(link):g}; at most {MAX_LINK_PARAMETER:g} kg, kg.m2")
    for joint in arm.chain.joints:
        if max(np.abs(joint.before[:3, 3]).max(), np.abs(joint.after[:3, 3]).max()) > MAX_LENGTH:
            raise InputError(f"{where}: joint '{joint.name}' is more than {MAX_LENGTH:g} m from the one before")
    return arm


def _largest(link: Link) -> float:
    return float(np.abs(link.parameters).max())


def _read_yaml_arm(path: Path, where: str) -> Arm:
    return validate(RobotFile, read_yaml(path), where).build()
