"""Robots of the field: single drives, pendulums, slides, and arms of two to seven joints in many sizes."""

from dataclasses import replace
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from armlab.common.settings import validate
from armlab.proof.blind.arms import Machine, make_machine, with_stretched_link
from problem.arm import Arm
from problem.robot_file import RobotFile

SMALL = ("turning drive", "pendulum", "slide", "double pendulum", "scara", "gantry", "first three of six", "irb120-arm")
LARGE = ("irb120", "irb120", "panda", "panda", "first five of seven")
LENGTH_SCALE, DENSITY = (0.4, 2.5), (0.6, 1.6)


def draw_machine(rng: np.random.Generator, large: bool) -> Machine:
    """A robot of another size than any other; large: of more than three joints. Its file holds the nominal links."""
    name = str(rng.choice(LARGE if large else SMALL))
    if name == "first three of six":
        machine = first_joints(make_machine("irb120"), 3)
    elif name == "first five of seven":
        machine = first_joints(make_machine("panda"), int(rng.integers(4, 6)))
    elif name in ("irb120", "panda", "scara", "irb120-arm"):
        machine = make_machine(name)
    else:
        machine = _simple_machine(rng, name)
    length = float(np.exp(rng.uniform(*np.log(LENGTH_SCALE))))
    return scaled_machine(machine, length, float(rng.uniform(*DENSITY)))


def first_joints(machine: Machine, joints: int) -> Machine:
    """The machine without the joints behind the first ones, and without what they carry."""
    file = machine.file
    links = file.links[:joints] if file.links else None
    rotors = file.rotor_inertia[:joints] if file.rotor_inertia else None
    cut = file.model_copy(update={"joints": file.joints[:joints], "links": links, "rotor_inertia": rotors})
    return replace(
        machine,
        file=cut,
        rating=machine.rating[:joints],
        speed=machine.speed[:joints],
        acceleration=machine.acceleration[:joints],
    )


def scaled_machine(machine: Machine, length: float, density: float) -> Machine:
    """The machine with all lengths and densities times a factor; torques and speeds follow (Froude 1872)."""
    data = machine.file.model_dump(mode="json", exclude_none=True)
    sliding = np.array([entry["type"] == "prismatic" for entry in data["joints"]])
    for entry, slides in zip(data["joints"], sliding, strict=True):
        entry["a"], entry["d"] = length * entry["a"], length * entry["d"]
        if slides and "position_limits" in entry:
            entry["position_limits"] = [length * each for each in entry["position_limits"]]
    for link in data["links"]:
        link["mass"] *= density * length**3
        link["first_moment"] = [density * length**4 * each for each in link["first_moment"]]
        link["inertia"] = [density * length**5 * each for each in link["inertia"]]
    rotors = data["rotor_inertia"]
    powers = np.where(sliding, 3, 5)
    data["rotor_inertia"] = [density * length ** int(power) * each for each, power in zip(rotors, powers, strict=True)]
    path = np.where(sliding, length, 1.0)
    return Machine(
        name=machine.name,
        file=validate(RobotFile, data, machine.name),
        rating=machine.rating * density * length ** np.where(sliding, 3.0, 4.0),
        speed=machine.speed * path / np.sqrt(length),
        acceleration=machine.acceleration * path / length,
    )


def with_field_links(rng: np.random.Generator, arm: Arm, errors: tuple[float, float]) -> tuple[Arm, tuple[float, ...]]:
    """The arm as it is, with links that are off by relative errors of a range, and how much each is off."""
    found: list[float] = []
    for number, link in enumerate(arm.links or ()):
        error = float(np.exp(rng.uniform(*np.log(errors))))
        mass, spread = np.exp(rng.choice([-1, 1]) * np.log1p(error)), np.exp(rng.uniform(-1, 1) * np.log1p(error))
        reach = float(np.linalg.norm(np.array(link.first_moment))) / link.mass
        shift = error * reach * rng.uniform(-1, 1, 3)
        arm, found = with_stretched_link(arm, number, float(mass), shift, float(spread)), [*found, error]
    return arm, tuple(found)


def _simple_machine(rng: np.random.Generator, name: str) -> Machine:
    """A machine of one to three joints: drives alone, pendulums, and slides."""
    if name in ("turning drive", "pendulum"):
        gravity = [0.0, 0.0, -9.81] if name == "turning drive" else [9.81, 0.0, 0.0]
        reach = 0.3 if name == "pendulum" else float(rng.uniform(0.0, 0.3))
        joints, links = [_joint("revolute", 0.3)], [_link(rng, 2.5, (-(0.3 - reach), 0.0, 0.02))]
        rating, rotor, limits = [12.0], [0.05], (6.0, 40.0)
    elif name == "double pendulum":
        gravity = [9.81, 0.0, 0.0]
        joints = [_joint("revolute", 0.3), _joint("revolute", 0.25)]
        links = [_link(rng, 2.0, (-0.1, 0.0, 0.0)), _link(rng, 1.2, (-0.08, 0.0, 0.0))]
        rating, rotor, limits = [18.0, 6.0], [0.06, 0.03], (6.0, 40.0)
    else:  # slides: one axis, or two across each other
        number = 1 if name == "slide" else int(rng.integers(2, 4))
        gravity = [0.0, 0.0, -9.81] if rng.random() < 0.4 else [0.0, -9.81, 0.0]
        turns = [np.pi / 2, np.pi / 2, 0.0]
        joints = [_joint("prismatic", 0.0, turns[place]) for place in range(number)]
        links = [_link(rng, mass, (0.0, 0.03, 0.05)) for mass in (40.0, 20.0, 9.0)[:number]]
        rating, rotor, limits = [900.0, 500.0, 250.0][:number], [55.0, 30.0, 12.0][:number], (0.6, 6.0)
    data: dict[str, Any] = {
        "name": name,
        "dh_convention": "standard",
        "gravity": gravity,
        "joints": [{**joint, "name": f"joint{place}"} for place, joint in enumerate(joints, 1)],
        "links": links,
        "rotor_inertia": rotor,
    }
    ones = np.ones(len(joints))
    return Machine(name, validate(RobotFile, data, name), np.array(rating), limits[0] * ones, limits[1] * ones)


def _joint(kind: str, a: float, alpha: float = 0.0) -> dict[str, Any]:
    limits = [-3.0, 3.0] if kind == "revolute" else [-0.4, 0.4]
    return {"type": kind, "a": a, "d": 0.0, "alpha": alpha, "position_limits": limits}


def _link(rng: np.random.Generator, mass: float, centre: tuple[float, float, float]) -> dict[str, Any]:
    """A link about its frame: a body of the size of a hand around its centre."""
    mass *= float(rng.uniform(0.7, 1.3))
    place = np.array(centre)
    own = mass * float(rng.uniform(0.03, 0.07)) ** 2 * np.diag(rng.uniform(0.8, 1.2, 3))
    inertia: Array = own + mass * (place @ place * np.eye(3) - np.outer(place, place))
    rows, columns = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]
    return {
        "mass": mass,
        "first_moment": (mass * place).tolist(),
        "inertia": inertia[rows, columns].tolist(),
    }
