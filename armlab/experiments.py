"""Searches and experiments as functions for scripts and notebooks: they return what commands write to files."""

from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pandas as pd
from joblib import cpu_count

from armlab.common.errors import InputError
from armlab.common.notebook import notebook_html
from bench.config import find_algorithm, parse_params
from bench.execute import Outcome, Trial, run_trial
from bench.run import Progress, RunOptions, load_experiment, run_missing
from bench.run import run_experiment as write_experiment
from bench.statistics.pairwise import duel_row, duels
from bench.store import open_store
from bench.tables import CELL_COLUMNS, summary_table, tidy_frame
from bench.terminal import describe_frame, winner_sentences
from problem.callables import CallableSettings
from problem.registry import parse_problem

EVALUATIONS, SWARM_SIZE = 5000, 50  # of a search or an experiment that does not say
DEFAULT_STORE = Path(".armlab/runs.sqlite")


def search(
    problem: str | Mapping[str, Any],
    algorithm: str = "l-shade",
    *,
    evaluations: int = EVALUATIONS,
    swarm_size: int = SWARM_SIZE,
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
    files: tuple[Path, ...] = ()

    @property
    def table(self) -> pd.DataFrame:
        """A row a problem, swarm size, budget and algorithm: minimum, median, quartiles, share of feasible ends."""
        return summary_table(self.trials)

    @property
    def duels(self) -> pd.DataFrame:
        """A row a pair of algorithms on a problem, swarm size and budget: who is better, and how surely.

        superiority: chance that an end of the subject is better than one of the rival (A12), with its 95 % interval,
        low and high. p_holm: Wilcoxon's test over paired repetitions, Holm's correction over the pairs of a problem.
        winner: empty where no difference is significant at 5 %.
        """
        groups = self.trials.groupby(CELL_COLUMNS, sort=False)
        rows = [
            dict(zip(CELL_COLUMNS, cell, strict=True)) | duel_row(duel)
            for cell, frame in groups
            for duel in duels(frame, list(combinations(frame["algorithm"].unique(), 2)))
        ]
        return pd.DataFrame(rows)

    def __repr__(self) -> str:
        """What was run, the table of medians and quartiles, and who beats whom."""
        head = f"Experiment {self.name!r}; trials: {len(self.trials)}, files: {len(self.files)}"
        return "\n".join([head, *(f"  {line}" for line in describe_frame(self.trials))])

    def _repr_html_(self) -> str:
        table = self.table
        shown = [name for name in table.columns if name not in ("average", "standard_deviation", "evaluations")]
        rows = [[f"{cell:.4g}" if isinstance(cell, float) else cell for cell in row] for row in table[shown].to_numpy()]
        text = " ".join(f"{sentence}." for sentence in winner_sentences(self.trials))
        return notebook_html(f"Experiment {self.name}", text, [name.replace("_", " ") for name in shown], rows)


def run_experiment(
    configuration: str | Path | Mapping[str, Any] | None = None,
    results: str | Path | None = None,
    store: str | Path | None = None,
    workers: int = 0,
    **keys: Any,
) -> ExperimentResult:
    """Run the missing trials of an experiment, and return all of them.

    configuration: a YAML file, or its keys as a dictionary or as keywords. problem may be a Python function of one
    point (dimension,) that returns a number, not negative, with its box as `lower` and `upper`. As keywords, name,
    seed, swarm_size and the budget may be left out, as in `search`. results: folder for tables and figures, which are
    written only there. store: file that keeps finished trials, `.armlab/runs.sqlite` if left out; those of a function
    are not kept, since nothing tells whether it changed. workers: processes, as many as there are cores if 0.
    Raises InputError, in one line, for a mistake in the configuration, and TrialsFailedError.
    Set OPENBLAS_NUM_THREADS=1 before Python starts to get the files of the command line to the byte with one worker.

        def cost(x):
            return (x**2).sum()

        armlab.run_experiment(problem=cost, lower=[-5, -5], upper=[5, 5], algorithms=["spso", "de"], repetitions=10)
    """
    source = _configuration(configuration, keys)
    loaded, count = load_experiment(source), workers or cpu_count()
    problems = {series.first.problem for series in loaded.entries.series}
    functions = [settings.build() for settings in problems if isinstance(settings, CallableSettings)]
    for function in functions:
        function.try_once()
    if functions and (results is not None or store is not None):
        raise InputError(
            f"problem {functions[0].name!r} is a function, and nothing tells whether it changed: leave out results and "
            "store, or register it as a problem (plug-ins in the documentation)"
        )
    with TemporaryDirectory() if functions else nullcontext() as folder:
        place = Path(folder) / "runs.sqlite" if folder else Path(store or DEFAULT_STORE)
        experiment, files = loaded.experiment, list[Path]()
        if results is not None:
            files = write_experiment(source, RunOptions(place, Path(results), count), _no_bar)
        with open_store(place) as opened:
            if results is None:
                timeout_s = experiment.trial_timeout_s
                run_missing(loaded.entries, opened, count, executor=experiment.executor, timeout_s=timeout_s)
            return ExperimentResult(experiment.name, tidy_frame(loaded.entries, opened), tuple(files))


def _configuration(given: str | Path | Mapping[str, Any] | None, keys: dict[str, Any]) -> Path | Mapping[str, Any]:
    """The file, or the keys with what keywords may leave out."""
    if given is not None and keys:
        raise InputError(f"give a configuration or its keys, not both: {', '.join(keys)} beside it")
    if isinstance(given, Mapping):
        return given
    if isinstance(given, str | Path):
        return Path(given)
    if given is not None or not keys:
        found = "nothing" if given is None else type(given).__name__
        raise InputError(
            "run_experiment takes a YAML file, a dictionary of its keys, or the keys themselves, as in "
            f"problem='paper', algorithms=['spso', 'l-shade'], repetitions=10; not {found}"
        )
    if not isinstance(keys.get("bounds", ""), str):
        raise InputError(
            "bounds says what becomes of points outside the box: clip, reflect or wrap; give the box of a function as "
            "lower=[...] and upper=[...]"
        )
    box = {name: keys.pop(name) for name in ("lower", "upper") if name in keys}
    if callable(keys.get("problem")) and len(box) < 2:
        raise InputError("problem is a function: give lower= and upper=, the ends of its box, a number a dimension")
    if box or callable(keys.get("problem")):
        keys["problem"] = {"preset": keys.get("problem"), **box}
    budget = {} if {"iterations", "evaluations"} & keys.keys() else {"evaluations": EVALUATIONS}
    return {"name": "experiment", "swarm_size": SWARM_SIZE, "seed": 0, **budget, **keys}


class _Silence:
    def update(self, n: int) -> None:
        """Show nothing."""


def _no_bar(total: int, done: int) -> AbstractContextManager[Progress]:
    return nullcontext(_Silence())
