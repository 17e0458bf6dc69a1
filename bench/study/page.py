"""The page over all experiments of the study."""

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from bench.page import markdown_table, page
from bench.paper.power_text import power_text

_READING = """\
Medians of the condition number; an infeasible end counts as infinite, and the share of the feasible ones stands in
brackets where it is not 100 %. All runs of a line have the same number of evaluations and, repetition by repetition,
the same first population. Duels: paired Wilcoxon on log10 of the condition number, Holm within each line, 5 %; effect
sizes (A12) with 95 % bootstrap intervals in `*_duels.csv`."""
_VARIANTS = """\
Chance that the variant ends better than MuPSO as published (A12, 95 % interval); `+` better, `-` worse at 5 % after
Holm within the column."""
_MUTATIONS = """\
Runs at the smaller budget. `share best before first`: of the runs that mutate, those that found nothing better after
their first mutation."""


@dataclass(frozen=True, eq=False)
class Part:
    """One experiment: its tidy outcomes, the table to show, its duels, and whether it has a figure."""

    name: str
    text: str
    frame: pd.DataFrame
    table: pd.DataFrame
    duels: pd.DataFrame
    figure: bool


def study_page(parts: Sequence[Part], mutations: pd.DataFrame) -> str:
    """Markdown text."""
    sections = [section for part in parts for section in _sections(part)]
    shown = mutations.round(2).rename(columns=lambda name: str(name).replace("_", " "))
    return page(
        "The study", _READING, _times(parts), *sections, "## How often MuPSO mutates", _MUTATIONS, _markdown(shown)
    )


def _times(parts: Sequence[Part]) -> str:
    rows = [[part.name, len(part.frame), f"{part.frame['seconds'].sum():.0f}"] for part in parts]
    total = sum(part.frame["seconds"].sum() for part in parts)
    table = markdown_table(["experiment", "runs", "seconds of one core"], rows)
    return (
        f"{table}\n\nMeasured, {total / 60:.0f} minutes of one core in all; finished runs are kept and not run again."
    )


def _sections(part: Part) -> list[str]:
    figure = [f"![{part.text}]({part.name}.png)"] if part.figure else []
    repetitions = part.frame["repetition"].nunique()
    text = f"{part.text} {repetitions} repetitions; settings: `{part.name}.settings.yaml`."
    return [f"## {part.name}", text, _markdown(part.table), _ends(part.duels, repetitions), *figure]


def _ends(duels: pd.DataFrame, repetitions: int) -> str:
    comparisons = len(duels) // len(duels.groupby(["problem", "swarm_size", "budget"]))
    power = power_text(repetitions, comparisons) + "."
    if duels["rival"].nunique() == 1:
        return f"{_VARIANTS} {power}"
    won = (duels["winner"] == duels["subject"]).sum()
    lost = (duels["winner"] == duels["rival"]).sum()
    return f"MuPSO is better in {won}, worse in {lost} of {len(duels)} duels. {power}"


def _markdown(table: pd.DataFrame) -> str:
    rows = [["-" if pd.isna(cell) else cell for cell in row] for row in table.to_numpy()]
    return markdown_table([str(name) for name in table.columns], rows)
