"""The motion of a link behind a drive train that gives, its motor as recorded: integrated in time.

The link's angle is theta + twist, theta the motor's. The links ask for the rigid torque at theta and, to first order,
for their own inertia times the acceleration of the twist; the drive train gives the force of its spring or of its
walls: inertia twist'' = -load - force(twist, twist'). So a resonance rings and a gap is crossed as the load and the
inertia say, not as a formula without a memory would have it.
"""

from dataclasses import dataclass

import numpy as np

from diagnosis.effects._drive_train import ffi, lib
from diagnosis.effects.contract import Scene
from problem.native import pointer
from recordings.run import Array

FINE = 0.1  # rad of the fastest oscillation a step
WALL_HZ = 80.0  # of the walls of a play, damped so that nothing bounces: stiff gears
FASTEST_HZ = 400.0  # of a resonance: stiffer springs follow their load at once, whatever the model's inertia is
LIGHTEST = 0.01  # of the greatest inertia that the joint feels in the run: a model may be wrong enough to have less


@dataclass(frozen=True)
class Twist:
    """Stiffness in N m/rad, damping_time in s (damping over stiffness); or a gap in rad."""

    stiffness: float = 0.0
    damping_time: float = 0.0
    gap: float = 0.0


def own_inertia(scene: Scene, joint: int) -> Array:
    """Inertia that a joint (from 0) feels of the links, its rotor left out, (samples,), kg m2 (kg): above zero."""
    inertia = scene.own_inertia[:, joint]
    return np.maximum(inertia, max(LIGHTEST * float(np.abs(inertia).max()), 1e-9))


def twisted(scene: Scene, joint: int, law: Twist) -> Array:
    """Twist of a joint (from 0), its speed and its acceleration, (3, samples); at rest with its load at the start."""
    slow = 0.0 if law.gap > 0 else law.stiffness / (2 * np.pi * FASTEST_HZ) ** 2
    inertia = np.maximum(own_inertia(scene, joint), slow)
    load = np.ascontiguousarray(scene.rigid_torque[:, joint])
    wall = 2 * np.pi * WALL_HZ
    stiffness, damping = (wall**2, 2 * wall) if law.gap > 0 else (law.stiffness, law.damping_time * law.stiffness)
    train = ffi.new("DriveTrain *", [stiffness, damping, law.gap])
    out = np.empty((3, len(load)))
    lib.twist_of_drive_train(
        train, len(load), scene.step, _half_steps(scene, law, inertia), pointer(load),
        pointer(np.ascontiguousarray(inertia)), pointer(out),
    )  # fmt: skip
    return out


def _half_steps(scene: Scene, law: Twist, inertia: Array) -> int:
    """Half the steps from sample to sample that follow the fastest oscillation."""
    if law.gap > 0:
        return int(np.ceil(scene.step * 2 * np.pi * WALL_HZ / FINE / 2))
    pitch = float(np.sqrt(law.stiffness / inertia.min()))
    return int(np.ceil(scene.step * max(pitch, law.damping_time * pitch**2) / FINE / 2))
