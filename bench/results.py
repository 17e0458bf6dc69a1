"""The result files of an experiment, from the run store: tables, figures, and the settings that made them."""

import json
from pathlib import Path

from algorithms.registry import load
from bench.config import Experiment
from bench.files import write_with_settings
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

Files = dict[str, str | bytes]


def write_results(experiment: Experiment, entries: Plan, settings: str, store: RunStore, folder: Path) -> list[Path]:
    """Write the files that the experiment's `output` names; returns their paths."""
    make = {
        "table": _table_files,
        "swarm_sizes": _swarm_size_files,
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


def _swarm_size_files(experiment: Experiment, entries: Plan, store: RunStore) -> Files:
    from bench.figures import draw_cost, draw_times  # matplotlib takes longer to import than a small run

    frame = tidy_frame(entries, store)
    cost, times = draw_cost(summary_table(frame)), draw_times(times_table(frame))
    figures = _image_files(experiment.name, cost) | _image_files(f"{experiment.name}_times", times)
    return _table_files(experiment, entries, store) | figures


def _convergence_files(experiment: Experiment, entries: Plan, store: RunStore) -> Files:
    from bench.figures import draw_convergence  # matplotlib takes longer to import than a small run

    table = convergence_table(entries, store)
    return {f"{experiment.name}.csv": as_csv(table)} | _image_files(experiment.name, draw_convergence(table))


def _image_files(name: str, images: dict[str, bytes]) -> Files:
    return {f"{name}.{suffix}": image for suffix, image in images.items()}
