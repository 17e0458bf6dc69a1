"""`armlab paper study`: runs the missing trials of its experiments and writes tables, figures and one page over all."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from armlab.common.files import write_whole
from bench.plan import Plan
from bench.run import LoadedExperiment, ProgressBar, RunOptions, describe_run, load_experiment, run_experiment
from bench.store import open_store
from bench.studies.best_known.records import best_known_values
from bench.studies.beyond_paper.beyond_paper_page import (
    StudyPart,
    effect_table,
    median_table,
    study_page,
    subject_duels_table,
    variant_duels_table,
)
from bench.studies.mutations import mutation_table
from bench.tables import as_csv, tidy_frame

SUBJECT = "mupso"
VARIANTS_EXPERIMENT = "study_mupso"
EXPERIMENTS = {
    "study_joint_fourier": "Five harmonics in joint space, the comparison of Table 3 with two more.",
    "study_random_frames": "Coordinates shifted at random: what is drawn to the origin of coordinates loses it.",
    "study_equal_evaluations": "Swarm sizes at equal evaluations.",
    "study_six_joints": "All six joints: 36 base parameters, 66 numbers.",
    "study_budgets": "Budgets from 1,500 to 150,000 evaluations; every run is planned for its own.",
    "study_mupso": "MuPSO's ingredients one by one; A12 above 0.5: the change helps.",
}
Files = dict[str, str | bytes]


@dataclass(frozen=True, eq=False)
class _Outcomes:
    frames: Mapping[str, pd.DataFrame]
    entries: Mapping[str, Plan]


def make_study(configs: Path, options: RunOptions, records: Path, bar: ProgressBar) -> Iterator[Path]:
    """Run the missing trials and write all files into the results folder; yields the files as they are written.

    configs: the folder with one configuration for each experiment. records: the best known trajectories. Raises the
    errors of `run_experiment`; finished trials stay in the store.
    """
    loaded = {name: load_experiment(configs / f"{name}.yaml") for name in EXPERIMENTS}
    for name in EXPERIMENTS:
        yield from run_experiment(configs / f"{name}.yaml", options, bar)
    for name, content in _make_files(_read_outcomes(loaded, options), records, options.workers).items():
        write_whole(options.results / name, content)
        yield options.results / name


def describe_study(configs: Path, options: RunOptions) -> Iterator[str]:
    """Lines that list the trials and estimate the time."""
    for name in EXPERIMENTS:
        yield from describe_run(configs / f"{name}.yaml", options)


def _read_outcomes(loaded: Mapping[str, LoadedExperiment], options: RunOptions) -> _Outcomes:
    entries = {name: experiment.entries for name, experiment in loaded.items()}
    with open_store(options.store) as store:
        return _Outcomes({name: tidy_frame(found, store) for name, found in entries.items()}, entries)


def _make_files(outcomes: _Outcomes, records: Path, workers: int) -> Files:
    from bench.comparison_figures import draw_budgets
    from bench.studies.beyond_paper.beyond_paper_figures import draw_ingredients, draw_swarm_sizes

    frames = outcomes.frames
    duels = {name: _duels_table(name, frame) for name, frame in frames.items()}
    mutations = mutation_table(outcomes.entries[VARIANTS_EXPERIMENT], workers)
    known = {name: best_known_values(entries, records) for name, entries in outcomes.entries.items()}
    figures = {
        "study_budgets": draw_budgets(frames["study_budgets"], known["study_budgets"]),
        "study_equal_evaluations": draw_swarm_sizes(frames["study_equal_evaluations"]),
        VARIANTS_EXPERIMENT: draw_ingredients(duels[VARIANTS_EXPERIMENT]),
    }
    shown = {name: median_table(frame, known[name]) for name, frame in frames.items()} | {
        VARIANTS_EXPERIMENT: effect_table(duels[VARIANTS_EXPERIMENT])
    }
    parts = [
        StudyPart(name, text, frames[name], shown[name], duels[name], name in figures)
        for name, text in EXPERIMENTS.items()
    ]
    return {
        **{f"{name}_duels.csv": as_csv(table) for name, table in duels.items()},
        "study_mupso_mutations.csv": as_csv(mutations),
        **{f"{name}.{suffix}": image for name, images in figures.items() for suffix, image in images.items()},
        "study.md": study_page(parts, mutations),
    }


def _duels_table(name: str, frame: pd.DataFrame) -> pd.DataFrame:
    return variant_duels_table(frame, SUBJECT) if name == VARIANTS_EXPERIMENT else subject_duels_table(frame, SUBJECT)
