"""The speed report: `results/speed.json` and `results/speed.md`."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from armlab.common.files import write_whole
from armlab.common.markdown import markdown_table
from bench.provenance import provenance
from bench.studies.speed.evaluations import (
    compare_with_pinocchio,
    evaluations_per_second,
    growth_with_joints,
    growth_with_samples,
    growth_with_swarm_size,
    price_of_derivatives,
)
from bench.studies.speed.overhead import measure_overheads


def measure_speed() -> dict[str, Any]:
    """All figures of the speed report, measured now on one core."""
    return {
        "condition_number": compare_with_pinocchio(),
        "evaluations_per_second": evaluations_per_second(),
        "derivative_price": price_of_derivatives(),
        "overhead_us": measure_overheads(),
        "growth_us": {
            "samples": growth_with_samples(),
            "joints": growth_with_joints(),
            "swarm_size": growth_with_swarm_size(),
        },
        "provenance": json.loads(provenance()),
    }


def write_speed_report(folder: Path) -> list[Path]:
    """Measure, and write both files into `folder`; returns their paths."""
    figures = measure_speed()
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / "speed.json", folder / "speed.md"]
    write_whole(paths[0], json.dumps(_round_figures(figures), indent=1) + "\n")
    write_whole(paths[1], speed_page(figures))
    return paths


def speed_page(figures: Mapping[str, Any]) -> str:
    """The figures as Markdown tables."""
    condition, rates = figures["condition_number"], figures["evaluations_per_second"]
    return "\n".join(
        [
            "# Speed\n",
            f"One core of {figures['provenance']['processor']}, one BLAS thread; medians, the rivals taking turns.\n",
            "## From motion to condition number, 3 joints, 100 samples\n",
            markdown_table(["pipeline", "us a trajectory"], _condition_rows(condition)),
            f"\nRatio to Pinocchio: {condition['ratio_to_pinocchio']:.1f} (a population of 50 at once), "
            f"{condition['ratio_to_pinocchio_one_at_a_time']:.1f} (one trajectory at a time). Largest relative "
            f"difference of the results: {condition['largest_relative_difference']:.1e}.\n",
            "## Whole evaluations a second\n",
            markdown_table(["preset", "evaluations a second"], [(name, f"{rate:.0f}") for name, rate in rates.items()]),
            "\n## Price of derivatives\n",
            "A point with its derivatives, in evaluations: as experiments count it (the dimension plus one, what "
            "forward differences take), and as measured against an evaluation in a population of 50, and against one "
            "alone.\n",
            markdown_table(
                ["problem", "stated", "measured, population of 50", "measured, one alone", "us"],
                _price_rows(figures["derivative_price"]),
            ),
            "\n## Overhead of the algorithms\n",
            "Microseconds an evaluation on the sphere, 15 dimensions, 50 points, 30 iterations, the objective's time "
            "included; one: one point at a time, all: the population at once.\n",
            markdown_table(["algorithm", "package", "us an evaluation"], _overhead_rows(figures["overhead_us"])),
            "\n## Growth\n",
            "Microseconds a trajectory: from motion to condition number against samples and joints; whole "
            "evaluations of `joint-fourier` against the points evaluated at once.\n",
            markdown_table(["against", "size", "us"], _growth_rows(figures["growth_us"])),
            "",
        ]
    )


def _condition_rows(condition: Mapping[str, float]) -> list[tuple[str, ...]]:
    return [
        ("armlab, population of 50", f"{condition['armlab_us']:.1f}"),
        ("armlab, one at a time", f"{condition['armlab_one_at_a_time_us']:.1f}"),
        ("Pinocchio regressor, numpy.linalg.cond", f"{condition['pinocchio_us']:.1f}"),
    ]


def _price_rows(prices: Mapping[str, Mapping[str, float]]) -> list[tuple[str, ...]]:
    return [
        (name, *(f"{price[key]:.0f}" for key in ("stated", "in_population", "single", "us")))
        for name, price in prices.items()
    ]


def _overhead_rows(overhead: Mapping[str, Mapping[str, float]]) -> list[tuple[str, ...]]:
    return [(name, way, f"{taken:.2f}") for name, ways in overhead.items() for way, taken in ways.items()]


def _growth_rows(growth: Mapping[str, Mapping[str, float]]) -> list[tuple[str, ...]]:
    return [(variable, size, f"{taken:.1f}") for variable, sizes in growth.items() for size, taken in sizes.items()]


def _round_figures(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _round_figures(entry) for key, entry in value.items()}
    return float(f"{value:.4g}") if isinstance(value, float) else value
