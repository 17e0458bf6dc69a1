"""`results/regression_calibration.json` and `.md`."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bench.files import write_whole
from bench.provenance import provenance
from bench.regression.calibration import Calibration, DefectFound
from bench.regression.defects import DEFECTS
from bench.regression.sweep import Cell, Sweep


def write_calibration(folder: Path, sweep: Sweep, calibration: Calibration) -> list[Path]:
    """Write both files; returns their paths."""
    paths = [folder / "regression_calibration.json", folder / "regression_calibration.md"]
    write_whole(paths[0], json.dumps(_content(sweep, calibration), indent=1) + "\n")
    write_whole(paths[1], _page(sweep, calibration))
    return paths


def _content(sweep: Sweep, calibration: Calibration) -> dict[str, Any]:
    return {
        "configuration": sweep.model_dump(mode="json", exclude_none=True),
        "runs": calibration.runs,
        "false_alarm_rate": {
            "nominal": calibration.rate,
            "committed_baseline": calibration.false_alarms,
            "redrawn_baseline": calibration.redrawn,
        },
        "power": {f"{shift:+g}": _by_name(power) for shift, power in calibration.power.items()},
        "defects": {
            name: {
                "found_by_fixed_run": not found.verdict.passed,
                "power": found.power,
                "power_by_cell": _by_name(found.power_by_cell),
            }
            for name, found in calibration.defects.items()
        },
        "provenance": json.loads(provenance()),
    }


def _by_name(shares: Mapping[Cell, float]) -> dict[str, float]:
    return {f"{cell.algorithm} on {cell.problem}": share for cell, share in shares.items()}


def _page(sweep: Sweep, calibration: Calibration) -> str:
    sections = [
        "# Calibration of the regression check",
        f"{calibration.runs} runs of {sweep.repetitions} repetitions, drawn from {sweep.calibration.repetitions} "
        "trials of unchanged code a cell with a seed of their own, against a baseline of "
        f"{sweep.baseline.repetitions}. "
        "Written by `armlab regression --calibrate`.",
        "## False alarms",
        f"Nominal rate of a whole check: {calibration.rate:g}. Share of runs with any alarm: "
        f"{calibration.false_alarms:.2%} against the committed baseline, {calibration.redrawn:.2%} where the baseline "
        "is drawn anew for each run.",
        "## Power against a shift",
        "Share of runs in which a cell raises the alarm when log10 cond of that cell alone is shifted.",
        "\n".join(_power_table(calibration.power)),
        "## The fixed run of unchanged code",
        _quoted(calibration.verdict.lines()),
        "## Defects put into the code",
        "The fixed run under each defect, as printed; power: share of drawn runs with an alarm, "
        f"from {sweep.calibration.defect_repetitions} defective trials a cell. A defect of the observation matrix is "
        "run with two algorithms only, the others being taken as unchanged: the power is a lower bound.",
        *(_section(name, found) for name, found in calibration.defects.items()),
    ]
    return "\n\n".join(sections) + "\n"


def _power_table(power: Mapping[float, Mapping[Cell, float]]) -> list[str]:
    heads = ["problem", "algorithm", *(f"{shift:+g}" for shift in power)]
    rows = [[*cell, *(f"{shares[cell]:.2f}" for shares in power.values())] for cell in next(iter(power.values()))]
    return [f"| {' | '.join(line)} |" for line in (heads, ["---"] * len(heads), *rows)]


def _section(name: str, found: DefectFound) -> str:
    shares = ", ".join(f"{share:.3f} for {cell}" for cell, share in _by_name(found.power_by_cell).items())
    return "\n\n".join(
        [
            f"### {name}: {DEFECTS[name].what}",
            _quoted(found.verdict.sentences()),
            f"Power {found.power:.3f}: {shares}.",
        ]
    )


def _quoted(lines: list[str]) -> str:
    return "\n".join(["```", *lines, "```"])
