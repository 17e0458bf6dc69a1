"""Small arms with servos, drawn at random, and their simulation file (MJCF with position actuators)."""

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from armlab.common.arrays import Array
from armlab.proof.blind.servo.servo_engine import STEP_S, Body, Servo, ServoArm, mass_and_bias

Law = Literal["pd", "pid", "cascade", "PI cascade"]


@dataclass(frozen=True)
class ArmSettings:
    """Ranges of arms and drives, in the range of hobby servos; chosen before any case was diagnosed.

    length_m, mass_kg: of links; the heaviest mass falls by `taper` a joint. rotor: inertia of a motor behind its gear,
    kg m2. armature: what comes on top, over the link's inertia.
    frequency_hz, ratio: of the drive with its load, undamped. sag_rad: by gravity at most. reserve: of the torque
    limit over gravity and `acceleration`, rad/s2. friction: over the limit. damping: share of the drive's damping.
    counts: of the encoder, a turn. rate_hz: of commands and samples. hold: commands of which a drive takes the first
    one and holds it, at 50 Hz or faster. read_gap_s: between the readings of two joints. jitter_s: of stamps.
    integral_hz: corner of the integral gain. wind_up: limit of the integral over that of the torque.
    """

    joints: tuple[int, int] = (2, 6)
    length_m: tuple[float, float] = (0.05, 0.30)
    mass_kg: tuple[float, float] = (0.05, 2.0)
    taper: float = 0.55
    rotor: tuple[float, float] = (0.0003, 0.003)
    armature: tuple[float, float] = (0.0, 1.0)
    frequency_hz: tuple[float, float] = (2.5, 7.0)
    ratio: tuple[float, float] = (0.4, 1.0)
    sag_rad: float = 0.15
    reserve: tuple[float, float] = (1.4, 3.0)
    acceleration: float = 40.0
    friction: tuple[float, float] = (0.02, 0.08)
    damping: tuple[float, float] = (0.1, 0.5)
    counts: tuple[int, ...] = (256, 1024, 4096, 4096, 16384)
    rate_hz: tuple[float, ...] = (50.0, 50.0, 100.0, 200.0, 500.0)
    hold: tuple[int, ...] = (1, 1, 2, 4, 10)
    least_hold_hz: float = 50.0
    read_gap_s: tuple[float, float] = (0.0, 0.0005)
    jitter_s: tuple[float, float] = (0.0, 0.0005)
    integral_hz: tuple[float, float] = (0.1, 0.5)
    wind_up: tuple[float, float] = (0.1, 0.4)


ARMS = ArmSettings()
AXES = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
AXIS_SHARES = ((0.5, 0.5, 0.0), (0.3, 0.5, 0.2))  # of the first joint, of the others


def draw_arm(rng: np.random.Generator, law: Law) -> tuple[ServoArm, Array]:
    """An arm and its home position (joints,), rad. A `cascade` is a PD; a `PI cascade` has an integral gain, too."""
    joints = int(rng.integers(ARMS.joints[0], ARMS.joints[1] + 1))
    bodies = draw_bodies(rng, joints)
    home = rng.uniform(-0.8, 0.8, joints)
    bare = ServoArm(bodies, ())
    poses = [home, *(home + rng.uniform(-1, 1, (30, joints)))]
    looks = [mass_and_bias(bare, pose, np.zeros(joints)) for pose in poses]
    inertia = np.max([np.diag(mass) for mass, _ in looks], axis=0)
    gravity = np.max([np.abs(bias) for _, bias in looks], axis=0)
    count = 2 * np.pi / int(rng.choice(ARMS.counts))
    servos = tuple(
        _draw_servo(rng, law, float(inertia[joint]), float(gravity[joint]), count) for joint in range(joints)
    )
    return ServoArm(bodies, servos), home


