"""The summary table as a page to read, with what its figures mean, and the paper's own if asked."""

from collections.abc import Hashable
from typing import Any

import pandas as pd

from bench.config import Experiment
from bench.page import markdown_table, page
from bench.printed import display_name, printed

_CONVENTIONS = """\
The figure is the problem's own, for an arm the condition number of the observation matrix of the
trajectory itself, without weights and penalty. Minimum, average and sample standard deviation (n - 1) are
of the feasible ends only, of which "feasible" gives the share; in the median and the quartiles an
infeasible end counts as infinite. Evaluations: those of one run, the first population included; every
algorithm has the same budget."""
_SOURCE = """\
In brackets: the paper's Table 3 as printed. Its conventions cannot be recovered in full, so its figures stand
beside ours for their order of magnitude, not to be met. Its seconds are as printed; ours are in
`{name}_times.csv`, since no two runs share them."""
_HEADINGS = {
    "minimum": "minimum",
    "average": "average",
    "standard_deviation": "standard deviation",
    "median": "median",
    "lower_quartile": "lower quartile",
    "upper_quartile": "upper quartile",
    "feasible_share": "feasible",
    "evaluations": "evaluations",
}
_PRINTED = ("minimum", "average", "standard_deviation")


def summary_page(table: pd.DataFrame, experiment: Experiment) -> str:
    """Markdown text of a summary table."""
    names = [name for name in table.columns if name not in _HEADINGS]
    headings = [*names, *_HEADINGS.values(), *(["seconds (paper)"] if experiment.printed else [])]
    rows = [_cells(row, names, experiment.printed) for row in table.to_dict("records")]
    notes = [_CONVENTIONS, *([_SOURCE.format(name=experiment.name)] if experiment.printed else [])]
    return page(experiment.name, _setting(experiment), markdown_table(headings, rows), *notes)


def _setting(experiment: Experiment) -> str:
    return (
        f"{experiment.repetitions} repetitions, seed {experiment.seed}, bounds: {experiment.bounds}. "
        f"All settings: `{experiment.name}.settings.yaml`."
    )


def _cells(row: dict[Hashable, Any], names: list[str], beside: bool) -> list[str]:
    label = str(row["algorithm"])
    paper = printed().table3.rows.get(label) if beside else None
    cells = [display_name(label) if name == "algorithm" else str(row[name]) for name in names]
    for name in _HEADINGS:
        ours = _number(name, row[name])
        cells.append(f"{ours} ({getattr(paper, name):g})" if paper and name in _PRINTED else ours)
    return [*cells, f"{paper.seconds:g}" if paper else "-"] if beside else cells


def _number(name: str, value: float) -> str:
    if name == "feasible_share":
        return f"{value:.0%}"
    return f"{value:.0f}" if name == "evaluations" else f"{value:.3g}"
