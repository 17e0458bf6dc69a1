"""Replays one joint in all windows for many parameter sets at once: the output error that estimates parameters.

One step of Moreau's midpoint rule (Moreau 1988), in which friction is an impulse bounded by its level, as MuJoCo's
friction loss but without its slip at rest; it is of second order between events. q_m is the position at half the step:

    q_m = q + h v / 2
    i_m = clip(i + h (ki d(c - q_m) - ki_speed v) / 2, -integral_limit, integral_limit)
    u   = s clip((kp - ki_speed) d(c - q_m) - kd (v + v*) / 2 + i_m, -most, most) - load - slope (q_m - q_m measured)
    most = limit - limit_slope |v_m| where the drive does work, limit where it brakes
    v*  = v + h (u - damping (v + v*) / 2) / m,  m = inertia + armature
    F   = friction + static_excess exp(-(v / stribeck_speed)^2) + load_friction |load + a|
    v'  = sgn(v*) max(|v*| - h F / (m + h (damping + s kd) / 2), 0)
    q'  = q_m + h v' / 2
    i'  = clip(i + h (ki d(c - q_m) - ki_speed (v + v') / 2), -integral_limit, integral_limit)

a is the torque that accelerated the link in the step before, inertia (v' - v) / h. v_m is the velocity in the middle of
the step, if the acceleration stays as in the step before.

Where the command changes within a step, the torque is the mean of the clipped torques before and after the change. The
commands there are the means of the steps around it, and the share of each follows from the mean of the step.

Where the drive reads its encoder in steps, q_m in its error is the nearest one.

The integral at the first step of a window is that of its run there, along the measured motion.

Joints that push each other are replayed together: within each step, one after the other with the accelerations of the
others in its load, until no velocity changes any more (Gauss-Seidel; it converges because a mass matrix is positive
definite).
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.diagnosis.motion._joint_replay import ffi, lib
from armlab.diagnosis.motion.servo import PARAMETERS, place
from armlab.diagnosis.motion.windows import Windows

FARTHEST = 1e6  # rad (m): a replay that goes farther has no bounds
MAX_STEP_PHASE = 0.5  # of kp h^2 / m: above it the explicit drive would not be stable, whatever the payload
SIGNALS = (
    "command",
    "inertia",
    "load",
    "slope",
    "measured",
    "first_velocity",
    "fraction",
    "integral",
    "unit_inertia",
    "unit_load",
    "unit_slope",
    "path_command",
    "path_measured",
)


def replay_joint(windows: Windows, values: Array, reads_steps: bool = False) -> Array:
    """Simulated position at the measured samples, (sets, samples), rad.

    values: (sets, parameters) in the order of PARAMETERS, or (parameters,) for one set. A drive too stiff for the step
    counts as the stiffest that is not. reads_steps: whether the drive acts on the steps of its encoder.
    """
    servos = _stable_servos(windows, np.array(values, dtype=np.float64, ndmin=2))
    out = np.empty((len(servos), len(windows.position)))
    stretch = ffi.new("Stretch *")
    _point_to(stretch, windows)
    if reads_steps:
        stretch.encoder_step, stretch.encoder_phase = windows.encoder_step, windows.encoder_phase
    integrals = ffi.new("double[]", len(servos) * windows.count)
    path = ffi.from_buffer("double[]", np.empty((windows.measured.shape[1] + 1, lib.LANES)))
    places = (ffi.from_buffer("Servo[]", servos), integrals, path, ffi.from_buffer("double[]", out))
    lib.replay_joint(stretch, len(servos), *places)
    return out


def replay_arm(
    windows: Sequence[Windows], values: Array, mass: Array, every: int, moves: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """Position and velocity of joints that push each other, (joints, windows, steps) each, at the start of each step.

    windows: of each joint, with loads that leave out the accelerations of the joints that are replayed. values:
    (joints, parameters). mass: (windows, rows, joints, joints), kg m2, at every `every`-th step, up to a row after the
    last one. moves: (windows, joints), which joints are replayed. One that runs away is FARTHEST off.
    """
    servos = np.concatenate([_stable_servos(own, row[None]) for own, row in zip(windows, values, strict=True)])
    count, steps = windows[0].measured.shape
    position, velocity = (np.empty((len(windows), count, steps)) for _ in range(2))
    stretches = ffi.new("Stretch[]", len(windows))
    for number, own in enumerate(windows):
        _point_to(stretches[number], own)
    table, kept = ffi.new("MassTable *"), (np.ascontiguousarray(mass), np.ascontiguousarray(moves, dtype=np.float64))
    table.rows, table.every = mass.shape[1], every
    table.mass, table.moves = (ffi.from_buffer("double[]", each) for each in kept)
    integrals = ffi.new("double[]", len(windows) * count)
    places = (ffi.from_buffer("double[]", position), ffi.from_buffer("double[]", velocity))
    lib.replay_arm(len(windows), stretches, ffi.from_buffer("Servo[]", servos), table, integrals, *places)
    return position, velocity


def _stable_servos(windows: Windows, servos: Array) -> Array:
    """The sets, (sets, parameters), with no drive too stiff for the step."""
    if servos.shape[1] != len(PARAMETERS):
        raise ValueError(f"a servo has {len(PARAMETERS)} parameters, not {servos.shape[1]}")
    servos = servos.copy()
    stiffest = MAX_STEP_PHASE * (windows.inertia.min() + servos[:, place("armature")]) / windows.step_s**2
    servos[:, place("kp")] = np.minimum(servos[:, place("kp")], stiffest)
    return servos


def _point_to(stretch: Any, windows: Windows) -> None:
    """Lets a Stretch of C point to the arrays of windows, which have to live as long as it is used."""
    stretch.windows, stretch.steps = windows.measured.shape
    stretch.columns, stretch.history, stretch.step = windows.command.shape[1], windows.history, windows.step_s
    stretch.path_columns = windows.path_command.shape[1]
    for name in SIGNALS:
        setattr(stretch, name, ffi.from_buffer("double[]", getattr(windows, name)))
    stretch.supply = ffi.NULL if windows.supply is None else ffi.from_buffer("double[]", windows.supply)
    for name in ("begin", "row", "run", "start"):
        setattr(stretch, name, ffi.from_buffer("int64_t[]", getattr(windows, name)))


def joint_errors(windows: Windows, values: Array) -> Array:
    """Simulated minus measured position, (sets, samples), rad; FARTHEST where a replay runs away."""
    errors = replay_joint(windows, values) - windows.position
    return np.where(np.abs(errors) < FARTHEST, errors, FARTHEST)
