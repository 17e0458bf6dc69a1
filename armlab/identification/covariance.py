"""Covariance of estimates whose errors are correlated in time and between joints.

A filter, a controller and effects that the model leaves out correlate neighbouring errors. Intervals that take errors
as independent are far too short. This module takes the larger of two variances, parameter by parameter. Newey and
West 1987 (lag of Andrews 1991) holds for errors whose size changes with the motion, but is too small in short runs.
Hannan 1963 holds for errors of any colour whose size does not change.
"""

from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from armlab.common.arrays import Array
from armlab.common.probabilities import normal_quantile, student_quantile
from armlab.identification.estimators.least_squares import Estimate
from armlab.identification.regression import Regression

CONFIDENCE = 0.95
MIN_LAG_PERIODS = 2.0  # of the filter's cut-off, within the lag
MAX_MEMORY_PERIODS = 6.0  # of the filter's cut-off: how far the colour of steady errors is followed
MAX_LAG_SHARE = 0.1  # of the longest run


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Covariance (columns, columns), and the factor from a standard error to half an interval.

    lag_s: time over which errors are taken as correlated.
    """

    covariance: Array
    factor: float
    lag_s: float

    @property
    def standard_errors(self) -> Array:
        """(columns,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0))


def uncertainty(data: Regression, estimate: Estimate) -> Uncertainty:
    """Covariance of an estimate that holds for correlated, uneven errors."""
    scores = _score_rows(data, estimate)
    lag = _score_lag(data, scores)
    parts = np.split(scores, np.cumsum(data.lengths)[:-1])
    uneven = np.sum([_bartlett_variance(part, lag) for part in parts], axis=0)
    # each fitted column takes an independent stretch of error out of the residual
    stretches = data.joints * data.samples / _samples_between_independent_errors(data, estimate)
    spare = stretches / max(stretches - len(estimate.values), 1.0)
    information = np.zeros_like(uneven) if estimate.information is None else estimate.information
    covariance = estimate.bread @ (spare * uneven + information) @ estimate.bread.T
    stationary = spare * _stationary_score_variance(data, estimate) + information
    steady = estimate.bread @ stationary @ estimate.bread.T
    degrees = max(1.5 * data.samples / lag, 2.0)  # of Bartlett's kernel, Priestley 1981, table 6.2
    factor = student_quantile((1 + CONFIDENCE) / 2, degrees)
    raised = _standard_error_ratio(steady, covariance) * normal_quantile((1 + CONFIDENCE) / 2) / factor
    scale = np.maximum(raised, 1.0)
    return Uncertainty(covariance * np.outer(scale, scale), factor, lag / data.rate_hz)


def _standard_error_ratio(above: Array, below: Array) -> Array:
    """Ratio of standard errors, 1 where there are none."""
    variance = np.diag(below)
    return np.sqrt(np.maximum(np.diag(above), 0) / np.where(variance > 0, variance, np.inf))


def _stationary_score_variance(data: Regression, estimate: Estimate) -> Array:
    """Variance of the summed scores if each joint's error is a stationary process, (columns, columns)."""
    residuals = data.residuals(estimate.values)
    instruments = estimate.instruments.reshape(data.samples, data.joints, -1)
    size = next_fast_len(2 * max(data.lengths), real=True)
    memory = min(int(MAX_MEMORY_PERIODS * data.correlation_s * data.rate_hz), max(data.lengths) - 1)
    out = np.zeros(estimate.bread.shape)
    ends = np.cumsum((0, *data.lengths))
    for joint in range(data.joints):
        active = np.flatnonzero(np.any(instruments[:, joint] != 0, axis=0))
        spectrum = _error_spectrum(np.split(residuals[:, joint], ends[1:-1]), size, memory)
        for part in np.split(instruments[:, joint, active], ends[1:-1]):
            waves = rfft(part, size, axis=0)
            out[np.ix_(active, active)] += ((waves.conj().T * spectrum) @ waves).real / size
    return out


def _error_spectrum(errors: list[Array], size: int, memory: int) -> Array:
    """Power of the errors at the frequencies of a real transform, both sides added; Parzen's window."""
    powers = np.sum([np.abs(rfft(error, size)) ** 2 for error in errors], axis=0)
    products = irfft(powers, size)
    lag = np.minimum(np.arange(size), size - np.arange(size)) / (memory + 1)
    window = np.where(lag <= 0.5, 1 - 6 * lag**2 + 6 * lag**3, 2 * np.maximum(1 - lag, 0) ** 3)
    spectrum = np.maximum(rfft(products * window).real, 0) / sum(map(len, errors))
    spectrum[1 : (size + 1) // 2] *= 2
    return np.asarray(spectrum)


def _score_rows(data: Regression, estimate: Estimate) -> Array:
    """Sum over the joints of instrument times residual, (samples, columns)."""
    products = estimate.instruments * data.residuals(estimate.values).ravel()[:, None]
    return np.asarray(products.reshape(data.samples, data.joints, -1).sum(axis=1))


def _score_lag(data: Regression, scores: Array) -> int:
    """Andrews 1991, eq. 6.2 and 6.4 for Bartlett's kernel, at least the memory of the filter, in samples."""
    before, after = scores[:-1], scores[1:]
    power = np.sum(before**2, axis=0)
    used = power > 0
    slope = np.clip(np.sum(before * after, axis=0)[used] / power[used], -0.97, 0.97)
    alpha = np.median(4 * slope**2 / ((1 - slope) ** 2 * (1 + slope) ** 2)) if used.any() else 0.0
    andrews = 1.1447 * (alpha * len(scores)) ** (1 / 3)
    filtered = MIN_LAG_PERIODS * data.correlation_s * data.rate_hz
    return int(np.clip(max(andrews, filtered), 1, max(MAX_LAG_SHARE * max(data.lengths), 1)))


def _bartlett_variance(scores: Array, lag: int) -> Array:
    """Weighted autocovariances of scores (samples, columns), as the mean over sliding sums of `lag` rows."""
    padded = np.vstack([np.zeros((lag, scores.shape[1])), scores, np.zeros((lag - 1, scores.shape[1]))])
    total = np.cumsum(padded, axis=0)
    sums = total[lag:] - total[:-lag]
    return np.asarray(sums.T @ sums / lag)


def _samples_between_independent_errors(data: Regression, estimate: Estimate) -> float:
    """Samples between independent errors: the integrated correlation of the residuals."""
    residuals = data.residuals(estimate.values)
    power = float(np.sum(residuals**2)) or 1.0
    lags = max(int(MIN_LAG_PERIODS * data.correlation_s * data.rate_hz), 1)
    ties = [float(np.sum(residuals[lag:] * residuals[:-lag])) / power for lag in range(1, lags + 1)]
    return float(np.clip(1 + 2 * sum(max(tie, 0.0) for tie in ties), 1, data.samples / 4))
