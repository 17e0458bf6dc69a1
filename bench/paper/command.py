"""`armlab paper`: all tables and figures of the paper and the replication report, in one folder."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from bench.dry_run import describe
from bench.experiment import Loaded, Options, ProgressBar, load_experiment, run_loaded
from bench.files import write_whole
from bench.frame import tidy_frame
from bench.known_values import known_values
from bench.mutations import InnerLife, inner_lives
from bench.paper.best_run import BestRun, best_run
from bench.paper.evidence import Evidence, literal_readings
from bench.paper.identify import identify
from bench.paper.published import published_readings
from bench.paper.ranking import SUBJECT, ranking_table, standings
from bench.paper.settings import (
    Figure4Settings,
    Table1Settings,
    Table2Settings,
    Table4Settings,
    TrajectorySettings,
    as_yaml,
    read_settings,
)
from bench.paper.table1 import deviations, table1
from bench.paper.table2 import differences, table2
from bench.paper.table4 import table4
from bench.printed import printed
from bench.store import open_store
from bench.table import as_csv
from problem.settings import Settings

EXPERIMENTS = ("table3", "figure2", "figure2_equal_evaluations", "figure3", "ranking")
STAGNATION = ("second_difference", "no_improvement")
Files = dict[str, str | bytes]


@dataclass(frozen=True)
class _Items:
    """The settings of what is no experiment of its own."""

    table1: Table1Settings
    table2: Table2Settings
    figure4: Figure4Settings
    figure5: TrajectorySettings
    table4: Table4Settings


def make_paper(configs: Path, options: Options, records: Path, bar: ProgressBar) -> Iterator[Path]:
    """Run what is missing and write everything into the results folder; yields the files as they are written.

    configs: the folder with one configuration for each table and figure. records: the best known trajectories.
    Raises as `run_experiment` does.
    """
    items = _read_items(configs)
    loaded = {name: load_experiment(configs / f"{name}.yaml") for name in EXPERIMENTS}
    for experiment in loaded.values():
        yield from run_loaded(experiment, options, bar)
    evidence = _gather(items, loaded, options, records)
    files = _files(items, loaded, evidence) | _settings(items)
    yield from _write(options.results, files)
    yield from _write(options.results, _report(evidence, options.results))


def describe_paper(configs: Path, options: Options) -> Iterator[str]:
    """What would be run, and how long it would take."""
    for name in EXPERIMENTS:
        yield from describe(configs / f"{name}.yaml", options)


def _read_items(configs: Path) -> _Items:
    return _Items(
        read_settings(Table1Settings, configs / "table1.yaml"),
        read_settings(Table2Settings, configs / "table2.yaml"),
        read_settings(Figure4Settings, configs / "figure4.yaml"),
        read_settings(TrajectorySettings, configs / "figure5.yaml"),
        read_settings(Table4Settings, configs / "table4.yaml"),
    )


def _gather(items: _Items, loaded: Mapping[str, Loaded], options: Options, records: Path) -> Evidence:
    paper = printed()
    frames, best = _outcomes(items, loaded, options)
    return Evidence(
        paper=paper,
        frames=frames,
        deviations=deviations(items.table1.arm, paper),
        differences=differences(loaded[items.table2.experiment].entries, paper),
        ranking=standings(frames["ranking"], known_values(loaded["ranking"].entries, records)),
        lives=_lives(loaded["table3"], options.workers),
        best=best,
        found=identify(items.table4, best),
        published=published_readings(paper.optimum),
        readings=literal_readings(paper),
    )


def _outcomes(items: _Items, loaded: Mapping[str, Loaded], options: Options) -> tuple[dict[str, pd.DataFrame], BestRun]:
    with open_store(options.store) as store:
        frames = {name: tidy_frame(found.entries, store) for name, found in loaded.items()}
        return frames, best_run(loaded[items.table4.experiment].entries, store, items.table4.algorithm)


def _lives(loaded: Loaded, workers: int) -> dict[str, list[InnerLife]]:
    runs = [entry for entry in loaded.entries if entry.trial.algorithm == SUBJECT]
    return {reading: inner_lives(runs, workers, stagnation=reading) for reading in STAGNATION}


def _files(items: _Items, loaded: Mapping[str, Loaded], evidence: Evidence) -> Files:
    from bench.paper.figure4 import draw_figure4
    from bench.paper.figure5 import draw_figure5

    figures = {
        items.figure4.name: draw_figure4(items.figure4, evidence.best),
        items.figure5.name: draw_figure5(items.figure5, evidence.best),
    }
    return {
        **table1(items.table1, evidence.paper),
        **table2(items.table2, loaded[items.table2.experiment].entries, evidence.paper),
        **table4(items.table4, evidence.best, evidence.found, evidence.paper),
        **{f"{name}.{suffix}": image for name, images in figures.items() for suffix, image in images.items()},
        "ranking_duels.csv": as_csv(ranking_table(evidence.ranking)),
    }


def _settings(items: _Items) -> Files:
    every: tuple[Settings, ...] = (items.table1, items.table2, items.figure4, items.figure5, items.table4)
    return {f"{item.model_dump()['name']}.settings.yaml": as_yaml(item) for item in every}


def _report(evidence: Evidence, folder: Path) -> Files:
    from bench.paper.html import as_html
    from bench.paper.report import FIGURES, replication

    text = replication(evidence)
    images = {name: (folder / name).read_bytes() for name in FIGURES}
    return {"replication.md": text, "replication.html": as_html("What could be reproduced", text, images)}


def _write(folder: Path, files: Files) -> Iterator[Path]:
    for name, content in files.items():
        write_whole(folder / name, content)
        yield folder / name
