"""How often the check cries wolf, and what it sees: runs drawn from banks of trials, and defects put in.

A run is a draw of repetitions without replacement, the same ones for all algorithms of a problem, since those
share their first populations.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from algorithms.contract import Array
from bench.plan import Entry
from bench.regression.baseline import Baseline
from bench.regression.comparison import p_values
from bench.regression.defects import DEFECTS
from bench.regression.guard import Verdict, judge
from bench.regression.inject import defective_ends
from bench.regression.sweep import Cell, Ends, Progress, Sample, Sweep, entries_of, run_entries
from bench.seeds import named_generator
from bench.statistics.holm import holm

SHIFTS = (-0.15, -0.1, -0.07, -0.05, -0.03, -0.02, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15)  # of log10 cond
DefectRun = Callable[[str, Sequence[Entry]], Ends]


@dataclass(frozen=True)
class DefectFound:
    """verdict: of the fixed run under the defect. power: share of drawn runs that raise an alarm, any and by cell."""

    verdict: Verdict
    power: float
    power_by_cell: Mapping[Cell, float]


@dataclass(frozen=True)
class Calibration:
    """Shares of runs that raise an alarm.

    false_alarms: runs of unchanged code against the committed baseline; redrawn: against a baseline of the same
    size, drawn anew for each run. power: by shift of log10 cond in a single cell, that cell's own alarm.
    """

    runs: int
    rate: float
    false_alarms: float
    redrawn: float
    power: Mapping[float, Mapping[Cell, float]]
    verdict: Verdict
    defects: Mapping[str, DefectFound]


def calibrate(sweep: Sweep, baseline: Baseline, workers: int, progress: Progress) -> Calibration:
    """Run the banks and the defects, and draw from them."""
    bank = run_entries(entries_of(sweep, sweep.calibration), workers, progress)
    fixed = run_entries(entries_of(sweep), workers, progress)
    run_defect = partial(defective_ends, workers=workers, progress=progress)
    drawn = _drawn(sweep, bank, sweep.repetitions)
    p = p_values(_stack(baseline.ends, drawn)[None], _stack_runs(drawn))
    return Calibration(
        runs=sweep.calibration.runs,
        rate=sweep.false_alarm_rate,
        false_alarms=float(_alarms(p, sweep).any(axis=1).mean()),
        redrawn=_redrawn(sweep, bank),
        power={shift: _power_of_shift(sweep, baseline, drawn, p, shift) for shift in SHIFTS},
        verdict=judge(baseline, fixed, sweep.false_alarm_rate),
        defects={name: _defect_found(name, sweep, baseline, fixed, drawn, run_defect) for name in _concerning(sweep)},
    )


def planned_trials(sweep: Sweep) -> int:
    """How many trials `calibrate` runs."""
    algorithms = _algorithms(sweep)
    defective = sum(len(algorithms & set(defect.algorithms)) for defect in DEFECTS.values())
    whole = sweep.calibration.repetitions + sweep.repetitions
    part = sweep.calibration.defect_repetitions + sweep.repetitions
    return len(sweep.problem) * (len(algorithms) * whole + defective * part)


def _concerning(sweep: Sweep) -> list[str]:
    """The defects of algorithms that take part."""
    return [name for name, defect in DEFECTS.items() if _algorithms(sweep) & set(defect.algorithms)]


def _algorithms(sweep: Sweep) -> set[str]:
    return {choice.name for choice in sweep.algorithms}


def _drawn(sweep: Sweep, bank: Ends, count: int, purpose: str = "run") -> Ends:
    """Runs (runs, count) of each cell, drawn from its bank (bank,)."""
    size = len(next(iter(bank.values())))
    problems = dict.fromkeys(cell.problem for cell in bank)
    chosen = {}
    for problem in problems:
        rng = named_generator("regression", purpose, sweep.calibration.seed, problem)
        order = rng.permuted(np.tile(np.arange(size), (sweep.calibration.runs, 1)), axis=1)
        chosen[problem] = order[:, :count]
    return {cell: ends[chosen[cell.problem]] for cell, ends in bank.items()}


def _redrawn(sweep: Sweep, bank: Ends) -> float:
    """Share of false alarms where baseline and run are drawn from the bank, without a common trial."""
    n, m = sweep.repetitions, sweep.baseline.repetitions
    both = _stack_runs(_drawn(sweep, bank, n + m, "run and baseline"))
    return float(_alarms(p_values(both[..., n:], both[..., :n]), sweep).any(axis=1).mean())


def _power_of_shift(sweep: Sweep, baseline: Baseline, drawn: Ends, p: Array, shift: float) -> dict[Cell, float]:
    """Share of runs that find one cell's log10 cond shifted, by cell."""
    power = {}
    for index, cell in enumerate(drawn):
        shifted = p.copy()
        shifted[:, index] = p_values(baseline.ends[cell], drawn[cell] * 10.0**shift)
        power[cell] = float(_alarms(shifted, sweep)[:, index].mean())
    return power


def _defect_found(name: str, sweep: Sweep, baseline: Baseline, fixed: Ends, drawn: Ends, run: DefectRun) -> DefectFound:
    """The fixed run under the defect, and draws from a bank of such runs; other cells are as without it."""
    verdict = judge(baseline, fixed | run(name, entries_of(sweep)), sweep.false_alarm_rate)
    sample = Sample(repetitions=sweep.calibration.defect_repetitions, seed=sweep.calibration.seed)
    bank = run(name, entries_of(sweep, sample))
    runs = drawn | _drawn(sweep, bank, sweep.repetitions, name)
    alarms = _alarms(p_values(_stack(baseline.ends, runs)[None], _stack_runs(runs)), sweep)
    by_cell = {cell: float(alarms[:, list(runs).index(cell)].mean()) for cell in bank}
    return DefectFound(verdict, float(alarms.any(axis=1).mean()), by_cell)


def _alarms(p: Array, sweep: Sweep) -> Array:
    """Which cells raise an alarm (runs, cells), of p-values (runs, cells, 2)."""
    adjusted = holm(p.reshape(len(p), -1)).reshape(p.shape)
    return np.asarray(adjusted.min(axis=-1) <= sweep.false_alarm_rate)


def _stack(ends: Ends, order: Ends) -> Array:
    return np.stack([ends[cell] for cell in order])


def _stack_runs(runs: Ends) -> Array:
    """Runs (runs, cells, n)."""
    return np.stack(list(runs.values()), axis=1)
