"""`armlab paper replication`: all tables and figures of the paper and the replication report, in one folder."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from algorithms.parameter_types import OURS
from armlab.common.errors import InputError
from armlab.common.files import write_whole
from armlab.common.settings import Settings, settings_to_yaml
from bench.printed import read_printed
from bench.run import LoadedExperiment, ProgressBar, RunOptions, describe_run, load_experiment, run_experiment
from bench.store import open_store
from bench.studies.best_known.records import best_known_values
from bench.studies.mutations import MutationHistory, replay_mutations
from bench.studies.paper.claims import Evidence, literal_readings
from bench.studies.paper.paper_settings import (
    Figure4Settings,
    Table1Settings,
    Table2Settings,
    Table4Settings,
    TrajectorySettings,
    read_settings,
)
from bench.studies.paper.paper_tables import (
    make_table1,
    make_table2,
    make_table4,
    table1_deviations,
    table2_differences,
)
from bench.studies.paper.published_coefficients import published_readings
from bench.studies.paper.ranking import (
    SUBJECT,
    TWO_PROGRAMS,
    frame_read_as,
    frames_by_reading,
    ranking_table,
    standings,
)
from bench.studies.paper.simulated_identification import BestRun, find_best_run, simulate_identification
from bench.studies.paper.tuned import TunedEvidence, read_tuned_evidence
from bench.tables import as_csv, tidy_frame

EXPERIMENTS = ("table3", "figure2", "figure2_equal_evaluations", "figure3", "ranking")
STAGNATION_READINGS = ("second_difference", "no_improvement")
Files = dict[str, str | bytes]


@dataclass(frozen=True)
class _ItemSettings:
    """The settings of the tables and figures that are no experiments."""

    table1: Table1Settings
    table2: Table2Settings
    figure4: Figure4Settings
    figure5: TrajectorySettings
    table4: Table4Settings


def make_paper(configs: Path, options: RunOptions, records: Path, bar: ProgressBar) -> Iterator[Path]:
    """Run the missing trials and write all files into the results folder; yields the files as they are written.

    configs: the folder with one configuration for each table and figure. records: the best known trajectories, in the
    folder that holds `tune` and `study`, the results of `armlab bench tune` and `armlab paper study`. Raises the errors
    of `run_experiment`.
    """
    items = _read_items(configs)
    tuned = read_tuned_evidence(records.parent / "tune", records.parent / "study")
    loaded = {name: load_experiment(configs / f"{name}.yaml") for name in EXPERIMENTS}
    for name in EXPERIMENTS:
        yield from run_experiment(configs / f"{name}.yaml", options, bar)
    evidence = _gather_evidence(items, loaded, options, records)
    files = _make_files(items, loaded, evidence, records) | _settings_files(items)
    yield from _write_files(options.results, files)
    yield from _write_files(options.results, _report_files(evidence, tuned, options.results))


def describe_paper(configs: Path, options: RunOptions) -> Iterator[str]:
    """Lines that list the trials and estimate the time."""
    for name in EXPERIMENTS:
        yield from describe_run(configs / f"{name}.yaml", options)


def _read_items(configs: Path) -> _ItemSettings:
    return _ItemSettings(
        read_settings(Table1Settings, configs / "table1.yaml"),
        read_settings(Table2Settings, configs / "table2.yaml"),
        read_settings(Figure4Settings, configs / "figure4.yaml"),
        read_settings(TrajectorySettings, configs / "figure5.yaml"),
        read_settings(Table4Settings, configs / "table4.yaml"),
    )


def _gather_evidence(
    items: _ItemSettings, loaded: Mapping[str, LoadedExperiment], options: RunOptions, records: Path
) -> Evidence:
    paper = read_printed()
    frames, best = _read_outcomes(items, loaded, options)
    known = best_known_values(loaded["ranking"].entries, records)
    return Evidence(
        paper=paper,
        frames=frames,
        deviations=table1_deviations(items.table1.arm, paper),
        differences=table2_differences(loaded[items.table2.experiment].entries, paper),
        rankings={reading: standings(frame, known) for reading, frame in frames_by_reading(frames["ranking"]).items()},
        two_programs=standings(frame_read_as(frames["ranking"], dict.fromkeys(TWO_PROGRAMS, "program")), known),
        default=_default_label(loaded),
        mutation_histories=_replay_subject(loaded["table3"], options.workers),
        best=best,
        found=simulate_identification(items.table4, best),
        published=published_readings(paper.optimum),
        readings=literal_readings(paper),
    )


def _default_label(loaded: Mapping[str, LoadedExperiment]) -> str:
    """The label of Table 3's problem among the conventions of the ranking."""
    wanted = loaded["table3"].entries[0].trial.problem
    labels = [entry.problem for entry in loaded["ranking"].entries.first_entries() if entry.trial.problem == wanted]
    if not labels:
        raise InputError("the ranking should have the problem of Table 3 among its conventions")
    return labels[0]


