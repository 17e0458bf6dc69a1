"""The area under the convergence curve: how good a run is at every moment, not only at its end."""

import numpy as np

from algorithms.contract import Array
from bench.statistics.targets import Run


def area_under_curve(run: Run, best: float, worst: float, budget: int) -> float:
    """Mean over the evaluations of log10 of the best so far, scaled to 0 at `best` and 1 at `worst`.

    Smaller is better; 1 minus it is IOHprofiler's area over the convergence curve. Values beyond the two count as the
    two, as does what is not known yet as `worst`.
    """
    level = np.append(1.0, _scaled(run.best, best, worst))
    ends = np.concatenate([[0.0], np.minimum(run.evaluations, budget), [float(budget)]])
    return float((level * np.diff(ends)).sum() / budget)


def _scaled(values: Array, best: float, worst: float) -> Array:
    low, high = np.log10(best), np.log10(worst)
    with np.errstate(divide="ignore"):
        logs = np.log10(values)
    if high <= low:
        return np.where(logs <= low, 0.0, 1.0)
    return np.asarray(np.clip((logs - low) / (high - low), 0.0, 1.0))
