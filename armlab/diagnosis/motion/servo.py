"""The law of a position servo at one joint, its parameters, and the effects that name them.

    torque  = s clip((kp - ki_speed) e - kd qd + i, -most, most)
    most    = limit - limit_slope |qd| where the drive does work, limit where it brakes
    e       = d(c(t - delay) + offset - q),  d(x) = sgn(x) max(|x| - dead_band / 2, 0)
    i'      = ki e - ki_speed qd,  |i| <= integral_limit
    torque  = (inertia + armature) qdd + load + damping qd + level f
    level   = friction + static_excess exp(-(qd / stribeck_speed)^2) + load_friction |inertia qdd + load|

A PID has no ki_speed. A cascade of position and velocity, kd (p e - qd) + j integral of (p e - qd), has ki = p j and
ki_speed = j, and kp = p kd + j.

Inertia and load also hold a mass at the tool, `payload`, which is the same at all joints. f is the sign of the
velocity, and anything between -1 and 1 at rest. c is the command, held between its samples. load is the torque of
gravity and of the other joints. s is 1, or the supply voltage over its nominal value, and less as the motor warms
(`windows.supply_factor`). Where nothing saturates, kd and
damping are one column; damping also holds back-EMF, with which the torque limit of a drive that is limited by its
voltage falls with speed. So damping is fitted as a rule, with the kd of the simulation or none. kd is fitted in its
place where a torque limit may act on it: of a drive of which nothing is stated, or where it explains more than damping.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from armlab.common.arrays import Array


@dataclass(frozen=True)
class ServoParameter:
    """One parameter of the law. effect, name: in a verdict. neutral: the value without effect.

    lowest, highest: bounds of a fit; scale: a step that matters on a small arm. role: a `usual` one is part of every
    fit, an `optional` one has to earn its place, an `unstated` one is part of a law that is tried where the simulation
    says nothing of the drive, a `shared` one is that of all joints, a `given` one is part of another: kd is fitted in
    place of damping, and the Stribeck speed is one of a few.
    equation: for the verdict, with {value} and {joint}. rivals: effects that fit these data as well, or nearly. mjcf:
    the field of MJCF that holds it.
    """

    key: str
    effect: str
    name: str
    unit: str
    neutral: float
    lowest: float
    highest: float
    scale: float
    role: Literal["usual", "optional", "unstated", "shared", "given"]
    equation: str
    rivals: tuple[str, ...] = ()
    mjcf: str = ""
    experiment: str = ""


INFINITE_LIMIT = 1e3  # N m: no servo of this law has more
PARAMETERS: tuple[ServoParameter, ...] = (
    ServoParameter(
        "kp",
        "controller_gain_error",
        "kp",
        "N.m/rad",
        np.nan,
        1e-3,
        1e5,
        1.0,
        "usual",
        "tau_{joint} = {value} (command_{joint} - q_{joint})",
        (),
        "kp",
        "record the same motion with a load of known mass, or with another gain",
    ),
    ServoParameter(
        "damping",
        "viscous_friction",
        "coefficient",
        "N.m.s/rad",
        0.0,
        0.0,
        1e3,
        0.1,
        "usual",
        "tau_{joint} += {value} qd_{joint}",
        ("controller_gain_error",),
        "damping (kv and damping are one column)",
        "record the motion with another gain kd, or with a reference velocity",
    ),
    ServoParameter(
        "friction",
        "coulomb_friction",
        "level",
        "N.m",
        0.0,
        0.0,
        1e3,
        0.02,
        "usual",
        "tau_{joint} += {value} sgn(qd_{joint})",
        (),
        "frictionloss",
    ),
    ServoParameter(
        "kd",
        "controller_gain_error",
        "kd",
        "N.m.s/rad",
        0.0,
        0.0,
        1e3,
        0.1,
        "given",
        "tau_{joint} = kp (command_{joint} - q_{joint}) - {value} qd_{joint}",
        ("viscous_friction",),
        "kv",
        "record the motion with another gain kd, or with a reference velocity",
    ),
    ServoParameter(
        "armature",
        "rotor_inertia",
        "inertia",
        "kg.m2",
        0.0,
        0.0,
        1e2,
        0.01,
        "optional",
        "tau_{joint} += {value} qdd_{joint}",
        ("inertial_parameter_error",),
        "armature",
        "compare with the motor's data sheet, or record faster motion",
    ),
    ServoParameter(
        "limit",
        "torque_saturation",
        "limit",
        "N.m",
        INFINITE_LIMIT,
        1e-2,
        INFINITE_LIMIT,
        0.5,
        "optional",
        "|tau_{joint}| <= {value}",
        (),
        "forcerange",
    ),
    ServoParameter(
        "limit_slope",
        "torque_saturation",
        "limit_slope",
        "N.m.s/rad",
        0.0,
        0.0,
        1e3,
        0.1,
        "optional",
        "|tau_{joint}| <= limit - {value} |qd_{joint}| where the drive does work",
        (),
        "",
        "record fast motion and slow motion with the same load",
    ),
    ServoParameter(
        "delay",
        "command_delay",
        "seconds",
        "s",
        0.0,
        -0.05,
        0.3,
        0.005,
        "optional",
        "command_{joint}(t - {value})",
        ("channel_skew",),
        "",
        "log the time at which each joint is read; record steps and fast motion",
    ),
    ServoParameter(
        "offset",
        "command_offset",
        "offset",
        "rad",
        0.0,
        -1.0,
        1.0,
        0.005,
        "optional",
        "command_{joint} + {value}",
        ("torque_offset", "encoder_offset"),
        "",
        "hold a variety of poses, each reached from both directions",
    ),
    ServoParameter(
        "dead_band",
        "controller_dead_band",
        "width",
        "rad",
        0.0,
        0.0,
        0.5,
        0.005,
        "optional",
        "tau_{joint} = 0 where |command_{joint} - q_{joint}| < {value} / 2",
        ("coulomb_friction", "backlash"),
        "",
        "record slow ramps in both directions with two gains",
    ),
    ServoParameter(
        "load_friction",
        "load_dependent_friction",
        "coefficient",
        "1",
        0.0,
        0.0,
        1.0,
        0.05,
        "optional",
        "tau_{joint} += {value} |tau_rigid_{joint}| sgn(qd_{joint})",
        (),
        "",
        "repeat one motion with two payloads",
    ),
    ServoParameter(
        "static_excess",
        "stribeck_friction",
        "static_excess",
        "N.m",
        0.0,
        0.0,
        1e3,
        0.02,
        "optional",
        "tau_{joint} += {value} exp(-(qd_{joint} / v)^2) sgn(qd_{joint})",
        (),
        "",
        "record slow creeping in both directions",
    ),
    ServoParameter(
        "stribeck_speed",
        "stribeck_friction",
        "velocity",
        "rad/s",
        0.1,
        1e-3,
        1e2,
        0.05,
        "given",
        "v = {value}",
    ),
    ServoParameter(
        "ki",
        "controller_gain_error",
        "ki",
        "N.m/(rad.s)",
        0.0,
        0.0,
        1e6,
        1.0,
        "unstated",
        "tau_{joint} += {value} integral of (command_{joint} - q_{joint})",
    ),
    ServoParameter(
        "ki_speed",
        "controller_gain_error",
        "ki_speed",
        "N.m/rad",
        0.0,
        0.0,
        1e5,
        1.0,
        "unstated",
        "tau_{joint} -= {value} (command_{joint} - q_{joint} + integral of qd_{joint})",
    ),
    ServoParameter(
        "integral_limit",
        "torque_saturation",
        "integral_limit",
        "N.m",
        INFINITE_LIMIT,
        0.0,
        INFINITE_LIMIT,
        0.5,
        "unstated",
        "|integral part of tau_{joint}| <= {value}",
    ),
    ServoParameter(
        "payload",
        "payload",
        "mass",
        "kg",
        0.0,
        -1e2,
        1e2,
        0.02,
        "shared",
        "{value} kg at the tool",
        ("inertial_parameter_error",),
        "mass, pos and fullinertia of the last body",
        "weigh the tool and what it holds",
    ),
)
KEYS = tuple(parameter.key for parameter in PARAMETERS)
USUAL = tuple(parameter.role == "usual" for parameter in PARAMETERS)
SHARED = tuple(parameter.role == "shared" for parameter in PARAMETERS)
OPTIONAL = tuple(parameter.role == "optional" for parameter in PARAMETERS)
UNSTATED = tuple(parameter.role == "unstated" for parameter in PARAMETERS)
Key = Literal[
    "kp",
    "damping",
    "friction",
    "kd",
    "armature",
    "limit",
    "limit_slope",
    "delay",
    "offset",
    "dead_band",
    "load_friction",
    "static_excess",
    "stribeck_speed",
    "ki",
    "ki_speed",
    "integral_limit",
    "payload",
]
LIMITS = (KEYS.index("limit"), KEYS.index("limit_slope"))  # of the torque
NEUTRAL = np.array([parameter.neutral for parameter in PARAMETERS])
LOWEST = np.array([parameter.lowest for parameter in PARAMETERS])
HIGHEST = np.array([parameter.highest for parameter in PARAMETERS])
SCALE = np.array([parameter.scale for parameter in PARAMETERS])


def place(key: Key) -> int:
    """Place of a parameter in an array of them."""
    return KEYS.index(key)


@dataclass(frozen=True, eq=False)
class Servos:
    """Parameters of the servos of an arm: values (joints, parameters) in the order of PARAMETERS, SI units.

    NaN where the simulation does not know a value.
    """

    values: Array

    def get(self, key: Key) -> Array:
        """One parameter of all joints, (joints,)."""
        return np.asarray(self.values[:, place(key)])

    def of_joint(self, row: int) -> dict[str, float | None]:
        """All parameters of one joint by their keys; a limit of None is no limit."""
        numbers: dict[str, float | None] = dict(zip(KEYS, self.values[row].tolist(), strict=True))
        limits: tuple[Key, ...] = ("limit", "integral_limit")
        return numbers | {key: None for key in limits if self.values[row, place(key)] >= INFINITE_LIMIT}
