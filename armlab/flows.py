"""Whole flows as functions for scripts and notebooks: they return what the command line writes to files."""

from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pandas as pd
from joblib import cpu_count

from armlab.common.arrays import Array
from armlab.common.errors import DataError, InputError
from armlab.common.notebook import notebook_html
from armlab.common.settings import suggest_name
from armlab.effects.contract import Candidate
from armlab.identification.identifier import METHODS, Identifier
from armlab.identification.identify import robot_path, wrong_reading
from armlab.identification.model import Model
from armlab.identification.torque_model import TorqueModel
from armlab.identification.validation import RunError, format_percent, run_error
from armlab.recordings.identifiable import require_identifiable, require_possible, require_torque
from armlab.recordings.recording import Recording
from bench.config import find_algorithm, parse_params
from bench.execute import Outcome, Trial, run_trial
from bench.run import Progress, RunOptions, load_experiment
from bench.run import run_experiment as write_experiment
from bench.store import open_store
from bench.tables import summary_table, tidy_frame
from problem.registry import parse_problem

SHOWN = 4  # runs or problems in a repr; the others are counted


def search(
    problem: str | Mapping[str, Any],
    algorithm: str = "l-shade",
    *,
    evaluations: int = 5000,
    swarm_size: int = 50,
    seed: int = 0,
    params: Mapping[str, Any] | None = None,
) -> Outcome:
    """The best point that an algorithm finds on a problem within a budget of evaluations.

    problem: the name of a preset, or its settings as in a configuration, `{"preset": "paper", "duration": 5.0}`.
    params: hyper-parameters that differ from the algorithm's defaults. The outcome is that of repetition 0 of an
    experiment with the same settings. Raises InputError, in one line, for a mistake in the arguments.

        armlab.search({"preset": "joint-fourier", "duration": 5.0}, "spso", evaluations=2000)
    """
    settings = parse_problem({"preset": problem} if isinstance(problem, str) else problem, "search")
    chosen = parse_params(find_algorithm(algorithm, "search").Params, dict(params or {}), f"params of {algorithm}")
    for name, value in (("evaluations", evaluations), ("swarm_size", swarm_size)):
        if value < 1:
            raise InputError(f"{name} is {value}: it must be at least 1")
    return run_trial(Trial(settings, algorithm, chosen, swarm_size, evaluations, "clip", seed, 0))


@dataclass(frozen=True, eq=False)
class ExperimentResult:
    """What `run_experiment` found. trials: a row a trial. files: the tables and figures that were written."""

    name: str
    trials: pd.DataFrame
    files: tuple[Path, ...]

    @property
    def table(self) -> pd.DataFrame:
        """A row a problem, swarm size, budget and algorithm: minimum, median, quartiles, share of feasible ends."""
        return summary_table(self.trials)

    def __repr__(self) -> str:
        problems = self.trials.groupby("problem", sort=False)
        lines = [f"Experiment {self.name!r}; trials: {len(self.trials)}, files: {len(self.files)}; medians:"]
        for problem, rows in list(problems)[:SHOWN]:
            medians = rows.groupby("algorithm", sort=False)["value"].median().sort_values()
            lines.append(f"  {problem}: " + ", ".join(f"{name} {value:.4g}" for name, value in medians.items()))
        return "\n".join(lines + _count_more(len(problems), "problems"))

    def _repr_html_(self) -> str:
        table = self.table
        shown = [name for name in table.columns if name not in ("average", "standard_deviation", "evaluations")]
        rows = [[f"{cell:.4g}" if isinstance(cell, float) else cell for cell in row] for row in table[shown].to_numpy()]
        text = f"trials: {len(self.trials)}, files: {len(self.files)}"
        return notebook_html(f"Experiment {self.name}", text, [name.replace("_", " ") for name in shown], rows)


