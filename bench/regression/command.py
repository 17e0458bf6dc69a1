"""The three things that `armlab regression` does, each as the lines that it prints and an exit code."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from bench.experiment import ProgressBar
from bench.files import check_folder
from bench.regression.baseline import Baseline, read_baseline, write_baseline
from bench.regression.guard import judge
from bench.regression.sweep import entries_of, read_sweep, run_entries

BASELINE = "regression_baseline.json"


@dataclass(frozen=True)
class Report:
    """What to print, and the exit code: 0 passed or written, 1 a regression."""

    lines: Sequence[str]
    exit_code: int = 0


@dataclass(frozen=True)
class Regression:
    """The check of one configuration, with its baseline in the folder `results`.

    Every method raises InputError, in one line, for bad input, StoppedError and TrialsFailedError.
    """

    config: Path
    results: Path
    workers: int
    bar: ProgressBar

    def check(self) -> Report:
        """Run the fixed sweep and compare it with the baseline."""
        sweep = read_sweep(self.config)
        baseline = read_baseline(self.results / BASELINE, sweep)
        entries = entries_of(sweep)
        with self.bar(len(entries), 0) as progress:
            verdict = judge(baseline, run_entries(entries, self.workers, progress.update), sweep.false_alarm_rate)
        return Report(verdict.lines(), 0 if verdict.passed else 1)

    def update_baseline(self) -> Report:
        """Make the baseline anew from the present code, and check that the fixed run passes against it."""
        sweep = read_sweep(self.config)
        check_folder(self.results, "regression_baseline", "")
        ends, fixed = entries_of(sweep, sweep.baseline), entries_of(sweep)
        with self.bar(len(ends) + len(fixed), 0) as progress:
            baseline = Baseline(
                run_entries(ends, self.workers, progress.update), run_entries(fixed, self.workers, progress.update)
            )
        path = self.results / BASELINE
        write_baseline(path, sweep, baseline)
        verdict = judge(baseline, baseline.fixed_run, sweep.false_alarm_rate)
        return Report([f"wrote {path}", *verdict.lines()], 0 if verdict.passed else 1)

    def calibrate(self) -> Report:
        """Compute the check's false-alarm rate and power, and write them down."""
        from bench.regression.calibration import (
            calibrate,
            planned_trials,
        )  # brings unittest.mock, which a check does not need
        from bench.regression.calibration_report import write_calibration

        sweep = read_sweep(self.config)
        baseline = read_baseline(self.results / BASELINE, sweep)
        check_folder(self.results, "regression_calibration", "")
        with self.bar(planned_trials(sweep), 0) as progress:
            calibration = calibrate(sweep, baseline, self.workers, progress.update)
        return Report([f"wrote {path}" for path in write_calibration(self.results, sweep, calibration)])
