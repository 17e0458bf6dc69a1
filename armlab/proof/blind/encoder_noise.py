"""What encoders leave unknown of the motion, as noise of the torque that a model predicts from recorded positions.

An observer who has a recording knows the positions q + n, n the rounding of the encoders. The torque that the bodies
need on them is off by M n'' in first order, M the mass matrix, so that the residual of the right model has, at the
frequency f, the power density

    S(f) = T(f) + (2 pi f)^4 M E M'

with T that of the torque's noise and E that of the rounding, both diagonal (errors in the variables; Fuller 1987). With
any motion as likely as any other beforehand, the residual divided by the root of S is all that the recording tells.
"""

from dataclasses import dataclass

import numpy as np

from armlab.common.arrays import Array
from armlab.proof.blind.engine import Track
from armlab.proof.blind.noise import Noise
from problem.arm import Arm
from problem.regressor import inertia_column

POSES = 32  # of a run, over which the mass matrix is averaged


@dataclass(frozen=True, eq=False)
class EncoderNoise:
    """Noise of the positions of one run, and the bodies that turn it into torque.

    inertia: (joints, joints), kg m2, mean over the run. step: (joints,), rad, to which positions are rounded. rate_hz:
    of the recording.
    """

    inertia: Array
    step: Array
    rate_hz: float

    def power(self, frequency: Array, rate_hz: float) -> Array:
        """Variance of a row at rate_hz in the torque, per frequency in Hz, (frequencies, joints, joints), (N m)2."""
        rounding = np.diag(self.step**2 / 12) * rate_hz / self.rate_hz
        density = self.inertia @ rounding @ self.inertia.T
        return np.asarray((2 * np.pi * frequency[:, None, None]) ** 4 * density)


def encoder_noise(arm: Arm, track: Track, step: Array, rate_hz: float) -> EncoderNoise:
    """Noise of the encoders on a run. step: (joints,), rad. rate_hz: of the recording."""
    position = track.position[:: max(len(track.position) // POSES, 1)]
    columns = [inertia_column(arm, position, joint).mean(axis=0) for joint in range(len(arm))]
    rotors = np.diag(arm.rotor_inertia or np.zeros(len(arm)))
    return EncoderNoise(np.column_stack(columns) + rotors, step, rate_hz)


def whitening_filter(samples: int, noise: Noise, encoders: EncoderNoise, rate_hz: float) -> Array:
    """What makes noise of torque and encoders white with unit variance, of runs of that many samples at rate_hz.

    noise: of the torque of a sample. Returns (frequencies, joints, joints), without phase.
    """
    frequency = np.asarray(np.fft.rfftfreq(2 * samples, 1 / rate_hz), dtype=np.float64)
    power = encoders.power(frequency, rate_hz)
    power += noise.power(frequency, rate_hz)[:, :, None] * np.eye(power.shape[1])
    size, axes = np.linalg.eigh(power)
    return np.asarray((axes / np.sqrt(size)[:, None, :]) @ axes.transpose(0, 2, 1))


def whiten_with_encoders(columns: Array, whitening: Array) -> Array:
    """Columns of all joints through a `whitening_filter`, which sees them mirrored at the ends.

    columns: (samples, joints, columns). Returns the same shape.
    """
    samples = len(columns)
    spectrum = np.fft.rfft(np.concatenate([columns, columns[::-1]]), axis=0)
    return np.asarray(np.fft.irfft(whitening @ spectrum, 2 * samples, axis=0)[:samples])
