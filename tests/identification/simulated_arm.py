"""Simulated recordings of the three-joint arm with a model that is known."""

import numpy as np

from armlab.common.arrays import Array
from armlab.effects.contract import Candidate, Scene
from armlab.identification.components import usual_components
from armlab.identification.structure import Structure
from armlab.recordings.recording import Role, Run
from problem.arm import Arm
from problem.motion import Motion
from problem.robot_file import load_arm

RATE_HZ = 250.0


def arm() -> Arm:
    return load_arm("irb120-arm")


def structure(components: tuple[Candidate, ...] | None = None) -> Structure:
    return Structure(arm(), usual_components(arm()) if components is None else components).separable()[0]


def truth(model: Structure) -> Array:
    """Base parameters of the arm's links and plausible friction."""
    sizes = {"viscous_friction": 1.5, "coulomb_friction": 2.0, "rotor_inertia": 0.05, "torque_offset": 0.4}
    own = [np.full(part.size, sizes.get(part.effect, 0.3)) for part in model.components]
    return np.concatenate([model.base.values(model.arm.parameters), *own])


def motion(seed: int, seconds: float = 10.0, rate_hz: float = RATE_HZ) -> tuple[Array, Motion]:
    """Times and a motion of five harmonics, derivatives exact."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(seconds * rate_hz)) / rate_hz
    omega = 2 * np.pi * 0.1 * np.arange(1, 6)
    a, b = rng.normal(0, 0.35, (2, 5, 3))
    sine, cosine = np.sin(np.outer(time, omega)), np.cos(np.outer(time, omega))
    position = sine @ a + cosine @ b
    velocity = (cosine * omega) @ a - (sine * omega) @ b
    acceleration = -(sine * omega**2) @ a - (cosine * omega**2) @ b
    return time, Motion(position, velocity, acceleration)


def scene(time: Array, moved: Motion) -> Scene:
    """A run with these times and motion."""
    return Scene("run.csv", time, moved, arm(), np.zeros(30), np.zeros(moved.position.shape))


def run(
    model: Structure, values: Array, seed: int = 0, noise: float = 0.0, role: Role = "identify", seconds: float = 10.0
) -> Run:
    """A recorded run with white torque noise, N m."""
    time, moved = motion(seed, seconds)
    torque = (model.matrix(scene(time, moved)) @ values).reshape(-1, len(model.arm))
    torque = torque + noise * np.random.default_rng(seed + 1000).standard_normal(torque.shape)
    return Run(f"run-{seed}.csv", role, time, moved.position, torque)
