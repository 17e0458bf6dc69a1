"""The cut-off that torque and columns share: as high as the encoders allow.

Effects at reversals and ripple need bandwidth. But noise of the encoders, differentiated twice, grows with the fourth
power of frequency; where it outweighs the noise of the torque, columns would explain their own noise.
"""

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import median_filter

from problem.arm import Arm
from problem.regressor import inertia_column
from recordings.cutoff import acceleration_spectrum, noise_level
from recordings.run import Array, Run

OUTWEIGHS = 0.5  # of the torque's power density: more of it from the encoders is too much
LOWEST_HZ = 10.0
SMOOTH = 41  # frequencies of a running median
STATES = 50  # of a run, for the inertia


def usable_cutoff(runs: Sequence[Run], arm: Arm, inertial: Array | None, highest_hz: float) -> float:
    """The highest frequency, Hz, up to which the encoders' noise stays below the torque's power on every joint.

    inertial: (10 * joints,) of the links; without them the highest is taken.
    """
    if inertial is None:
        return highest_hz
    return max(min(_usable(run, arm, inertial, highest_hz) for run in runs), min(LOWEST_HZ, highest_hz))


def _usable(run: Run, arm: Arm, inertial: Array, highest_hz: float) -> float:
    frequency, spectrum, shape = acceleration_spectrum(run.position, run.rate_hz)
    noise = noise_level(frequency, spectrum, shape, run.rate_hz)
    induced = np.outer(shape, np.square(_inertia(run, arm, inertial)) @ noise)
    power = _running_median(_power(run.torque, run.rate_hz, len(run.position) - 2))
    allowed = np.all(induced <= OUTWEIGHS * power[: len(induced)], axis=1)
    too_much = np.flatnonzero(~allowed & (frequency >= LOWEST_HZ))
    return float(min(frequency[too_much[0]] if len(too_much) else highest_hz, highest_hz))


def _inertia(run: Run, arm: Arm, inertial: Array) -> Array:
    """Root mean square of the mass matrix over the run, (joints, joints)."""
    position = run.position[:: max(run.samples // STATES, 1)]
    columns = [inertia_column(arm, position, joint, inertial) for joint in range(len(arm))]
    rotors = np.diag(arm.rotor_inertia) if arm.rotor_inertia else 0.0
    return np.asarray(np.sqrt(np.mean(np.square(np.stack(columns, axis=-1) + rotors), axis=0)))


def _power(signal: Array, rate_hz: float, samples: int) -> Array:
    """One-sided power density (frequencies, channels), on the frequencies of `samples` samples."""
    part = signal[:samples]
    window = np.hanning(samples)[:, None]
    scale = 2 / (np.sum(window**2) * rate_hz)
    return np.asarray(scale * np.abs(np.fft.rfft((part - part.mean(axis=0)) * window, axis=0)) ** 2)


def _running_median(power: Array) -> Array:
    return np.asarray(median_filter(power, size=(SMOOTH, 1), mode="nearest") / np.log(2))
