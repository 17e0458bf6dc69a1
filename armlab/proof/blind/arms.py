"""The arms of the concealed recordings, and changed copies of an arm: links, lengths, gravity and rotors."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from armlab.common.settings import read_yaml, validate
from problem.arm import Arm, Joint, Link
from problem.pseudo_inertia import (
    link_from_centre_of_mass,
    link_from_pseudo_inertia,
    pseudo_inertia_of,
    transform_pseudo_inertia,
)
from problem.robot_file import BUILT_IN_FOLDER, RobotFile
from problem.transforms import rotation_x, rotation_y, translation

# Gaz et al. 2019, as in franka_description: mass, centre of mass, Ixx Iyy Izz Ixy Ixz Iyz about it; modified D-H frames
PANDA_LINKS = (
    (4.970684, (0.003875, 0.002081, -0.04762), (0.70337, 0.70661, 0.009117, -0.000139, 0.006772, 0.019169)),
    (0.646926, (-0.003141, -0.02872, 0.003495), (0.007962, 0.02811, 0.025995, -0.003925, 0.010254, 0.000704)),
    (3.228604, (0.027518, 0.039252, -0.066502), (0.037242, 0.036155, 0.01083, -0.004761, -0.011396, -0.012805)),
    (3.587895, (-0.05317, 0.104419, 0.027454), (0.025853, 0.019552, 0.028323, 0.007796, -0.001332, 0.008641)),
    (1.225946, (-0.011953, 0.041065, -0.038437), (0.035549, 0.029474, 0.008627, -0.002117, -0.004037, 0.000229)),
    (1.666555, (0.060149, -0.014117, -0.010517), (0.001964, 0.004354, 0.005433, 0.000109, -0.001158, 0.000341)),
    (0.735522, (0.010517, -0.004252, 0.061597), (0.012516, 0.010027, 0.004815, -0.000428, -0.001196, -0.000741)),
)
# a horizontal arm in the size of small assembly robots: the joint axes stand along gravity
SCARA_FILE: dict[str, Any] = {
    "name": "scara",
    "dh_convention": "standard",
    "joints": [
        {"name": "joint1", "type": "revolute", "a": 0.325, "d": 0.2, "alpha": 0.0, "position_limits": [-2.2, 2.2]},
        {"name": "joint2", "type": "revolute", "a": 0.225, "d": 0.0, "alpha": 0.0, "position_limits": [-2.5, 2.5]},
    ],
}
SCARA_LINKS = (
    (6.8, (-0.14, 0.004, 0.03), (0.021, 0.082, 0.089, 0.0006, 0.0011, -0.0004)),
    (4.1, (-0.09, -0.003, 0.05), (0.017, 0.039, 0.031, -0.0003, 0.0009, 0.0002)),
)


@dataclass(frozen=True, eq=False)
class Machine:
    """An arm with what a builder would know of it.

    file: the robot file that goes with a recording. rating: (joints,), N m, torque of the drives at rest.
    speed, acceleration: (joints,), what the motions use at most, rad/s and rad/s2.
    """

    name: str
    file: RobotFile
    rating: Array
    speed: Array
    acceleration: Array

    @property
    def arm(self) -> Arm:
        """The nominal arm: the simulation that a recording is compared with."""
        return self.file.build()

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.file.joints)

    @property
    def range(self) -> Array:
        """Lowest and highest position of each joint, (2, joints), rad."""
        limits = [entry.position_limits or (-2.5, 2.5) for entry in self.file.joints]
        return np.array(limits, dtype=np.float64).T

    def settings(self) -> dict[str, Any]:
        """The content of the robot file."""
        return self.file.model_dump(mode="json", exclude_none=True)


def make_machine(name: str) -> Machine:
    """The arm of that name: `irb120-arm`, `irb120`, `panda` or `scara`; KeyError for another."""
    return {"irb120-arm": _make_irb120_arm, "irb120": _make_irb120, "panda": _make_panda, "scara": _make_scara}[name]()


def _make_irb120_arm() -> Machine:
    data = {**_read_built_in("irb120-arm"), "rotor_inertia": [0.25, 0.3, 0.08]}
    return _build_machine(data, (60, 60, 30), (2.2, 1.8, 2.2), (10, 9, 12))


def _make_irb120() -> Machine:
    data = {**_read_built_in("irb120"), "rotor_inertia": [0.3, 0.35, 0.09, 0.03, 0.025, 0.012]}
    speed, acceleration = (2.2, 1.8, 2.2, 3.0, 3.0, 3.5), (10, 9, 12, 15, 15, 20)
    return _build_machine(data, (60, 60, 30, 10, 10, 6), speed, acceleration)


def _make_panda() -> Machine:
    rotors = [0.55, 0.55, 0.45, 0.45, 0.2, 0.2, 0.2]
    data = {
        **_read_built_in("unisa-panda"),
        "name": "panda",
        "links": _robot_file_links(PANDA_LINKS),
        "rotor_inertia": rotors,
    }
    speed, acceleration = (1.6, 1.3, 1.6, 1.5, 2.0, 2.0, 2.0), (7, 5, 7, 8, 10, 10, 10)
    return _build_machine(data, (80, 80, 80, 60, 12, 12, 10), speed, acceleration)


def _make_scara() -> Machine:
    data = {**SCARA_FILE, "links": _robot_file_links(SCARA_LINKS), "rotor_inertia": [0.35, 0.12]}
    return _build_machine(data, (70, 30), (3.5, 4.5), (16, 22))


def _read_built_in(name: str) -> dict[str, Any]:
    data: dict[str, Any] = read_yaml(BUILT_IN_FOLDER / f"{name}.yaml")
    return data


def _build_machine(
    data: dict[str, Any], rating: tuple[float, ...], speed: tuple[float, ...], acceleration: tuple[float, ...]
) -> Machine:
    return Machine(
        name=data["name"],
        file=validate(RobotFile, data, data["name"]),
        rating=np.array(rating, dtype=np.float64),
        speed=np.array(speed, dtype=np.float64),
        acceleration=np.array(acceleration, dtype=np.float64),
    )


def _robot_file_links(bodies: tuple[tuple[float, tuple[float, ...], tuple[float, ...]], ...]) -> list[dict[str, Any]]:
    """Links of a robot file from bodies about their centres of mass."""
    out = []
    for mass, centre, (xx, yy, zz, xy, xz, yz) in bodies:
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        link = link_from_centre_of_mass(mass, np.array(centre), inertia)
        out.append({"mass": link.mass, "first_moment": list(link.first_moment), "inertia": list(link.inertia)})
    return out


def with_parameters(arm: Arm, parameters: Array) -> Arm:
    """The arm with other inertial parameters, (10 * joints,)."""
    return replace(arm, links=tuple(_make_link(*row) for row in parameters.reshape(-1, 10).tolist()))


def _make_link(
    m: float, x: float, y: float, z: float, xx: float, yy: float, zz: float, xy: float, xz: float, yz: float
) -> Link:
    return Link(m, (x, y, z), (xx, yy, zz, xy, xz, yz))


def with_body(arm: Arm, link: int, body: Link) -> Arm:
    """The arm with a body fixed to a link (from 0), given in that link's frame."""
    parameters = arm.parameters.reshape(-1, 10).copy()
    parameters[link] += body.parameters
    return with_parameters(arm, parameters.ravel())