def _read_outcomes(
    items: _ItemSettings, loaded: Mapping[str, LoadedExperiment], options: RunOptions
) -> tuple[dict[str, pd.DataFrame], BestRun]:
    with open_store(options.store) as store:
        frames = {name: tidy_frame(found.entries, store) for name, found in loaded.items()}
        return frames, find_best_run(loaded[items.table4.experiment].entries, store, items.table4.algorithm)


def _replay_subject(loaded: LoadedExperiment, workers: int) -> dict[str, list[MutationHistory]]:
    runs = [entry for entry in loaded.entries if entry.trial.algorithm == SUBJECT]
    return {reading: replay_mutations(runs, workers, stagnation=reading) for reading in STAGNATION_READINGS}


def _make_files(
    items: _ItemSettings, loaded: Mapping[str, LoadedExperiment], evidence: Evidence, records: Path
) -> Files:
    from bench.comparison_figures import draw_ends, draw_ranking
    from bench.studies.paper.trajectory_figures import draw_figure4, draw_figure5

    known = best_known_values(loaded["table3"].entries, records)
    usable = [standing.problem for standing in evidence.ranking if standing.usable]
    ranking = frames_by_reading(evidence.frames["ranking"])[OURS]
    figures = {
        "table3": draw_ends(evidence.frames["table3"], known),
        "ranking": draw_ranking(ranking[ranking["problem"].isin(usable)]),
        items.figure4.name: draw_figure4(items.figure4, evidence.best),
        items.figure5.name: draw_figure5(items.figure5, evidence.best),
    }
    return {
        **make_table1(items.table1, evidence.paper),
        **make_table2(items.table2, loaded[items.table2.experiment].entries, evidence.paper),
        **make_table4(items.table4, evidence.best, evidence.found, evidence.paper),
        **{f"{name}.{suffix}": image for name, images in figures.items() for suffix, image in images.items()},
        "ranking_duels.csv": as_csv(
            pd.concat(
                [ranking_table(found).assign(reading=reading) for reading, found in evidence.rankings.items()],
                ignore_index=True,
            )
        ),
    }


def _settings_files(items: _ItemSettings) -> Files:
    every: tuple[Settings, ...] = (items.table1, items.table2, items.figure4, items.figure5, items.table4)
    return {f"{item.model_dump()['name']}.settings.yaml": settings_to_yaml(item) for item in every}


def _report_files(evidence: Evidence, tuned: TunedEvidence, folder: Path) -> Files:
    from bench.studies.paper.replication_page import FIGURE_CAPTIONS, markdown_to_html, replication_page

    text = replication_page(evidence, tuned)
    images = {name: (folder / name).read_bytes() for name in FIGURE_CAPTIONS}
    return {"replication.md": text, "replication.html": markdown_to_html("What could be reproduced", text, images)}


def _write_files(folder: Path, files: Files) -> Iterator[Path]:
    for name, content in files.items():
        write_whole(folder / name, content)
        yield folder / name
