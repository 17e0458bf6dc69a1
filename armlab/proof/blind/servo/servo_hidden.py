"""What is hidden: how an arm differs from its simulation file, by a size, and what is true then."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from armlab.proof.blind.servo.servo_engine import STEP_S, Body, Servo, ServoArm

Parameters = dict[str, tuple[float, str]]


@dataclass(frozen=True)
class Kind:
    """One kind of difference. effect: its name. largest: of sizes. both_ways: whether the size has a sign.

    of_drive: whether a simulation without a controller lacks it anyway. equivalent: names that no motion tells from it.
    part: a name that is a part of its law, which is neither right nor wrong.
    """

    effect: str
    largest: float
    both_ways: bool = False
    of_drive: bool = False
    equivalent: tuple[str, ...] = ()
    part: str = ""


KINDS = {
    "gain": Kind("controller_gain_error", 0.6, both_ways=True, of_drive=True),
    "damping of the drive": Kind("controller_gain_error", 0.8, True, True, ("viscous_friction",)),
    "friction": Kind("coulomb_friction", 0.95, both_ways=True),
    "damping": Kind("viscous_friction", 0.95, True, False, ("controller_gain_error",)),
    "armature": Kind("rotor_inertia", 0.9, both_ways=True),
    "delay": Kind("command_delay", 0.04),
    "saturation": Kind("torque_saturation", 0.8, of_drive=True),
    "dead band": Kind("controller_dead_band", 0.1),
    "offset": Kind("command_offset", 0.15, both_ways=True, equivalent=("torque_offset",)),
    "payload": Kind("payload", 2.0, equivalent=("inertial_parameter_error",)),
    "load friction": Kind("load_dependent_friction", 0.4),
    "Stribeck friction": Kind("stribeck_friction", 1.0, part="coulomb_friction"),
}
FREE_IN_EVERY_FIT = {"gain": "kp", "friction": "friction", "damping": "damping"}  # fields of a Servo


@dataclass(frozen=True)
class Hidden:
    """One difference. joint: from 0; a payload hangs at the last one, and a delay is of all joints. size: its extent.

    falling: of a saturation, whether the limit falls with speed and supply. shape: Stribeck velocity, rad/s.
    """

    kind: str
    joint: int
    sign: float = 1.0
    size: float = 0.0
    falling: bool = False
    shape: float = 0.05

    @property
    def facts(self) -> Kind:
        """What is true of every difference of its kind."""
        return KINDS[self.kind]

    def place(self, arm: ServoArm) -> int | None:
        """Joint (link) from 1; None for all joints."""
        return None if self.kind == "delay" else arm.joints if self.kind == "payload" else self.joint + 1

    def apply(self, arm: ServoArm) -> ServoArm:
        """The arm with the difference."""
        if self.kind == "payload":
            return replace(arm, bodies=(*arm.bodies[:-1], _loaded(arm.bodies[-1], self.size)))
        change = CHANGES[self.kind]
        servos = (
            change(servo, self) if self.kind == "delay" or joint == self.joint else servo
            for joint, servo in enumerate(arm.servos)
        )
        return replace(arm, servos=tuple(servos), sag=0.3 * self.size if self.falling else arm.sag)

    def parameters(self, arm: ServoArm) -> Parameters:
        """The numbers that are true on an arm that has the difference, with units."""
        if self.kind == "payload":
            return {"mass": (arm.bodies[-1].mass * self.size / (1 + self.size), "kg")}
        true = servo_parameters(arm.servos[self.joint])[self.facts.effect]
        return {} if self.falling else true


def servo_parameters(servo: Servo) -> dict[str, Parameters]:
    """True numbers of a drive by effect: absolute values."""
    return {
        "controller_gain_error": {"kp": (servo.kp, "N m/rad"), "kd": (servo.kd, "N m s/rad")},
        "coulomb_friction": {"level": (servo.friction, "N m")},
        "viscous_friction": {"coefficient": (servo.damping, "N m s/rad")},
        "rotor_inertia": {"inertia": (servo.armature, "kg m2")},
        "command_delay": {"seconds": (servo.delay, "s")},
        "torque_saturation": {"limit": (servo.limit, "N m")},
        "controller_dead_band": {"width": (servo.dead_band, "rad")},
        "command_offset": {"offset": (servo.offset, "rad")},
        "load_dependent_friction": {"coefficient": (servo.load_friction, "")},
        "stribeck_friction": {
            "level": (servo.friction, "N m"),
            "static_level": (servo.friction + servo.static_extra, "N m"),
        },
    }


def _change_gain(servo: Servo, hidden: Hidden) -> Servo:
    return _with_gains(servo, servo.kp * (1 + hidden.sign * hidden.size), servo.kd)


def _change_drive_damping(servo: Servo, hidden: Hidden) -> Servo:
    return _with_gains(servo, servo.kp, servo.kd * (1 + hidden.sign * hidden.size))


def _with_gains(servo: Servo, kp: float, kd: float) -> Servo:
    position_gain = (kp - servo.ki) / kd if servo.cascaded else 0.0
    return replace(servo, kp=kp, kd=kd, position_gain=position_gain)


def _scaled(field: str) -> Callable[[Servo, Hidden], Servo]:
    return lambda servo, hidden: replace(servo, **{field: getattr(servo, field) * (1 + hidden.sign * hidden.size)})


def _added(field: str) -> Callable[[Servo, Hidden], Servo]:
    return lambda servo, hidden: replace(servo, **{field: getattr(servo, field) + hidden.sign * hidden.size})


def _change_delay(servo: Servo, hidden: Hidden) -> Servo:
    """A later command, by whole steps of the engine, at which it takes commands over."""
    return replace(servo, delay=servo.delay + STEP_S * round(hidden.size / STEP_S))


def _change_limit(servo: Servo, hidden: Hidden) -> Servo:
    """A lower limit; or one that falls with speed, by the size over 5 rad/s, and with the supply."""
    if hidden.falling:
        return replace(servo, limit_slope=hidden.size * servo.limit / 5.0)
    return replace(servo, limit=servo.limit * (1 - hidden.size))


def _change_static_friction(servo: Servo, hidden: Hidden) -> Servo:
    return replace(servo, static_extra=hidden.size * servo.friction, stribeck_velocity=hidden.shape)


CHANGES: dict[str, Callable[[Servo, Hidden], Servo]] = {
    "gain": _change_gain,
    "damping of the drive": _change_drive_damping,
    "friction": _scaled("friction"),
    "damping": _scaled("damping"),
    "armature": _scaled("armature"),
    "delay": _change_delay,
    "saturation": _change_limit,
    "dead band": _added("dead_band"),
    "offset": _added("offset"),
    "load friction": _added("load_friction"),
    "Stribeck friction": _change_static_friction,
}


def _loaded(body: Body, share: float) -> Body:
    """The last link with a point mass at its end; share: of the link's mass."""
    mass = share * body.mass
    whole = body.mass + mass
    end = np.array([2 * body.centre[0], 0.0, 0.0])
    centre = (body.mass * np.array(body.centre) + mass * end) / whole
    inertia = np.array(body.inertia)
    for m, place in ((body.mass, np.array(body.centre)), (mass, end)):
        x, y, z = place - centre
        inertia = inertia + m * np.array([y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z])
    return replace(body, mass=whole, centre=tuple(centre.tolist()), inertia=tuple(inertia.tolist()))
