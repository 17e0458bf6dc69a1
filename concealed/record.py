"""From tracks to what a drive would have logged: stamps, quantised positions, noisy means of torque."""

from dataclasses import dataclass

import numpy as np

from concealed.passes import Simulated
from concealed.shares import taken
from concealed.simulate import FINE_HZ
from recordings.run import Array, Role

ENCODER_STEPS = (20, 24)  # powers of two a joint turn, gear included
JITTER_S = 2e-5  # of stamps that are late while the samples are even


@dataclass(frozen=True, eq=False)
class Logged:
    """One run as logged. clean: (samples, joints), N m, what the torque channels would read without noise."""

    role: Role
    time: Array
    position: Array
    torque: Array
    clean: Array


def logged(case: Simulated, run: int, noisy: bool = True) -> Logged:
    """A run of a case, sampled at its rate; without noise, rounding and jitter on request."""
    plan, track, rng = case.plan, case.tracks[run], case.plan.stream(f"log {run}")
    stamp, instant = _instants(case, run, rng, noisy)
    joints, effects = track.joints, case.everything
    centre = np.repeat(instant[:, None], joints, axis=1)
    lag = np.sum([effect.lag(joints) for effect in effects] or [np.zeros(joints)], axis=0)
    torque = track.means(track.load + taken(effects, track, run), centre - lag, 1 / plan.rate_hz)
    for effect in effects:
        torque = effect.read(torque)
    shift = np.sum([effect.shift(joints) for effect in effects] or [np.zeros(joints)], axis=0)
    sampled = track.at(instant)
    position, role = sampled.position + shift, plan.runs[run].role
    if not noisy:
        return Logged(role, stamp, position, torque, torque)
    step = 2 * np.pi / 2.0 ** rng.integers(*ENCODER_STEPS, joints)
    noise = plan.noise.sample(plan.stream(f"noise {run}"), sampled.velocity, instant)
    read = plan.noise.rounded(torque + noise)
    return Logged(role, stamp, np.rint(position / step) * step, read, torque)


def _instants(case: Simulated, run: int, rng: np.random.Generator, noisy: bool) -> tuple[Array, Array]:
    """Stamps and true instants: even samples with late stamps, or samples taken unevenly and stamped well."""
    plan = case.plan
    even = np.arange(round(plan.runs[run].length_s * plan.rate_hz)) / plan.rate_hz
    if not noisy:
        return even, even
    if plan.stream("clock").random() < 0.3:
        uneven = even + rng.integers(-1, 2, len(even)) / FINE_HZ
        return np.maximum(uneven, 0.0), np.maximum(uneven, 0.0)
    return even + np.abs(rng.normal(0, JITTER_S, len(even))), even
