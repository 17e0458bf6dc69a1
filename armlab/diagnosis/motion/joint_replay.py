"""Replays one joint in all windows for many parameter sets at once: the output error that estimates parameters.

One step of Moreau's midpoint rule (Moreau 1988), in which friction is an impulse bounded by its level, as MuJoCo's
friction loss but without its slip at rest; it is of second order between events. q_m is the position at half the step:

    q_m = q + h v / 2
    i   = clip(i + h ki d(c - q_m), -integral_limit, integral_limit)
    u   = s clip(kp d(c - q_m) - kd (v + v*) / 2 + i, -limit, limit) - load - slope (q_m - q_m measured)
    v*  = v + h (u - damping (v + v*) / 2) / m,  m = inertia + armature
    v'  = sgn(v*) max(|v*| - h (friction + load_friction |load|) / (m + h (damping + s kd) / 2), 0)
    q'  = q_m + h v' / 2

Where the command changes within a step, the torque is the mean of the clipped torques before and after the change. The
commands there are the means of the steps around it, and the share of each follows from the mean of the step.

The integral at the first step of a window is that of its run there, along the measured motion.
"""

from dataclasses import replace

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.motion._joint_replay import ffi, lib
from armlab.diagnosis.motion.servo import PARAMETERS, place
from armlab.diagnosis.motion.windows import Windows

FARTHEST = 1e6  # rad (m): a replay that goes farther has no bounds
MAX_STEP_PHASE = 0.5  # of kp h^2 / m: above it the explicit drive would not be stable, whatever the payload


def replay_joint(windows: Windows, values: Array) -> Array:
    """Simulated position at the measured samples, (sets, samples), rad.

    values: (sets, parameters) in the order of PARAMETERS, or (parameters,) for one set. A drive too stiff for the step
    counts as the stiffest that is not.
    """
    servos = np.array(values, dtype=np.float64, ndmin=2)
    if servos.shape[1] != len(PARAMETERS):
        raise ValueError(f"a servo has {len(PARAMETERS)} parameters, not {servos.shape[1]}")
    stiffest = MAX_STEP_PHASE * (windows.inertia.min() + servos[:, place("armature")]) / windows.step_s**2
    servos[:, place("kp")] = np.minimum(servos[:, place("kp")], stiffest)
    out = np.empty((len(servos), len(windows.position)))
    names: tuple[str, ...] = (
        "command",
        "inertia",
        "load",
        "slope",
        "measured",
        "first_velocity",
        "fraction",
        "integral",
    )
    names = (*names, "unit_inertia", "unit_load", "unit_slope", "path_command", "path_measured")
    stretch = ffi.new("Stretch *")
    stretch.windows, stretch.steps = windows.measured.shape
    stretch.columns, stretch.history, stretch.step = windows.command.shape[1], windows.history, windows.step_s
    stretch.path_columns = windows.path_command.shape[1]
    for name in names:
        setattr(stretch, name, ffi.from_buffer("double[]", getattr(windows, name)))
    stretch.supply = ffi.NULL if windows.supply is None else ffi.from_buffer("double[]", windows.supply)
    for name in ("begin", "row", "run", "start"):
        setattr(stretch, name, ffi.from_buffer("int64_t[]", getattr(windows, name)))
    integrals = ffi.new("double[]", len(servos) * windows.count)
    path = ffi.from_buffer("double[]", np.empty((windows.measured.shape[1] + 1, lib.LANES)))
    places = (ffi.from_buffer("Servo[]", servos), integrals, path, ffi.from_buffer("double[]", out))
    lib.replay_joint(stretch, len(servos), *places)
    return out


def replay_paths(windows: Windows, values: Array) -> tuple[Array, Array]:
    """Simulated position and velocity at the beginning of each step, (windows, steps) each, rad and rad/s.

    values: (parameters,). A window that ends before the last step repeats its commands and loads.
    """
    count, steps = windows.measured.shape
    everywhere = replace(
        windows,
        begin=np.arange(count + 1, dtype=np.int64) * steps,
        row=np.tile(np.arange(steps, dtype=np.int64), count),
        fraction=np.zeros(count * steps),
        position=np.zeros(count * steps),
    )
    position = replay_joint(everywhere, values).reshape(count, steps)
    turns = (-1.0) ** np.arange(steps)  # v' = 2 (q' - q) / h - v
    sums = np.cumsum(2 / windows.step_s * np.diff(position, axis=1) * turns[1:], axis=1)
    velocity = turns * (windows.first_velocity[:, None] + np.pad(sums, ((0, 0), (1, 0))))
    return position, velocity


def joint_errors(windows: Windows, values: Array) -> Array:
    """Simulated minus measured position, (sets, samples), rad; FARTHEST where a replay runs away."""
    errors = replay_joint(windows, values) - windows.position
    return np.where(np.abs(errors) < FARTHEST, errors, FARTHEST)
