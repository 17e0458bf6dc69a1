"""`armlab bench tune`: tunes every algorithm, judges all on problems that took no part, writes tables and a page."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from armlab.common.errors import InputError
from armlab.common.settings import settings_to_yaml, suggest_name
from bench.comparison_figures import draw_ranking
from bench.files import check_folder, write_with_settings
from bench.plan import plan_trials
from bench.run import ProgressBar
from bench.store import open_store
from bench.studies.best_known.records import best_known_values
from bench.studies.tuning.judged import TUNED, JudgedRuns, ends_path, ends_table, sweep_label
from bench.studies.tuning.parameter_search import Tuned, run_frame, tune_algorithm
from bench.studies.tuning.tuning_page import TuningOutcome, configurations_table, tuning_page
from bench.studies.tuning.tuning_settings import TuningSettings, read_tuning
from bench.tables import as_csv


@dataclass(frozen=True)
class TuningOptions:
    """algorithms: only these of the configuration, all if empty. configurations: in place of the configuration's.

    store: file of the run store. results: folder. workers: processes. records: the best known trajectories.
    """

    algorithms: tuple[str, ...]
    configurations: int | None
    store: Path
    results: Path
    records: Path
    workers: int
    overwrite: bool = False


def tune_algorithms(path: Path, options: TuningOptions, bar: ProgressBar) -> Iterator[Path]:
    """Tune, judge and write; yields the written files.

    It can be stopped at any time: what was run is in the store, and the same command goes on from there. Raises
    InputError, in one line, for any mistake in the configuration; StoppedError, TrialsFailedError.
    """
    settings = _chosen(read_tuning(path), options)
    plan_trials(
        settings.experiment(_published(settings) + _swept(settings), judging=True), str(path)
    )  # a mistake is told before the hours of tuning
    check_folder(options.results, settings.name, settings_to_yaml(settings), options.overwrite)
    with open_store(options.store) as store:
        with bar(settings.configurations * len(settings.algorithms), 0) as progress:
            tuned = [tune_algorithm(settings, name, store, progress.update) for name in settings.algorithms]
        plan = plan_trials(settings.experiment(_contestants(settings, tuned), judging=True), "tuning")
        frame = run_frame(plan, store, options.workers)
    known = best_known_values(plan.first_entries(), options.records)
    runs = JudgedRuns(settings, frame)
    files: dict[str, str | bytes] = {
        f"{settings.name}_configurations.csv": as_csv(configurations_table(tuned)),
        f"{settings.name}_judged.csv": as_csv(runs.medians().reset_index()),
        ends_path(options.results, settings.name).name: as_csv(ends_table(frame)),
        f"{settings.name}_duels.csv": as_csv(runs.duels_table()),
        **{f"{settings.name}_ranking.{suffix}": image for suffix, image in draw_ranking(runs.contest()).items()},
        f"{settings.name}.md": tuning_page(TuningOutcome(tuple(tuned), runs, known)),
    }
    yield from write_with_settings(options.results, settings.name, files, settings_to_yaml(settings))


def _chosen(settings: TuningSettings, options: TuningOptions) -> TuningSettings:
    for name in options.algorithms:
        if name not in settings.algorithms:
            raise InputError(
                f"'{settings.name}' does not tune '{name}': {suggest_name(name, list(settings.algorithms))}"
            )
    changes: dict[str, object] = {}
    if options.algorithms:
        changes["algorithms"] = {name: settings.algorithms[name] for name in options.algorithms}
        if settings.sweep is not None and settings.sweep.algorithm not in options.algorithms:
            changes["sweep"] = None
    if options.configurations is not None:
        changes["configurations"] = options.configurations
    return settings.model_copy(update=changes)


def _contestants(settings: TuningSettings, tuned: Sequence[Tuned]) -> list[dict[str, object]]:
    """Each algorithm as published and as tuned, and the sweep of one hyper-parameter."""
    chosen: list[dict[str, object]] = [
        {"name": one.algorithm, "label": f"{one.algorithm}{TUNED}", "params": dict(one.best.params)} for one in tuned
    ]
    return _published(settings) + chosen + _swept(settings)


def _published(settings: TuningSettings) -> list[dict[str, object]]:
    return [{"name": name} for name in settings.algorithms]


def _swept(settings: TuningSettings) -> list[dict[str, object]]:
    sweep = settings.sweep
    if sweep is None:
        return []
    return [
        {
            "name": sweep.algorithm,
            "label": sweep_label(sweep.algorithm, sweep.parameter, value),
            "params": {sweep.parameter: value},
        }
        for value in sweep.values
    ]
