"""Tables of the study beyond the paper, medians side by side and duels with effect sizes, and the page over all of its
experiments.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from armlab.common.markdown import markdown_page, markdown_table
from bench.printed import display_name
from bench.statistics import is_feasible, quantile
from bench.statistics.pairwise import Duel, duel_row, duels, duels_against_all
from bench.statistics.power import power_text
from bench.tables import CELL_COLUMNS

DuelChooser = Callable[[pd.DataFrame], list[Duel]]


def median_table(frame: pd.DataFrame, known: Mapping[str, float]) -> pd.DataFrame:
    """One row a problem, swarm size and budget, as far as they vary; one column an algorithm: the median of its ends.

    An infeasible end counts as infinite; if there are any, the share of the feasible ones stands in brackets. known:
    the best condition number of a problem, as far as there is a record.
    """
    varying = [name for name in CELL_COLUMNS if frame[name].nunique() > 1]
    rows = []
    for names, group in frame.groupby(CELL_COLUMNS, sort=False):
        cell = dict(zip(CELL_COLUMNS, names, strict=True))
        medians = dict(_medians_by_algorithm(group))
        value, least = min((median, label) for label, (median, _) in medians.items())
        row = {name: cell[name] for name in varying}
        row |= {display_name(label): _format_median(*found) for label, found in medians.items()}
        record = known.get(str(cell["problem"]))
        row |= {"least": display_name(least) if np.isfinite(value) else "-"}
        rows.append(row | {"best known": f"{record:.3g}" if record else "-"})
    return pd.DataFrame(rows)


def _medians_by_algorithm(group: pd.DataFrame) -> Iterator[tuple[str, tuple[float, float]]]:
    for label, rows in group.groupby("algorithm", sort=False):
        feasible = is_feasible(rows["value"].to_numpy(), rows["violation"].to_numpy())
        yield str(label), (quantile(np.where(feasible, rows["value"], np.inf), 0.5), float(feasible.mean()))


def _format_median(median: float, share: float) -> str:
    return f"{median:.3g}" if share == 1 else f"{median:.3g} ({share:.0%})"


def subject_duels_table(frame: pd.DataFrame, subject: str) -> pd.DataFrame:
    """The subject against every other algorithm, in each problem, swarm size and budget."""
    return _duel_table(frame, lambda group: duels_against_all(group, subject))


def variant_duels_table(frame: pd.DataFrame, default: str) -> pd.DataFrame:
    """Every other entry against the default, so that A12 above 0.5 means that the change helps."""

    def fight(group: pd.DataFrame) -> list[Duel]:
        return duels(group, [(str(label), default) for label in group["algorithm"].unique() if label != default])

    return _duel_table(frame, fight)


def _duel_table(frame: pd.DataFrame, fight: DuelChooser) -> pd.DataFrame:
    rows = [
        dict(zip(CELL_COLUMNS, names, strict=True)) | duel_row(duel)
        for names, group in frame.groupby(CELL_COLUMNS, sort=False)
        for duel in fight(group)
    ]
    return pd.DataFrame(rows)


def effect_table(table: pd.DataFrame) -> pd.DataFrame:
    """The duels of the variants to read: one row a variant, one column a problem and budget."""
    signs = np.select([table["winner"] == table["subject"], table["winner"] == table["rival"]], [" +", " -"], "")
    rows = table.assign(
        variant=table["subject"],
        cell=[f"{row.superiority:.2f} ({row.low:.2f}-{row.high:.2f})" for row in table.itertuples()]
        + signs.astype(object),
        column=[f"{row.problem}, {row.budget}" for row in table.itertuples()],
    )
    wide = rows.pivot(index="variant", columns="column", values="cell")
    return wide.loc[rows["variant"].unique(), rows["column"].unique()].reset_index()


def effects_markdown(table: pd.DataFrame) -> str:
    """The duels of the variants as a Markdown table."""
    return _format_table(effect_table(table))


_READING = """\
Medians of the condition number; an infeasible end counts as infinite, and the share of the feasible ones stands in
brackets where it is not 100 %. All runs of a line have the same number of evaluations and, repetition by repetition,
the same first population. Duels: paired Wilcoxon on log10 of the condition number, Holm within each line, 5 %; effect
sizes (A12) with 95 % intervals in `*_duels.csv`."""
_VARIANTS_READING = """\
Chance that the variant ends better than MuPSO as published (A12, 95 % interval); `+` better, `-` worse at 5 % after
Holm within the column."""
_MUTATIONS_READING = """\
Runs at the smaller budget. `share best before first`: of the runs that mutate, those that found nothing better after
their first mutation."""


@dataclass(frozen=True, eq=False)
class StudyPart:
    """One experiment: its tidy outcomes, the table to show, its duels, and whether it has a figure."""

    name: str
    text: str
    frame: pd.DataFrame
    table: pd.DataFrame
    duels: pd.DataFrame
    figure: bool


def study_page(parts: Sequence[StudyPart], mutations: pd.DataFrame) -> str:
    """The study as a Markdown page."""
    sections = [section for part in parts for section in _part_sections(part)]
    shown = mutations.round(2).rename(columns=lambda name: str(name).replace("_", " "))
    return markdown_page(
        "The study",
        _READING,
        _times_text(parts),
        *sections,
        "## How often MuPSO mutates",
        _MUTATIONS_READING,
        _format_table(shown),
    )


def _times_text(parts: Sequence[StudyPart]) -> str:
    rows = [[part.name, len(part.frame), f"{part.frame['seconds'].sum():.0f}"] for part in parts]
    total = sum(part.frame["seconds"].sum() for part in parts)
    table = markdown_table(["experiment", "runs", "seconds of one core"], rows)
    return (
        f"{table}\n\nMeasured, {total / 60:.0f} minutes of one core in all; finished runs are kept and not run again."
    )


def _part_sections(part: StudyPart) -> list[str]:
    figure = [f"![{part.text}]({part.name}.svg)"] if part.figure else []
    repetitions = part.frame["repetition"].nunique()
    text = f"{part.text} {repetitions} repetitions; settings: `{part.name}.settings.yaml`."
    return [f"## {part.name}", text, _format_table(part.table), _duels_text(part.duels, repetitions), *figure]


def _duels_text(duels: pd.DataFrame, repetitions: int) -> str:
    comparisons = len(duels) // len(duels.groupby(["problem", "swarm_size", "budget"]))
    power = power_text(repetitions, comparisons) + "."
    if duels["rival"].nunique() == 1:
        return f"{_VARIANTS_READING} {power}"
    won = (duels["winner"] == duels["subject"]).sum()
    lost = (duels["winner"] == duels["rival"]).sum()
    return f"MuPSO is better in {won}, worse in {lost} of {len(duels)} duels. {power}"


def _format_table(table: pd.DataFrame) -> str:
    rows = [["-" if pd.isna(cell) else cell for cell in row] for row in table.to_numpy()]
    return markdown_table([str(name) for name in table.columns], rows)
