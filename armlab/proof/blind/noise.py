"""Noise on the torque channels: white and coloured for development, further kinds for judged nulls only."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from armlab.common.arrays import Array

USUAL_KINDS = ("white", "coloured")
JUDGED_KINDS = ("heavy_tails", "growing_with_speed", "quantised", "mains_hum")  # never in development sets


@dataclass(frozen=True)
class NoiseRanges:
    """What a case draws its noise from; chosen by eye, in the range of logged motor currents.

    level: standard deviation of a sample, share of the rating. coloured_share, realistic_coloured_share: the coloured
    part over the whole, by tier. white_coloured_share: the same of noise that is called white. corner_hz: of the
    coloured part.
    """

    level: tuple[float, float] = (0.0015, 0.004)
    coloured_share: tuple[float, float] = (0.3, 0.7)
    realistic_coloured_share: tuple[float, float] = (0.5, 0.85)
    white_coloured_share: float = 0.02
    corner_hz: tuple[float, float] = (1.5, 15)


NOISE = NoiseRanges()


@dataclass(frozen=True, eq=False)
class Noise:
    """White noise and noise of first order beside it, the same kind on every joint.

    white, coloured: (joints,), N m, standard deviations of a sample. corner_hz: of the coloured part.
    """

    kind: str
    white: Array
    coloured: Array
    corner_hz: float

    @property
    def level(self) -> Array:
        """Standard deviation of a sample at each joint, (joints,), N m."""
        return np.asarray(np.hypot(self.white, self.coloured))

    def memory(self, rate_hz: float) -> float:
        """Correlation of the coloured part from one sample to the next."""
        return float(np.exp(-2 * np.pi * self.corner_hz / rate_hz))

    def sample(self, rng: np.random.Generator, velocity: Array, time: Array) -> Array:
        """Noise on a run, (samples, joints), N m. velocity: (samples, joints), rad/s."""
        samples, joints = velocity.shape
        memory = self.memory(1 / float(time[1] - time[0]))
        driven = rng.standard_normal((samples + 200, joints)) * np.sqrt(1 - memory**2)
        coloured = lfilter([1.0], [1.0, -memory], driven, axis=0)[200:]
        white = rng.standard_normal((samples, joints))
        if self.kind == "heavy_tails":
            white = rng.standard_t(3, (samples, joints)) / np.sqrt(3)
        noise = self.white * white + self.coloured * coloured
        if self.kind == "growing_with_speed":
            speed = np.abs(velocity) / np.maximum(np.abs(velocity).max(axis=0), 1e-9)
            noise = noise * (0.4 + 1.6 * speed)
        if self.kind == "mains_hum":
            phase = rng.uniform(0, 2 * np.pi, (2, joints))
            for order, angle in zip((1, 3), phase, strict=True):
                noise = noise + self.white * np.sin(2 * np.pi * 50 * order * time[:, None] + angle) / order
        return np.asarray(noise)

    def power(self, frequency: Array, rate_hz: float) -> Array:
        """Variance of a sample at rate_hz, per frequency in Hz, (frequencies, joints), (N m)2; that of white noise is
        the same at every frequency."""
        memory = self.memory(rate_hz)
        passed = (1 - memory**2) / np.abs(1 - memory * np.exp(-2j * np.pi * frequency / rate_hz)) ** 2
        return np.asarray(self.white**2 + np.outer(passed, self.coloured**2))

    def quantise(self, torque: Array) -> Array:
        """Torque channels (samples, joints) at the resolution of the kind of noise."""
        return np.rint(torque / (3 * self.white)) * 3 * self.white if self.kind == "quantised" else torque

    def whitened(self, signal: Array, joint: int, rate_hz: float) -> Array:
        """A signal (samples, ...) of one joint, filtered so that the usual noise would be white with unit variance.

        White noise and noise of first order together are a process of order (1, 1); its moving average's root
        is found from the two autocovariances of (1 - memory B) noise.
        """
        memory = self.memory(rate_hz)
        white, coloured = self.white[joint] ** 2, self.coloured[joint] ** 2
        same, next_one = white * (1 + memory**2) + coloured * (1 - memory**2), -memory * white
        root = (same - np.sqrt(same**2 - 4 * next_one**2)) / (2 * next_one)
        power = next_one / root
        return np.asarray(lfilter([1.0, -memory], [1.0, root], signal, axis=0) / np.sqrt(power))


def draw_noise(rng: np.random.Generator, kind: str, rating: Array, realistic: bool) -> Noise:
    """Noise of the level of `NOISE`; its coloured part is larger in the realistic tier."""
    low, high = NOISE.level
    level = rating * np.exp(rng.uniform(np.log(low), np.log(high), len(rating)))
    share = NOISE.white_coloured_share
    if kind != "white":
        share = rng.uniform(*(NOISE.realistic_coloured_share if realistic else NOISE.coloured_share))
    return Noise(kind, level * np.sqrt(1 - share**2), level * share, float(rng.uniform(*NOISE.corner_hz)))
