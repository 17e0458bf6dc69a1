"""Commands of small arms, as people send them: waypoints, sums of sines, steps and slow ramps."""

from typing import Literal, get_args

import numpy as np

from armlab.common.arrays import Array

Family = Literal["waypoints", "multisine", "steps", "ramps"]
FAMILIES: tuple[Family, ...] = get_args(Family)
REST_S = 1.0  # at the start of each motion, so that an arm has settled before the record begins


def draw_command(rng: np.random.Generator, family: Family, home: Array, rate_hz: float, length_s: float) -> Array:
    """Commands (samples, joints), rad, that begin with REST_S at home; length_s: of what is recorded."""
    time = np.arange(round(length_s * rate_hz)) / rate_hz
    make = {"waypoints": _waypoints, "multisine": _multisine, "steps": _steps, "ramps": _ramps}[family]
    motion = np.stack([make(rng, time) for _ in home], axis=1)
    rest = np.zeros((round(REST_S * rate_hz), len(home)))
    return np.asarray(home + np.concatenate([rest, motion - motion[:1]]))


def _waypoints(rng: np.random.Generator, time: Array) -> Array:
    """Minimum-jerk moves between random places, with short stops (Flash and Hogan 1985)."""
    out, start, place = np.zeros_like(time), 0.0, 0.0
    while start < time[-1]:
        goal = float(rng.uniform(-0.8, 0.8))
        duration = max(abs(goal - place) / float(rng.uniform(0.5, 1.5)), 0.4)
        s = np.clip((time - start) / duration, 0, 1)
        out += (goal - place) * (10 * s**3 - 15 * s**4 + 6 * s**5)
        start += duration + float(rng.uniform(0.0, 0.5))
        place = goal
    return out


def _multisine(rng: np.random.Generator, time: Array) -> Array:
    frequencies = rng.uniform(0.1, 1.5, 5)
    amplitudes = rng.uniform(0.3, 1.0, 5) / (1 + frequencies)
    waves = amplitudes * np.sin(2 * np.pi * np.outer(time, frequencies) + rng.uniform(0, 2 * np.pi, 5))
    blend = np.minimum(time / 0.5, 1.0)
    return np.asarray(blend * waves.sum(axis=1) * 0.6 / amplitudes.sum())


def _steps(rng: np.random.Generator, time: Array) -> Array:
    jumps = np.cumsum(rng.uniform(0.5, 1.3, len(time)))
    levels = rng.uniform(-0.35, 0.35, len(time) + 1)
    levels[0] = 0.0
    return np.asarray(levels[np.searchsorted(jumps, time, side="right")])


def _ramps(rng: np.random.Generator, time: Array) -> Array:
    """Slow to and fro, at a speed of its own each way."""
    out, place, direction = np.zeros_like(time), 0.0, float(rng.choice([-1, 1]))
    turns, corners = [0.0], [0.0]
    while turns[-1] < time[-1]:
        goal = direction * float(rng.uniform(0.2, 0.5))
        turns.append(turns[-1] + abs(goal - place) / float(rng.uniform(0.1, 0.35)))
        corners.append(goal)
        place, direction = goal, -direction
    out = np.interp(time, turns, corners)
    return np.asarray(out)
