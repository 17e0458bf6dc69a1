"""Tables of outcomes: trials, summaries, times, average convergence, and the summary as a Markdown page."""

from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from itertools import chain, islice
from typing import Any

import numpy as np
import pandas as pd

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.report.page import Table
from bench.config import Experiment
from bench.execute import Curves
from bench.plan import Entry
from bench.printed import display_name, read_printed
from bench.statistics import Summary, is_feasible, summarise
from bench.statistics.ends import row_quantiles
from bench.store import OutcomeFigures, RunStore

CELL_COLUMNS = ["problem", "swarm_size", "budget"]
GROUP_COLUMNS = [*CELL_COLUMNS, "algorithm"]
_ROWS_PER_PIECE = 4096  # that are Python objects at a time; in the table a row takes some tens of bytes


def tidy_frame(entries: Iterable[Entry], store: RunStore) -> pd.DataFrame:
    """One row a trial in the order of the entries, without those that were not run yet; arrays are not read.

    A trial that failed has its reason in `failure`, which is empty elsewhere, and counts as a loss: no value, and an
    infinite violation and fitness. Raises InputError if there is no trial at all.
    """
    rows = (row for entry in entries if (row := _trial_row(entry, store)) is not None)
    pieces = list(_frame_pieces(rows))
    if not pieces:
        raise InputError(f"{store.path} holds none of these trials")
    frame = pd.concat(pieces, ignore_index=True)
    return frame.assign(dimension=frame.groupby("problem")["dimension"].transform("max"))


def _frame_pieces(rows: Iterator[dict[str, object]]) -> Iterator[pd.DataFrame]:
    for first in rows:
        yield pd.DataFrame(list(chain([first], islice(rows, _ROWS_PER_PIECE - 1))))


_FAILED = OutcomeFigures(np.nan, np.inf, np.inf, evaluations=0, seconds=np.nan, dimension=0)


def _trial_row(entry: Entry, store: RunStore) -> dict[str, object] | None:
    """The numbers and labels of one trial by column; None where it was not run yet."""
    if store.has(entry.key):
        return entry_labels(entry) | store.figures(entry.key)._asdict() | {"failure": ""}
    reason = store.failure(entry.key)
    return None if reason is None else entry_labels(entry) | _FAILED._asdict() | {"failure": reason}


def failed_sentences(frame: pd.DataFrame) -> list[str]:
    """How many trials of whom failed, and why, a sentence each."""
    failed = frame[frame["failure"] != ""]
    return [
        f"{len(rows)} {'trials' if len(rows) > 1 else 'trial'} of {algorithm} on {problem} failed and "
        f"{'count' if len(rows) > 1 else 'counts'} as infeasible: {reason}"
        for (problem, algorithm, reason), rows in failed.groupby(["problem", "algorithm", "failure"], sort=False)
    ]


def missing_sentences(frame: pd.DataFrame, planned: Mapping[tuple[str, str], int]) -> list[str]:
    """How many trials of whom were not run, a sentence each; planned: trials by problem and algorithm."""
    there = frame.groupby(["problem", "algorithm"]).size()
    left = {pair: count - int(there.get(pair, 0)) for pair, count in planned.items()}
    return [
        f"{count} of {planned[problem, algorithm]} trials of {algorithm} on {problem} are missing"
        for (problem, algorithm), count in left.items()
        if count
    ]


def entry_labels(entry: Entry) -> dict[str, object]:
    """The labels of a trial by column."""
    return {
        "problem": entry.problem,
        "swarm_size": entry.trial.swarm_size,
        "budget": entry.trial.evaluations,
        "algorithm": entry.algorithm,
        "repetition": entry.trial.repetition,
    }


def cell_label(frame: pd.DataFrame, cell: tuple[Any, ...]) -> str:
    """A problem, with its swarm size and budget where the frame has several. cell: by `CELL_COLUMNS`."""
    problem, swarm_size, budget = cell
    parts = [str(problem)]
    parts += [f"{swarm_size} points"] if frame["swarm_size"].nunique() > 1 else []
    parts += [f"{budget} evaluations"] if frame["budget"].nunique() > 1 else []
    return ", ".join(parts)


