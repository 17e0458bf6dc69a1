"""The report about a result set as one HTML file that loads nothing from the network, with scripts and the data of
its charts.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml
from markupsafe import Markup

from algorithms.registry import names as registered
from armlab.common.arrays import Array
from armlab.common.documents import ResultLines, written_files
from armlab.common.files import write_whole
from armlab.common.report.page import render_page
from armlab.common.report.palette import SeriesStyle, series_style
from bench.report import sections
from bench.report.analysis import ProblemAnalysis, analyse_cells, losses_by_problem, share_of_targets_reached
from bench.report.ranking_chart import draw_critical_difference
from bench.result_sets.formats import make_folder, read_results
from bench.result_sets.result_set import ResultSet
from bench.statistics.critical_difference import (
    CriticalDifference,
    critical_difference,
    paired_ranking,
)
from bench.statistics.ends import place_of_zero
from bench.statistics.performance import performance_profile
from bench.store import open_store
from bench.studies.properties import AlgorithmProperties, measure_isolated, stored_properties
from bench.terminal import describe_frame

_PROFILE_FACTORS = np.geomspace(1.0, 10.0, 60)
_CURVE_POINTS = 60


def page_data(cells: Sequence[ProblemAnalysis], algorithms: Sequence[str]) -> str:
    """The data of the charts as JSON; numbers have four digits, null stands for an infinite one."""
    content = {
        "algorithms": list(algorithms),
        "problems": [_problem_data(cell) for cell in cells],
        "overall": _overall_data(cells, algorithms),
    }
    return json.dumps(content, separators=(",", ":"), allow_nan=False)


def _problem_data(cell: ProblemAnalysis) -> dict[str, Any]:
    curves = {name: cell.progress[name].quartiles for name in cell.algorithms}
    return {
        "name": cell.label,
        "zero": None if (zero := place_of_zero(_shown_values(cell))) is None else float(f"{zero:.4g}"),
        "evaluations": _to_json_numbers(cell.moments),
        **_time_data(cell),
        "convergence": {name: [_to_json_numbers(part) for part in parts] for name, parts in curves.items()},
        "reached": {
            name: _to_json_numbers(share_of_targets_reached([cell], name, cell.moments)) for name in cell.algorithms
        },
        "ends": {name: _to_json_numbers(cell.ends(name)) for name in cell.algorithms},
        "boxes": {name: _to_json_numbers(_quartiles(cell, name)) for name in cell.algorithms},
    }


def _time_data(cell: ProblemAnalysis) -> dict[str, Any]:
    """Medians of the best so far against seconds of one core, on one grid for all; null before a run's first and after
    its last evaluation. Empty where results came without seconds.
    """
    if "seconds" not in cell.trials:
        return {}
    costs = {name: cell.seconds_per_evaluation(name) for name in cell.algorithms}
    known = [cost for cost in costs.values() if cost > 0]
    if not known:
        return {}
    grid = np.geomspace(cell.moments[0] * min(known), cell.moments[-1] * max(known), _CURVE_POINTS)
    medians = {name: cell.progress[name].quartiles[1] for name in cell.algorithms}
    values = {name: _value_at(grid, cell.moments * costs[name], medians[name]) for name in cell.algorithms}
    return {
        "seconds": _to_json_numbers(grid),
        "against_time": {name: _to_json_numbers(found) for name, found in values.items()},
    }


def _value_at(grid: Array, times: Array, values: Array) -> Array:
    """The last value at each time of the grid, infinite before the first and after the last one."""
    place = np.searchsorted(times, grid * (1 + 1e-9), side="right") - 1
    there = (place >= 0) & (grid <= times[-1] * (1 + 1e-9))
    return np.where(there, values[np.maximum(place, 0)], np.inf)


def _shown_values(cell: ProblemAnalysis) -> Array:
    """Every value of the charts of a problem."""
    parts = [cell.ends(name) for name in cell.algorithms]
    return np.concatenate([*parts, *(cell.progress[name].quartiles.ravel() for name in cell.algorithms)])


def _overall_data(cells: Sequence[ProblemAnalysis], algorithms: Sequence[str]) -> dict[str, Any]:
    first = min(cell.moments[0] for cell in cells)
    moments = np.unique(np.geomspace(first, max(cell.moments[-1] for cell in cells), _CURVE_POINTS).round())
    medians = [{name: cell.summary(name).median for name in cell.algorithms} for cell in cells]
    profile = performance_profile(pd.DataFrame(medians)[list(algorithms)], _PROFILE_FACTORS)
    return {
        "evaluations": _to_json_numbers(moments),
        "reached": {name: _to_json_numbers(share_of_targets_reached(cells, name, moments)) for name in algorithms},
        "factors": _to_json_numbers(_PROFILE_FACTORS),
        "profile": {name: _to_json_numbers(profile[name].to_numpy()) for name in algorithms},
    }


def _quartiles(cell: ProblemAnalysis, algorithm: str) -> Array:
    summary = cell.summary(algorithm)
    return np.array([summary.lower_quartile, summary.median, summary.upper_quartile])


def _to_json_numbers(values: Array) -> list[float | None]:
    return [float(f"{value:.4g}") if np.isfinite(value) else None for value in values.tolist()]


_SCRIPTS = ("scales.js", "lines.js", "boxes.js", "page.js")


def report_page(results: ResultSet, cells: Sequence[ProblemAnalysis], facts: Sequence[AlgorithmProperties]) -> str:
    """The page as HTML; facts: properties of the algorithms that took part and are registered here."""
    looks = {name: series_style(index) for index, name in enumerate(results.algorithms)}
    losses = [cell.losses for cell in cells]
    within, over = paired_ranking(losses), critical_difference(losses_by_problem(cells))
    is_sweep = over.blocks < len(cells) > 1
    data = page_data(cells, results.algorithms).replace("<", "\\u003c")  # a label must not end the script
    return render_page(
        __package__,
        "results.html",
        results.name,
        counts=sections.count_sentence(results, cells),
        headline=sections.headline(cells, within, over),
        looks=looks,
        ranking=sections.ranking_text(within, cells),
        picture=draw_critical_difference(within, looks),
        over_problems=None if len(cells) == 1 or over.blocks == 1 else _over_problems(over, looks),
        noun="setting" if is_sweep else "problem",
        tally=sections.tally_table(cells, results.algorithms) if len(cells) > 1 else None,
        problems=[
            sections.ProblemPart(cell.label, sections.ends_table(cell), sections.duels_table(cell)) for cell in cells
        ],
        ratings=sections.rating_part(cells),
        power=sections.power_part(cells),
        properties=sections.properties_part(facts),
        origin=sections.origin_part(results),
        data=Markup(data),
        scripts=Markup("\n".join(_read_asset(name) for name in _SCRIPTS)),
    )


def _over_problems(over: CriticalDifference, looks: Mapping[str, SeriesStyle]) -> tuple[str, Markup]:
    """The ranking over problems: its text and its picture."""
    return sections.generalisation_text(over), draw_critical_difference(over, looks)


def _read_asset(name: str) -> str:
    return (files("bench.report") / "assets" / name).read_text(encoding="utf-8")


def write_report(
    where: Path, store: Path, out: Path | None, progress: Callable[[str], None] = lambda message: None
) -> ResultLines:
    """Write the page about results; tells the table, who beats whom, and the file.

    progress: is told what is being done.

    Raises InputError, in one line, if there are no results.
    """
    progress("reading results")
    results = read_results(where, store)
    path = out or Path("results") / f"{results.name}_report.html"
    make_folder(path.parent)
    facts = _measure_participants(results, store, progress)
    progress("comparing algorithms")
    write_whole(path, report_page(results, analyse_cells(results), facts))
    yield from results.missing
    yield from describe_frame(results.trials)
    return (yield from written_files([path]))


def _measure_participants(
    results: ResultSet, store: Path, progress: Callable[[str], None]
) -> list[AlgorithmProperties]:
    """Properties of the algorithms that took part and are registered here; results may come from elsewhere.

    They are measured once and kept in the run store, if there is one.
    """
    took_part = dict.fromkeys(entry["name"] for entry in yaml.safe_load(results.settings)["algorithms"].values())
    names = [name for name in took_part if name in registered()]
    found = []
    with open_store(store) if store.exists() else nullcontext() as opened:
        for number, name in enumerate(names, 1):
            progress(f"measuring algorithms, {number} of {len(names)}")
            found.append(measure_isolated(name) if opened is None else stored_properties(name, opened))
    return [each for each in found if each is not None]