def with_stretched_link(arm: Arm, link: int, mass: float, shift: Array, spread: float) -> Arm:
    """The arm with a link whose mass and inertia grow by factors and whose centre of mass is moved.

    shift: (3,), m. spread: factor of the inertia about the centre, beyond that of the mass.
    """
    if arm.links is None:
        raise ValueError(f"the arm {arm.name!r} has no `links`")
    old = arm.links[link]
    pseudo, centre = pseudo_inertia_of(old), np.array(old.first_moment) / old.mass
    about_centre = transform_pseudo_inertia(pseudo, translation(*(-centre)))
    about_centre[:3, :3] *= spread
    new = link_from_pseudo_inertia(mass * transform_pseudo_inertia(about_centre, translation(*(centre + shift))))
    parameters = arm.parameters.reshape(-1, 10).copy()
    parameters[link] = new.parameters
    return with_parameters(arm, parameters.ravel())


def with_longer_link(arm: Arm, joint: int, along: str, metres: float) -> Arm:
    """The arm with a longer `a` (behind the joint, from 0, along x) or `d` (along z)."""
    old = arm.joints[joint]
    if along == "d":
        new = Joint(old.name, old.kind, old.before @ translation(0, 0, metres), old.after, old.limits)
    else:
        new = Joint(old.name, old.kind, old.before, translation(metres, 0, 0) @ old.after, old.limits)
    return replace(arm, joints=(*arm.joints[:joint], new, *arm.joints[joint + 1 :]))


def with_tilt(arm: Arm, about_x: float, about_y: float) -> Arm:
    """The arm on a base that is turned about its x and y axes, rad."""
    turn = (rotation_x(about_x) @ rotation_y(about_y))[:3, :3]
    gravity = turn.T @ np.array(arm.gravity)
    return replace(arm, gravity=(float(gravity[0]), float(gravity[1]), float(gravity[2])))


def with_rotor(arm: Arm, joint: int, inertia: float) -> Arm:
    """The arm with more inertia behind the gear of a joint (from 0), kg m2."""
    rotors = list(arm.rotor_inertia or (0.0,) * len(arm))
    rotors[joint] += inertia
    return replace(arm, rotor_inertia=tuple(rotors))
