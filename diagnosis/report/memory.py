"""How white is what is left? The time over which an error remembers itself, beside that of noise through the filter."""

import numpy as np

from armlab.diagnosis.data import Observed
from recordings.run import Array

LONGEST_S = 1.0
WHITE = 3.0  # times the memory of noise through the filter: more is structure


def memory_seconds(residual: Array, joint: int, observed: Observed) -> float:
    """Time over which the held-out error (rows,) of a joint (from 0) is tied to itself, s: half its correlations' sum.

    White noise of infinite bandwidth has zero; white noise through a low-pass of cut-off f has about 1 / (4 f).
    """
    lags = max(int(LONGEST_S * observed.rate_hz), 1)
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


def filter_memory_seconds(observed: Observed) -> float:
    """The same of white noise that passed the torque's filter."""
    return 1 / (4 * observed.cutoff_hz)


def white(residual: Array, joint: int, observed: Observed) -> bool:
    """Whether what is left of a joint (from 0) may be noise that passed the torque's filter."""
    return memory_seconds(residual, joint, observed) <= WHITE * filter_memory_seconds(observed)
