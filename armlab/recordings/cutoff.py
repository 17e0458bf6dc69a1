"""Choice of the cut-off frequency from the data: less signal lost against more noise kept in the acceleration.

Real arms also vibrate above the frequency band of their motion. A rigid model does not explain these vibrations.
The cut-off is therefore at most ten times the bandwidth of the motion, a rule of thumb for rigid models.
"""

from dataclasses import dataclass

import numpy as np
from scipy.fft import dst

from armlab.common.arrays import Array
from armlab.recordings.filters import Butterworth

CANDIDATE_COUNT = 60
MIN_CUTOFF_PERIODS = 10  # periods of the lowest candidate within the run
MAX_CUTOFF_SHARE = 0.4  # of the sampling rate
MOTION_POWER_SHARE = 0.99  # of the velocity, or of the travel, below the bandwidth of the motion
MAX_BANDWIDTH_MULTIPLE = 10  # of that bandwidth
ROWS_PER_CUTOFF = 4  # rows kept in a period of the cut-off: what the filter leaves holds no more
NOISE_BAND_START = 0.3  # of the sampling rate: above it a well sampled motion has nothing but noise


@dataclass(frozen=True, eq=False)
class CutoffChoice:
    """A cut-off and the reason for it: the estimated error of the acceleration at each candidate.

    motion_hz: bandwidth of the motion; the choice is the candidate of least risk up to ten times that.
    candidates_hz, risk: (candidates,), risk as a share of the acceleration's power, summed over the joints.
    frequency_hz: (frequencies,). spectrum, noise: (frequencies, joints), power of the measured acceleration
    and the part that is taken for encoder noise.
    """

    cutoff_hz: float
    motion_hz: float
    candidates_hz: Array
    risk: Array
    frequency_hz: Array
    spectrum: Array
    noise: Array


def choose_cutoff(position: Array, rate_hz: float) -> CutoffChoice:
    """The cut-off with the least estimated mean-square error of the acceleration (Mallows 1973, eq. C_p).

    position: (samples, joints), at an even rate. Position noise is assumed to be white; its level is
    measured at the highest frequencies. The error of a candidate is the signal it removes plus the noise it passes.
    """
    frequency, spectrum, shape = acceleration_spectrum(position, rate_hz)
    noise = shape[:, None] * noise_level(frequency, spectrum, shape, rate_hz)
    lowest = MIN_CUTOFF_PERIODS * rate_hz / len(position)
    candidates = np.geomspace(min(lowest, MAX_CUTOFF_SHARE * rate_hz / 2), MAX_CUTOFF_SHARE * rate_hz, CANDIDATE_COUNT)
    power = np.sum(spectrum, axis=0)
    moving = power > 0
    risk = np.empty(CANDIDATE_COUNT)
    for index, cutoff in enumerate(candidates):
        gain = Butterworth(rate_hz, float(cutoff), len(position)).response(frequency)[:, None]
        errors = np.sum((1 - gain) ** 2 * (spectrum - noise) + gain**2 * noise, axis=0)
        risk[index] = np.sum(errors[moving] / power[moving])
    motion_hz = bandwidth(frequency, spectrum - noise, rate_hz)
    best = min(float(candidates[np.argmin(risk)]), max(MAX_BANDWIDTH_MULTIPLE * motion_hz, float(candidates[0])))
    return CutoffChoice(best, motion_hz, candidates, risk, frequency, spectrum, noise)


def travel_bandwidth(position: Array, rate_hz: float) -> float:
    """The frequency below which the travel of the joints together has nearly all its power, Hz.

    position: (samples, joints). Unlike the velocity, the position of a coarse encoder has little noise. The line
    between the ends of the run is taken away, so that a sine series has no jump there.
    """
    along = np.linspace(0, 1, len(position))[:, None]
    travel = position - (1 - along) * position[0] - along * position[-1]
    power = np.cumsum(np.sum(dst(travel, type=1, axis=0) ** 2, axis=1))
    order = int(np.searchsorted(power, MOTION_POWER_SHARE * power[-1])) + 1
    return order * rate_hz / (2 * (len(position) + 1))


def bandwidth(frequency: Array, spectrum: Array, rate_hz: float) -> float:
    """The frequency below which the velocity of every joint has nearly all its power, Hz.

    spectrum: (frequencies, joints), of the accelerations without their noise.
    """
    slope = (2 * rate_hz * np.sin(np.pi * frequency[1:] / rate_hz)) ** 2
    velocity = np.cumsum(np.maximum(spectrum[1:], 0) / slope[:, None], axis=0)
    inside = velocity <= MOTION_POWER_SHARE * velocity[-1]
    return float(frequency[1:][np.minimum(np.sum(inside, axis=0).max(), len(slope) - 1)])


def acceleration_spectrum(position: Array, rate_hz: float) -> tuple[Array, Array, Array]:
    """Frequencies (f,), power (f, joints) of the second differences, and the shape (f,) of white noise."""
    differences = np.diff(position, n=2, axis=0) * rate_hz**2
    window = np.hanning(len(differences))[:, None]
    scale = 2 / (np.sum(window**2) * rate_hz)
    spectrum = np.asarray(scale * np.abs(np.fft.rfft(differences * window, axis=0)) ** 2, dtype=np.float64)
    frequency = np.asarray(np.fft.rfftfreq(len(differences), 1 / rate_hz), dtype=np.float64)
    shape = (2 - 2 * np.cos(2 * np.pi * frequency / rate_hz)) ** 2 * rate_hz**4
    return frequency, spectrum, shape


def noise_level(frequency: Array, spectrum: Array, shape: Array, rate_hz: float) -> Array:
    """Density of the white position noise of each joint, (joints,), from the highest frequencies.

    The median of a periodogram is its mean times log 2: lines of mains or of a controller do not lift it.
    """
    high = frequency > NOISE_BAND_START * rate_hz
    return np.asarray(np.median(spectrum[high] / shape[high, None], axis=0) / np.log(2))
