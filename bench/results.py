"""The result files of an experiment, from the run store: tables, figures, and the settings that made them."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import pandas as pd

from algorithms.registry import load
from bench.config import Experiment
from bench.files import file_name, write_with_settings
from bench.fingerprint import calls_lapack
from bench.plan import Plan, rival_pairs
from bench.store import RunStore
from bench.tables import (
    as_csv,
    convergence_table,
    failed_sentences,
    summary_page,
    summary_table,
    tidy_frame,
    times_table,
)
from bench.value_names import value_name

Files = dict[str, str | bytes]


def write_results(experiment: Experiment, entries: Plan, settings: str, store: RunStore, folder: Path) -> list[Path]:
    """Write the files that the experiment's `output` names; returns their paths."""
    make = {
        "table": _table_files,
        "convergence": _convergence_files,
        "rivals": _rivals_files,
    }[experiment.output]
    return write_with_settings(folder, experiment.name, make(experiment, entries, store), settings)


def _table_files(experiment: Experiment, entries: Plan, store: RunStore) -> Files:
    frame = tidy_frame(entries, store)
    table = summary_table(frame)
    notes = [*(f"{text}." for text in failed_sentences(frame)), *_processor_notes(entries, store)]
    return {
        f"{experiment.name}.csv": as_csv(table),
        f"{experiment.name}.md": summary_page(table, experiment, notes),
        f"{experiment.name}_times.csv": as_csv(times_table(frame)),
        **_sweep_files(experiment, entries, frame),
    }


def _processor_notes(entries: Plan, store: RunStore) -> list[str]:
    """For whom the numbers of algorithms that call LAPACK hold, a sentence; empty without any."""
    series = [each for each in entries.series if calls_lapack(load(each.first.algorithm))]
    if not series:
        return []
    keys = (each.entry(repetition).key for each in series for repetition in range(entries.repetitions))
    origins = [json.loads(facts) for facts in store.origins(keys)]
    places = dict.fromkeys(
        f"{each.get('processor')} ({each.get('blas_kernels')}; {each.get('simd')})" for each in origins
    )
    names = ", ".join(dict.fromkeys(each.algorithm for each in series))
    return [f"These call LAPACK, and another processor gives them other numbers: {names}. Here: {'; '.join(places)}."]


def _rivals_files(experiment: Experiment, entries: Plan, store: RunStore) -> Files:
    from bench.rivals import rivals_page, rivals_table  # scipy's statistics take longer to import than a small run

    table = rivals_table(tidy_frame(entries, store), rival_pairs(entries.first_entries()))
    pages = {f"{experiment.name}_rivals.csv": as_csv(table), f"{experiment.name}_rivals.md": rivals_page(table)}
    return _table_files(experiment, entries, store) | pages


def _sweep_files(experiment: Experiment, entries: Plan, frame: pd.DataFrame) -> Files:
    """Figures against a key with several values, for each problem and value of the other keys."""
    sizes, budgets = len(experiment.swarm_size) > 1, len(experiment.iterations or experiment.evaluations or ()) > 1
    if not sizes and not budgets:
        return {}
    from bench.comparison_figures import draw_budgets
    from bench.figures import draw_cost, draw_times  # matplotlib takes longer to import than a small run

    files: Files = {}
    values = {entry.problem: value_name(entry.trial.problem) for entry in entries.first_entries()}
    rank = frame.groupby(["problem", "swarm_size"])["budget"].rank(method="dense")  # a budget may follow the size
    for place, problem, rows in _parts(frame.assign(place=rank), ["problem", "place"] if sizes else []):
        stem = experiment.name + place
        if sizes:
            files |= _image_files(stem, draw_cost(summary_table(rows), values[problem]))
            files |= _image_files(f"{stem}_times", draw_times(times_table(rows)))
    for place, _, rows in _parts(frame, ["problem", "swarm_size"] if budgets else []):
        files |= _image_files(f"{experiment.name}{place}_budgets", draw_budgets(rows, {}, figures=values))
    return files


def _parts(frame: pd.DataFrame, keys: Sequence[str]) -> Iterator[tuple[str, str, pd.DataFrame]]:
    """Part of a file's name, problem and rows for each combination of keys; nothing without keys."""
    if not keys:
        return
    varying = [key for key in keys if frame[key].nunique() > 1]
    for values, rows in frame.groupby(list(keys), sort=False):
        named = dict(zip(keys, values, strict=True))
        yield "".join(f"_{file_name(str(named[key]))}" for key in varying), str(named["problem"]), rows


def _convergence_files(experiment: Experiment, entries: Plan, store: RunStore) -> Files:
    from bench.figures import draw_convergence  # matplotlib takes longer to import than a small run

    files: Files = {}
    problems = list(dict.fromkeys(entry.problem for entry in entries.first_entries()))
    for problem in problems:
        stem = experiment.name if len(problems) == 1 else f"{experiment.name}_{file_name(problem)}"
        table = convergence_table([entry for entry in entries if entry.problem == problem], store)
        files |= {f"{stem}.csv": as_csv(table)} | _image_files(stem, draw_convergence(table))
    return files


def _image_files(name: str, images: dict[str, bytes]) -> Files:
    return {f"{name}.{suffix}": image for suffix, image in images.items()}
