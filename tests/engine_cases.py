"""Small recordings of the three-joint arm for the engine: its own equations, and torques that are added to them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from armlab.common.arrays import Array
from armlab.recordings.recording import Recording, Role, Run, Transmission
from problem.arm import Arm
from problem.motion import Motion
from problem.regressor import rigid_body_torque
from problem.robot_file import load_arm

RATE_HZ = 200.0
NOISE = 0.05  # N m
Hidden = Callable[[Motion, Array], Array]


def nothing(motion: Motion, time: Array) -> Array:
    """No torque beside the arm's own."""
    return np.zeros(motion.position.shape)


def motion_at(time: Array, seed: int) -> Motion:
    """A smooth motion of three joints, with its exact derivatives."""
    rng = np.random.default_rng(seed)
    omega = 2 * np.pi * np.array([0.2, 0.4, 0.6, 1.0])
    sine, cosine = rng.uniform(-0.3, 0.3, (2, 4, 3))
    angle = np.outer(time, omega)
    position = np.sin(angle) @ sine + np.cos(angle) @ cosine
    velocity = np.cos(angle) * omega @ sine - np.sin(angle) * omega @ cosine
    acceleration = -np.sin(angle) * omega**2 @ sine - np.cos(angle) * omega**2 @ cosine
    return Motion(position, velocity, acceleration)


def run(hidden: Hidden, seed: int, role: Role, seconds: float, inertial: Array | None = None) -> Run:
    """One run with white noise."""
    time = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    motion = motion_at(time, seed)
    torque = rigid_body_torque(load_arm("irb120-arm"), motion, inertial) + hidden(motion, time)
    noise = NOISE * np.random.default_rng(seed + 100).standard_normal(torque.shape)
    return Run(f"run-{seed}.csv", role, time, motion.position, torque + noise)


def recording(hidden: Hidden = nothing, seconds: float = 6.0, inertial: Array | None = None) -> Recording:
    """Two runs that identify and one that validates; inertial: of the real arm, the nominal one if left out."""
    arm = load_arm("irb120-arm")
    roles: tuple[Role, ...] = ("identify", "identify", "validate")
    runs = tuple(run(hidden, seed, role, seconds, inertial) for seed, role in enumerate(roles))
    return of_runs(arm, runs)


def of_runs(arm: Arm, runs: tuple[Run, ...]) -> Recording:
    """A recording in memory."""
    unit = np.eye(len(arm))
    transmission = Transmission(unit, np.zeros(len(arm)), unit, np.ones(len(arm)))
    return Recording(Path("memory"), "irb120-arm", arm, runs, transmission)
