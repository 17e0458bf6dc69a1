"""Identification of an arm from one period of a trajectory under noise, as on a real arm."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType

import numpy as np
from scipy.signal import butter, sosfiltfilt

from armlab.common.arrays import Array
from problem.excitation import ExcitationProblem
from problem.motion import Motion
from problem.regressor import observation_matrix, rigid_body_torque

RATE_HZ = 100.0
FILTER_CUTOFF_HZ = 5.0  # ten times the highest harmonic of the family
FILTER_ORDER = 4
RUN_UP_S = 1.5  # s of the periodic motion before and after the period, in which the filter forgets its ends
ENCODER_COUNTS = 8192  # of an encoder on the joint's side, per turn
TORQUE_NOISE = 0.5  # N m
TORQUE_SHARE = 0.05  # standard deviation of a gain that flickers
COULOMB_FRICTION = 1.0  # N m of Coulomb friction that the model lacks


@dataclass(frozen=True)
class MeasurementNoise:
    """Measurement noise; standard deviations in N m, or as a share of the torque itself.

    counts: encoder counts a turn, None for exact positions. friction: Coulomb friction in each joint, N m, which the
    model lacks.
    """

    torque: float = 0.0
    share: float = 0.0
    counts: int | None = None
    friction: float = 0.0

    def positions(self, exact: Array, rng: np.random.Generator) -> Array:
        """Positions (samples, joints) as the encoders give them; their zeros lie anywhere within a count."""
        if self.counts is None:
            return exact
        step = 2 * np.pi / self.counts
        zero = rng.uniform(0.0, step, exact.shape[1])
        return np.asarray(step * np.round((exact + zero) / step) - zero)

    def torques(self, exact: Array, velocity: Array, rng: np.random.Generator) -> Array:
        """Torques (samples, joints) as measured."""
        noise = rng.normal(size=(2, *exact.shape))
        return np.asarray(
            exact * (1 + self.share * noise[0]) + self.torque * noise[1] + self.friction * np.sign(velocity)
        )


NOISE_KINDS: Mapping[str, MeasurementNoise] = MappingProxyType(
    {
        "torque": MeasurementNoise(torque=TORQUE_NOISE),
        "proportional": MeasurementNoise(share=TORQUE_SHARE),
        "encoder": MeasurementNoise(counts=ENCODER_COUNTS),
        "both": MeasurementNoise(torque=TORQUE_NOISE, counts=ENCODER_COUNTS),
        "friction": MeasurementNoise(torque=TORQUE_NOISE, counts=ENCODER_COUNTS, friction=COULOMB_FRICTION),
    }
)


def identification_errors(
    problem: ExcitationProblem,
    point: Array,
    noise: MeasurementNoise,
    streams: Callable[[int], np.random.Generator],
    repetitions: int,
) -> Array:
    """Errors (repetitions, base) of the base parameters identified from one period each, SI units.

    Positions are low-pass filtered without phase shift and differentiated; torque and columns pass the same
    filter (parallel filtering); the fit is ordinary least squares.
    """
    arm, base = problem.arm, problem.base
    margin = round(RUN_UP_S * RATE_HZ)
    times = np.arange(-margin, round(problem.duration * RATE_HZ) + margin) / RATE_HZ
    exact = problem.trajectory.motions(point[None], times).motion.select(np.intp(0))
    torque = rigid_body_torque(arm, exact)
    truth = base.values(arm.parameters)
    errors = np.empty((repetitions, len(base)))
    for repetition in range(repetitions):
        rng = streams(repetition)
        motion = _differentiate(noise.positions(exact.position, rng))
        measured = _low_pass(noise.torques(torque, exact.velocity, rng))
        matrix = observation_matrix(arm, motion)[:, base.columns].reshape(len(times), -1)
        rows = slice(margin, -margin)
        matrix = _low_pass(matrix)[rows].reshape(-1, len(base))
        errors[repetition] = np.linalg.lstsq(matrix, measured[rows].ravel(), rcond=None)[0] - truth
    return errors


def _differentiate(position: Array) -> Motion:
    """The motion of measured positions (samples, joints): filtered, then central differences of fourth order."""
    smooth = _low_pass(position)
    padded = np.pad(smooth, ((2, 2), (0, 0)), mode="edge")  # rows at the ends are left out of the fit
    before, last, here, after, next_but_one = (padded[at : at + len(smooth)] for at in range(5))
    velocity = (before - 8 * last + 8 * after - next_but_one) * (RATE_HZ / 12)
    acceleration = (-before + 16 * last - 30 * here + 16 * after - next_but_one) * (RATE_HZ**2 / 12)
    return Motion(smooth, velocity, acceleration)


def _low_pass(signal: Array) -> Array:
    """The signal (samples, ...) through a Butterworth filter forwards and backwards."""
    return np.asarray(sosfiltfilt(_filter_sections(), signal, axis=0))


@lru_cache
def _filter_sections() -> Array:
    return np.asarray(butter(FILTER_ORDER, FILTER_CUTOFF_HZ, fs=RATE_HZ, output="sos"))
