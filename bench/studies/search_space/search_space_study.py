"""`armlab paper search-space`: runs the missing trials of its configuration in both search spaces, compares them."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import pandas as pd

from armlab.common.errors import InputError
from armlab.common.files import write_whole
from armlab.common.markdown import markdown_page, markdown_table
from bench.execute import canonical
from bench.plan import Plan
from bench.printed import display_name
from bench.run import ProgressBar, RunOptions, describe_run, load_experiment, run_experiment
from bench.statistics import summarise
from bench.statistics.pairwise import duels
from bench.statistics.power import power_text
from bench.store import open_store
from bench.studies.best_known.records import record_key, records_by_problem
from bench.studies.search_space.loss import RANDOM_POINTS, SpaceFigures, measure_space
from bench.tables import as_csv, tidy_frame
from problem.registry import ProblemSettings

CONFIG = "search_space.yaml"
FEASIBLE_MARK = " feasible"
"""Ends the label of a problem, or an algorithm, in the feasible search space."""


def make_search_space(configs: Path, options: RunOptions, records: Path, bar: ProgressBar) -> Iterator[Path]:
    """Run the missing trials and write all files into the results folder; yields the files as they are written.

    configs: the folder with the configuration. records: the best known trajectories. Raises the errors of
    `run_experiment`, and InputError for a problem that is not there in both search spaces, or has no record.
    """
    entries = load_experiment(configs / CONFIG).entries
    pairs = pair_problems({entry.problem: entry.trial.problem for entry in entries.first_entries()})
    figures = measure_spaces(entries, list(pairs), records)
    yield from run_experiment(configs / CONFIG, options, bar)
    with open_store(options.store) as store:
        comparison = comparison_table(tidy_frame(entries, store), pairs)
    given_up = pd.DataFrame([each.row() for each in figures])
    files = {
        "comparison.csv": as_csv(comparison),
        "given_up.csv": as_csv(given_up),
        "comparison.md": search_space_page(comparison, figures, entries.repetitions),
    }
    for name, content in files.items():
        write_whole(options.results / name, content)
        yield options.results / name


def describe_search_space(configs: Path, options: RunOptions) -> Iterator[str]:
    """Lines that list the trials and estimate the time."""
    yield from describe_run(configs / CONFIG, options)


def pair_problems(settings: Mapping[str, ProblemSettings]) -> dict[str, str]:
    """By the label of each problem in its coefficients, the label of the same one in the feasible search space.

    Raises InputError for a problem that has no counterpart.
    """
    spaces: dict[str, dict[bool, str]] = {}
    for label, each in settings.items():
        content = each.model_dump(mode="json")
        feasible = content.pop("search_space", None) == "feasible"
        spaces.setdefault(canonical(content), {})[feasible] = label
    for found in spaces.values():
        if len(found) == 1:
            raise InputError(f"{CONFIG}: '{next(iter(found.values()))}' should be there in both search spaces")
    return {found[False]: found[True] for found in spaces.values()}


def measure_spaces(entries: Plan, labels: Sequence[str], records: Path) -> list[SpaceFigures]:
    """The figures of each problem, by the labels in their coefficients; InputError where there is no record."""
    known = records_by_problem(records)
    settings = {entry.problem: entry.trial.problem for entry in entries.first_entries()}
    for label in labels:
        if record_key(settings[label]) not in known:
            raise InputError(f"{records}: has no best known trajectory of '{label}'")
    return [measure_space(label, settings[label], known[record_key(settings[label])]) for label in labels]


def comparison_table(frame: pd.DataFrame, pairs: Mapping[str, str]) -> pd.DataFrame:
    """One row a problem and algorithm: medians and feasible shares in both spaces, and the duel of the two.

    frame: as `tidy_frame` returns it. superiority: probability that the run in the feasible search space ends better.
    """
    rows = []
    for plain, space in pairs.items():
        ours = frame[frame["problem"] == space]
        both = pd.concat([frame[frame["problem"] == plain], ours.assign(algorithm=ours["algorithm"] + FEASIBLE_MARK)])
        ends = {
            label: summarise(group["value"].to_numpy(), group["violation"].to_numpy())
            for label, group in both.groupby("algorithm", sort=False)
        }
        names = [str(name) for name in ours["algorithm"].unique()]
        for name, duel in zip(names, duels(both, [(name + FEASIBLE_MARK, name) for name in names]), strict=True):
            rows.append(
                {
                    "problem": plain,
                    "algorithm": name,
                    "median": ends[name].median,
                    "feasible_share": ends[name].feasible_share,
                    "median_in_space": ends[name + FEASIBLE_MARK].median,
                    "feasible_share_in_space": ends[name + FEASIBLE_MARK].feasible_share,
                    "superiority": duel.superiority,
                    "low": duel.low,
                    "high": duel.high,
                    "p_holm": duel.p,
                    "better": {None: "", name: "coefficients"}.get(duel.winner(), "feasible"),
                }
            )
    return pd.DataFrame(rows)


_READING = """\
Both search spaces hold the same series; in the feasible one every point keeps the limits of position, velocity and
acceleration at every instant (`docs/problem.md`). Pairs of runs have the same numbers in their first population and the
same budget. Medians are of the condition number; an infeasible end counts as infinite, and the share of the feasible
ones stands in brackets where it is not 100 %. A12: chance that the run in the feasible search space ends better, with
its 95 % interval; p: Wilcoxon's signed-rank test on log10 of the condition number, Holm over the algorithms of a
problem."""
_GIVEN_UP_READING = """\
Feasible points: share of {points} random points of the box that keep all limits at the samples, in the coefficients and
in the feasible search space. Excess: by which the best known trajectory breaks limits between its samples, summed over
the limits, relative to each; the feasible search space does not allow that. Moved: the best known trajectory, shrunk to
where the space begins. Improved: the end of a descent in the space from there; given up: its excess over the best
known."""


def comparison_markdown(comparison: pd.DataFrame) -> str:
    """The comparison of both spaces as a Markdown table."""
    headings = ["problem", "algorithm", "coefficients", "feasible space", "A12", "p", "better"]
    rows = [
        (
            row["problem"],
            display_name(row["algorithm"]),
            _median(row["median"], row["feasible_share"]),
            _median(row["median_in_space"], row["feasible_share_in_space"]),
            f"{row['superiority']:.2f} [{row['low']:.2f}, {row['high']:.2f}]",
            f"{row['p_holm']:.2g}",
            row["better"] or "-",
        )
        for row in comparison.to_dict("records")
    ]
    return markdown_table(headings, rows)


def search_space_page(comparison: pd.DataFrame, figures: Sequence[SpaceFigures], repetitions: int) -> str:
    """Both tables as a Markdown page."""
    lost = [
        (
            each.problem,
            f"{each.feasible_points:.2%}",
            f"{each.feasible_points_of_space:.0%}",
            f"{each.best_known:.5g}",
            f"{each.excess:.2%}",
            f"{each.moved:.5g}",
            f"{each.improved:.5g}",
            f"{each.loss:.2%}",
        )
        for each in figures
    ]
    lost_headings = ["problem", "feasible points", "in space", "best known", "excess", "moved", "improved", "given up"]
    comparisons = comparison["algorithm"].nunique()
    return markdown_page(
        "The feasible search space",
        "## Each algorithm in both spaces",
        f"{_READING} {power_text(repetitions, comparisons)}. Settings: `search_space.settings.yaml`.",
        comparison_markdown(comparison),
        "## What it gives up",
        markdown_table(lost_headings, lost),
        _GIVEN_UP_READING.format(points=RANDOM_POINTS),
    )


def _median(median: float, share: float) -> str:
    return f"{median:.3g}" if share == 1 else f"{median:.3g} ({share:.0%})"
