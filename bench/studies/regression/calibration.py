"""Calibration of the regression check: its false-alarm rate, and its power against shifts and defects.

A run is a draw of repetitions without replacement from a bank of trials. All algorithms of a problem use the same
repetitions, because they share their first populations.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from armlab.common.files import write_whole
from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.statistics import adjust_by_holm
from armlab.common.streams import named_generator
from bench.plan import Entry
from bench.provenance import provenance
from bench.studies.regression.check import CheckVerdict, judge_run, p_values
from bench.studies.regression.defects import DEFECTS, run_ends_with_defect
from bench.studies.regression.sweep import Baseline, Cell, Ends, Progress, Sample, Sweep, plan_entries, run_entries

LOG10_SHIFTS = (-0.15, -0.1, -0.07, -0.05, -0.03, -0.02, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15)  # of log10 cond
DefectRun = Callable[[str, Sequence[Entry]], Ends]


@dataclass(frozen=True)
class DefectResult:
    """verdict: of the fixed run under the defect. power: share of drawn runs that raise an alarm, in any cell and by
    cell.
    """

    verdict: CheckVerdict
    power: float
    power_by_cell: Mapping[Cell, float]


@dataclass(frozen=True)
class Calibration:
    """Shares of runs that raise an alarm.

    false_alarms: runs of unchanged code against the committed baseline; false_alarms_of_drawn_baselines: against a
    baseline of the same size, drawn anew for each run. power: by shift of log10 cond in a single cell, that cell's own
    alarm.
    """

    runs: int
    rate: float
    false_alarms: float
    false_alarms_of_drawn_baselines: float
    power: Mapping[float, Mapping[Cell, float]]
    verdict: CheckVerdict
    defects: Mapping[str, DefectResult]


def calibrate(sweep: Sweep, baseline: Baseline, workers: int, progress: Progress) -> Calibration:
    """Run the banks and the defects, and draw from them."""
    bank = run_entries(plan_entries(sweep, sweep.calibration), workers, progress)
    fixed = run_entries(plan_entries(sweep), workers, progress)
    run_defect = partial(run_ends_with_defect, workers=workers, progress=progress)
    drawn = _draw_runs(sweep, bank, sweep.repetitions)
    p = p_values(_stack_ends(baseline.ends, drawn)[None], _stack_runs(drawn))
    return Calibration(
        runs=sweep.calibration.runs,
        rate=sweep.false_alarm_rate,
        false_alarms=float(_find_alarms(p, sweep).any(axis=1).mean()),
        false_alarms_of_drawn_baselines=_false_alarms_of_drawn_baselines(sweep, bank),
        power={shift: _power_of_shift(sweep, baseline, drawn, p, shift) for shift in LOG10_SHIFTS},
        verdict=judge_run(baseline, fixed, sweep.false_alarm_rate),
        defects={
            name: _try_defect(name, sweep, baseline, fixed, drawn, run_defect) for name in _relevant_defects(sweep)
        },
    )


def planned_trials(sweep: Sweep) -> int:
    """How many trials `calibrate` runs."""
    algorithms = _algorithm_names(sweep)
    defective = sum(len(algorithms & set(defect.algorithms)) for defect in DEFECTS.values())
    whole = sweep.calibration.repetitions + sweep.repetitions
    part = sweep.calibration.defect_repetitions + sweep.repetitions
    return len(sweep.problem) * (len(algorithms) * whole + defective * part)


def _relevant_defects(sweep: Sweep) -> list[str]:
    """The defects of algorithms that take part."""
    return [name for name, defect in DEFECTS.items() if _algorithm_names(sweep) & set(defect.algorithms)]


def _algorithm_names(sweep: Sweep) -> set[str]:
    return {choice.name for choice in sweep.algorithms}


def _draw_runs(sweep: Sweep, bank: Ends, count: int, purpose: str = "run") -> Ends:
    """Runs (runs, count) of each cell, drawn from its bank (bank,)."""
    size = len(next(iter(bank.values())))
    problems = dict.fromkeys(cell.problem for cell in bank)
    chosen = {}
    for problem in problems:
        rng = named_generator("regression", purpose, sweep.calibration.seed, problem)
        order = rng.permuted(np.tile(np.arange(size), (sweep.calibration.runs, 1)), axis=1)
        chosen[problem] = order[:, :count]
    return {cell: ends[chosen[cell.problem]] for cell, ends in bank.items()}


def _false_alarms_of_drawn_baselines(sweep: Sweep, bank: Ends) -> float:
    """Share of false alarms where baseline and run are drawn from the bank, without a common trial."""
    n, m = sweep.repetitions, sweep.baseline.repetitions
    both = _stack_runs(_draw_runs(sweep, bank, n + m, "run and baseline"))
    return float(_find_alarms(p_values(both[..., n:], both[..., :n]), sweep).any(axis=1).mean())


def _power_of_shift(sweep: Sweep, baseline: Baseline, drawn: Ends, p: Array, shift: float) -> dict[Cell, float]:
    """Share of runs that detect a shift of one cell's log10 cond, by cell."""
    power = {}
    for index, cell in enumerate(drawn):
        shifted = p.copy()
        shifted[:, index] = p_values(baseline.ends[cell], drawn[cell] * 10.0**shift)
        power[cell] = float(_find_alarms(shifted, sweep)[:, index].mean())
    return power


