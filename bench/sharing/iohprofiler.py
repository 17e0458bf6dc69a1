"""A result set in the format of IOHprofiler, for IOHanalyzer, iohinspector and others (Doerr 2018, arXiv 1810.05281).

A folder an algorithm; in it, a problem's JSON file and its table of evaluations and best values. An infeasible best has
no number in that format: it is written as the largest double. Readers know a run by its row at evaluation 1, but runs
are kept population by population: that row has the same largest double, "nothing known yet".
"""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np

from algorithms.contract import Array
from bench.files import write_whole
from bench.sharing.result_set import ResultSet, runs_of
from bench.sharing.tidy import make_folder
from bench.statistics.targets import Run

NOTHING = float(np.finfo(float).max)
_VERSION = "0.3.5"  # of the format


def write_iohprofiler(results: ResultSet, folder: Path) -> list[Path]:
    """Write a result set into a folder; returns the JSON files."""
    written = []
    for number, (label, trials, curves) in enumerate(results.cells(), start=1):
        for algorithm, runs in runs_of(curves).items():
            place = folder / _slug(algorithm)
            written.append(
                _write(place, number, label, int(trials["dimension"].iloc[0]), algorithm, list(runs.values()))
            )
    return written


def _write(place: Path, number: int, label: str, dimension: int, algorithm: str, runs: list[Run]) -> Path:
    name = f"f{number}_{_slug(label)}"
    table = f"data_{name}/IOHprofiler_f{number}_DIM{dimension}.dat"
    make_folder(place / f"data_{name}")
    write_whole(place / table, "\n".join(["evaluations raw_y", *map(_rows, runs)]) + "\n")
    path = place / f"IOHprofiler_{name}.json"
    scenario = {"dimension": dimension, "path": table, "runs": [_summary(run) for run in runs]}
    write_whole(path, json.dumps(_header(number, label, algorithm) | {"scenarios": [scenario]}, indent=1) + "\n")
    return path


def _header(number: int, label: str, algorithm: str) -> dict[str, Any]:
    return {
        "version": _VERSION,
        "suite": "armlab",
        "function_id": number,
        "function_name": label,
        "maximization": False,
        "algorithm": {"name": algorithm, "info": "armlab"},
        "attributes": ["evaluations", "raw_y"],
    }


def _rows(run: Run) -> str:
    known = zip(run.evaluations.tolist(), _finite(run).tolist(), strict=True)
    return "\n".join([f"1 {NOTHING!r}", *(f"{evaluations:.0f} {value!r}" for evaluations, value in known)])


def _summary(run: Run) -> dict[str, Any]:
    best = _finite(run)
    first = int(best.argmin())
    found = {"evals": int(run.evaluations[first]), "y": float(best[first]), "x": []}
    return {"instance": 1, "evals": int(run.evaluations[-1]), "best": found}


def _finite(run: Run) -> Array:
    return np.asarray(np.minimum(run.best, NOTHING))


def _slug(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9.-]+", "_", text)
