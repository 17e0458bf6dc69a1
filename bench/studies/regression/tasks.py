"""The three tasks of `armlab tools regression`, each as the lines that it prints and an exit code."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from algorithms.registry import load
from bench.files import check_folder
from bench.fingerprint import calls_lapack
from bench.plan import Entry
from bench.processor import kernels_text
from bench.run import ProgressBar
from bench.studies.regression.check import judge_run
from bench.studies.regression.sweep import (
    Baseline,
    Cell,
    Ends,
    Sweep,
    plan_entries,
    read_baseline,
    read_part_of_baseline,
    read_sweep,
    run_entries,
    write_baseline,
)

BASELINE_FILE = "regression_baseline.json"


@dataclass(frozen=True)
class TaskReport:
    """What to print, and the exit code: 0 passed or written, 1 a regression."""

    lines: Sequence[str]
    exit_code: int = 0


@dataclass(frozen=True)
class RegressionTasks:
    """The check of one configuration, with its baseline in the folder `results`.

    Every method raises InputError, in one line, for bad input, StoppedError and TrialsFailedError.
    """

    config: Path
    results: Path
    workers: int
    bar: ProgressBar

    def check(self) -> TaskReport:
        """Run the fixed sweep and compare it with the baseline."""
        sweep = read_sweep(self.config)
        baseline = read_baseline(self.results / BASELINE_FILE, sweep)
        now = self._run(plan_entries(sweep))
        cells = lapack_cells(sweep)
        of_other_kernels = {cell for cell in cells if baseline.kernels.get(cell) != kernels_text()}
        verdict = judge_run(baseline, now, sweep.false_alarm_rate, of_other_kernels)
        return TaskReport([*verdict.lines(), *describe_kernels(cells, baseline.kernels)], 0 if verdict.passed else 1)

    def update_baseline(self) -> TaskReport:
        """Make the baseline anew from the present code, and check that the fixed run passes against it."""
        sweep = read_sweep(self.config)
        check_folder(self.results, "regression_baseline", "")
        ends, fixed = self._run(plan_entries(sweep, sweep.baseline)), self._run(plan_entries(sweep))
        baseline = Baseline(ends, fixed, dict.fromkeys(lapack_cells(sweep), kernels_text()))
        path = self.results / BASELINE_FILE
        write_baseline(path, sweep, baseline)
        verdict = judge_run(baseline, baseline.fixed_run, sweep.false_alarm_rate)
        return TaskReport([f"wrote {path}", *verdict.lines()], 0 if verdict.passed else 1)

    def extend_baseline(self) -> TaskReport:
        """Add the cells that the baseline lacks, and leave those that it has as they are.

        A cell that calls LAPACK and names no kernels gets those of this process where its fixed run comes out the same,
        else it is made anew. Whether the present code still gives the others is what `check` says afterwards.
        """
        sweep, path = read_sweep(self.config), self.results / BASELINE_FILE
        there, kept = read_part_of_baseline(path, sweep)
        unnamed = set(lapack_cells(sweep)) & there.ends.keys() - there.kernels.keys()
        again = self._run([entry for entry in plan_entries(sweep) if _cell(entry) in unnamed])
        found = {cell for cell, ends in again.items() if np.array_equal(np.sort(ends), there.fixed_run[cell])}
        known = there.ends.keys() - (unnamed - found)
        ends, fixed = (
            self._run([entry for entry in entries if _cell(entry) not in known])
            for entries in (plan_entries(sweep, sweep.baseline), plan_entries(sweep))
        )
        if not ends and not found:
            return TaskReport([f"{path} has every cell of configuration '{sweep.name}'"])
        samples = ({**there.ends, **ends}, {**there.fixed_run, **fixed})
        all_ends, fixed_run = ({cell: sample[cell] for cell in sweep.cells if cell in sample} for sample in samples)
        named = dict.fromkeys(found | (set(lapack_cells(sweep)) & ends.keys()), kernels_text())
        write_baseline(path, sweep, Baseline(all_ends, fixed_run, there.kernels | named), kept)
        return TaskReport([f"wrote {path}: {len(ends)} cells are new, {len(known)} as they were"])

    def _run(self, entries: Sequence[Entry]) -> Ends:
        """The ends of trials, run anew; nothing without trials."""
        if not entries:
            return {}
        with self.bar(len(entries), 0) as progress:
            return run_entries(entries, self.workers, progress.update)

    def calibrate(self) -> TaskReport:
        """Compute the check's false-alarm rate and power, and write them down."""
        from bench.studies.regression.calibration import (  # brings unittest.mock, which a check does not need
            calibrate,
            planned_trials,
            write_calibration,
        )

        sweep = read_sweep(self.config)
        baseline = read_baseline(self.results / BASELINE_FILE, sweep)
        check_folder(self.results, "regression_calibration", "")
        with self.bar(planned_trials(sweep), 0) as progress:
            calibration = calibrate(sweep, baseline, self.workers, progress.update)
        return TaskReport([f"wrote {path}" for path in write_calibration(self.results, sweep, calibration)])


def _cell(entry: Entry) -> Cell:
    return Cell(entry.problem, entry.algorithm)


def lapack_cells(sweep: Sweep) -> list[Cell]:
    """The cells of algorithms that call LAPACK, so that the kernels of BLAS decide their last digits and their path."""
    callers = {choice.label or choice.name for choice in sweep.algorithms if calls_lapack(load(choice.name))}
    return [cell for cell in sweep.cells if cell.algorithm in callers]


def describe_kernels(cells: Sequence[Cell], recorded: Mapping[Cell, str]) -> list[str]:
    """For which kernels the cells that call LAPACK hold, here and in the baseline, in words."""
    here = kernels_text()
    by_kernels: dict[str, list[str]] = {}
    for cell in cells:
        by_kernels.setdefault(recorded.get(cell, "kernels that it does not name"), []).append(str(cell.algorithm))
    return [
        f"Cells of {', '.join(dict.fromkeys(names))} call LAPACK: here they are of {here}, "
        + ("as those of the baseline." if there == here else f"those of the baseline of {there}.")
        for there, names in by_kernels.items()
    ]
