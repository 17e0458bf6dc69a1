"""Comparison of two result sets, algorithm by algorithm and problem by problem, as a table and a page."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from armlab.common.arrays import Array
from armlab.common.documents import ResultLines
from armlab.common.errors import InputError
from armlab.common.files import write_texts
from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.statistics import adjust_by_holm
from bench.result_sets.formats import read_results
from bench.result_sets.result_set import ResultSet
from bench.statistics import is_feasible, quantile
from bench.statistics.pairwise import log_losses, signed_rank_p
from bench.statistics.superiority import superiority
from bench.studies.regression.check import location_p_value
from bench.tables import CELL_COLUMNS, as_csv


@dataclass(frozen=True)
class Comparison:
    """One algorithm on one problem in both sets; medians of the value, where an infeasible end counts as infinite.

    superiority: probability that an end of the second set is better than one of the first (A12), with a 95 % interval.
    p: of equality, two-sided, after Holm's correction over all comparisons.
    """

    problem: str
    algorithm: str
    first_count: int
    second_count: int
    first_median: float
    second_median: float
    superiority: float
    low: float
    high: float
    p: float

    def change(self, rate: float = 0.05) -> str:
        """The change from the first set to the second, in words."""
        if self.p > rate:
            return "="
        return "better" if self.superiority > 0.5 else "worse"


def are_paired(first: ResultSet, second: ResultSet) -> bool:
    """Whether equal repetitions began with equal populations, which equal seeds give."""
    return first.seed == second.seed


def changed_problems(first: ResultSet, second: ResultSet) -> list[str]:
    """Labels of problems that have other settings in the second set."""
    ours, theirs = first.problems, second.problems
    return [label for label in ours if label in theirs and ours[label] != theirs[label]]


def compare_sets(first: ResultSet, second: ResultSet) -> pd.DataFrame:
    """One row a `Comparison` with its `change`, for all cells that both sets have; empty if they share none."""
    raw = [_compare_cell(*shared, paired=are_paired(first, second)) for shared in _shared_trials(first, second)]
    adjusted = adjust_by_holm(np.array([comparison.p for comparison in raw]))
    found = [Comparison(**{**asdict(c), "p": float(p)}) for c, p in zip(raw, adjusted, strict=True)]
    columns = [*Comparison.__dataclass_fields__, "change"]
    return pd.DataFrame([asdict(c) | {"change": c.change()} for c in found], columns=columns)


def _shared_trials(first: ResultSet, second: ResultSet) -> Iterator[tuple[str, str, pd.DataFrame, pd.DataFrame]]:
    """Problem, algorithm and the trials of both sets, for all cells with the same labels and budget in both."""
    theirs = dict(list(second.trials.groupby([*CELL_COLUMNS, "algorithm"], sort=False)))
    for label, trials in first.ends():
        for key, rows in trials.groupby([*CELL_COLUMNS, "algorithm"], sort=False):
            if key in theirs:
                yield label, str(rows["algorithm"].iloc[0]), rows, theirs[key]


def _compare_cell(problem: str, algorithm: str, first: pd.DataFrame, second: pd.DataFrame, paired: bool) -> Comparison:
    effect, p = _test_difference(first, second, paired)
    counts = len(first), len(second)
    return Comparison(problem, algorithm, *counts, _median_value(first), _median_value(second), *effect, p)


def _test_difference(
    first: pd.DataFrame, second: pd.DataFrame, paired: bool
) -> tuple[tuple[float, float, float], float]:
    both = [first.assign(algorithm="first"), second.assign(algorithm="second")]
    losses = log_losses(pd.concat(both, ignore_index=True))
    old, new = (losses[name].dropna().to_numpy() for name in ("first", "second"))
    if paired and sorted(first["repetition"]) == sorted(second["repetition"]):
        p = signed_rank_p(new, old)
    else:
        p = float(location_p_value(old, new)) if np.ptp(np.append(old, new)) else 1.0
    return superiority(new, old), p


def _median_value(trials: pd.DataFrame) -> float:
    values: Array = trials["value"].to_numpy()
    return quantile(np.where(is_feasible(values, trials["violation"].to_numpy()), values, np.inf), 0.5)


_HEADINGS = ("problem", "algorithm", "median, first", "median, second", "A12 (95 %)", "p (Holm)", "change")
_READING = """\
Medians of the problem's own figure; an infeasible end counts as infinite. A12: chance that an end of the second set is
better than one of the first, with its 95 % interval. p: {test}, two-sided, after Holm over all {count}
comparisons; "change" is at 5 %."""
_CHANGE_NAMES = {"better": "better", "worse": "worse", "=": "not told apart"}
_TEST_NAMES = {True: "Wilcoxon's signed-rank test, paired by repetition", False: "Mann and Whitney's rank-sum test"}


def compare_results(first: Path, second: Path, store: Path, out: Path | None) -> ResultLines:
    """The page of a comparison, in Markdown; with `out` also `comparison.md` and `comparison.csv` in that folder.

    The document has a row a comparison.

    Raises InputError, in one line, if there are no results or the two have nothing in common.
    """
    sets = read_results(first, store), read_results(second, store)
    table = compare_sets(*sets)
    if table.empty:
        raise InputError(f"{first} and {second} have no problem, budget and algorithm in common")
    text = _comparison_page(*sets, table)
    pages = {"comparison.md": text, "comparison.csv": as_csv(table)}
    written = () if out is None else write_texts(pages, out)
    yield text.rstrip("\n")
    names = {"first": sets[0].name, "second": sets[1].name}
    return {**names, "paired": are_paired(*sets), "comparisons": table.to_dict("records"), "files": written}


def _comparison_page(first: ResultSet, second: ResultSet, table: pd.DataFrame) -> str:
    rows = [
        [
            row["problem"],
            row["algorithm"],
            *(f"{row[name]:.4g}" for name in ("first_median", "second_median")),
            f"{row['superiority']:.2f} ({row['low']:.2f} - {row['high']:.2f})",
            f"{row['p']:.2g}",
            row["change"],
        ]
        for row in table.to_dict("records")
    ]
    counts = table["change"].value_counts()
    verdict = ", ".join(f"{counts.get(change, 0)} {name}" for change, name in _CHANGE_NAMES.items())
    reading = _READING.format(test=_TEST_NAMES[are_paired(first, second)], count=len(table))
    changed = changed_problems(first, second)
    notes = [f"Not the same problem in both sets: {', '.join(changed)}."] if changed else []
    return markdown_page(
        f"{first.name} against {second.name}", f"{verdict}.", *notes, markdown_table(_HEADINGS, rows), reading
    )
