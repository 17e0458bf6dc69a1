"""What the page's charts draw, as JSON."""

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from algorithms.contract import Array
from bench.report.analysis import Cell, reached
from bench.statistics.profiles import performance_profile

_FACTORS = np.geomspace(1.0, 10.0, 60)
_MOMENTS = 60


def page_data(cells: Sequence[Cell], algorithms: Sequence[str]) -> str:
    """JSON text; numbers have four digits, a null is an infinite one."""
    content = {
        "algorithms": list(algorithms),
        "problems": [_problem(cell) for cell in cells],
        "overall": _overall(cells, algorithms),
    }
    return json.dumps(content, separators=(",", ":"), allow_nan=False)


def _problem(cell: Cell) -> dict[str, Any]:
    curves = {name: cell.progress[name].quartiles for name in cell.algorithms}
    return {
        "name": cell.label,
        "evaluations": _numbers(cell.moments),
        "convergence": {name: [_numbers(part) for part in parts] for name, parts in curves.items()},
        "reached": {name: _numbers(reached([cell], name, cell.moments)) for name in cell.algorithms},
        "ends": {name: _numbers(cell.ends(name)) for name in cell.algorithms},
        "boxes": {name: _numbers(_box(cell, name)) for name in cell.algorithms},
    }


def _overall(cells: Sequence[Cell], algorithms: Sequence[str]) -> dict[str, Any]:
    first = min(cell.moments[0] for cell in cells)
    moments = np.unique(np.geomspace(first, max(cell.moments[-1] for cell in cells), _MOMENTS).round())
    medians = [{name: cell.summary(name).median for name in cell.algorithms} for cell in cells]
    profile = performance_profile(pd.DataFrame(medians)[list(algorithms)], _FACTORS)
    return {
        "evaluations": _numbers(moments),
        "reached": {name: _numbers(reached(cells, name, moments)) for name in algorithms},
        "factors": _numbers(_FACTORS),
        "profile": {name: _numbers(profile[name].to_numpy()) for name in algorithms},
    }


def _box(cell: Cell, algorithm: str) -> Array:
    summary = cell.summary(algorithm)
    return np.array([summary.lower_quartile, summary.median, summary.upper_quartile])


def _numbers(values: Array) -> list[float | None]:
    return [float(f"{value:.4g}") if np.isfinite(value) else None for value in values.tolist()]
