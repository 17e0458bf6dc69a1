"""The noise of kept rows, and the filter that makes it white: rows count what they are worth."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from recordings.run import Array

MEMORY = 2000  # rows after which noise has forgotten


@dataclass(frozen=True, eq=False)
class Whitening:
    """Per joint the prediction-error filter (order + 1,), first tap one, and the innovations' standard deviation."""

    taps: tuple[Array, ...]
    scales: tuple[float, ...]

    def __call__(self, rows: Array, joint: int) -> Array:
        """Consecutive rows (rows, columns) of a joint at unit variance; the first ones, without a past, are lost."""
        taps = self.taps[joint]
        return np.asarray(lfilter(taps, [1.0], rows, axis=0)[len(taps) - 1 :] / self.scales[joint])

    @property
    def level(self) -> Array:
        """Standard deviation of a row's noise at each joint, (joints,), N m."""
        impulse = np.zeros(MEMORY)
        impulse[0] = 1.0
        pairs = zip(self.taps, self.scales, strict=True)
        return np.array([scale * np.sqrt(np.sum(lfilter([1.0], taps, impulse) ** 2)) for taps, scale in pairs])
