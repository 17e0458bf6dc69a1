"""Friction that builds up over a short way after each reversal (Dahl 1968), and falls with speed (LuGre).

Both may stand beside Coulomb friction: of a joint's bearings and seals some turn over at once.
LuGre's bristles (Canudas de Wit, Olsson, Astrom and Lischinsky 1995) bend by z: dz/dt = qd - stiffness |qd| z / g(qd),
with the Stribeck curve g; their torque is stiffness z. Written over the way of the joint, the time is gone.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from scipy.linalg.lapack import dtbtrs

from diagnosis.effects.contract import Scene, Value
from diagnosis.effects.direction import PARTS, mean_within, within
from diagnosis.effects.stribeck import OF_TOP_SPEED, SPEED_RANGE
from diagnosis.effects.term import EveryJoint, Term, number, top_speed
from problem.arm import Arm
from recordings.run import Array
from recordings.vocabulary import effect_named

WAYS = (1e-3, 4e-3, 1.6e-2, 6e-2)  # of the joint's travel: the way over which friction turns, for a first look
WAY_RANGE = (2e-4, 0.2)
RATIO, RATIO_RANGE = 1.4, (1.0, 4.0)  # static over sliding friction


@dataclass(frozen=True)
class DahlFriction(Term):
    """level z with dz/dq = (stiffness / level) (1 - z sgn(qd)); shape: the way level / stiffness, rad (m)."""

    effect = "presliding_hysteresis"
    form = "Dahl"
    names = ("level", "stiffness")

    @classmethod
    def first_looks(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """Ways from a thousandth of the joint's travel up."""
        travel = max(float(np.ptp(scene.motion.position[:, joint - 1])) for scene in scenes)
        bounds = ((WAY_RANGE[0] * travel, WAY_RANGE[1] * travel),)
        return [cls.at(arm, joint, shape=(share * travel,), bounds=bounds) for share in WAYS]

    def columns(self, scene: Scene) -> Array:
        """The state along the recorded motion."""
        return self._stacked(mean_within(dahl_state(within(scene, self.own), self.shape[0])))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Sliding level, and stiffness at a reversal from rest."""
        level = float(coefficients[0])
        return {"level": level, "stiffness": level / self.shape[0]}

    def equation(self, coefficients: Array) -> str:
        """The law with its numbers."""
        own = self.joint
        return f"tau_{own} += {number(coefficients[0])} z, dz/dq_{own} = (1 - z sgn(qd_{own}))/{number(self.shape[0])}"

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect with level and stiffness."""
        level = float(parameters["level"])
        way = level / float(parameters["stiffness"])
        return cls.at(arm, joints[0], shape=(way,), bounds=((way / 10, way * 10),)), np.array([level])


@dataclass(frozen=True)
class LuGreFriction(Term):
    """level z with dz/d|q| = (sgn(qd) - z / h) / way, h = 1 + (ratio - 1) exp(-(qd / velocity)^2).

    shape: the way level / stiffness, rad (m); the static over the sliding level; Stribeck's velocity, rad/s (m/s).
    """

    effect = "presliding_hysteresis"
    form = "LuGre"
    names = ("level", "stiffness", "static_level", "velocity")

    @classmethod
    def first_looks(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """Short and longer ways with slow and faster Stribeck velocities."""
        travel = max(float(np.ptp(scene.motion.position[:, joint - 1])) for scene in scenes)
        top = top_speed(scenes, joint)
        ways, speeds = (tuple(size * x for x in pair) for size, pair in ((travel, WAY_RANGE), (top, SPEED_RANGE)))
        shapes = [(way * travel, RATIO, share * top) for way in WAYS[:3] for share in OF_TOP_SPEED[1:]]
        return [cls.at(arm, joint, shape=shape, bounds=(ways, RATIO_RANGE, speeds)) for shape in shapes]

    def columns(self, scene: Scene) -> Array:
        """The state along the recorded motion."""
        way, ratio, slow = self.shape
        velocity = scene.motion.velocity[:, self.own]
        curve = 1 + (ratio - 1) * np.exp(-((velocity / slow) ** 2))
        return self._stacked(mean_within(lugre_state(within(scene, self.own), np.repeat(curve, PARTS), way)))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Both levels, the stiffness at a reversal, and Stribeck's velocity."""
        level, (way, ratio, slow) = float(coefficients[0]), self.shape
        return {"level": level, "stiffness": level / way, "static_level": ratio * level, "velocity": slow}

    def unit(self, name: str) -> str:
        """Unit of a parameter; what Stribeck friction has, too, has the unit that it has there."""
        if name in ("static_level", "velocity"):
            return effect_named("stribeck_friction").parameter(name).unit_for(self.kind)
        return super().unit(name)

    def equation(self, coefficients: Array) -> str:
        """The law with its numbers."""
        own, (way, ratio, slow) = self.joint, self.shape
        curve = f"1 + {number(ratio - 1)} exp(-(qd_{own}/{number(slow)})^2)"
        return f"tau_{own} += {number(coefficients[0])} z, dz/d|q_{own}| = (sgn(qd_{own}) - z/({curve}))/{number(way)}"

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect with its four parameters."""
        level, stiffness, static, slow = (float(parameters[name]) for name in cls.names)
        way = level / stiffness
        bounds = ((way / 10, way * 10), RATIO_RANGE, (slow / 10, slow * 10))
        return cls.at(arm, joints[0], shape=(way, static / level, slow), bounds=bounds), np.array([level])


def dahl_state(position: Array, way: float) -> Array:
    """Exact solution of dz/dq = (1 - z sgn(dq)) / way along positions (samples,), from z = 0.

    Between reversals z closes in on the direction exponentially with the way gone, so that only the states at
    the reversals follow from one another.
    """
    steps = np.diff(position, prepend=position[0])
    direction = _held_sign(steps)
    gone = np.cumsum(np.abs(steps)) / way
    starts = np.concatenate([[0], np.flatnonzero(np.diff(direction)) + 1])
    # a stretch begins at the sample before its first step
    before = gone[np.maximum(starts - 1, 0)]
    lengths = np.diff(np.append(before, gone[-1]))
    state, states = 0.0, np.empty(len(starts))
    for index, (turn, decay) in enumerate(zip(direction[starts].tolist(), np.exp(-lengths).tolist(), strict=True)):
        states[index] = state
        state = turn + (state - turn) * decay
    counts = np.diff(np.append(starts, len(position)))
    since = np.exp(-(gone - np.repeat(before, counts)))
    return np.asarray(direction + (np.repeat(states, counts) - direction) * since)


def _held_sign(steps: Array) -> Array:
    """Sign of each step, the last one where there is no step."""
    places = np.where(steps != 0, np.arange(len(steps)), 0)
    return np.sign(steps)[np.maximum.accumulate(places)]


def lugre_state(position: Array, curve: Array, way: float) -> Array:
    """Solution of dz/d|q| = (sgn(dq) - z / curve) / way along positions, from z = 0; curve: (samples,).

    Exact while the curve holds from sample to sample.
    """
    steps = np.diff(position, prepend=position[0])
    between = np.append(curve[0], (curve[1:] + curve[:-1]) / 2)
    decay = np.exp(-np.abs(steps) / (way * between))
    bands = np.vstack([np.ones(len(decay)), np.append(-decay[1:], 0.0)])  # z_k - decay_k z_(k-1) = input_k, all at once
    solved, _ = dtbtrs(bands, (np.sign(steps) * between * (1 - decay))[:, None], uplo="L")
    return np.asarray(solved[:, 0])


PRESLIDING = EveryJoint("presliding_hysteresis", (DahlFriction, LuGreFriction))
