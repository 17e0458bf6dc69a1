"""The way of one trial through problem and driver; this is what a worker process runs."""

import time
import traceback
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from algorithms.contract import AnyAlgorithm, Array, Box, as_loss
from algorithms.driver import Result, minimise
from algorithms.registry import load
from bench.outcome import Curves, Outcome
from bench.seeds import first_population, own_stream
from bench.trial import Trial
from problem.contract import Evaluation, Problem
from problem.registry import ProblemSettings


@dataclass(frozen=True)
class Failure:
    """A trial that raised, with the traceback as text."""

    trial: Trial
    traceback: str


@dataclass(frozen=True)
class _Tape:
    """The objective that an algorithm sees, and all that the problem said along the way."""

    problem: Problem
    said: list[Evaluation] = field(default_factory=list)

    def __call__(self, points: Array) -> Array:
        evaluation = self.problem.evaluate(points)
        self.said.append(evaluation)
        return np.asarray(evaluation.fitness, dtype=float)

    def column(self, name: str) -> Array:
        """One figure of all evaluated points in their order (evaluations,)."""
        return np.concatenate([np.asarray(getattr(evaluation, name), float) for evaluation in self.said])


def run_batch(work: Sequence[tuple[str, Trial]]) -> list[tuple[str, Outcome | Failure]]:
    """Run trials one after the other, each with its key; one that raises leaves the others alone."""
    return [(key, _run_guarded(trial)) for key, trial in work]


def _run_guarded(trial: Trial) -> Outcome | Failure:
    try:
        return run_trial(trial)
    except Exception:  # whatever an algorithm of a third party raises: the runner reports it with its trial
        return Failure(trial, traceback.format_exc())


def run_trial(trial: Trial) -> Outcome:
    """Search once, from the first population and the stream that the trial's names give."""
    tape = _Tape(built(trial.problem))
    began = time.process_time()
    result = _search(trial, tape)
    return _outcome(result, tape, time.process_time() - began)


def replay(trial: Trial) -> Result:
    """The search of `run_trial` with the algorithm's last state, which no outcome keeps."""
    return _search(trial, _Tape(built(trial.problem)))


def _search(trial: Trial, tape: _Tape) -> Result:
    name = tape.problem.name
    box = Box(tape.problem.lower, tape.problem.upper)
    start = first_population(trial.seed, name, trial.repetition, trial.swarm_size, box)
    rng = own_stream(trial.seed, name, trial.algorithm, trial.params_text, trial.repetition)
    return minimise(loaded(trial.algorithm), trial.params, tape, box, start, trial.evaluations, rng, trial.bounds)


@lru_cache(maxsize=8)
def built(settings: ProblemSettings) -> Problem:
    """The problem, built once a process: it is cheaper to build than to send."""
    return settings.build()


@lru_cache
def loaded(name: str) -> AnyAlgorithm:
    """The algorithm, looked up once a process: the entry points of a large environment take long to read."""
    return load(name)


def _outcome(result: Result, tape: _Tape, seconds: float) -> Outcome:
    best = tape.problem.evaluate(result.best_x[None])
    return Outcome(
        value=float(best.value[0]),
        violation=float(best.violation[0]),
        fitness=float(result.best_fitness),
        evaluations=int(result.evaluations),
        seconds=seconds,
        best_x=result.best_x,
        curves=_curves(result, tape),
    )


def _curves(result: Result, tape: _Tape) -> Curves:
    fitness = as_loss(tape.column("fitness"))
    value = np.append(tape.column("value"), np.nan)
    violation = np.append(tape.column("violation"), np.inf)
    best = _index_of(result.best_so_far, fitness)
    present = _index_of(result.present_best, fitness)
    return Curves(
        evaluations=np.asarray(result.history_evaluations, dtype=float),
        best_value=value[best],
        best_violation=violation[best],
        present_value=value[present],
        present_violation=violation[present],
    )


def _index_of(wanted: Array, fitness: Array) -> NDArray[np.intp]:
    """For each wanted figure the first evaluation that gave it; one past the end if none did."""
    order = np.argsort(fitness, kind="stable")
    place = np.minimum(np.searchsorted(fitness[order], wanted), len(fitness) - 1)
    return np.where(fitness[order[place]] == wanted, order[place], len(fitness))
