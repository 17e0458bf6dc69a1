"""One trial: its content and key, its execution, and its outcome.

Worker processes run this module.
"""

import dataclasses
import hashlib
import json
import time
import traceback
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from algorithms.contract import AnyAlgorithm, Box, BrokenContractError, as_loss
from algorithms.driver import DerivativeSource, Result, minimise
from algorithms.parameter_types import OURS
from algorithms.registry import load
from armlab.common.arrays import Array
from armlab.common.derivatives import Derivatives, Question
from armlab.common.errors import describe_failure
from bench.seeds import first_population, own_stream
from problem.contract import DifferentiableProblem, Evaluation, Problem
from problem.registry import ProblemSettings


@dataclass(frozen=True)
class Trial:
    """One run of one algorithm on one problem; its fields decide the outcome to the bit.

    params: the algorithm's own `Params`. evaluations: the budget. repetition: counts from 0. derivative_price: in
    evaluations, of a point with its derivatives; None: the dimension plus one, what forward differences take.
    """

    problem: ProblemSettings
    algorithm: str
    params: Any
    swarm_size: int
    evaluations: int
    bounds: str
    seed: int
    repetition: int
    derivative_price: int | None = None

    @property
    def problem_text(self) -> str:
        """The problem's settings as canonical text."""
        return _problem_text(self.problem)

    @property
    def params_text(self) -> str:
        """The hyper-parameters as canonical text."""
        return canonical(stated_params(self.params))

    def key(self, code: str) -> str:
        """SHA-256 of the trial's content and of the code (see `fingerprint`) that would run it."""
        content = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        if self.derivative_price is None:
            del content["derivative_price"]  # keys of trials without a price of their own stay as they were
        content |= {"problem": self.problem_text, "params": self.params_text, "code": code}
        return hashlib.sha256(canonical(content).encode()).hexdigest()

    @property
    def series_text(self) -> str:
        """Algorithm, problem, swarm size and budget, in words."""
        return f"{self.algorithm} on {self.problem_text}, swarm size {self.swarm_size}, {self.evaluations} evaluations"


def stated_params(params: Any) -> dict[str, Any]:
    """Hyper-parameters by name; the reading `ours` is left out, so that trials from before it keep their streams."""
    stated = dataclasses.asdict(params)
    if stated.get("reading") == OURS:
        del stated["reading"]
    return stated


def canonical(content: Any) -> str:
    """JSON with sorted keys and no spaces: equal content gives equal text."""
    return json.dumps(content, sort_keys=True, separators=(",", ":"))


@lru_cache(maxsize=64)
def _problem_text(problem: ProblemSettings) -> str:
    return canonical(problem.model_dump(mode="json"))  # once for all trials on it


@dataclass(frozen=True)
class Curves:
    """Convergence, one entry a population (k,), of the problem's own value without weights and penalty.

    evaluations: the sum up to this population. best_*: of the best point so far. present_*: of the algorithm's own
    present best.
    """

    evaluations: Array
    best_value: Array
    best_violation: Array
    present_value: Array
    present_violation: Array


@dataclass(frozen=True)
class Outcome:
    """The end of a trial: its best point (d,) and the problem's evaluation of it.

    value: the problem's own value, e.g. the condition number, without weights and penalty. violation: 0 if feasible.
    fitness: the minimised number. seconds: processor time of the search alone.
    """

    value: float
    violation: float
    fitness: float
    evaluations: int
    seconds: float
    best_x: Array
    curves: Curves

    def __repr__(self) -> str:
        limits = "every limit kept" if self.violation == 0 else f"violation {self.violation:.4g}"
        point = np.array2string(self.best_x, precision=4, threshold=8, edgeitems=3)
        return (
            f"Outcome: value {self.value:.6g}, {limits}; {self.evaluations} evaluations, {self.seconds:.3g} s\n"
            f"  best point, {len(self.best_x)} dimensions: {point}"
        )


@dataclass(frozen=True)
class Failure:
    """A trial that raised an error. reason: in one line. traceback: its text, empty where the line says it all."""

    trial: Trial
    reason: str
    traceback: str = ""


