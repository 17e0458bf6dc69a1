"""The sweep of the regression check, the ends that it compares, and the committed baseline."""

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.files import write_whole
from armlab.common.settings import Settings, read_yaml, validate
from bench.config import Experiment, PositiveInt
from bench.execute import Outcome
from bench.plan import Entry, plan_trials
from bench.provenance import provenance
from bench.run import run_missing
from bench.statistics import is_feasible
from bench.store import open_store

END_DIGITS = 9  # significant ones that are kept and compared: rounding of another processor seldom reaches them

Seed = Annotated[int, Field(ge=0)]
Progress = Callable[[int], object]


class Cell(NamedTuple):
    """One algorithm on one problem, by their labels."""

    problem: str
    algorithm: str


Ends = dict[Cell, Array]
"""Condition numbers at the ends of the repetitions (n,) of each cell; an infeasible end is infinite."""


class Sample(Settings):
    """Repetitions of every cell from one seed."""

    repetitions: PositiveInt
    seed: Seed


class CalibrationSettings(Sample):
    """A bank of trials of unchanged code, and one of `defect_repetitions` of each defect; runs: drawn from them."""

    defect_repetitions: PositiveInt
    runs: PositiveInt


class Sweep(Experiment):
    """An experiment that is compared with a baseline of the same experiment from another seed.

    false_alarm_rate: chance that unchanged searches with new random numbers raise any alarm at all.
    """

    false_alarm_rate: Annotated[float, Field(gt=0, lt=1)]
    baseline: Sample
    calibration: CalibrationSettings
    output: Literal["table"] = "table"

    @property
    def cells(self) -> list[Cell]:
        """All cells, in the order of the configuration."""
        algorithms = [choice.label or choice.name for choice in self.algorithms]
        return [Cell(problem.label, algorithm) for problem in self.problem for algorithm in algorithms]

    @model_validator(mode="after")
    def _one_cell_an_algorithm(self) -> Self:
        if len(self.swarm_size) > 1 or len(self.iterations or self.evaluations or ()) > 1:
            raise ValueError("should have one 'swarm_size' and one budget")
        return self

    @model_validator(mode="after")
    def _independent(self) -> Self:
        if len({self.seed, self.baseline.seed, self.calibration.seed}) < 3:
            raise ValueError("'seed', 'baseline.seed' and 'calibration.seed' should be three different numbers")
        return self

    @model_validator(mode="after")
    def _enough_to_draw_from(self) -> Self:
        if self.calibration.repetitions < self.baseline.repetitions + self.repetitions:
            raise ValueError("'calibration.repetitions' should be enough for a baseline and a run beside it")
        if self.calibration.defect_repetitions < self.repetitions:
            raise ValueError("'calibration.defect_repetitions' should be enough for a run")
        return self


def read_sweep(path: Path) -> Sweep:
    """The sweep in a YAML file; raises InputError, in one line, for any mistake in it."""
    return validate(Sweep, read_yaml(path), str(path))


def plan_entries(sweep: Sweep, sample: Sample | None = None) -> Sequence[Entry]:
    """The trials of the fixed run itself, or of another sample of the same cells."""
    other = {} if sample is None else {"seed": sample.seed, "repetitions": sample.repetitions}
    return plan_trials(sweep.model_copy(update=other), f"configuration '{sweep.name}'")


def run_entries(entries: Sequence[Entry], workers: int, progress: Progress) -> Ends:
    """Run all trials anew, in an empty store of their own."""
    with TemporaryDirectory() as folder, open_store(Path(folder) / "runs.sqlite") as store:
        run_missing(entries, store, workers, progress=progress)
        return group_ends((entry, store.get(entry.key)) for entry in entries)


def group_ends(outcomes: Iterable[tuple[Entry, Outcome]]) -> Ends:
    """The ends by cell, in the order of the repetitions."""
    ends: dict[Cell, list[float]] = {}
    for entry, outcome in outcomes:
        feasible = is_feasible(np.array(outcome.value), np.array(outcome.violation))
        end = outcome.value if feasible else np.inf
        ends.setdefault(Cell(entry.problem, entry.algorithm), []).append(float(f"{end:.{END_DIGITS}g}"))
    return {cell: np.array(values) for cell, values in ends.items()}


BASELINE_SCHEMA = "regression-baseline/1"
_BASELINE_REMEDY = "make it anew with `armlab tools regression --update-baseline`"


@dataclass(frozen=True)
class Baseline:
    """ends: (m,) of each cell, from the baseline's own seed. fixed_run: (n,), what the check itself gave then.

    kernels: of BLAS, and SIMD level, of the cells of algorithms that call LAPACK.
    """

    ends: Ends
    fixed_run: Ends
    kernels: dict[Cell, str] = field(default_factory=dict)


