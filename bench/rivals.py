"""Our algorithms beside the same algorithms of other packages: result and time, pair by pair."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd

from armlab.common.markdown import markdown_page, markdown_table
from bench.statistics import is_feasible, quantile
from bench.statistics.pairwise import duels
from bench.tables import CELL_COLUMNS

_READING = """\
Median: of the ends, for an arm the condition number; an infeasible end counts as infinite. Ours better: chance
that an end of ours is better than one of theirs (A12), ties counting half. p: Wilcoxon's signed-rank test, paired by
repetition (equal first populations), after Holm over the pairs of one problem. us: microseconds of processor time an
evaluation, median of the runs, everything included. Most peers take one point at a time, for which a problem costs
more than for a population at once, and the loop of every peer runs in a thread of its own and waits there for each
answer: the figure is what a comparison here takes, not the peer's own overhead."""


def rivals_table(frame: pd.DataFrame, pairs: Sequence[tuple[str, str]]) -> pd.DataFrame:
    """One row a problem and pair, with the labels of both; frame: as `tidy_frame` returns it."""
    return pd.DataFrame([row for _, cell in frame.groupby(CELL_COLUMNS, sort=False) for row in _pair_rows(cell, pairs)])


def rivals_page(table: pd.DataFrame) -> str:
    """The table as a Markdown page."""
    headings = ["problem", "ours", "median", "us", "theirs", "median", "us", "ours better", "p"]
    rows = [
        (
            *(row["problem"], row["ours"], f"{row['our_median']:.3g}", f"{row['our_microseconds']:.0f}"),
            *(row["theirs"], f"{row['their_median']:.3g}", f"{row['their_microseconds']:.0f}"),
            f"{row['ours_better']:.2f} [{row['low']:.2f}, {row['high']:.2f}]",
            f"{row['p']:.2g}",
        )
        for row in table.to_dict("records")
    ]
    return markdown_page("Ours against theirs", markdown_table(headings, rows), _READING)


def _pair_rows(cell: pd.DataFrame, pairs: Sequence[tuple[str, str]]) -> Iterator[dict[str, Any]]:
    by_label = {str(label): rows for label, rows in cell.groupby("algorithm", sort=False)}
    place = {name: cell[name].iloc[0] for name in CELL_COLUMNS}
    for duel in duels(cell, pairs):
        ours, theirs = by_label[duel.subject], by_label[duel.rival]
        yield {
            **place,
            "ours": duel.subject,
            "our_median": _median_value(ours),
            "our_microseconds": _median_microseconds(ours),
            "theirs": duel.rival,
            "their_median": _median_value(theirs),
            "their_microseconds": _median_microseconds(theirs),
            "ours_better": duel.superiority,
            "low": duel.low,
            "high": duel.high,
            "p": duel.p,
        }


def _median_value(rows: pd.DataFrame) -> float:
    values = rows["value"].to_numpy()
    return quantile(np.where(is_feasible(values, rows["violation"].to_numpy()), values, np.inf), 0.5)


def _median_microseconds(rows: pd.DataFrame) -> float:
    return float((1e6 * rows["seconds"] / rows["evaluations"]).median())
