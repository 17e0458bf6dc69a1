"""Axes: where a value stands, and the round numbers that are written beside it."""

from dataclasses import dataclass

import numpy as np

from recordings.run import Array

LOG_SPAN = 3.0  # factor below which a logarithmic axis is widened


@dataclass(frozen=True)
class Axis:
    """An axis from low to high; log: logarithmic, for positive values. label: what it is, with its unit."""

    label: str
    low: float
    high: float
    log: bool = False

    def at(self, values: Array | float) -> Array:
        """Places between 0 (low) and 1 (high)."""
        if self.log:
            inside = np.log(np.maximum(np.asarray(values, dtype=float), 1e-300))
            low, high = np.log(self.low), np.log(self.high)
            return np.asarray((inside - low) / (high - low))
        return np.asarray((np.asarray(values, dtype=float) - self.low) / (self.high - self.low))

    def ticks(self, most: int = 6) -> list[tuple[float, str]]:
        """Round values inside the axis, and how they are written."""
        values = self._log_ticks(most) if self.log else _round_steps(self.low, self.high, most)
        return [(value, f"{value:.6g}".replace("-", "−")) for value in values]

    def _log_ticks(self, most: int) -> list[float]:
        decades = np.arange(np.floor(np.log10(self.low)), np.ceil(np.log10(self.high)) + 1)
        for mantissas in ((1, 2, 5), (1, 3), (1,)):
            values = [float(f"{m * 10.0**d:.3g}") for d in decades for m in mantissas]
            inside = [value for value in values if self.low <= value <= self.high]
            if len(inside) <= most:
                return inside
        return inside[:: max(len(inside) // most, 1)]


def axis_for(label: str, *values: Array, zero: bool = False, log: bool = False) -> Axis:
    """An axis that holds all finite values with a little room; zero: it begins or ends at zero or beyond."""
    every = np.concatenate([np.ravel(np.asarray(each, dtype=float)) for each in values])
    every = every[np.isfinite(every) & ((every > 0) | (not log))]
    low, high = (float(every.min()), float(every.max())) if len(every) else (0.1, 1.0)
    if log:
        middle = np.sqrt(low * high)
        low, high = min(low, middle / LOG_SPAN**0.5), max(high, middle * LOG_SPAN**0.5)
        return Axis(label, low / 1.3, high * 1.3, log=True)
    if zero:
        low, high = min(low, 0.0), max(high, 0.0)
    room = 0.05 * (high - low) or 0.5 * abs(high) or 1.0
    return Axis(label, low - room * (low != 0 or not zero), high + room * (high != 0 or not zero))


def _round_steps(low: float, high: float, most: int) -> list[float]:
    rough = (high - low) / most
    power = 10.0 ** np.floor(np.log10(rough))
    step = next(m * power for m in (1, 2, 5, 10) if m * power >= rough)
    first = int(np.ceil(low / step - 1e-9))
    last = int(np.floor(high / step + 1e-9))
    return [float(f"{number * step:.12g}") for number in range(first, last + 1)]
