"""Replays one joint in all windows for many parameter sets at once: the output error that estimates parameters.

One step of Moreau's time stepping (Moreau 1988), in which friction is an impulse bounded by its level, as MuJoCo's
friction loss but without its slip at rest; damping is implicit, gravity and drive are explicit:

    u  = s clip(kp d(c - q) - kd v*, -limit, limit) - load - slope (q - q measured)
    v* = (m v + h u) / (m + h damping),  m = inertia + armature
    v  = sgn(v*) max(|v*| - h (friction + load_friction |load|) / (m + h damping), 0)
    q  = q + h v
"""

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.motion._joint_replay import ffi, lib
from armlab.diagnosis.motion.servo import PARAMETERS, place
from armlab.diagnosis.motion.windows import Windows

MAX_STEP_PHASE = 0.5  # of kp h^2 / m: above it the explicit drive would not be stable


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
    names = ("command", "inertia", "load", "slope", "measured", "first_velocity", "fraction")
    stretch = ffi.new("Stretch *")
    stretch.windows, stretch.steps = windows.measured.shape
    stretch.columns, stretch.history, stretch.step = windows.command.shape[1], windows.history, windows.step_s
    for name in names:
        setattr(stretch, name, ffi.from_buffer("double[]", getattr(windows, name)))
    stretch.supply = ffi.NULL if windows.supply is None else ffi.from_buffer("double[]", windows.supply)
    stretch.begin = ffi.from_buffer("int64_t[]", windows.begin)
    stretch.row = ffi.from_buffer("int64_t[]", windows.row)
    lib.replay_joint(stretch, len(servos), ffi.from_buffer("Servo[]", servos), ffi.from_buffer("double[]", out))
    return out


def joint_errors(windows: Windows, values: Array) -> Array:
    """Simulated minus measured position, (sets, samples), rad."""
    return replay_joint(windows, values) - windows.position