def run_experiment(
    path: str | Path, results: str | Path = "results", store: str | Path = ".armlab/runs.sqlite", workers: int = 0
) -> ExperimentResult:
    """Run the missing trials of a configuration, write its tables and figures, and return all trials.

    results: folder of the tables and figures. store: file that keeps finished trials. workers: processes, as many as
    there are cores if 0. Raises InputError, in one line, for a mistake in the configuration, and TrialsFailedError.
    Set OPENBLAS_NUM_THREADS=1 before Python starts to get the files of the command line to the byte with one worker.
    """
    path, store = Path(path), Path(store)
    files = write_experiment(path, RunOptions(store, Path(results), workers or cpu_count()), _no_bar)
    loaded = load_experiment(path)
    with open_store(store) as opened:
        return ExperimentResult(loaded.experiment.name, tidy_frame(loaded.entries, opened), tuple(files))


class _Silence:
    def update(self, n: int) -> None:
        """Show nothing."""


def _no_bar(total: int, done: int) -> AbstractContextManager[Progress]:
    return nullcontext(_Silence())


def identify(
    recording: Recording,
    method: str = "weighted",
    *,
    components: tuple[Candidate, ...] | None = None,
    cutoff_hz: float | None = None,
    as_read: bool = False,
) -> Model:
    """The model of the arm that fits the runs with the role `identify`, with 95 % intervals.

    method: an estimator of `armlab identify --method`. components: viscous and Coulomb friction, rotor inertia and
    offset at each joint if left out. cutoff_hz: of the low-pass, chosen from the positions if left out.
    as_read: the recording and the robot file are not doubted. Raises InputError where no run identifies, where the runs
    do not fit the arm, or where the recording is read wrongly.

        model = armlab.identify(armlab.read_recording("my-recording"))
        model.save("model.yaml")
    """
    if method not in METHODS:
        raise InputError(f"unknown method {method!r}: {suggest_name(method, list(METHODS))}")
    require_identifiable(recording)
    runs = recording.runs_to_identify()
    wrong = None if as_read else wrong_reading(recording)
    if wrong is not None:
        raise InputError(f"{recording.name}: {wrong.sentence} `as_read=True` identifies it all the same")
    require_possible(recording)
    identifier = Identifier(recording.arm, components, method, cutoff_hz=cutoff_hz, robot=robot_path(recording))
    try:
        model = identifier.fit(runs).model_
    except DataError as error:
        raise InputError(f"{recording.name}: {error}") from None
    model.provenance.update(recording=recording.name, runs=[run.name for run in runs], version=version("armlab"))
    return model


@dataclass(frozen=True, eq=False)
class Prediction:
    """A model beside a recording. errors: one a run. torque: by the name of the run, (samples, joints), N m (N)."""

    recording: Recording
    errors: tuple[RunError, ...]
    torque: dict[str, Array]

    def __repr__(self) -> str:
        lines = [f"Prediction of {self.recording.name!r}: error in percent of the torque, filtered and as recorded"]
        for each in self.errors[:SHOWN]:
            lines.append(f"  {each.run} ({each.role}): {_filtered_and_recorded(each)}")
        return "\n".join(lines + _count_more(len(self.errors), "runs"))

    def _repr_html_(self) -> str:
        rows = [
            (each.run, each.role, format_percent(each.relative_percent), format_percent(each.recorded_percent))
            for each in self.errors
        ]
        text = "Error in percent of the torque."
        return notebook_html(
            f"Prediction of {self.recording.name}", text, ("run", "role", "filtered", "recorded"), rows
        )


def predict(model: TorqueModel, recording: Recording) -> Prediction:
    """The torque of a model for every run of a recording, and its errors.

    model: of `identify`, of a file, or `diagnosis.model`.
    Raises InputError where the model has another number of joints than the recording, and for torque that is none.
    """
    if len(model.arm) != len(recording.arm):
        raise InputError(f"the model has {len(model.arm)} joints, {recording.name} has {len(recording.arm)}")
    require_torque(recording)
    errors = tuple(run_error(model, model.signals(run)) for run in recording.runs)
    return Prediction(recording, errors, {run.name: model.predict(run) for run in recording.runs})


def _filtered_and_recorded(error: RunError) -> str:
    return f"{format_percent(error.relative_percent)}, {format_percent(error.recorded_percent)}"


def _count_more(count: int, what: str) -> list[str]:
    return [f"  and {count - SHOWN} more {what}"] if count > SHOWN else []
