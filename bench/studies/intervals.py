"""`armlab tools intervals`: intervals of A12 in written tables, and in the pages beside them, by the present method."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pandas as pd
import yaml

from armlab.common.errors import InputError
from armlab.common.files import write_whole
from bench.files import file_name
from bench.result_sets.duels import duels_page
from bench.rivals import rivals_page
from bench.statistics.pairwise import Duel
from bench.statistics.superiority import superiority_interval
from bench.studies.beyond_paper.beyond_paper_figures import draw_ingredients
from bench.studies.beyond_paper.beyond_paper_page import effects_markdown
from bench.studies.beyond_paper.beyond_paper_study import VARIANTS_EXPERIMENT
from bench.studies.search_space.search_space_study import comparison_markdown
from bench.studies.tuning.judged import ALL_TUNED, duels_by_rival
from bench.tables import as_csv

_EFFECTS = ("superiority", "ours_better")
"""Columns of A12 in written tables; the interval stands in `low` and `high`."""
_ROUNDING = 0.01  # of a count of half wins: A12 is written with six digits


def renew_intervals(results: Path) -> Iterator[Path]:
    """Compute the intervals of every table below a folder anew, from its A12 and the repetitions of its settings.

    Rewrites the tables, and what the pages and figures beside them show of them; yields the files. Raises InputError,
    in one line, for a table without settings, an A12 that so many repetitions cannot give, and a page that shows
    something else than its table.
    """
    for path in sorted(results.rglob("*.csv")):
        columns = pd.read_csv(path, nrows=0).columns
        effect = next((name for name in _EFFECTS if name in columns), None)
        if effect is None or not {"low", "high"} <= set(columns):
            continue
        old = pd.read_csv(path, keep_default_na=False)
        repetitions = _repetitions_of(path)
        new = _with_intervals(old, effect, repetitions, path)
        files = {path: as_csv(new)} | dict(_pages(path, old, new, repetitions))
        for file, content in files.items():
            write_whole(file, content)
            yield file


def _repetitions_of(path: Path) -> int:
    """Repetitions of the settings whose name begins that of a table, or of the only ones in its folder."""
    stems = {file.name.removesuffix(".settings.yaml"): file for file in path.parent.glob("*.settings.yaml")}
    named = [name for name in stems if path.stem.startswith(f"{name}_")] or list(stems)
    if not named or (len(stems) > 1 and not path.stem.startswith(named[0])):
        raise InputError(f"{path}: there are no settings beside it that say how many repetitions it has")
    settings = yaml.safe_load(stems[max(named, key=len)].read_text())
    return int(settings.get("judge_repetitions", settings.get("repetitions")))


def _with_intervals(table: pd.DataFrame, effect: str, repetitions: int, path: Path) -> pd.DataFrame:
    half_wins = table[effect] * 2 * repetitions**2
    if ((half_wins - half_wins.round()).abs() > _ROUNDING).any():
        raise InputError(f"{path}: has an A12 that {repetitions} repetitions cannot give")
    shares = half_wins.round() / (2 * repetitions**2)
    bounds = [superiority_interval(float(share), repetitions) for share in shares]
    return table.assign(low=[low for low, _ in bounds], high=[high for _, high in bounds])


def _pages(path: Path, old: pd.DataFrame, new: pd.DataFrame, repetitions: int) -> Iterator[tuple[Path, str | bytes]]:
    """The files beside a table that show its intervals, with the new ones."""
    page = path.with_suffix(".md")
    if "ours_better" in new:
        yield page, rivals_page(new)
    elif "comparison" in new:
        yield _replaced(path.with_name("tune.md"), old, new, _tuned_markdown)
    elif "median_in_space" in new:
        yield _replaced(page, old, new, comparison_markdown)
    elif path.stem == f"{VARIANTS_EXPERIMENT}_duels":
        yield _replaced(path.with_name("study.md"), old, new, effects_markdown)
        for suffix, image in draw_ingredients(new).items():
            yield path.with_name(f"{VARIANTS_EXPERIMENT}.{suffix}"), image
    elif page.exists():
        subject = str(new["subject"].iloc[0])
        name = path.stem.removesuffix(f"_{file_name(subject)}_duels")
        yield page, duels_page(name, subject, new, repetitions)


def _replaced(
    page: Path, old: pd.DataFrame, new: pd.DataFrame, render: Callable[[pd.DataFrame], str]
) -> tuple[Path, str]:
    text, shown = page.read_text(), render(old)
    if shown not in text:
        raise InputError(f"{page}: shows other intervals than the table beside it; its command writes both anew")
    return page, text.replace(shown, render(new))


def _tuned_markdown(table: pd.DataFrame) -> str:
    rows = table[table["comparison"] == ALL_TUNED]
    fought = {
        str(problem): [
            Duel(row["subject"], row["rival"], row["superiority"], row["low"], row["high"], row["p_holm"])
            for row in group.to_dict("records")
        ]
        for problem, group in rows.groupby("problem", sort=False)
    }
    return duels_by_rival(list(fought.items()))
