"""The committed baseline: the ends of many repetitions, those of the fixed run, and where they come from."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from algorithms.contract import Array
from bench.files import write_whole
from bench.provenance import provenance
from bench.regression.sweep import Cell, Ends, Sweep
from problem.errors import InputError

SCHEMA = "regression-baseline/1"
_REMEDY = "make it anew with `armlab regression --update-baseline`"


@dataclass(frozen=True)
class Baseline:
    """ends: (m,) of each cell, from the baseline's own seed. fixed_run: (n,), what the check itself gave then."""

    ends: Ends
    fixed_run: Ends


def write_baseline(path: Path, sweep: Sweep, baseline: Baseline) -> None:
    """Write the baseline with its configuration and provenance, a line for each sample of each cell."""
    head = {"schema": SCHEMA, "configuration": _configuration(sweep), "provenance": json.loads(provenance())}
    cells = ",\n".join(_cell_text(cell, baseline) for cell in baseline.ends)
    text = json.dumps(head, indent=1, sort_keys=True).removesuffix("\n}")
    write_whole(path, f'{text},\n "cells": [\n{cells}\n ]\n}}\n')


def read_baseline(path: Path, sweep: Sweep) -> Baseline:
    """The baseline of that sweep; raises InputError if there is none, it is broken, or it is of another sweep."""
    try:
        content = json.loads(path.read_text())
    except FileNotFoundError:
        raise InputError(f"there is no baseline {path}: {_REMEDY}") from None
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read the baseline {path}: {error}") from None
    if not isinstance(content, dict) or content.get("schema") != SCHEMA:
        raise InputError(f"{path} is not a baseline of schema '{SCHEMA}': {_REMEDY}")
    _check_configuration(content.get("configuration"), sweep, path)
    try:
        baseline = Baseline(_ends(content, "baseline"), _ends(content, "fixed_run"))
    except (KeyError, TypeError, ValueError):
        raise InputError(f"'cells' in {path} are not as they were written: {_REMEDY}") from None
    if baseline.ends.keys() != set(sweep.cells):
        raise InputError(f"'cells' in {path} are not those of configuration '{sweep.name}': {_REMEDY}")
    return baseline


def _configuration(sweep: Sweep) -> dict[str, Any]:
    """What the file of the sweep says, but for the calibration; defaults of problems and algorithms stay out.

    A default that changes is a change of the code, which the check must see by what it does.
    """
    text = sweep.model_dump_json(exclude={"calibration"}, exclude_none=True)
    configuration: dict[str, Any] = json.loads(text)
    return configuration


def _check_configuration(recorded: Any, sweep: Sweep, path: Path) -> None:
    wanted = _configuration(sweep)
    if not isinstance(recorded, dict):
        raise InputError(f"'configuration' is missing in {path}: {_REMEDY}")
    for key in sorted(wanted.keys() | recorded.keys()):
        if wanted.get(key) != recorded.get(key):
            raise InputError(f"{path} was made with another '{key}' than configuration '{sweep.name}' has: {_REMEDY}")


def _cell_text(cell: Cell, baseline: Baseline) -> str:
    head = json.dumps(cell._asdict())[1:-1]
    samples = (("baseline", baseline.ends[cell]), ("fixed_run", baseline.fixed_run[cell]))
    lines = [f'   "{name}": {json.dumps(_numbers(ends))}' for name, ends in samples]
    return f"  {{{head},\n" + ",\n".join(lines) + "}"


def _numbers(ends: Array) -> list[float | None]:
    """Ascending; None, in JSON null, for an infeasible end."""
    return [float(end) if np.isfinite(end) else None for end in np.sort(ends)]


def _ends(content: dict[str, Any], sample: str) -> Ends:
    return {
        Cell(entry["problem"], entry["algorithm"]): np.array(
            [np.inf if end is None else float(end) for end in entry[sample]]
        )
        for entry in content["cells"]
    }
