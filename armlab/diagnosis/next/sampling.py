"""How a run is sampled for a design: rate, shared filter of torque and columns, whitening of the noise, and weights
of the kept rows.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation
from scipy.signal import lfilter

from armlab.common.arrays import Array
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.rows.data import Segment, rows_in, split_segment
from armlab.diagnosis.torque.rows.noise import Noise
from armlab.effects.contract import Candidate, Scene
from armlab.recordings.filters import Butterworth
from problem.base_parameters import BaseParameters
from problem.regressor import observation_matrix

IMPULSE_ROWS = 2000  # rows after which the response of the noise model has died away


def noise_levels(noise: Noise) -> Array:
    """Standard deviation of a row's noise at each joint, (joints,), N m."""
    impulse = np.zeros(IMPULSE_ROWS)
    impulse[0] = 1.0
    pairs = zip(noise.taps, noise.scales, strict=True)
    return np.array([scale * np.sqrt(np.sum(lfilter([1.0], taps, impulse) ** 2)) for taps, scale in pairs])


SHORT_STRETCH_WORTH = 0.5  # of a row's worth, in a stretch between standstills that is too short for a diagnosis
SAMPLES_PER_ROW = 2  # samples of a designed motion for each kept row
ROWS_PER_CUTOFF = 3.0  # without a recording; a diagnosis keeps 2.2, with which the best known values would be 1e-3 off
INDEPENDENT_PER_HERTZ = 2.0  # numbers a second that a low-pass leaves independent, for each hertz of its cut-off


@dataclass(frozen=True, eq=False)
class Sampling:
    """How rows of a motion are kept and weighted.

    kept_hz: rows a second after the filter. noise: of those rows. standing: (joints,), rad/s (m/s): below this speed a
    joint stands still, and friction takes any value. Rows near a standstill count nothing, and rows of short stretches
    between standstills count less. Zero for a joint whose friction does not stick; empty without a recording.
    """

    kept_hz: float
    cutoff_hz: float
    noise: Noise
    standing: tuple[float, ...] = ()

    @property
    def rate_hz(self) -> float:
        """Samples a second of a designed motion."""
        return SAMPLES_PER_ROW * self.kept_hz

    def times(self, duration: float) -> Array:
        """Instants of a designed motion, s."""
        return np.asarray(np.arange(round(duration * self.rate_hz) + 1) / self.rate_hz)

    def filter(self, samples: int) -> Butterworth:
        """The filter of a designed motion."""
        return Butterworth(self.rate_hz, self.cutoff_hz, samples, SAMPLES_PER_ROW)

    def whiten(self, columns: Array, velocity: Array) -> Array:
        """Whitened and weighted rows of kept columns (rows, joints, columns): (rows of all joints, columns).

        velocity: (samples, joints), of the whole motion.
        """
        moves = self._moving_samples(velocity)[::SAMPLES_PER_ROW]
        kept = []
        for joint in range(columns.shape[1]):
            rows = self.noise.whitened(columns[:, joint], joint, [Segment(0, "identify", 0, len(columns))])
            kept.append(rows * _row_weights(moves[:, joint])[len(moves) - len(rows) :, None])
        return np.concatenate(kept)

    def _moving_samples(self, velocity: Array) -> NDArray[np.bool_]:
        """Instants (samples, joints) that are far enough from standing still for the filter."""
        if not self.standing:
            return np.ones(velocity.shape, dtype=bool)
        still = np.abs(velocity) < np.array(self.standing)
        margin = Settings().tuning.data.standstill_margin
        reach = round(margin / self.cutoff_hz * self.rate_hz)
        return np.asarray(~binary_dilation(still, structure=np.ones((2 * reach + 1, 1))))


def _row_weights(moves: NDArray[np.bool_]) -> Array:
    """Weights (rows,): zero near a standstill, less than one in stretches too short for a diagnosis."""
    whole = Segment(0, "identify", 0, len(moves))
    shortest = Settings().tuning.data.min_segment_rows
    long = rows_in(split_segment(whole, moves, shortest), len(moves)) if not moves.all() else moves
    return np.asarray(np.where(long, 1.0, np.where(moves, np.sqrt(SHORT_STRETCH_WORTH), 0.0)))


def white_noise_sampling(levels: Array, cutoff_hz: float) -> Sampling:
    """White noise below the cut-off. levels: (joints,), standard deviation of the filtered torque, N m."""
    kept_hz = ROWS_PER_CUTOFF * cutoff_hz
    scales = np.asarray(levels) * np.sqrt(
        kept_hz / (INDEPENDENT_PER_HERTZ * cutoff_hz)
    )  # rows that share their noise count less
    return Sampling(kept_hz, cutoff_hz, Noise(tuple(np.ones(1) for _ in levels), tuple(scales.tolist()), (), ()))


def kept_columns(
    base: BaseParameters, candidates: tuple[Candidate, ...], scene: Scene, keep: Butterworth, smooth: bool = False
) -> Array:
    """Base parameters' columns, then the candidates', at the kept rows: (rows, joints, columns).

    smooth: the motion is far below the cut-off, so that the filter would leave the rigid columns as they are.
    """
    return _keep_columns(
        _rigid_columns(base, scene), [each.columns(scene) for each in candidates], candidates, keep, smooth
    )


MAX_CHANGE = 1e-3  # of a column's largest entry, for a motion that is changed by far less: more is a jump of a sign


def column_changes(
    base: BaseParameters, candidates: tuple[Candidate, ...], scenes: tuple[Scene, Scene], keep: Butterworth
) -> Array:
    """By how much the same columns change from one scene to another one very near: (rows, joints, columns).

    Where the sign of a velocity jumps at a sample, its entry does not count: almost everywhere its derivative is zero.
    """
    before, after = scenes
    own = []
    for candidate in candidates:
        column = candidate.columns(before)
        change = candidate.columns(after) - column
        own.append(np.where(np.abs(change) > MAX_CHANGE * np.abs(column).max(initial=0.0), 0.0, change))
    rigid = _rigid_columns(base, after) - _rigid_columns(base, before)
    return _keep_columns(rigid, own, candidates, keep, smooth=True)


def _rigid_columns(base: BaseParameters, scene: Scene) -> Array:
    """The base parameters' columns, (samples, joints, columns)."""
    whole = observation_matrix(scene.arm, scene.motion)[:, base.columns]
    return np.asarray(whole.reshape(len(scene.time), len(scene.arm), -1))


def _keep_columns(
    rigid: Array, own: list[Array], candidates: tuple[Candidate, ...], keep: Butterworth, smooth: bool
) -> Array:
    """Rigid columns (samples, joints, columns) and those of candidates, at the kept rows."""
    joints = rigid.shape[1]
    out = [rigid[keep.rows] if smooth else keep(rigid)]
    flat = keep(np.concatenate([each.reshape(len(each), -1) for each in own], axis=1)) if own else np.empty((0, 0))
    at = 0
    for candidate, each in zip(candidates, own, strict=True):
        count = each.shape[1] * each.shape[2]
        full = np.zeros((len(flat), joints, each.shape[2]))
        full[:, list(candidate.rows)] = flat[:, at : at + count].reshape(-1, each.shape[1], each.shape[2])
        out.append(full)
        at += count
    return np.concatenate(out, axis=2)
