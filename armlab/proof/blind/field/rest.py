"""The rest that every real arm has and no law of the library explains, in kinds that depend on different things.

Each kind is a torque on the track of a run. A joint has a mixture of them, scaled to a share of its torque.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

from armlab.common.arrays import Array
from armlab.proof.blind.effects.friction import bouc_wen
from armlab.proof.blind.engine import Track


@dataclass(frozen=True, eq=False)
class RestRun:
    """What a kind of rest may depend on at one joint: the track, the joint's friction state (steps,) and its usual
    speed. half_turn: way that counts as half a turn, rad (m). stream: random numbers of the run.
    """

    track: Track
    joint: int
    state: Array
    top_speed: float
    half_turn: float
    stream: np.random.Generator


RestLaw = Callable[[RestRun, np.random.Generator], Array]


def uneven_friction(run: RestRun, rng: np.random.Generator) -> Array:
    """Friction that is higher at some places of the path: a smooth random function of position times direction."""
    return run.state * _random_curve(run, rng, 3, 30)


def harmonic_ripple(run: RestRun, rng: np.random.Generator) -> Array:
    """Ripple of a gear that grows with its load, two and four waves a turn of the motor (Tuttle 1992)."""
    order = 2 * float(rng.integers(30, 120))
    angle = order * run.track.position[:, run.joint] / run.half_turn * np.pi + rng.uniform(0, 6)
    load = np.abs(run.track.load[:, run.joint])
    grown = 0.4 + load / max(float(np.sqrt(np.mean(load**2))), 1e-12)
    return np.asarray(grown * (np.sin(angle) + float(rng.uniform(0.2, 0.8)) * np.sin(2 * angle + rng.uniform(0, 6))))


def cable_drag(run: RestRun, rng: np.random.Generator) -> Array:
    """A hose that is pulled along: it holds back with hysteresis over a long way, and stiffens towards the ends."""
    position = run.track.position[:, run.joint] / run.half_turn
    steps = np.diff(position, prepend=position[0]) / float(rng.uniform(0.05, 0.3))
    bent = position - rng.uniform(-0.4, 0.4)
    return np.asarray(bouc_wen(steps) + float(rng.uniform(0, 1.5)) * bent**3)


def base_compliance(run: RestRun, rng: np.random.Generator) -> Array:
    """A base that yields to the torque of all joints and swings: its reaction at this joint, of one mode."""
    step = run.track.step_s
    pitch, damping = 2 * np.pi * float(rng.uniform(4, 14)), float(rng.uniform(0.03, 0.12))
    pushed = run.track.load @ rng.normal(size=run.track.joints)
    pushed = pushed - pushed.mean()
    decay, angle = np.exp(-damping * pitch * step), pitch * np.sqrt(1 - damping**2) * step
    poles = np.array([1.0, -2 * decay * np.cos(angle), decay**2])
    swung = lfilter([poles.sum()], poles, pushed)
    return np.asarray(swung - pushed)


def rough_contact(run: RestRun, rng: np.random.Generator) -> Array:
    """Contact that is never twice the same: friction that wanders along the way that was travelled."""
    travelled = np.cumsum(np.abs(np.diff(run.track.position[:, run.joint], prepend=run.track.position[0, run.joint])))
    travelled /= run.half_turn
    length = float(np.exp(rng.uniform(np.log(0.005), np.log(0.1))))
    marks = np.arange(int(travelled[-1] / length) + 8)
    rough = gaussian_filter1d(run.stream.standard_normal(len(marks)), 1.0)
    return np.asarray(run.state * np.interp(travelled / length, marks, rough))


def wandering_drive(run: RestRun, rng: np.random.Generator) -> Array:
    """Torque of a drive whose magnets, oil and current sensors wander: noise of first order, more while it turns."""
    memory_s = float(np.exp(rng.uniform(np.log(0.01), np.log(1.0))))
    kept = float(np.exp(-run.track.step_s / memory_s))
    driven = run.stream.standard_normal(len(run.track.time)) * np.sqrt(1 - kept**2)
    wander = lfilter([1.0], [1.0, -kept], driven)
    busy = np.abs(run.track.velocity[:, run.joint]) / run.top_speed
    return np.asarray(wander * (0.4 + np.minimum(busy / 0.3, 1.0)))


def tilted_axis(run: RestRun, rng: np.random.Generator) -> Array:
    """Links that bend and axes that are not quite straight: waves of the positions of two joints together."""
    other = int(rng.integers(run.track.joints))
    own = run.track.position[:, run.joint] / run.half_turn * np.pi
    beside = run.track.position[:, other] / max(float(np.ptp(run.track.position[:, other])), 1e-9) * np.pi
    wave = np.sin(rng.uniform(1, 3) * own + rng.uniform(0, 6)) + np.sin(own + rng.uniform(1, 2) * beside)
    return np.asarray(wave * (1 + 0.5 * np.cos(2 * own)))


KINDS: dict[str, RestLaw] = {
    "uneven friction": uneven_friction,
    "harmonic ripple": harmonic_ripple,
    "cable drag": cable_drag,
    "base compliance": base_compliance,
    "rough contact": rough_contact,
    "wandering drive": wandering_drive,
    "tilted axis": tilted_axis,
}
NAMES = {"cable drag": "cable_stiffness", "base compliance": "flexible_base", "harmonic ripple": "torque_ripple"}


STILL_SHARE = 1e-6  # of a column's size, that its spread exceeds where the joint moves


@dataclass(frozen=True)
class JointRest:
    """The rest of one joint: how much of each kind, and the share of the torque's spread that all make together.

    key: of the random numbers that belong to the robot and not to a run.
    """

    weights: dict[str, float]
    share: float
    key: int

    def columns(self, run: RestRun) -> Array:
        """Each kind along a run, (steps, kinds), before it is scaled."""
        return np.column_stack(
            [KINDS[kind](run, np.random.default_rng([self.key, place])) for place, kind in enumerate(self.weights)]
        )

    def factors(self, columns: Array, torque: Array) -> Array:
        """What the columns of all runs are multiplied by, (kinds,), so that they make the share of a torque."""
        spread = np.std(columns, axis=0)
        moves = spread > STILL_SHARE * np.abs(columns).max(axis=0)  # a joint that is held has a constant, which is none
        weighted = np.where(moves, list(self.weights.values()), 0.0) / np.where(moves, spread, 1.0)
        size = max(float(np.std(columns @ weighted)), 1e-12)
        return np.asarray(weighted * self.share * float(np.std(torque)) / size)


def draw_rest(rng: np.random.Generator, share: float) -> JointRest:
    """Two to four kinds."""
    kinds = [str(each) for each in rng.permutation(list(KINDS))[: int(rng.integers(2, 5))]]
    weights = {kind: float(rng.uniform(0.3, 1.0)) for kind in kinds}
    return JointRest(weights, share, int(rng.integers(2**31)))


def _random_curve(run: RestRun, rng: np.random.Generator, low: float, high: float) -> Array:
    angle = run.track.position[:, run.joint] / run.half_turn * np.pi
    waves = [np.sin(rng.uniform(low, high) * angle + rng.uniform(0, 6)) * rng.normal() for _ in range(5)]
    return np.asarray(np.sum(waves, axis=0))
