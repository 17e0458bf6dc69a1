"""How the drives of a field case log a run: rate, encoders, torque from current, noise, and clocks that stumble."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from armlab.common.arrays import Array

RATES_HZ = (50, 100, 100, 125, 200, 200, 250, 250, 400, 500, 500, 500)


@dataclass(frozen=True, eq=False)
class DriveLog:
    """Drawn once a case.

    encoder_bits: (joints,), steps a turn, or the range of a joint that slides, as a power of two; encoder_noise:
    (joints,), of a sample before it is rounded, steps. noise: (joints,), of a sample of torque, share of its spread;
    coloured: share of it of first order, with corner_hz; with_speed: how much more at the usual speed. torque_step:
    (joints,), of the torque, share of its spread; 0 for a number as it is. jitter: of the instants, share of a step.
    held, dropped, doubled: share of the rows. slow_torque: rows that the torque channel stays the same for. as_current:
    whether current and gains are written. velocity: whether velocity is. suffix: of the files.
    """

    rate_hz: int
    encoder_bits: Array
    encoder_noise: Array
    noise: Array
    coloured: float
    corner_hz: float
    with_speed: float
    torque_step: Array
    jitter: float
    held: float
    dropped: float
    doubled: float
    slow_torque: int
    as_current: bool
    velocity: bool
    suffix: str

    def noise_of(self, rng: np.random.Generator, speed: Array) -> Array:
        """Noise of the torque in its spread, (samples, joints). speed: (samples, joints), of the usual one."""
        kept = float(np.exp(-2 * np.pi * self.corner_hz / self.rate_hz))
        driven = rng.standard_normal((len(speed) + 200, speed.shape[1])) * np.sqrt(1 - kept**2)
        slow = lfilter([1.0], [1.0, -kept], driven, axis=0)[200:]
        white = rng.standard_normal(speed.shape)
        mixed = np.sqrt(1 - self.coloured**2) * white + self.coloured * slow
        return np.asarray(self.noise * mixed * (1 + self.with_speed * np.minimum(speed, 2.0)))


def draw_drive_log(rng: np.random.Generator, joints: int) -> DriveLog:
    """Drives of hobby servos, of laboratories, and of industry."""
    bits = float(rng.uniform(12, 14) if rng.random() < 0.1 else rng.uniform(17, 20))
    noise = np.exp(rng.uniform(np.log(0.005), np.log(0.3)) + rng.normal(0, 0.4, joints))
    coarse = rng.random() < 0.5
    step = np.exp(rng.uniform(np.log(3e-4), np.log(0.02)) + rng.normal(0, 0.5, joints))
    stumbles = rng.random(4) < 0.3
    return DriveLog(
        rate_hz=int(rng.choice(RATES_HZ)),
        encoder_bits=np.clip(np.rint(bits + rng.normal(0, 0.7, joints)), 12, 20),
        encoder_noise=rng.uniform(0, 1.5, joints) * (rng.random() < 0.7),
        noise=noise,
        coloured=float(rng.uniform(0.2, 0.9)),
        corner_hz=float(np.exp(rng.uniform(np.log(2), np.log(40)))),
        with_speed=float(rng.uniform(0, 1.5)),
        torque_step=step if coarse else np.zeros(joints),
        jitter=float(np.exp(rng.uniform(np.log(1e-3), np.log(0.1)))) if stumbles[0] else 0.0,
        held=float(rng.uniform(0, 0.02)) if stumbles[1] else 0.0,
        dropped=float(rng.uniform(0, 0.02)) if stumbles[2] else 0.0,
        doubled=float(rng.uniform(0, 0.01)) if stumbles[3] else 0.0,
        slow_torque=int(rng.integers(2, 5)) if rng.random() < 0.06 else 1,
        as_current=bool(rng.random() < 0.3),
        velocity=bool(rng.random() < 0.4),
        suffix=str(rng.choice([".csv", ".parquet"])),
    )
