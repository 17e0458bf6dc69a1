"""What `run`, `paper table3` and `report` print: the table of the ends, and who beats whom on each problem."""

from collections.abc import Iterator, Sequence

import pandas as pd

from bench.printed import display_name
from bench.statistics.critical_difference import ERROR_RATE, CriticalDifference, critical_difference
from bench.statistics.pairwise import log_losses
from bench.tables import CELL_COLUMNS, cell_label, failed_sentences, summary_table

MAX_ROWS = 40  # of the table: a screen
_SHOWN = ("median", "lower_quartile", "upper_quartile", "minimum", "feasible_share")


def describe_frame(frame: pd.DataFrame) -> Iterator[str]:
    """The lines about a tidy frame: what failed, a table of medians and quartiles, and a winner for each problem."""
    yield from failed_sentences(frame)
    yield from _table_lines(frame)
    yield from winner_sentences(frame)


def winner_sentences(frame: pd.DataFrame) -> Iterator[str]:
    """Who beats whom on each problem, swarm size and budget, a sentence each; a screen of them."""
    cells = list(frame.groupby(CELL_COLUMNS, sort=False))
    for cell, rows in cells[:MAX_ROWS]:
        where = f"{cell_label(frame, cell)}: " if len(cells) > 1 else ""
        yield f"{where}{winner_sentence(critical_difference(log_losses(rows)))}"
    if len(cells) > MAX_ROWS:
        yield f"and {len(cells) - MAX_ROWS} problems more"


def winner_sentence(found: CriticalDifference) -> str:
    """Who has the best average rank over paired runs, whom it beats, and who is not told apart from it."""
    best, *others = map(display_name, found.ranks)
    if not others:
        return f"{best} is the only algorithm"
    if found.has_too_few_blocks:
        return f"{best} has the best average rank; {found.blocks} repetitions are too few to tell any pair apart"
    first = next(iter(found.ranks))
    beaten = [display_name(name) for name in found.ranks if name != first and found.p[first, name] <= ERROR_RATE]
    equal = [name for name in others if name not in beaten]
    parts = [f"beats {', '.join(beaten)}"] if beaten else []
    parts += [f"is not told apart from {', '.join(equal)}"] if equal else []
    return f"{best} {' and '.join(parts)} (Wilcoxon, paired, Holm, 5 %)"


def _table_lines(frame: pd.DataFrame) -> list[str]:
    table = summary_table(frame)
    budgets = frame.drop_duplicates([*CELL_COLUMNS, "algorithm"])["budget"].to_numpy()
    if len(set(budgets)) > 1:
        table.insert(0, "budget", budgets)
    names = [name for name in ("problem", "swarm_size", "budget", "algorithm") if name in table]
    rows: list[Sequence[str]] = [[*names, *(name.replace("_", " ") for name in _SHOWN)]]
    for row in table.head(MAX_ROWS).to_dict("records"):
        numbers = [f"{row[name]:.0%}" if name == "feasible_share" else f"{row[name]:.4g}" for name in _SHOWN]
        rows.append([*(str(row[name]) for name in names), *numbers])
    more = len(table) - MAX_ROWS
    return [*text_table(rows), *([f"and {more} rows more"] if more > 0 else [])]


def text_table(rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a table whose columns are as wide as their longest cell."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