@dataclass(frozen=True)
class _RecordedObjective:
    """The objective that an algorithm sees; it records every evaluation of the problem."""

    problem: Problem
    said: list[Evaluation] = field(default_factory=list)

    def __call__(self, points: Array) -> Array:
        evaluation = self.problem.evaluate(points)
        self.said.append(evaluation)
        return np.asarray(evaluation.fitness, dtype=float)

    def differentiate(self, point: Array, question: Question) -> Derivatives:
        """Derivatives at a point (d,), for an algorithm that asks for them."""
        if not isinstance(self.problem, DifferentiableProblem):
            raise TypeError(f"problem {self.problem.name!r} offers no derivatives")
        return self.problem.differentiate(point, question)

    def column(self, name: str) -> Array:
        """One quantity of all evaluated points in their order (evaluations,)."""
        return np.concatenate([np.asarray(getattr(evaluation, name), float) for evaluation in self.said])


def run_batch(work: Sequence[tuple[str, Trial]]) -> list[tuple[str, Outcome | Failure]]:
    """Run trials one after the other, each with its key. An error in one trial does not affect the others."""
    return [(key, _run_guarded(trial)) for key, trial in work]


def _run_guarded(trial: Trial) -> Outcome | Failure:
    try:
        with np.errstate():  # what a third party makes of it ends with its trial
            return run_trial(trial)
    except BrokenContractError as error:
        return Failure(trial, str(error))
    except (Exception, SystemExit) as error:  # whatever a third party raises: the runner reports it
        return Failure(trial, describe_failure(error), traceback.format_exc())


def run_trial(trial: Trial) -> Outcome:
    """Search once, from the first population and with the random stream that belong to the trial."""
    tape = _RecordedObjective(build_problem(trial.problem))
    began = time.process_time()
    result = _run_search(trial, tape)
    return _make_outcome(result, tape, time.process_time() - began)


def replay(trial: Trial) -> Result:
    """Repeat the search of `run_trial` and return it with the algorithm's last state, which no outcome keeps."""
    return _run_search(trial, _RecordedObjective(build_problem(trial.problem)))


def _run_search(trial: Trial, tape: _RecordedObjective) -> Result:
    name = tape.problem.name
    box = Box(tape.problem.lower.copy(), tape.problem.upper.copy())  # an algorithm may write into them
    start = first_population(trial.seed, name, trial.repetition, trial.swarm_size, box)
    rng = own_stream(trial.seed, name, trial.algorithm, trial.params_text, trial.repetition)
    source = DerivativeSource(tape.differentiate, trial.derivative_price or len(box.lower) + 1)
    algorithm = load_algorithm(trial.algorithm)
    return minimise(algorithm, trial.params, tape, box, start, trial.evaluations, rng, trial.bounds, source)


@lru_cache(maxsize=8)
def build_problem(settings: ProblemSettings) -> Problem:
    """The problem, built once in each process: building is cheaper than sending it."""
    return settings.build()


@lru_cache
def load_algorithm(name: str) -> AnyAlgorithm:
    """The algorithm, looked up once in each process: reading the entry points of a large environment is slow."""
    return load(name)


def _make_outcome(result: Result, tape: _RecordedObjective, seconds: float) -> Outcome:
    best = tape.problem.evaluate(result.best_x[None])
    if best.value[0] < 0:
        raise ValueError(
            f"problem {tape.problem.name!r} gave the value {best.value[0]:g}: add a constant, none below 0"
        )
    return Outcome(
        value=float(best.value[0]),
        violation=float(best.violation[0]),
        fitness=float(result.best_fitness),
        evaluations=int(result.evaluations),
        seconds=seconds,
        best_x=result.best_x,
        curves=_make_curves(result, tape),
    )


def _make_curves(result: Result, tape: _RecordedObjective) -> Curves:
    fitness = as_loss(tape.column("fitness"))
    value = np.append(tape.column("value"), np.nan)
    violation = np.append(tape.column("violation"), np.inf)
    best = _first_index_of(result.best_so_far, fitness)
    present = _first_index_of(result.present_best, fitness)
    return Curves(
        evaluations=np.asarray(result.history_evaluations, dtype=float),
        best_value=value[best],
        best_violation=violation[best],
        present_value=value[present],
        present_violation=violation[present],
    )


def _first_index_of(wanted: Array, fitness: Array) -> NDArray[np.intp]:
    """For each wanted number the index of the first evaluation that gave it; one past the end if none did."""
    order = np.argsort(fitness, kind="stable")
    place = np.minimum(np.searchsorted(fitness[order], wanted), len(fitness) - 1)
    return np.where(fitness[order[place]] == wanted, order[place], len(fitness))
