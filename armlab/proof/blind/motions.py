"""Families of motions: references that a controller follows, each (samples, joints), rad.

Every family starts from its own random numbers and is then scaled to the limits of the arm. No two runs of a
recording share frequencies.
"""

from collections.abc import Callable

import numpy as np

from armlab.common.arrays import Array
from armlab.proof.blind.arms import Machine

Family = Callable[[np.random.Generator, Array, int], Array]
USED_RANGE = 0.7  # of the position limits
SMOOTHING_S = 0.06  # corners of a point-to-point motion are rounded over this time


def fourier(rng: np.random.Generator, time: Array, joints: int) -> Array:
    """Five harmonics of about a tenth of a hertz."""
    base, harmonics = rng.uniform(0.08, 0.12), np.arange(1.0, 6.0)
    return _random_waves(rng, time, joints, base * harmonics, 1 / harmonics**0.8)


def multisine(rng: np.random.Generator, time: Array, joints: int) -> Array:
    """Sines with random phases at odd multiples of another fundamental, up to about two hertz."""
    base, harmonics = rng.uniform(0.14, 0.19), np.arange(1.0, 13.0, 2.0)
    return _random_waves(rng, time, joints, base * harmonics, 1 / harmonics)


def creeping(rng: np.random.Generator, time: Array, joints: int) -> Array:
    """Slow waves with many reversals, faster ones between them: mostly below a tenth of the usual speed."""
    slow = _random_waves(rng, time, joints, rng.uniform(0.05, 0.4, 4), np.array([1.0, 0.5, 0.2, 0.1]))
    burst = np.clip(np.sin(2 * np.pi * time / rng.uniform(6, 9) + rng.uniform(0, 6)) - 0.5, 0, 1)[:, None]
    return slow + 2 * burst**2 * _random_waves(rng, time, joints, rng.uniform(0.5, 0.9, 2), np.array([1.0, 0.6]))


def point_to_point(rng: np.random.Generator, time: Array, joints: int) -> Array:
    """Moves between random places with trapezoids of velocity, corners rounded, and short rests.

    A slow wave beneath keeps the joints from standing still, where friction may be anything.
    """
    knots, places = [time[0] - 1.0], [rng.uniform(-1, 1, joints)]
    while knots[-1] < time[-1] + 1:
        knots += [knots[-1] + rng.uniform(0.7, 1.6)]
        places += [rng.uniform(-1, 1, joints)]
        knots += [knots[-1] + rng.uniform(0.05, 0.3)]
        places += [places[-1]]
    stretched = np.interp(time, knots, np.arange(len(knots), dtype=np.float64))
    start, share = np.floor(stretched).astype(int), stretched % 1
    blend = _trapezoid(share, rng.uniform(0.25, 0.4))
    values, width = np.array(places), round(SMOOTHING_S / (time[1] - time[0]))
    path = values[start] + blend[:, None] * (values[np.minimum(start + 1, len(values) - 1)] - values[start])
    slow = _random_waves(rng, time, joints, rng.uniform(0.05, 0.12, 2), np.array([0.2, 0.1]))
    return moving_average(moving_average(path, width), width) + slow


def chirp(rng: np.random.Generator, time: Array, joints: int) -> Array:
    """Sweeps up to a few hertz, amplitude falling as frequency grows, upon a slow wave."""
    length = time[-1] - time[0]
    first, last = rng.uniform(0.1, 0.2, joints), rng.uniform(2.0, 4.0, joints)
    share = ((time - time[0]) / length)[:, None]
    frequency = first * (last / first) ** share
    angle = 2 * np.pi * length * (frequency - first) / np.log(last / first) + rng.uniform(0, 2 * np.pi, joints)
    amplitude = (first / frequency) ** 1.2
    return np.asarray(amplitude * np.sin(angle)) + _random_waves(
        rng, time, joints, rng.uniform(0.06, 0.1, 2), np.array([0.6, 0.3])
    )


FAMILIES: dict[str, Family] = {
    "fourier": fourier,
    "multisine": multisine,
    "creeping": creeping,
    "point-to-point": point_to_point,
    "chirp": chirp,
}


def make_reference(family: str, rng: np.random.Generator, time: Array, machine: Machine) -> Array:
    """A reference of a family within the arm's range, speed and acceleration, (samples, joints), rad."""
    shape = FAMILIES[family](rng, time, machine.joints)
    low, high = machine.range
    middle, reach = (low + high) / 2, USED_RANGE * np.minimum((high - low) / 2, 2.0)
    shape = shape - (shape.max(axis=0) + shape.min(axis=0)) / 2
    step = time[1] - time[0]
    velocity = np.diff(shape, axis=0) / step
    acceleration = np.diff(velocity, axis=0) / step
    vigour = rng.uniform(0.6, 1.0, machine.joints)
    most = np.minimum(
        machine.speed / np.abs(velocity).max(axis=0), machine.acceleration / np.abs(acceleration).max(axis=0)
    )
    scale = vigour * np.minimum(reach / np.abs(shape).max(axis=0), most)
    shift = rng.uniform(-1, 1, machine.joints) * np.maximum(reach - scale * np.abs(shape).max(axis=0), 0)
    return np.asarray(middle + shift + scale * shape)


def _random_waves(rng: np.random.Generator, time: Array, joints: int, frequency_hz: Array, weight: Array) -> Array:
    sine = rng.normal(0, 1, (len(frequency_hz), joints)) * weight[:, None]
    cosine = rng.normal(0, 1, (len(frequency_hz), joints)) * weight[:, None]
    angle = 2 * np.pi * np.outer(time, frequency_hz)
    return np.asarray(np.sin(angle) @ sine + np.cos(angle) @ cosine)


def _trapezoid(share: Array, ramp: float) -> Array:
    """Path from 0 to 1 with a trapezoidal velocity; ramp: share of the time of each ramp."""
    top = 1 / (1 - ramp)
    up = np.minimum(share, ramp) ** 2 * top / (2 * ramp)
    down = np.maximum(share - (1 - ramp), 0) ** 2 * top / (2 * ramp)
    return np.asarray(up + np.maximum(share - ramp, 0) * top - down)


def moving_average(path: Array, width: int) -> Array:
    """Mean over a window about each sample; the first and last sample are repeated beyond the ends."""
    padded = np.concatenate([np.repeat(path[:1], width // 2, 0), path, np.repeat(path[-1:], width - width // 2, 0)])
    total = np.cumsum(np.vstack([np.zeros((1, path.shape[1])), padded]), axis=0)
    return np.asarray((total[width:] - total[:-width])[: len(path)] / width)