SUMMARY_COLUMNS = ["algorithm", *Summary.__dataclass_fields__, "evaluations"]


def summary_table(frame: pd.DataFrame) -> pd.DataFrame:
    """One row a problem, swarm size, budget and algorithm, in the order of the frame.

    evaluations: average over the repetitions that did not fail. Problem and swarm size are left out where there is only
    one.
    """
    rows = [
        {
            **dict(zip(GROUP_COLUMNS, names, strict=True)),
            **asdict(summarise(group["value"].to_numpy(), group["violation"].to_numpy())),
            "evaluations": group.loc[group["evaluations"] > 0, "evaluations"].mean(),
        }
        for names, group in frame.groupby(GROUP_COLUMNS, sort=False)
    ]
    return pd.DataFrame(rows)[_varying_columns(frame) + SUMMARY_COLUMNS]


def times_table(frame: pd.DataFrame) -> pd.DataFrame:
    """Processor time of the search, s, by the same groups: average of a run, standard deviation, and total."""
    seconds = frame.groupby(GROUP_COLUMNS, sort=False)["seconds"]
    table = seconds.agg(average_seconds="mean", standard_deviation="std", total_seconds="sum").reset_index()
    return table[[*_varying_columns(frame), "algorithm", "average_seconds", "standard_deviation", "total_seconds"]]


def _varying_columns(frame: pd.DataFrame) -> list[str]:
    return [name for name in ("problem", "swarm_size") if frame[name].nunique() > 1]


def as_csv(table: pd.DataFrame) -> str:
    """CSV text with six significant digits, which rounding differences between machines rarely change."""
    return table.to_csv(index=False, float_format="%.6g", na_rep="nan", lineterminator="\n")


def convergence_table(entries: Sequence[Entry], store: RunStore) -> pd.DataFrame:
    """One row an algorithm and iteration; iteration 0 is the first population.

    median_best_so_far, median_present_best: over all repetitions, an infeasible point counting as infinite, so that the
    first never rises. best_so_far, present_best: the paper's averages, over the repetitions whose point is feasible at
    that time, NaN if there are none; the two shares give how many those are.
    """
    labels = dict.fromkeys(entry.algorithm for entry in entries)
    return pd.concat(
        [_average_convergence(label, _stored_curves(label, entries, store)) for label in labels],
        ignore_index=True,
    )


def _stored_curves(label: str, entries: Sequence[Entry], store: RunStore) -> list[Curves]:
    """The curves of an algorithm; a trial that failed has that of a run that found nothing."""
    own = [entry for entry in entries if entry.algorithm == label]
    return [store.get(entry.key).curves if store.has(entry.key) else _nothing_found(entry) for entry in own]


def _nothing_found(entry: Entry) -> Curves:
    nothing, violation = np.array([np.nan]), np.array([np.inf])
    return Curves(np.array([float(entry.trial.swarm_size)]), nothing, violation, nothing, violation)


def _average_convergence(label: str, curves: Sequence[Curves]) -> pd.DataFrame:
    moments = np.unique(np.concatenate([curve.evaluations for curve in curves]))
    best_ends = (
        _align_curves(moments, curves, [curve.best_value for curve in curves]),
        _align_curves(moments, curves, [curve.best_violation for curve in curves]),
    )
    present_ends = (
        _align_curves(moments, curves, [curve.present_value for curve in curves]),
        _align_curves(moments, curves, [curve.present_violation for curve in curves]),
    )
    best, best_share = _feasible_mean(*best_ends)
    present, present_share = _feasible_mean(*present_ends)
    return pd.DataFrame(
        {
            "algorithm": label,
            "iteration": np.arange(len(moments)),
            "evaluations": moments,
            "median_best_so_far": _median_end(*best_ends),
            "median_present_best": _median_end(*present_ends),
            "best_so_far": best,
            "best_so_far_feasible_share": best_share,
            "present_best": present,
            "present_best_feasible_share": present_share,
        }
    )


def _align_curves(moments: Array, curves: Sequence[Curves], rows: Sequence[Array]) -> Array:
    """The rows at common numbers of evaluations, (n, moments); populations need not be of one size.

    Before its first population a run has the value of that population, and after its end the value of its end.
    """
    places = [np.searchsorted(curve.evaluations, moments, side="right") - 1 for curve in curves]
    return np.stack([row[np.maximum(place, 0)] for row, place in zip(rows, places, strict=True)])


