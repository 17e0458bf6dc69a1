"""Scenes for tests of effects: smooth motions of random arms, derivatives exact."""

from dataclasses import replace

import numpy as np
from random_arms import random_arm

from armlab.common.arrays import Array
from armlab.effects.contract import Candidate, Family, Scene
from armlab.effects.library import BUILT_IN
from problem.arm import Arm
from problem.motion import Motion
from problem.regressor import rigid_body_torque

RATE_HZ = 500.0
HARMONICS = 2 * np.pi * 0.2 * np.arange(1, 5)


def waves(joints: int, seed: int, seconds: float = 8.0, rate_hz: float = RATE_HZ) -> tuple[Array, Motion]:
    """Times and a motion of four harmonics."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(seconds * rate_hz)) / rate_hz
    a, b = rng.normal(0, 0.4, (2, 4, joints))
    sine, cosine = np.sin(np.outer(time, HARMONICS)), np.cos(np.outer(time, HARMONICS))
    first, second = HARMONICS, HARMONICS**2
    position, velocity = sine @ a + cosine @ b, (cosine * first) @ a - (sine * first) @ b
    return time, Motion(position, velocity, -(sine * second) @ a - (cosine * second) @ b)


def scene_of(arm: Arm, motion: Motion, time: Array, run: str = "run-1.csv", friction: float = 0.5) -> Scene:
    """The scene of an arm whose links are known, with Coulomb friction in the present model."""
    torque = rigid_body_torque(arm, motion) + friction * np.sign(motion.velocity)
    return Scene(run, time, motion, arm, arm.parameters, torque)


def scene(kinds: str = "RRR", seed: int = 0, run: str = "run-1.csv", seconds: float = 8.0) -> Scene:
    """A random arm on a smooth motion."""
    arm = random_arm(kinds, seed=3)
    time, motion = waves(len(kinds), seed, seconds)
    return scene_of(arm, motion, time, run)


def family(effect: str) -> Family:
    """The built-in family of an effect."""
    return next(each for each in BUILT_IN if each.effect == effect)


def candidate(effect: str, scenes: list[Scene], joint: int | None = None, form: str = "") -> Candidate:
    """The first candidate of an effect at a joint (and of a form)."""
    places = family(effect).candidates(scenes[0].arm, scenes)
    found = [place[0] for place in places if place[0].joint == joint and (not form or place[0].form == form)]
    assert found, f"no {effect} {form} at {joint}"
    return found[0]


def torque_of(chosen: Candidate, coefficients: Array, where: Scene) -> Array:
    """Torque of a candidate at all joints, (samples, joints)."""
    out = np.zeros(where.motion.position.shape)
    out[:, list(chosen.rows)] = chosen.columns(where) @ coefficients
    return out


def moved(where: Scene, motion: Motion) -> Scene:
    """The scene with another motion, its model's torque as before."""
    return replace(where, motion=motion)
