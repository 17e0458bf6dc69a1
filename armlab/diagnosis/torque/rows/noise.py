"""Coloured errors: an autoregressive model a joint, and the filter that makes its errors white.

Rows that are whitened (generalised least squares) count what they are worth: a slow error of a coloured kind is no
evidence, a fast one may be strong evidence.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.diagnosis.torque.rows.data import Observed, Segment
from armlab.diagnosis.tuning import NoiseTuning
from armlab.recordings.recording import Role

Kind = TypeVar("Kind", bound=np.generic)
CACHED_NUMBERS = 16_000  # that are filtered at a time, 128 kB


@dataclass(frozen=True, eq=False)
class Noise:
    """Per joint the prediction-error filter (order + 1,), first tap one, and the innovations' standard deviation.

    resting: (rows,), how far a row may be off that stands near a standstill or a reversal. There friction takes any
    value up to its level, for a time that no law of motion tells: such a stretch counts as little as it is off itself.
    through: whether the filter goes on through these stretches; else their rows are taken as they are.
    """

    taps: tuple[Array, ...]
    scales: tuple[float, ...]
    resting: tuple[Array, ...]
    through: tuple[bool, ...]

    def whitened(self, matrix: Array, joint: int, segments: Sequence[Segment]) -> Array:
        """Rows (rows, columns) filtered within each segment and brought to unit variance; first rows are lost."""
        out = self._filtered(matrix, joint, segments)
        out /= self.scales[joint]
        return out

    def white(self, matrix: Array, joint: int, observed: Observed, role: Role) -> Array:
        """All rows of a role at unit variance: in their order, or those in motion and then those at rest."""
        if self.through[joint]:
            whole = observed.of_role(role)
            out = self._filtered(matrix, joint, whole)
            out /= self._kept(self.resting[joint], joint, whole)[:, None]
            return out
        rest = observed.at_rest(role, joint)
        moving = self.whitened(matrix, joint, observed.of_role(role, joint))
        return np.concatenate([moving, matrix[rest] / self.resting[joint][rest, None]]) if len(rest) else moving

    def numbers(self, values: NDArray[np.intp], joint: int, observed: Observed, role: Role) -> NDArray[np.intp]:
        """Values (rows,) such as numbers of stretches at the rows of `white`."""
        if self.through[joint]:
            return self._kept(values, joint, observed.of_role(role))
        moving = self._kept(values, joint, observed.of_role(role, joint))
        return np.concatenate([moving, values[observed.at_rest(role, joint)]])

    def in_motion(self, observed: Observed) -> "Noise":
        """The same where rows at rest, and those that the filter ties to them, count nothing."""
        resting = [each.copy() for each in self.resting]
        for joint, rows in enumerate(resting):
            for segment in observed.segments:
                for rest in observed.stretches_at_rest(joint, segment):
                    rows[self._tied(joint, rest, segment)] = np.inf
        return replace(self, resting=tuple(resting))

    def lost(self, joint: int) -> int:
        """Rows that are lost at the start of each segment."""
        return len(self.taps[joint]) - 1

    def _tied(self, joint: int, rest: Segment, segment: Segment) -> slice:
        return slice(rest.start, min(rest.stop + self.lost(joint) * self.through[joint], segment.stop))

    def _filtered(self, matrix: Array, joint: int, segments: Sequence[Segment]) -> Array:
        """Prediction errors of each segment, one below the other, in an array of their own."""
        order = self.lost(joint)
        out = np.empty((sum(max(each.stop - each.start - order, 0) for each in segments), matrix.shape[1]))
        start = 0
        for each in segments:
            stop = start + max(each.stop - each.start - order, 0)
            _write_prediction_errors(matrix[each.start : each.stop], self.taps[joint], out[start:stop])
            start = stop
        return out

    def _kept(self, values: NDArray[Kind], joint: int, segments: Sequence[Segment]) -> NDArray[Kind]:
        return np.concatenate([values[each.start + self.lost(joint) : each.stop] for each in segments])


def choose_noise(coloured: Noise, white: Noise, plain: NDArray[np.bool_]) -> Noise:
    """The noise of each joint: white where `plain` (joints,) says so."""
    pick = [white if each else coloured for each in plain]
    return Noise(
        tuple(each.taps[joint] for joint, each in enumerate(pick)),
        tuple(each.scales[joint] for joint, each in enumerate(pick)),
        tuple(each.resting[joint] for joint, each in enumerate(pick)),
        tuple(each.through[joint] for joint, each in enumerate(pick)),
    )


def _write_prediction_errors(rows: Array, taps: Array, out: Array) -> None:
    """Rows (order + n, columns) less what those before tell of them, (n, columns): some at a time stay in the cache."""
    order, size = len(taps) - 1, max(CACHED_NUMBERS // max(rows.shape[1], 1), 1)
    for start in range(0, len(out), size):
        stop = min(start + size, len(out))
        part = out[start:stop]
        part[:] = rows[order + start : order + stop]
        for lag in range(1, order + 1):
            part += taps[lag] * rows[order - lag + start : order - lag + stop]


def fit_noise(residuals: Array, observed: Observed, fitted: float, tuning: NoiseTuning, colour: bool = True) -> Noise:
    """The noise of residuals (rows, joints) that `fitted` columns a joint have been taken out of.

    colour: False for errors that count as independent of each other. Colour that was learnt in motion holds at rest,
    too, where a joint moves for most of the time and is hardly more off at rest.
    """
    taps, scales, resting, through = [], [], [], []
    for joint in range(residuals.shape[1]):
        parts = [residuals[each.start : each.stop, joint] for each in observed.used(joint)]
        found, variance = _fit_autoregression(parts, tuning) if colour else (np.ones(1), _mean_square(parts))
        count = sum(map(len, parts))
        spare = count / max(count - fitted, tuning.min_free_share * count)
        taps.append(found)
        scales.append(float(np.sqrt(variance * spare)))
        left, least = residuals[:, joint], float(np.sqrt(_mean_square(parts) * spare))
        resting.append(_rest_scales(left, least, joint, observed) * np.sqrt(tuning.filter_correlation_rows))
        through.append(False)
        if len(found) > 1 and count >= tuning.min_moving_share * len(residuals):
            filtered, at_rest = _scales_through_rest(left, found, scales[-1], joint, observed)
            if at_rest <= tuning.max_rest_ratio * scales[-1]:
                resting[-1], through[-1] = filtered, True
    return Noise(tuple(taps), tuple(scales), tuple(resting), tuple(through))


def error_colours(residuals: Array, observed: Observed, tuning: NoiseTuning) -> Array:
    """How much larger errors (rows, joints) in motion are than what their past does not tell of them, (joints,).

    A logarithm: 0 for white errors. What a sensor adds is forgotten soon; physics that a model lacks is not.
    """
    out = []
    for joint in range(residuals.shape[1]):
        parts = [residuals[each.start : each.stop, joint] for each in observed.used(joint)]
        out.append(0.5 * float(np.log(_mean_square(parts) / _fit_autoregression(parts, tuning)[1])))
    return np.maximum(out, 0.0)


def _rest_scales(residual: Array, least: float, joint: int, observed: Observed) -> Array:
    """Of each row: the root mean square of the stretch at rest that it belongs to, no less than in motion."""
    out = np.full(len(residual), least)
    for segment in observed.segments:
        for rest in observed.stretches_at_rest(joint, segment):
            out[rest.start : rest.stop] = max(float(np.sqrt(np.mean(residual[rest.start : rest.stop] ** 2))), least)
    return out


def _scales_through_rest(
    residual: Array, taps: Array, scale: float, joint: int, observed: Observed
) -> tuple[Array, float]:
    """Of each filtered row the rms of the stretch at rest that the filter ties it to, or the scale; and that of all."""
    order, out, squares = len(taps) - 1, np.full(len(residual), scale), [np.zeros(0)]
    for segment in observed.segments:
        errors = np.zeros(len(residual))
        whole = residual[segment.start : segment.stop, None]
        _write_prediction_errors(whole, taps, errors[segment.start + order : segment.stop, None])
        for rest in observed.stretches_at_rest(joint, segment):
            tied = slice(max(rest.start, segment.start + order), min(rest.stop + order, segment.stop))
            if tied.start < tied.stop:
                squares.append(errors[tied] ** 2)
                out[tied] = np.maximum(out[tied], np.sqrt(np.mean(squares[-1])))
    together = np.concatenate(squares)
    return out, float(np.sqrt(np.mean(together))) if len(together) else 0.0


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