def draw_bodies(rng: np.random.Generator, joints: int) -> tuple[Body, ...]:
    """Links along x, each about another axis than the one before at random; the first one about z or y."""
    out, before = [], 0.0
    for joint in range(joints):
        length = float(rng.uniform(*ARMS.length_m))
        heaviest = max(ARMS.mass_kg[1] * ARMS.taper**joint, 2 * ARMS.mass_kg[0])
        mass = float(np.exp(rng.uniform(np.log(ARMS.mass_kg[0]), np.log(heaviest))))
        width = float(rng.uniform(0.1, 0.3)) * length
        x, y, z = (length * float(rng.uniform(low, high)) for low, high in ((0.3, 0.6), (-0.1, 0.1), (-0.1, 0.1)))
        own = mass / 12 * np.array([2 * width**2, length**2 + width**2, length**2 + width**2]) * rng.uniform(0.8, 1.2)
        axis = AXES[int(rng.choice(3, p=AXIS_SHARES[min(joint, 1)]))]
        inertia = (float(own[0]), float(own[1]), float(own[2]), 0.0, 0.0, 0.0)
        out.append(Body((before, 0.0, 0.0), axis, mass, (x, y, z), inertia))
        before = length
    return tuple(out)


def _draw_servo(rng: np.random.Generator, law: Law, inertia: float, gravity: float, count: float) -> Servo:
    rotor = float(np.exp(rng.uniform(*np.log(ARMS.rotor))))
    armature = rotor + float(rng.uniform(*ARMS.armature)) * inertia
    moved = inertia + armature
    kp = max(moved * (2 * np.pi * float(rng.uniform(*ARMS.frequency_hz))) ** 2, gravity / ARMS.sag_rad)
    both = 2 * float(rng.uniform(*ARMS.ratio)) * float(np.sqrt(kp * moved))
    damping = float(rng.uniform(*ARMS.damping)) * both
    kd = both - damping
    limit = float(rng.uniform(*ARMS.reserve)) * (gravity + moved * ARMS.acceleration)
    servo = Servo(kp, kd, limit, count=count, armature=armature, damping=damping)
    servo = replace(servo, friction=float(rng.uniform(*ARMS.friction)) * limit)
    corner = 2 * np.pi * float(rng.uniform(*ARMS.integral_hz))
    wind_up = float(rng.uniform(*ARMS.wind_up)) * limit
    if law == "pid":
        return replace(servo, ki=corner * kp, integral_limit=wind_up)
    if law == "pd":
        return servo
    ki = corner * kd if law == "PI cascade" else 0.0
    return replace(servo, cascaded=True, position_gain=(kp - ki) / kd, ki=ki, integral_limit=wind_up)


def write_mjcf(arm: ServoArm, actuators: bool) -> str:
    """The MJCF of an arm: links, damping, friction, rotors, and position actuators on request."""
    root = ElementTree.Element("mujoco", model="servo-arm")
    ElementTree.SubElement(root, "compiler", angle="radian")
    ElementTree.SubElement(root, "option", timestep=_text(4 * STEP_S), integrator="implicitfast")
    parent = ElementTree.SubElement(root, "worldbody")
    drives = ElementTree.Element("actuator")
    for number, (body, servo) in enumerate(zip(arm.bodies, arm.servos, strict=True), 1):
        name = f"joint{number}"
        parent = ElementTree.SubElement(parent, "body", name=f"link{number}", pos=_text(*body.shift))
        drive_train = {"damping": _text(servo.damping), "frictionloss": _text(servo.friction)}
        drive_train |= {"armature": _text(servo.armature), "range": _text(-np.pi, np.pi)}
        ElementTree.SubElement(parent, "joint", {"name": name, "axis": _text(*body.axis), **drive_train})
        inertia = {"pos": _text(*body.centre), "mass": _text(body.mass), "fullinertia": _text(*body.inertia)}
        ElementTree.SubElement(parent, "inertial", inertia)
        gains = {"kp": _text(servo.kp), "kv": _text(servo.kd), "forcerange": _text(-servo.limit, servo.limit)}
        ElementTree.SubElement(drives, "position", {"name": name, "joint": name, **gains})
    ElementTree.SubElement(parent, "site", name="tool", pos=_text(2 * arm.bodies[-1].centre[0], 0, 0))
    if actuators:
        root.append(drives)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _text(*values: float) -> str:
    return " ".join(f"{value:.9g}" for value in values)
