"""The search for hyper-parameters: Optuna's tree-structured Parzen estimator (Watanabe 2023), configuration by
configuration.

The first configuration is the published one. What a configuration is worth is, over the training problems, the average
of log10 of its median end divided by that of the published configuration; a median that is infinite counts as ten
times the published one. Every run is a trial of the run store: a tuning that was stopped, or gets a larger budget,
repeats its decisions from the stored outcomes and goes on.
"""

import dataclasses
import json
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import optuna
import pandas as pd

from armlab.common.errors import InputError
from armlab.common.streams import named_generator
from bench.config import find_algorithm, parse_params
from bench.plan import Plan, plan_trials
from bench.run import run_missing
from bench.store import RunStore
from bench.studies.tuning.judged import median_ends
from bench.studies.tuning.tuning_settings import ParameterRange, TuningSettings
from bench.tables import tidy_frame

INFEASIBLE_LOSS = 1.0  # log10 of ten times the published median
_STARTUP = 8  # random configurations before the estimator decides
Progress = Callable[[int], object]


@dataclass(frozen=True)
class Configuration:
    """Hyper-parameters that were tried, and their loss; 0 for the published ones, -0.1 is a median 21 % lower."""

    params: Mapping[str, float | int]
    loss: float


@dataclass(frozen=True)
class Tuned:
    """All configurations of one algorithm, the published one first; importance: share of each hyper-parameter."""

    algorithm: str
    configurations: tuple[Configuration, ...]
    importance: Mapping[str, float]

    @property
    def best(self) -> Configuration:
        """The configuration with the least loss, the earlier one of equals."""
        return min(self.configurations, key=lambda one: one.loss)


def tune_algorithm(settings: TuningSettings, name: str, store: RunStore, progress: Progress) -> Tuned:
    """Try as many configurations as `settings` says, one after the other; progress is called with 1 after each.

    Raises InputError for a hyper-parameter that the algorithm does not have, StoppedError, TrialsFailedError.
    """
    ranges = settings.algorithms[name]
    published = _published_params(name, ranges)
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    seed = int(named_generator("tuning", settings.train_seed, name).integers(2**31))
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=seed, n_startup_trials=_STARTUP))
    study.enqueue_trial(published)
    reference: dict[str, float] = {}
    found = []
    for _ in range(settings.configurations):
        trial = study.ask()
        params = {key: _suggest(trial, key, allowed) for key, allowed in ranges.items()}
        medians = median_ends(_run(settings, {"name": name, "params": params}, store))
        reference = reference or medians
        loss = relative_loss(medians, reference)
        study.tell(trial, loss)
        found.append(Configuration(params, loss))
        progress(1)
    return Tuned(name, tuple(found), _importance(study))


def relative_loss(medians: Mapping[str, float], reference: Mapping[str, float]) -> float:
    """Average over the problems of log10(median / reference), no term above INFEASIBLE_LOSS.

    A problem whose reference is infinite counts 0 as long as it stays so, and minus INFEASIBLE_LOSS if it is solved.
    """
    terms = []
    for problem, expected in reference.items():
        solved, known = np.isfinite(medians[problem]), np.isfinite(expected)
        if solved and known:
            terms.append(min(float(np.log10(medians[problem] / expected)), INFEASIBLE_LOSS))
        else:
            terms.append(INFEASIBLE_LOSS * (int(known) - int(solved)))
    return float(np.mean(terms))


def _published_params(name: str, ranges: Mapping[str, ParameterRange]) -> dict[str, Any]:
    """The defaults of what is tuned."""
    params = parse_params(find_algorithm(name, "tuning").Params, {}, f"params of {name}")
    known = [field.name for field in dataclasses.fields(params)]
    for key, allowed in ranges.items():
        if key not in known:
            raise InputError(f"tuning of {name}: no hyper-parameter '{key}': known: {', '.join(known)}")
        value = getattr(params, key)
        if not allowed.low <= value <= allowed.high:
            raise InputError(
                f"tuning of {name}: the range of '{key}', {allowed.low} to {allowed.high}, should hold the published "
                f"value {value}"
            )
    return {key: getattr(params, key) for key in ranges}


def _suggest(trial: optuna.Trial, key: str, allowed: ParameterRange) -> float | int:
    if allowed.whole:
        return trial.suggest_int(key, int(allowed.low), int(allowed.high), log=allowed.log)
    return trial.suggest_float(key, float(allowed.low), float(allowed.high), log=allowed.log)


def _run(settings: TuningSettings, algorithm: dict[str, Any], store: RunStore) -> pd.DataFrame:
    """In this process: a configuration takes less time than a pool of workers takes to start."""
    return run_frame(plan_trials(settings.experiment([algorithm], judging=False), "tuning"), store, workers=1)


def run_frame(plan: Plan, store: RunStore, workers: int) -> pd.DataFrame:
    """The tidy outcomes of a plan; what the store lacks is run."""
    run_missing(plan, store, workers)
    return tidy_frame(plan, store)


def _importance(study: optuna.Study) -> dict[str, float]:
    """PED-ANOVA (Watanabe, Bansal and Hutter 2023); a single hyper-parameter has it all."""
    names = list(study.best_trial.params)
    if len(names) < 2:
        return dict.fromkeys(names, 1.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
        evaluator = optuna.importance.PedAnovaImportanceEvaluator()
        return dict(optuna.importance.get_param_importances(study, evaluator=evaluator))


def params_text(params: Mapping[str, float | int]) -> str:
    """Hyper-parameters in one line, four digits each."""
    return json.dumps(
        {key: float(f"{value:.4g}") if isinstance(value, float) else value for key, value in params.items()}
    )
