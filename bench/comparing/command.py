"""What `armlab compare` does: two result sets to a page and a table."""

from pathlib import Path

import pandas as pd

from bench.comparing.cells import are_paired, changed_problems, compare
from bench.files import write_whole
from bench.page import markdown_table, page
from bench.sharing.command import read_results
from bench.sharing.result_set import ResultSet
from bench.sharing.tidy import make_folder
from bench.table import as_csv
from problem.errors import InputError

_HEADINGS = ("problem", "algorithm", "median, first", "median, second", "A12 (95 %)", "p (Holm)", "change")
_READING = """\
Medians of the problem's own figure; an infeasible end counts as infinite. A12: chance that an end of the second set is
better than one of the first, with a 95 % bootstrap interval. p: {test}, two-sided, after Holm over all {count}
comparisons; "change" is at 5 %."""
_CHANGES = {"better": "better", "worse": "worse", "=": "not told apart"}
_TESTS = {True: "Wilcoxon's signed-rank test, paired by repetition", False: "Mann and Whitney's rank-sum test"}


def compare_results(first: Path, second: Path, store: Path, out: Path | None) -> str:
    """The page of a comparison, in Markdown; with `out` also `comparison.md` and `comparison.csv` in that folder.

    Raises InputError, in one line, if there are no results or the two have nothing in common.
    """
    sets = read_results(first, store), read_results(second, store)
    table = compare(*sets)
    if table.empty:
        raise InputError(f"{first} and {second} have no problem, budget and algorithm in common")
    text = _page(*sets, table)
    if out is not None:
        make_folder(out)
        write_whole(out / "comparison.md", text)
        write_whole(out / "comparison.csv", as_csv(table))
    return text


def _page(first: ResultSet, second: ResultSet, table: pd.DataFrame) -> str:
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
    verdict = ", ".join(f"{counts.get(change, 0)} {name}" for change, name in _CHANGES.items())
    reading = _READING.format(test=_TESTS[are_paired(first, second)], count=len(table))
    changed = changed_problems(first, second)
    notes = [f"Not the same problem in both sets: {', '.join(changed)}."] if changed else []
    return page(f"{first.name} against {second.name}", f"{verdict}.", *notes, markdown_table(_HEADINGS, rows), reading)
