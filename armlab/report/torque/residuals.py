"""The residuals that a report shows: held-out rows, the residual without a finding, binned means, and the
correlation time that tells whether a residual is white.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.diagnosis.result import Claim, Diagnosis
from armlab.diagnosis.torque.rows.data import Observed, Segment, rows_in
from armlab.identification.validation import filter_in_words

Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class ShownResiduals:
    """A diagnosis that has something to show: its runs, and the residuals (rows, joints), N m (N).

    given: of the simulation as it is, None where there is none.
    """

    observed: Observed
    refit: Array
    final: Array
    given: Array | None

    def held_out(self, joint: int) -> NDArray[np.bool_]:
        """Rows (rows,) that took no part in the fit, and in which a joint (from 0) moves."""
        return self.observed.rows_held_out(joint)

    def used(self, joint: int) -> Rows:
        """Numbers of the rows in which a joint (from 0) moves."""
        return np.flatnonzero(rows_in(self.observed.used(joint), self.observed.rows))

    def held_out_rms(self, residual: Array) -> Array:
        """Root mean square on held-out rows, (joints,)."""
        joints = range(residual.shape[1])
        return np.array([np.sqrt(np.mean(residual[self.held_out(joint), joint] ** 2)) for joint in joints])

    @property
    def filtered(self) -> str:
        """Which torque the residuals are of, in words: `filtered below 8 Hz`."""
        return filter_in_words([self.observed.cutoff_hz])

    @property
    def before(self) -> Array:
        """The residual before the diagnosis: of the simulation as given, else of the refitted links."""
        return self.refit if self.given is None else self.given


def select_residuals(diagnosis: Diagnosis) -> ShownResiduals | None:
    """What can be drawn of a diagnosis; None where nothing was fitted."""
    observed, refit, final = diagnosis.observed, diagnosis.refit, diagnosis.final
    if observed is None or refit is None or final is None:
        return None
    return ShownResiduals(observed, refit, final, None if diagnosis.simulation.kind == "refit" else diagnosis.nominal)


def residual_without(diagnosis: Diagnosis, claim: Claim, joint: int) -> Array:
    """Residual (rows,) at a joint (from 0) of the model found without this finding; an unknown is not in it."""
    assert diagnosis.final is not None
    left = diagnosis.final[:, joint]
    return left if claim.candidate is None else np.asarray(left + claim.prediction[:, joint])


def clearest_stretch(data: ShownResiduals, seconds: float) -> tuple[Segment, slice]:
    """The held-out segment and its rows, `seconds` long, in which the error of the model falls most."""
    width = max(int(seconds * data.observed.rate_hz), 10)
    scale = np.maximum(data.held_out_rms(data.before), 1e-300)
    gained = np.sum((data.before / scale) ** 2 - (data.final / scale) ** 2, axis=1)
    best: tuple[float, Segment, slice] | None = None
    for each in data.observed.of_role("validate"):
        count = min(width, each.stop - each.start)
        sums = np.convolve(gained[each.start : each.stop], np.ones(count), mode="valid")
        at = each.start + int(np.argmax(sums))
        if best is None or float(sums.max()) > best[0]:
            best = float(sums.max()), each, slice(at, at + count)
    assert best is not None
    return best[1], best[2]


def space_rows(rows: Rows, most: int) -> Rows:
    """At most `most` of the rows, evenly spaced."""
    return rows[np.unique(np.linspace(0, len(rows) - 1, min(most, len(rows))).astype(int))] if len(rows) else rows


def bin_means(x: Array, y: Array, bins: int) -> tuple[Array, Array, Array]:
    """Means of x and y, and the scatter of y, in bins of equally many rows; fewer where x is the same."""
    order = np.argsort(x, kind="stable")
    parts = [part for part in np.array_split(order, min(bins, len(x))) if len(part)]
    means = [(x[part].mean(), y[part].mean(), y[part].std()) for part in parts]
    across, height, scatter = np.array(means).T
    return across, height, scatter


MAX_LAG_SECONDS = 1.0
MAX_WHITE_RATIO = 3.0  # times the correlation time of noise through the filter: more is structure


def correlation_seconds(residual: Array, joint: int, observed: Observed) -> float:
    """Correlation time of the held-out error (rows,) of a joint (from 0), s: half the sum of its autocorrelations.

    White noise of infinite bandwidth has zero; white noise through a low-pass of cut-off f has about 1 / (4 f).
    """
    lags = max(int(MAX_LAG_SECONDS * observed.rate_hz), 1)
    products, power = np.zeros(lags + 1), 0.0
    for each in observed.of_role("validate", joint):
        part = residual[each.start : each.stop]
        part = part - part.mean()
        power += float(part @ part)
        products += [float(part[lag:] @ part[: len(part) - lag]) if lag < len(part) else 0.0 for lag in range(lags + 1)]
    if power <= 0:
        return 0.0
    correlation = products / power
    negative = np.flatnonzero(correlation < 0)
    end = int(negative[0]) if len(negative) else lags + 1
    return float((0.5 + correlation[1:end].sum()) / observed.rate_hz)


def filter_correlation_seconds(observed: Observed) -> float:
    """Correlation time of white noise that passed the filter of the torque, s."""
    return 1 / (4 * observed.cutoff_hz)


def is_white(residual: Array, joint: int, observed: Observed) -> bool:
    """Whether the residual of a joint (from 0) may be white noise that passed the filter of the torque."""
    return correlation_seconds(residual, joint, observed) <= MAX_WHITE_RATIO * filter_correlation_seconds(observed)
