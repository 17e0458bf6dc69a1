"""Filters without phase shift, the same for the torque and for the columns of a regressor.

A low-pass rounds the jump of sign(velocity) at a reversal. A column that does not pass the filter of the torque
differs from the torque there, and a fit explains the difference by effects that do not exist. So one object filters
both.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import DataError
from armlab.common.linear_filter import LinearFilter

BUTTERWORTH_ORDER = 4  # of the Butterworth filter each way


@dataclass(frozen=True)
class Butterworth:
    """Butterworth filter run forwards and backwards (Gustafsson 1996 for the ends: odd extension here).

    Half gain at `cutoff_hz`; of the filtered rows it keeps each `step`-th one but `trim` at both ends.
    """

    rate_hz: float
    cutoff_hz: float
    samples: int
    step: int = 1

    def __post_init__(self) -> None:
        """Raises ValueError for a cut-off that the sampling rate cannot carry."""
        if not 0 < self.cutoff_hz < self.rate_hz / 2:
            limit = self.rate_hz / 2
            raise DataError(f"cut-off {self.cutoff_hz:g} Hz should lie between 0 and half the rate, {limit:g} Hz")

    @property
    def trim(self) -> int:
        """Rows at each end that the end of the recording disturbs: two periods of the cut-off."""
        return min(int(np.ceil(2 * self.rate_hz / self.cutoff_hz)), self.samples // 10)

    @property
    def rows(self) -> slice:
        """The rows that are kept."""
        return slice(self.trim, self.samples - self.trim, self.step)

    def __call__(self, signal: Array) -> Array:
        """The smoothed signal, rows near the ends left out and thinned: (kept, ...)."""
        return self._pass(signal, self.rows)

    def smooth(self, signal: Array) -> Array:
        """The smoothed signal, (samples, ...)."""
        return self._pass(signal, slice(None))

    def _pass(self, signal: Array, rows: slice) -> Array:
        padding = min(int(np.ceil(3 * self.rate_hz / self.cutoff_hz)), len(signal) - 1)
        return _low_pass(self.cutoff_hz, self.rate_hz).both_ways(signal, padding, rows)

    def response(self, frequency_hz: Array) -> Array:
        """Gain at each frequency: the squared one of a single pass, by the bilinear transform."""
        ratio = np.tan(np.pi * frequency_hz / self.rate_hz) / np.tan(np.pi * self.cutoff_hz / self.rate_hz)
        return np.asarray(1 / (1 + ratio ** (2 * BUTTERWORTH_ORDER)))


@lru_cache(maxsize=64)
def _low_pass(cutoff_hz: float, rate_hz: float) -> LinearFilter:
    return LinearFilter.butterworth(BUTTERWORTH_ORDER, cutoff_hz, rate_hz)
