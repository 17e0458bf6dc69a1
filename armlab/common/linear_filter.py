"""Linear filters of second-order sections: thousands of columns pass them in a diagnosis.

scipy.signal has them, too; it filters one column after the other, and takes a quarter of a second to load.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from armlab.common._linear_filter import ffi, lib
from armlab.common.arrays import Array


@dataclass(frozen=True, eq=False)
class LinearFilter:
    """Sections in series, each b0, b1, b2, a1, a2.

    y[t] = b0 x[t] + b1 x[t - 1] + b2 x[t - 2] - a1 y[t - 1] - a2 y[t - 2]
    """

    sections: tuple[tuple[float, float, float, float, float], ...]

    def __post_init__(self) -> None:
        """Raises ValueError for more sections than the kernel has."""
        if len(self.sections) > lib.MAX_SECTIONS:
            raise ValueError(f"a filter has at most {lib.MAX_SECTIONS} sections, not {len(self.sections)}")

    @classmethod
    def first_order_lag(cls, keep: float) -> "LinearFilter":
        """y[t] = (1 - keep) x[t] + keep y[t - 1]."""
        return cls(((1 - keep, 0.0, 0.0, -keep, 0.0),))

    @classmethod
    def bilinear(cls, numerator: Sequence[float], denominator: Sequence[float], rate_hz: float) -> "LinearFilter":
        """A transfer function by the bilinear transform; both polynomials (3,) of s, the highest power first.

        rate_hz: of the samples.
        """
        powers = np.array([4 * rate_hz**2, 2 * rate_hz, 1.0])
        by_power = np.array([[1, -2, 1], [1, 0, -1], [1, 2, 1]])
        b0, b1, b2 = (powers * numerator) @ by_power
        a0, a1, a2 = (powers * denominator) @ by_power
        return cls(((b0 / a0, b1 / a0, b2 / a0, a1 / a0, a2 / a0),))

    @classmethod
    def butterworth(cls, order: int, cutoff_hz: float, rate_hz: float) -> "LinearFilter":
        """Low-pass of an even order, half power at the cut-off, by the bilinear transform."""
        turn = float(np.tan(np.pi * cutoff_hz / rate_hz))
        sections = []
        for pair in reversed(range(order // 2)):  # the most damped one first
            damping = 2 * turn * float(np.sin(np.pi * (2 * pair + 1) / (2 * order)))
            scale = 1 + damping + turn**2
            gain = turn**2 / scale
            sections.append((gain, 2 * gain, gain, 2 * (turn**2 - 1) / scale, (1 - damping + turn**2) / scale))
        return cls(tuple(sections))

    @cached_property
    def settled(self) -> Array:
        """States (sections, 2) after an input of one that has lasted for a long time."""
        states, level = [], 1.0
        for b0, b1, b2, a1, a2 in self.sections:
            out = level * (b0 + b1 + b2) / (1 + a1 + a2)
            states.append((out - b0 * level, b2 * level - a2 * out))
            level = out
        return np.array(states)

    def forwards(self, signal: Array, start: Array | float = 0.0) -> Array:
        """The filtered signal (samples,). start: states before it, (sections, 2) or one for all."""
        values = np.ascontiguousarray(signal, dtype=np.float64)
        states = np.ascontiguousarray(np.broadcast_to(start, (len(self.sections), 2)), dtype=np.float64)
        out = np.empty(len(values))
        sections = len(self.sections)
        lib.filter_forwards(sections, self._data, _numbers(states), len(values), _numbers(values), _numbers(out))
        return out

    def both_ways(self, signal: Array, padding: int, rows: slice = slice(None)) -> Array:
        """A signal (samples, ...) filtered forwards and then backwards, which leaves no delay; the chosen rows of it.

        padding: how many samples are added at each end: the signal there, turned about its last point. Raises
        ValueError for a padding as long as the signal, and for rows in descending order.
        """
        samples = len(signal)
        if not 0 <= padding < samples:
            raise ValueError(f"a padding of {padding} samples takes a signal that is longer, not one of {samples}")
        columns = np.ascontiguousarray(signal, dtype=np.float64).reshape(samples, -1)
        first, end, step = rows.indices(samples)
        if step < 1:
            raise ValueError("rows should be in ascending order")
        kept = len(range(first, end, step))
        out = np.empty((kept, *signal.shape[1:]))
        scratch = np.empty((samples + 2 * padding) * lib.MAX_LANES)
        if out.size:
            lib.filter_both_ways(
                len(self.sections),
                self._data,
                _numbers(self.settled),
                samples,
                columns.shape[1],
                padding,
                _numbers(columns),
                first,
                step,
                kept,
                _numbers(scratch),
                _numbers(out),
            )
        return out

    @cached_property
    def _data(self) -> Any:
        return ffi.new("Section[]", self.sections)


def _numbers(array: Array) -> Any:
    """The memory of a contiguous array, as a C pointer."""
    return ffi.from_buffer("double[]", array)
