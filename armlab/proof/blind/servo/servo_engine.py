"""The engine: rigid links on joints that stick, each driven by a servo; servo_arm.c states the step."""

from dataclasses import dataclass

import numpy as np

from armlab.common.arrays import Array
from armlab.proof.blind.servo._servo_arm import ffi, lib

STEP_S = 0.00025
GRAVITY = (0.0, 0.0, -9.81)  # m/s2


@dataclass(frozen=True)
class Body:
    """A link with the hinge before it, in its own frame, which is turned as the one before at angle zero.

    shift: of the hinge, m, in the frame before. axis: of unit length. mass: kg. centre: m. inertia: about the centre,
    kg m2, xx, yy, zz, xy, xz, yz.
    """

    shift: tuple[float, float, float]
    axis: tuple[float, float, float]
    mass: float
    centre: tuple[float, float, float]
    inertia: tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class Servo:
    """The drive and the friction of a joint.

    PID: tau = kp e - kd qd + i, di/dt = ki e. Cascade: tau = kd s + i, s = position_gain e - qd, di/dt = ki s, and its
    kp is the stiffness kd position_gain + ki.
    |i| <= integral_limit, |tau| <= limit - limit_slope |qd| where the drive does work, and limit where it brakes. e is
    the delayed command plus the offset, less the position as the encoder reads it, without half the dead band.

    kp: N m/rad. kd: N m s/rad. ki: N m/(rad s), of a cascade N m/rad. position_gain: 1/s. limit: N m. limit_slope:
    N m s/rad. delay: s. dead_band, offset, count: rad; a count of 0 is an encoder without steps. armature: kg m2.
    damping: N m s/rad. friction, static_extra: N m. stribeck_velocity: rad/s. load_friction: N m per N m in the gear.
    """

    kp: float
    kd: float
    limit: float
    ki: float = 0.0
    integral_limit: float = 0.0
    cascaded: bool = False
    position_gain: float = 0.0
    limit_slope: float = 0.0
    delay: float = 0.0
    dead_band: float = 0.0
    offset: float = 0.0
    count: float = 0.0
    armature: float = 0.0
    damping: float = 0.0
    friction: float = 0.0
    static_extra: float = 0.0
    stribeck_velocity: float = 0.0
    load_friction: float = 0.0


@dataclass(frozen=True)
class ServoArm:
    """An arm with servos. hold_s: how long a drive holds a command. sag: fall of the supply when all drives push fully.

    A drive takes a command over at phase_s and multiples of hold_s after it. The limits of all drives follow the
    supply.
    """

    bodies: tuple[Body, ...]
    servos: tuple[Servo, ...]
    hold_s: float = STEP_S
    phase_s: float = 0.0
    sag: float = 0.0

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.bodies)


def simulate(arm: ServoArm, command: Array, period: float, first: Array) -> Array:
    """Positions (steps + 1, joints), rad, every STEP_S, of an arm that starts at rest at `first`, (joints,).

    command: (samples, joints), rad, each held for `period`, s.
    """
    count, joints = command.shape
    steps = round(count * period / STEP_S)
    command, first = (np.ascontiguousarray(each, dtype=float) for each in (command, first))
    out = np.empty((steps + 1, joints))
    settings = ffi.new("ArmData *", [list(GRAVITY), STEP_S, arm.hold_s, arm.phase_s, period, arm.sag])
    pointers = (ffi.from_buffer("double *", each) for each in (command, first, out))
    given = (joints, _bodies(arm), _servos(arm), settings, steps, count)
    if lib.simulate(*given, *pointers) != 0:
        raise ArithmeticError("a step of the arm has no solution: its mass matrix is not positive definite")
    return out


@dataclass(frozen=True, eq=False)
class Followed:
    """How an arm moved: position and velocity (steps + 1, joints), rad and rad/s; torque of the drives at half of each
    step, (steps, joints), N m."""

    position: Array
    velocity: Array
    torque: Array


def follow(
    arm: ServoArm, gravity: tuple[float, float, float], step_s: float, given: Array, first: tuple[Array, Array]
) -> Followed:
    """The motion of an arm whose drives add given torques (steps, joints), N m, to those of their kp and kd.

    first: position and velocity (joints,). Raises ArithmeticError where a step has no solution.
    """
    steps, joints = given.shape
    position, velocity, torque = np.empty((steps + 1, joints)), np.empty((steps + 1, joints)), np.empty((steps, joints))
    asked = (np.ascontiguousarray(each, dtype=float) for each in (given, *first))
    pointers = [ffi.from_buffer("double *", each) for each in (*asked, position, velocity, torque)]
    if lib.follow(joints, _bodies(arm), _servos(arm), list(gravity), step_s, steps, *pointers) != 0:
        raise ArithmeticError("a step of the arm has no solution: its mass matrix is not positive definite")
    return Followed(position, velocity, torque)


def mass_and_bias(arm: ServoArm, position: Array, velocity: Array) -> tuple[Array, Array]:
    """Mass matrix (joints, joints) without rotors, kg m2, and torques (joints,) of gravity and velocity, N m."""
    given = (np.ascontiguousarray(each, dtype=float) for each in (GRAVITY, position, velocity))
    mass, bias = np.empty((arm.joints, arm.joints)), np.empty(arm.joints)
    pointers = (ffi.from_buffer("double *", each) for each in (*given, mass, bias))
    lib.mass_and_bias(arm.joints, _bodies(arm), *pointers)
    return mass, bias


def _bodies(arm: ServoArm) -> object:
    fields = (
        [list(each.shift), list(each.axis), each.mass, list(each.centre), list(each.inertia)] for each in arm.bodies
    )
    return ffi.new("BodyData[]", list(fields))


def _servos(arm: ServoArm) -> object:
    names = [name for name, _ in ffi.typeof("ServoData").fields]
    return ffi.new("ServoData[]", [{name: getattr(servo, name) for name in names} for servo in arm.servos])
