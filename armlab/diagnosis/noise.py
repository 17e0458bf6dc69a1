"""Coloured errors: an autoregressive model a joint, and the filter that makes its errors white.

Rows that are whitened (generalised least squares) count what they are worth: a slow error of a coloured kind is no
evidence, a fast one may be strong evidence.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.diagnosis.data import Observed, Segment
from armlab.diagnosis.tuning import NoiseTuning
from armlab.recordings.recording import Role


@dataclass(frozen=True, eq=False)
class Noise:
    """Per joint the prediction-error filter (order + 1,), first tap one, and the innovations' standard deviation.

    resting: (rows,), how far a row may be off that stands near a standstill or a reversal. There friction takes any
    value up to its level, for a time that no law of motion tells: such a stretch counts as little as it is off itself.
    """

    taps: tuple[Array, ...]
    scales: tuple[float, ...]
    resting: tuple[Array, ...]

    def whitened(self, matrix: Array, joint: int, segments: Sequence[Segment]) -> Array:
        """Rows (rows, columns) filtered within each segment and brought to unit variance; first rows are lost."""
        taps = self.taps[joint]
        parts = [_prediction_errors(matrix[each.start : each.stop], taps) for each in segments]
        return np.concatenate(parts) / self.scales[joint]

    def white(self, matrix: Array, joint: int, observed: Observed, role: Role) -> Array:
        """All rows of a role at unit variance: those in motion, whitened, then those at rest."""
        rest = observed.at_rest(role, joint)
        moving = self.whitened(matrix, joint, observed.of_role(role, joint))
        return np.concatenate([moving, matrix[rest] / self.resting[joint][rest, None]])

    def numbers(self, values: NDArray[np.intp], joint: int, observed: Observed, role: Role) -> NDArray[np.intp]:
        """Values (rows,) such as numbers of stretches at the rows of `white`."""
        moving = [values[each.start + self.lost(joint) : each.stop] for each in observed.of_role(role, joint)]
        return np.concatenate([*moving, values[observed.at_rest(role, joint)]])

    def lost(self, joint: int) -> int:
        """Rows that are lost at the start of each segment."""
        return len(self.taps[joint]) - 1


def choose_noise(coloured: Noise, white: Noise, plain: NDArray[np.bool_]) -> Noise:
    """The noise of each joint: white where `plain` (joints,) says so."""
    pick = [white if each else coloured for each in plain]
    return Noise(
        tuple(each.taps[joint] for joint, each in enumerate(pick)),
        tuple(each.scales[joint] for joint, each in enumerate(pick)),
        tuple(each.resting[joint] for joint, each in enumerate(pick)),
    )


def _prediction_errors(rows: Array, taps: Array) -> Array:
    order = len(taps) - 1
    out = rows[order:].copy()
    for lag in range(1, order + 1):
        out += taps[lag] * rows[order - lag : len(rows) - lag]
    return out


def fit_noise(residuals: Array, observed: Observed, fitted: float, tuning: NoiseTuning, colour: bool = True) -> Noise:
    """The noise of residuals (rows, joints) that `fitted` columns a joint have been taken out of.

    colour: False for errors that count as independent of each other.
    """
    taps, scales, resting = [], [], []
    for joint in range(residuals.shape[1]):
        parts = [residuals[each.start : each.stop, joint] for each in observed.used(joint)]
        found, variance = _fit_autoregression(parts, tuning) if colour else (np.ones(1), _mean_square(parts))
        count = sum(map(len, parts))
        spare = count / max(count - fitted, tuning.min_free_share * count)
        taps.append(found)
        scales.append(float(np.sqrt(variance * spare)))
        moving = np.sqrt(_mean_square(parts) * spare)
        resting.append(
            np.sqrt(tuning.filter_correlation_rows) * _rest_scales(residuals[:, joint], moving, joint, observed)
        )
    return Noise(tuple(taps), tuple(scales), tuple(resting))


def _rest_scales(residual: Array, moving: float, joint: int, observed: Observed) -> Array:
    """Of each row: the root mean square of the stretch at rest that it belongs to, no less than in motion."""
    out = np.full(len(residual), moving)
    for each in observed.stretches_at_rest(joint):
        out[each.start : each.stop] = max(float(np.sqrt(np.mean(residual[each.start : each.stop] ** 2))), moving)
    return out


def _mean_square(parts: Sequence[Array]) -> float:
    return max(float(np.mean(np.concatenate(parts) ** 2)), 1e-300)


def _fit_autoregression(parts: Sequence[Array], tuning: NoiseTuning) -> tuple[Array, float]:
    """Least squares on the rows before, with the order of the least BIC (Schwarz 1978)."""
    longest = min(tuning.max_order, min(map(len, parts)) // tuning.min_rows_per_order)
    lagged = np.concatenate([np.lib.stride_tricks.sliding_window_view(part, longest + 1) for part in parts])
    count, products = len(lagged), lagged.T @ lagged / len(lagged)
    white = tuning.white_noise_share * np.trace(products) / (longest + 1)
    products = products[::-1, ::-1] + white * np.eye(longest + 1)
    if products[0, 0] <= 0:
        return np.ones(1), 1e-300
    best = (np.inf, np.ones(1), float(products[0, 0]))
    for order in range(longest + 1):
        weights = np.linalg.solve(products[1 : order + 1, 1 : order + 1], products[0, 1 : order + 1])
        variance = float(products[0, 0] - weights @ products[0, 1 : order + 1])
        score = count * np.log(max(variance, 1e-300)) + order * np.log(count)
        if score < best[0]:
            best = (score, np.concatenate([[1.0], -weights]), variance)
    return best[1], best[2]
