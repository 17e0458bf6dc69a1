"""`armlab bench duels`: one algorithm of a result set against every other, with effect sizes, intervals and power."""

from collections.abc import Hashable, Iterator, Mapping
from pathlib import Path

import pandas as pd

from armlab.common.errors import InputError
from armlab.common.files import write_whole
from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.settings import suggest_name
from bench.files import file_name
from bench.printed import display_name
from bench.result_sets.formats import make_folder, read_results
from bench.statistics.power import power_text
from bench.studies.beyond_paper.beyond_paper_page import subject_duels_table
from bench.tables import CELL_COLUMNS, as_csv

_READING = """\
A12: chance that a run of {subject} ends better than one of the other, ties counting half, with its 95 %
interval. `+` {subject} is better, `-` worse: paired Wilcoxon on log10 of the ends, an infeasible one counting as the
worst, 5 % after Holm within the line."""


def write_duels(where: Path, store: Path, subject: str, folder: Path) -> list[Path]:
    """Write NAME_SUBJECT_duels.csv and .md into a folder; returns the files.

    Raises InputError, in one line, if there are no results or none of that algorithm.
    """
    results = read_results(where, store)
    labels = [str(label) for label in results.trials["algorithm"].unique()]
    if subject not in labels:
        raise InputError(f"{results.name} has no algorithm '{subject}': {suggest_name(subject, labels)}")
    if len(labels) == 1:
        raise InputError(f"{results.name} has no algorithm beside '{subject}': a duel needs two")
    table = subject_duels_table(results.trials, subject)
    stem = f"{results.name}_{file_name(subject)}_duels"
    repetitions = results.trials["repetition"].nunique()
    make_folder(folder)
    files = {f"{stem}.csv": as_csv(table), f"{stem}.md": duels_page(results.name, subject, table, repetitions)}
    for name, content in files.items():
        write_whole(folder / name, content)
    return [folder / name for name in files]


def duels_page(name: str, subject: str, table: pd.DataFrame, repetitions: int) -> str:
    """The table that `subject_duels_table` gives, as a Markdown page."""
    shown = display_name(subject)
    left_over = f"not told apart, of {len(table.groupby(CELL_COLUMNS))}"
    return markdown_page(
        f"{name}: {shown} against every other",
        _READING.format(subject=shown),
        f"{power_text(repetitions, table['rival'].nunique())}.",
        markdown_table(
            ["against", "better", "worse", left_over, "A12, median", "least", "largest"],
            _totals(table),
        ),
        _effects(table),
    )


def _totals(table: pd.DataFrame) -> Iterator[list[object]]:
    """One row a rival, over all problems and budgets."""
    for rival, rows in table.groupby("rival", sort=False):
        won, lost = ((rows["winner"] == rows[side]).sum() for side in ("subject", "rival"))
        effects = (f"{value:.2f}" for value in rows["superiority"].quantile([0.5, 0.0, 1.0]))
        yield [display_name(str(rival)), won, lost, len(rows) - won - lost, *effects]


def _effects(table: pd.DataFrame) -> str:
    """One row a problem, swarm size and budget, as far as they vary, and one column a rival."""
    varying = [column for column in CELL_COLUMNS if table[column].nunique() > 1] or CELL_COLUMNS[:1]
    rivals = table["rival"].unique()
    rows = [
        [*rows[varying].iloc[0], *map(_effect_cell, rows.to_dict("records"))]
        for _, rows in table.groupby(CELL_COLUMNS, sort=False)
    ]
    return markdown_table([*varying, *map(display_name, rivals)], rows)


def _effect_cell(row: Mapping[Hashable, object]) -> str:
    sign = {row["subject"]: " +", row["rival"]: " -"}.get(row["winner"], "")
    return f"{row['superiority']:.2f} ({row['low']:.2f}-{row['high']:.2f}){sign}"
