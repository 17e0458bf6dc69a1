"""The plan of a pair: one robot recorded twice, and what changes between the recordings."""

from dataclasses import dataclass, fields, replace
from typing import Literal, get_args

import numpy as np
from scipy.signal import lfilter

from armlab.common.arrays import Array
from armlab.proof.blind.effects.bodies import Payload
from armlab.proof.blind.effects.channels import EncoderOffset, TorqueGain
from armlab.proof.blind.effects.friction import Coulomb, Viscous
from armlab.proof.blind.effects.hidden import HiddenEffect
from armlab.proof.blind.formats import Tier
from armlab.proof.blind.noise import Noise
from armlab.proof.blind.plan import Plan, RunPlan, draw_background, draw_plan, draw_runs, random_stream

ChangeKind = Literal["friction", "payload", "gain", "zero"]
PairKind = Literal["null", "friction", "payload", "gain", "zero"]
CHANGE_KINDS: tuple[ChangeKind, ...] = get_args(ChangeKind)


@dataclass(frozen=True)
class PairSettings:
    """Sizes of changes and shares of pairs; fixed before any comparison was scored.

    friction: growth of the level and of the coefficient of one joint. payload_kg, gain, zero_deg: of the others.
    same_motion_share: pairs whose two recordings are of the same motions. drifting_share: null pairs whose torque
    channels drift. drift: standard deviation of a drift over that of the noise. drift_s: its correlation time.
    max_draws: draws of a place where the change is at least `least_multiple` detection limits.
    """

    friction: float = 0.4
    payload_kg: float = 2.0
    gain: float = 0.05
    zero_deg: float = 0.5
    same_motion_share: float = 0.5
    drifting_share: float = 0.34
    drift: tuple[float, float] = (0.5, 1.5)
    drift_s: tuple[float, float] = (10.0, 60.0)
    least_multiple: float = 3.0
    max_draws: int = 12


PAIRS = PairSettings()


@dataclass(frozen=True, eq=False)
class DriftingNoise(Noise):
    """Noise with a slow drift of each torque channel. drift: (joints,), N m. drift_s: its correlation time, s."""

    drift: Array
    drift_s: float

    def sample(self, rng: np.random.Generator, velocity: Array, time: Array) -> Array:
        """Noise on a run, (samples, joints), N m."""
        keep = float(np.exp(-(time[1] - time[0]) / self.drift_s))
        driven = rng.standard_normal(velocity.shape) * np.sqrt(1 - keep**2)
        start = keep * rng.standard_normal((1, velocity.shape[1]))
        slow, _ = lfilter([1.0], [1.0, -keep], driven, axis=0, zi=start)
        return np.asarray(super().sample(rng, velocity, time) + self.drift * slow)


@dataclass(frozen=True, eq=False)
class SidePlan(Plan):
    """One recording of a pair. side: `old` or `new`. same_motion: whether both are of the same motions."""

    side: str = "old"
    same_motion: bool = False

    def stream(self, what: str) -> np.random.Generator:
        """Random numbers for one purpose: motions may be shared, servos always are."""
        shared = what == "controller" or (self.same_motion and what.startswith("motion"))
        return random_stream("pair", "" if shared else self.side, what, self.seed, self.tier, self.index)


@dataclass(frozen=True, eq=False)
class PairPlan:
    """A robot recorded twice. kind: what changes."""

    kind: PairKind
    old: SidePlan
    new: SidePlan

    @property
    def name(self) -> str:
        """A random name, which says nothing about the pair."""
        plan = self.old
        return random_stream("pair name", plan.seed, plan.tier, plan.index, self.kind == "null").bytes(6).hex()

    @property
    def drifting(self) -> bool:
        """Whether the torque channels drift."""
        return isinstance(self.old.noise, DriftingNoise)


def draw_pair(seed: int, index: int, tier: Tier, changed: bool, development: bool) -> PairPlan:
    """The plan of a pair. development: leaves out the kinds of noise that are kept for judged sets."""
    kind: PairKind = CHANGE_KINDS[index % len(CHANGE_KINDS)] if changed else "null"
    plan = draw_plan(seed, index, tier, True, development)
    rng = random_stream("pair", seed, tier, index, changed)
    same = bool(rng.random() < PAIRS.same_motion_share)
    background = plan.background or draw_background(rng, plan.machine)
    runs: tuple[RunPlan, ...] = plan.runs if same else draw_runs(rng)
    noise = plan.noise
    if not changed and rng.random() < PAIRS.drifting_share:
        drift = noise.level * rng.uniform(*PAIRS.drift, len(noise.level))
        given = {each.name: getattr(noise, each.name) for each in fields(Noise)}
        noise = DriftingNoise(**given, drift=drift, drift_s=float(np.exp(rng.uniform(*np.log(PAIRS.drift_s)))))
    given = {each.name: getattr(plan, each.name) for each in fields(Plan)}
    given |= {"background": background, "noise": noise}
    old = SidePlan(**given, side="old", same_motion=same)
    return PairPlan(kind, old, replace(old, side="new", runs=runs))


def draw_change(pair: PairPlan, attempt: int) -> tuple[HiddenEffect, ...]:
    """What changes: effects that the new recording has beside those of the old one.

    attempt: counts the draws of a place; another one is made where the change cannot be seen.
    """
    plan = pair.new
    rng = random_stream("change", plan.seed, plan.tier, plan.index, attempt)
    machine = plan.machine
    joint = int(rng.integers(machine.joints))
    direction = {"direction": float(rng.choice([-1, 1]))}
    if pair.kind == "friction":
        own = [each for each in plan.background if each.joint == joint and isinstance(each, Coulomb | Viscous)]
        return tuple(replace(each, size=PAIRS.friction * each.size) for each in own)
    if pair.kind == "payload":
        link = int(rng.choice(Payload.places(machine)))
        return (replace(Payload.draw(rng, machine, link), size=PAIRS.payload_kg),)
    if pair.kind == "gain":
        return (TorqueGain(joint, PAIRS.gain, 0.5, "factor", {**direction, "knee": 0.0, "peak": 0.0}),)
    if pair.kind == "zero":
        return (EncoderOffset(joint, float(np.deg2rad(PAIRS.zero_deg)), 0.08, "constant", direction),)
    return ()