def write_baseline(path: Path, sweep: Sweep, baseline: Baseline, kept: Any = None) -> None:
    """Write the baseline with its configuration and provenance, a line for each sample of each cell.

    kept: provenance of the cells that another code made, where there are any.
    """
    head = {
        "schema": BASELINE_SCHEMA,
        "configuration": _sweep_configuration(sweep),
        "provenance": json.loads(provenance()),
    }
    head |= {"kept": kept} if kept else {}
    cells = ",\n".join(_cell_text(cell, baseline) for cell in baseline.ends)
    text = json.dumps(head, indent=1, sort_keys=True).removesuffix("\n}")
    write_whole(path, f'{text},\n "cells": [\n{cells}\n ]\n}}\n')


def read_baseline(path: Path, sweep: Sweep) -> Baseline:
    """The baseline of that sweep; raises InputError if there is none, it is broken, or it is of another sweep."""
    content = _read_content(path)
    _check_configuration(content.get("configuration"), sweep, path)
    baseline = _read_cells(content, path)
    if baseline.ends.keys() != set(sweep.cells):
        raise InputError(f"'cells' in {path} are not those of configuration '{sweep.name}': {_BASELINE_REMEDY}")
    return baseline


def read_part_of_baseline(path: Path, sweep: Sweep) -> tuple[Baseline, Any]:
    """A baseline that may lack problems and algorithms of the sweep, and its provenance.

    Raises InputError as `read_baseline` does, for every other difference.
    """
    content = _read_content(path)
    recorded, wanted = content.get("configuration"), _sweep_configuration(sweep)
    if isinstance(recorded, dict):
        for key in ("problem", "algorithms"):  # what is added may differ, what was there may not
            if all(entry in wanted[key] for entry in recorded.get(key, [])):
                recorded = recorded | {key: wanted[key]}
    _check_configuration(recorded, sweep, path)
    return _read_cells(content, path), content.get("kept") or content.get("provenance")


def _read_content(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text())
    except FileNotFoundError:
        raise InputError(f"there is no baseline {path}: {_BASELINE_REMEDY}") from None
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read the baseline {path}: {error}") from None
    if not isinstance(content, dict) or content.get("schema") != BASELINE_SCHEMA:
        raise InputError(f"{path} is not a baseline of schema '{BASELINE_SCHEMA}': {_BASELINE_REMEDY}")
    return content


def _read_cells(content: dict[str, Any], path: Path) -> Baseline:
    try:
        kernels = {_cell_of(entry): str(entry["kernels"]) for entry in content["cells"] if "kernels" in entry}
        return Baseline(_read_ends(content, "baseline"), _read_ends(content, "fixed_run"), kernels)
    except (KeyError, TypeError, ValueError):
        raise InputError(f"'cells' in {path} are not as they were written: {_BASELINE_REMEDY}") from None


def _sweep_configuration(sweep: Sweep) -> dict[str, Any]:
    """The content of the sweep's file without the calibration; defaults of problems and algorithms are left out.

    A changed default is a change of the code, which the check must detect by its effect.
    """
    text = sweep.model_dump_json(exclude={"calibration"}, exclude_none=True)
    configuration: dict[str, Any] = json.loads(text)
    return configuration


def _check_configuration(recorded: Any, sweep: Sweep, path: Path) -> None:
    wanted = _sweep_configuration(sweep)
    if not isinstance(recorded, dict):
        raise InputError(f"'configuration' is missing in {path}: {_BASELINE_REMEDY}")
    for key in sorted(wanted.keys() | recorded.keys()):
        if wanted.get(key) != recorded.get(key):
            raise InputError(
                f"{path} was made with another '{key}' than configuration '{sweep.name}' has: {_BASELINE_REMEDY}"
            )


def _cell_text(cell: Cell, baseline: Baseline) -> str:
    named = {"kernels": baseline.kernels[cell]} if cell in baseline.kernels else {}
    head = json.dumps(cell._asdict() | named)[1:-1]
    samples = (("baseline", baseline.ends[cell]), ("fixed_run", baseline.fixed_run[cell]))
    lines = [f'   "{name}": {json.dumps(_to_json_numbers(ends))}' for name, ends in samples]
    return f"  {{{head},\n" + ",\n".join(lines) + "}"


def _to_json_numbers(ends: Array) -> list[float | None]:
    """Ascending; None, in JSON null, for an infeasible end."""
    return [float(end) if np.isfinite(end) else None for end in np.sort(ends)]


def _cell_of(entry: dict[str, Any]) -> Cell:
    return Cell(entry["problem"], entry["algorithm"])


def _read_ends(content: dict[str, Any], sample: str) -> Ends:
    return {
        _cell_of(entry): np.array([np.inf if end is None else float(end) for end in entry[sample]])
        for entry in content["cells"]
    }
