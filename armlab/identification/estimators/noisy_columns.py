"""Estimators for encoder noise in the columns, which least squares takes as exact.

Noise in the columns draws parameters to zero. `column_noise` shows how a noise of the positions arrives in each row,
through the same smoothing, differentiation and filter. In closed loop the torque also answers to encoder noise, so
errors and columns are correlated; instrumental variables use columns of a motion without that noise (Janot, Vandanjon
and Gautier 2014).
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh

from armlab.common.arrays import Array
from armlab.common.errors import DataError
from armlab.identification.estimators.least_squares import Estimate, column_lengths, least_squares, pseudo_inverse
from armlab.identification.regression import Regression, refilter
from armlab.identification.structure import Structure
from armlab.recordings.cutoff import acceleration_spectrum, noise_level
from armlab.recordings.differentiate import Signals
from armlab.recordings.recording import Run


def reference_instruments(structure: Structure, signals: Signals) -> Array:
    """Columns along the reference motion, (kept * joints, columns).

    Raises ValueError for a run without `reference_position`.
    """
    run = signals.run
    if run.reference_position is None:
        raise DataError(f"{run.name} has no reference_position: instruments need a motion without noise")
    return structure.filtered(refilter(signals, replace(run, position=run.reference_position)))


@dataclass(frozen=True, eq=False)
class InstrumentalVariables:
    """instruments: (samples * joints, columns), correlated with the columns, not with the errors."""

    instruments: Array

    def __call__(self, data: Regression) -> Estimate:
        """The estimate at which the residual is orthogonal to the instruments."""
        left, right = column_lengths(self.instruments), column_lengths(data.matrix)
        cross = (self.instruments / left).T @ (data.matrix / right)
        bread = np.linalg.pinv(cross, rcond=1e-10) / right[:, None] / left
        return Estimate(bread @ (self.instruments.T @ data.torque), bread, self.instruments)


def encoder_deviation(run: Run) -> Array:
    """Standard deviation of white position noise at each joint, (joints,), from the highest frequencies."""
    frequency, spectrum, shape = acceleration_spectrum(run.position, run.rate_hz)
    density = noise_level(frequency, spectrum, shape, run.rate_hz)
    return np.asarray(np.sqrt(density * run.rate_hz / 2))


def column_noise(structure: Structure, signals: Signals, rng: np.random.Generator, draws: int = 4) -> Array:
    """What encoder noise does to the columns: (draws, kept * joints, columns) differences."""
    deviation, clean = encoder_deviation(signals.run), structure.filtered(signals)

    def disturbed() -> Array:
        noise = deviation * rng.standard_normal(signals.run.position.shape)
        run = replace(signals.run, position=signals.run.position + noise)
        return structure.filtered(refilter(signals, run))

    return np.stack([disturbed() - clean for _ in range(draws)])


@dataclass(frozen=True, eq=False)
class TotalLeastSquares:
    """Generalised total least squares (Van Huffel and Vandewalle 1989): noise of known shape in the columns.

    noise: (draws, samples * joints, columns) as `column_noise` gives it. Torque noise is estimated from the
    residual of least squares.
    """

    noise: Array

    def __call__(self, data: Regression) -> Estimate:
        """Least error over its variance, by the generalised eigenvalue problem of the augmented matrix."""
        start = least_squares(data.matrix, data.torque)
        weights = 1 / np.sqrt(np.mean(data.residuals(start) ** 2, axis=0))
        scaled = data.weighted(weights)
        rows = np.tile(weights, data.samples)[:, None]
        errors = np.mean([(draw * rows).T @ (draw * rows) for draw in self.noise], axis=0)
        size = data.matrix.shape[1]
        both = np.column_stack([scaled.matrix, scaled.torque])
        length = np.linalg.norm(both, axis=0)
        gram = both.T @ both / np.outer(length, length)
        spread = np.zeros_like(gram)
        spread[:size, :size] = errors / np.outer(length[:size], length[:size])
        spread[size, size] = len(scaled.torque) / length[size] ** 2
        vector = eigh(spread, gram)[1][:, -1] / length
        values = -vector[:size] / vector[size]
        level = float(np.sum((scaled.torque - scaled.matrix @ values) ** 2))
        ratio = level / (len(scaled.torque) + float(values @ errors @ values))
        bread = pseudo_inverse(scaled.matrix.T @ scaled.matrix - ratio * errors)
        return Estimate(values, bread, data.weighted(weights**2).matrix)


@dataclass(frozen=True, eq=False)
class MaximumLikelihood:
    """Noise on both sides, its variance row by row (Olsen, Swevers and Verdonck 2002).

    A row's variance is the torque's plus what the encoder noise does at these parameters; the normal
    equations lose the part that is noise times noise.
    """

    noise: Array
    rounds: int = 5

    def __call__(self, data: Regression) -> Estimate:
        """The estimate from these data."""
        values = least_squares(data.matrix, data.torque)
        for _ in range(self.rounds):
            weights = 1 / self._variance(data, values)
            weighted = data.matrix * weights[:, None]
            errors = np.mean([(draw * weights[:, None]).T @ draw for draw in self.noise], axis=0)
            bread = pseudo_inverse(weighted.T @ data.matrix - errors)
            values = bread @ (weighted.T @ data.torque)
        return Estimate(values, bread, weighted)

    def _variance(self, data: Regression, values: Array) -> Array:
        """Variance of each row: what the residual shows beyond the encoder's part is the torque's."""
        encoder = np.mean((self.noise @ values) ** 2, axis=0).reshape(-1, data.joints)
        whole = np.mean(data.residuals(values) ** 2, axis=0)
        torque = np.maximum(whole - encoder.mean(axis=0), 0.05 * whole)
        return np.asarray((encoder + torque).ravel())
