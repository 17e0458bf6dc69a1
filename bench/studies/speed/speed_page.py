"""The speed report: `results/speed/speed.json` and `results/speed/speed.md`."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from types import MappingProxyType
from typing import Any

from armlab.common.files import write_whole
from armlab.common.markdown import markdown_table
from bench.provenance import provenance
from bench.studies.speed.evaluations import (
    ANCHOR,
    ARMS,
    PIPELINE_SAMPLES,
    POPULATION,
    SINGLE,
    PipelineFigures,
    compare_pipelines,
    evaluations_per_second,
    growth_with_joints,
    growth_with_samples,
    growth_with_swarm_size,
    price_of_derivatives,
)
from bench.studies.speed.four_lanes import describe_build
from bench.studies.speed.overhead import measure_overheads

_PIPELINE_READING = """\
All pipelines take the same random motions. CasADi: the regressor of the arm as a formula with common subexpressions,
generated as C and compiled with -O3 -march=native for this processor, or written out as C++ over four samples, with the
sum of the Gram matrix in the same pass, fused products and fast mathematics; armlab's kernel takes any arm and any
processor, and its results are the same to the bit on each. "Times Pinocchio": how many times as fast as Pinocchio's
regressor with numpy.linalg.cond.
"""
MIN_ANCHOR_LEAD = MappingProxyType({3: 11.8, 6: 7.7, 7: 6.7})
"""Joints: how many times as fast as Pinocchio the C++ code, one at a time, was when it was first built by hand."""


def measure_speed() -> dict[str, Any]:
    """All figures of the speed report, measured now on one core."""
    return {
        "condition_number": [_pipeline_entry(compare_pipelines(arm)) for arm in ARMS],
        "anchor": describe_build(),
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
    conditions, rates = figures["condition_number"], figures["evaluations_per_second"]
    anchored = [each for each in conditions if each["shares_of_anchor"]]
    return "\n".join(
        [
            "# Speed\n",
            f"One core of {figures['provenance']['processor']}, one BLAS thread; medians, the rivals taking turns.\n",
            f"## From motion to condition number, {PIPELINE_SAMPLES} samples\n",
            _PIPELINE_READING,
            markdown_table(["joints", "pipeline", "us a trajectory", "times Pinocchio"], _pipeline_rows(conditions)),
            f"\nLargest relative difference of the condition numbers: {_worst(conditions, 'results_apart')}; of an "
            f"entry of CasADi's observation matrix from Pinocchio's: {_worst(conditions, 'matrices_apart')}.\n",
            *(_anchor_section(anchored, figures["anchor"]) if anchored else []),
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


def _anchor_section(conditions: Sequence[Mapping[str, Any]], build: str) -> list[str]:
    rows = []
    for each in conditions:
        shares, first = each["shares_of_anchor"], MIN_ANCHOR_LEAD[each["joints"]]
        lead = each["times_pinocchio"][f"{ANCHOR}, {SINGLE}"]
        counts = "yes" if lead >= first else "no"
        rows.append(
            (
                str(each["joints"]),
                *(f"{shares[way]:.2f}" for way in (POPULATION, SINGLE)),
                f"{lead:.1f}",
                f"{first:.1f}",
                counts,
            )
        )
    return [
        "## Beside C++ built by hand\n",
        f"armlab's time as a share of that of the C++ code over four lanes with numpy.linalg.eigvalsh ({build}). A row "
        "counts where that code, one at a time, is at least as many times as fast as Pinocchio as it was when it was "
        "first built. The pipeline with armlab's spectra.c shows what the code would gain from it.\n",
        markdown_table(["joints", POPULATION, SINGLE, "C++: times Pinocchio", "at first", "counts"], rows),
        "",
    ]


def _pipeline_entry(found: PipelineFigures) -> dict[str, Any]:
    return asdict(found) | {"times_pinocchio": found.ratios, "shares_of_anchor": found.shares_of_anchor}


def _pipeline_rows(conditions: Sequence[Mapping[str, Any]]) -> list[tuple[str, ...]]:
    return [
        (str(each["joints"]), name, f"{taken:.1f}", f"{each['times_pinocchio'][name]:.1f}")
        for each in conditions
        for name, taken in each["us"].items()
    ]


def _worst(conditions: Sequence[Mapping[str, Any]], name: str) -> str:
    return f"{max(each[name] for each in conditions):.1e}"


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
    if isinstance(value, list):
        return [_round_figures(entry) for entry in value]
    return float(f"{value:.4g}") if isinstance(value, float) else value
