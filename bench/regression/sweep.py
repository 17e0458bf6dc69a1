"""What the check runs: its configuration, and the ends of the searches that it compares."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from algorithms.contract import Array
from bench.config import Experiment, PositiveInt
from bench.outcome import Outcome
from bench.plan import Entry, plan
from bench.runner import run_missing
from bench.statistics import is_feasible
from bench.store import open_store
from problem.settings import Settings, validate
from problem.yaml_input import read_yaml

DIGITS = 9  # significant ones that are kept and compared: rounding of another processor seldom reaches them

Seed = Annotated[int, Field(ge=0)]
Progress = Callable[[int], object]


class Cell(NamedTuple):
    """What is compared: one algorithm on one problem, by their labels."""

    problem: str
    algorithm: str


Ends = dict[Cell, Array]
"""Condition numbers at the ends of the repetitions (n,) of each cell; an infeasible end is infinite."""


class Sample(Settings):
    """Repetitions of every cell from one seed."""

    repetitions: PositiveInt
    seed: Seed


class Calibration(Sample):
    """A bank of trials of unchanged code, and one of `defect_repetitions` of each defect; runs: drawn from them."""

    defect_repetitions: PositiveInt
    runs: PositiveInt


class Sweep(Experiment):
    """An experiment that is compared with a baseline of the same experiment from another seed.

    false_alarm_rate: chance that unchanged searches with new random numbers raise any alarm at all.
    """

    false_alarm_rate: Annotated[float, Field(gt=0, lt=1)]
    baseline: Sample
    calibration: Calibration
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


def entries_of(sweep: Sweep, sample: Sample | None = None) -> Sequence[Entry]:
    """The trials of the fixed run itself, or of another sample of the same cells."""
    other = {} if sample is None else {"seed": sample.seed, "repetitions": sample.repetitions}
    return plan(sweep.model_copy(update=other), f"configuration '{sweep.name}'")


def run_entries(entries: Sequence[Entry], workers: int, progress: Progress) -> Ends:
    """Run all trials anew, in a store of their own that nothing was kept in before."""
    with TemporaryDirectory() as folder, open_store(Path(folder) / "runs.sqlite") as store:
        run_missing(entries, store, workers, progress)
        return ends_of((entry, store.get(entry.key)) for entry in entries)


def ends_of(outcomes: Iterable[tuple[Entry, Outcome]]) -> Ends:
    """The ends by cell, in the order of the repetitions."""
    ends: dict[Cell, list[float]] = {}
    for entry, outcome in outcomes:
        feasible = is_feasible(np.array(outcome.value), np.array(outcome.violation))
        end = outcome.value if feasible else np.inf
        ends.setdefault(Cell(entry.problem, entry.algorithm), []).append(float(f"{end:.{DIGITS}g}"))
    return {cell: np.array(values) for cell, values in ends.items()}