def _median_end(values: Array, violations: Array) -> Array:
    """Median of each column of (n, k), where an infeasible entry is infinite."""
    return row_quantiles(np.where(is_feasible(values, violations), values, np.inf).T, 0.5)


def _feasible_mean(values: Array, violations: Array) -> tuple[Array, Array]:
    """Averages over the feasible entries of each column of (n, k), and the shares of these entries."""
    feasible = is_feasible(values, violations)
    count = feasible.sum(axis=0)
    total = np.where(feasible, values, 0.0).sum(axis=0)
    mean = np.divide(total, count, out=np.full(len(count), np.nan), where=count > 0)
    return mean, count / len(values)


_SUMMARY_NOTE = """\
The figure is the problem's own, for an arm the condition number of the observation matrix of the
trajectory itself, without weights and penalty. Minimum, average and sample standard deviation (n - 1) are
of the feasible ends only, of which "feasible" gives the share; in the median and the quartiles an
infeasible end counts as infinite. Evaluations: those of one run, the first population included; every
algorithm has the same budget."""
_PRINTED_NOTE = """\
In brackets: the paper's Table 3 as printed. Its conventions cannot be recovered in full, so its figures stand
beside ours for their order of magnitude, not to be met. Its seconds are as printed; ours are in
`{name}_times.csv`, since no two runs share them."""
_SUMMARY_HEADINGS = {
    "minimum": "minimum",
    "average": "average",
    "standard_deviation": "standard deviation",
    "median": "median",
    "lower_quartile": "lower quartile",
    "upper_quartile": "upper quartile",
    "feasible_share": "feasible",
    "evaluations": "evaluations",
}
_PRINTED_COLUMNS = ("minimum", "average", "standard_deviation")


def summary_page(table: pd.DataFrame, experiment: Experiment, remarks: Sequence[str] = ()) -> str:
    """A summary table as a Markdown page; remarks: sentences on these trials, such as those that failed."""
    names = [name for name in table.columns if name not in _SUMMARY_HEADINGS]
    headings = [*names, *_SUMMARY_HEADINGS.values(), *(["seconds (paper)"] if experiment.printed else [])]
    rows = [_summary_cells(row, names, experiment.printed) for row in table.to_dict("records")]
    notes = [*remarks, _SUMMARY_NOTE, *([_PRINTED_NOTE.format(name=experiment.name)] if experiment.printed else [])]
    return markdown_page(experiment.name, _settings_line(experiment), markdown_table(headings, rows), *notes)


def summary_for_print(table: pd.DataFrame) -> Table:
    """A summary table as the cells that a paper prints."""
    names = [name for name in table.columns if name not in _SUMMARY_HEADINGS]
    rows = [_summary_cells(row, names, beside=False) for row in table.to_dict("records")]
    texts = [place for place, name in enumerate(names) if name != "swarm_size"]
    return Table([*names, *_SUMMARY_HEADINGS.values()], rows, texts)


def _settings_line(experiment: Experiment) -> str:
    return (
        f"{experiment.repetitions} repetitions, seed {experiment.seed}, bounds: {experiment.bounds}. "
        f"All settings: `{experiment.name}.settings.yaml`."
    )


def _summary_cells(row: dict[Hashable, Any], names: list[str], beside: bool) -> list[str]:
    label = str(row["algorithm"])
    paper = read_printed().table3.rows.get(label) if beside else None
    cells = [display_name(label) if name == "algorithm" else str(row[name]) for name in names]
    for name in _SUMMARY_HEADINGS:
        ours = _format_number(name, row[name])
        cells.append(f"{ours} ({getattr(paper, name):g})" if paper and name in _PRINTED_COLUMNS else ours)
    return [*cells, f"{paper.seconds:g}" if paper else "-"] if beside else cells


def _format_number(name: str, value: float) -> str:
    if name == "feasible_share":
        return f"{value:.0%}"
    return f"{value:.0f}" if name == "evaluations" and np.isfinite(value) else f"{value:.3g}"