def _try_defect(name: str, sweep: Sweep, baseline: Baseline, fixed: Ends, drawn: Ends, run: DefectRun) -> DefectResult:
    """The fixed run under the defect, and draws from a bank of such runs; other cells are as without it."""
    verdict = judge_run(baseline, fixed | run(name, plan_entries(sweep)), sweep.false_alarm_rate)
    sample = Sample(repetitions=sweep.calibration.defect_repetitions, seed=sweep.calibration.seed)
    bank = run(name, plan_entries(sweep, sample))
    runs = drawn | _draw_runs(sweep, bank, sweep.repetitions, name)
    alarms = _find_alarms(p_values(_stack_ends(baseline.ends, runs)[None], _stack_runs(runs)), sweep)
    by_cell = {cell: float(alarms[:, list(runs).index(cell)].mean()) for cell in bank}
    return DefectResult(verdict, float(alarms.any(axis=1).mean()), by_cell)


def _find_alarms(p: Array, sweep: Sweep) -> Array:
    """Which cells raise an alarm (runs, cells), of p-values (runs, cells, 2)."""
    adjusted = adjust_by_holm(p.reshape(len(p), -1)).reshape(p.shape)
    return np.asarray(adjusted.min(axis=-1) <= sweep.false_alarm_rate)


def _stack_ends(ends: Ends, order: Ends) -> Array:
    return np.stack([ends[cell] for cell in order])


def _stack_runs(runs: Ends) -> Array:
    """Runs (runs, cells, n)."""
    return np.stack(list(runs.values()), axis=1)


def write_calibration(folder: Path, sweep: Sweep, calibration: Calibration) -> list[Path]:
    """Write both files; returns their paths."""
    paths = [folder / "regression_calibration.json", folder / "regression_calibration.md"]
    write_whole(paths[0], json.dumps(_calibration_content(sweep, calibration), indent=1) + "\n")
    write_whole(paths[1], _calibration_page(sweep, calibration))
    return paths


def _calibration_content(sweep: Sweep, calibration: Calibration) -> dict[str, Any]:
    return {
        "configuration": sweep.model_dump(mode="json", exclude_none=True),
        "runs": calibration.runs,
        "false_alarm_rate": {
            "nominal": calibration.rate,
            "committed_baseline": calibration.false_alarms,
            "redrawn_baseline": calibration.false_alarms_of_drawn_baselines,
        },
        "power": {f"{shift:+g}": _shares_by_name(power) for shift, power in calibration.power.items()},
        "defects": {
            name: {
                "found_by_fixed_run": not found.verdict.passed,
                "power": found.power,
                "power_by_cell": _shares_by_name(found.power_by_cell),
            }
            for name, found in calibration.defects.items()
        },
        "provenance": json.loads(provenance()),
    }


def _shares_by_name(shares: Mapping[Cell, float]) -> dict[str, float]:
    return {f"{cell.algorithm} on {cell.problem}": share for cell, share in shares.items()}


def _calibration_page(sweep: Sweep, calibration: Calibration) -> str:
    return markdown_page(
        "Calibration of the regression check",
        f"{calibration.runs} runs of {sweep.repetitions} repetitions, drawn from {sweep.calibration.repetitions} "
        "trials of unchanged code a cell with a seed of their own, against a baseline of "
        f"{sweep.baseline.repetitions}. "
        "Written by `armlab tools regression --calibrate`.",
        "## False alarms",
        f"Nominal rate of a whole check: {calibration.rate:g}. Share of runs with any alarm: "
        f"{calibration.false_alarms:.2%} against the committed baseline, "
        f"{calibration.false_alarms_of_drawn_baselines:.2%} where the baseline "
        "is drawn anew for each run.",
        "## Power against a shift",
        "Share of runs in which a cell raises the alarm when log10 cond of that cell alone is shifted.",
        _power_table(calibration.power),
        "## The fixed run of unchanged code",
        _code_block(calibration.verdict.lines()),
        "## Defects put into the code",
        "The fixed run under each defect, as printed; power: share of drawn runs with an alarm, "
        f"from {sweep.calibration.defect_repetitions} defective trials a cell. A defect of the observation matrix is "
        "run with two algorithms only, the others being taken as unchanged: the power is a lower bound.",
        *(_defect_section(name, found) for name, found in calibration.defects.items()),
    )


def _power_table(power: Mapping[float, Mapping[Cell, float]]) -> str:
    headings = ["problem", "algorithm", *(f"{shift:+g}" for shift in power)]
    rows = [[*cell, *(f"{shares[cell]:.2f}" for shares in power.values())] for cell in next(iter(power.values()))]
    return markdown_table(headings, rows)


def _defect_section(name: str, found: DefectResult) -> str:
    shares = ", ".join(f"{share:.3f} for {cell}" for cell, share in _shares_by_name(found.power_by_cell).items())
    return "\n\n".join(
        [
            f"### {name}: {DEFECTS[name].what}",
            _code_block(found.verdict.sentences()),
            f"Power {found.power:.3f}: {shares}.",
        ]
    )


def _code_block(lines: list[str]) -> str:
    return "\n".join(["```", *lines, "```"])
