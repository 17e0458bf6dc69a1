"""From a configuration to its trials, each with the names under which it stands in tables and figures."""

from dataclasses import dataclass
from itertools import product
from typing import Any

from algorithms.contract import AnyAlgorithm
from bench.config import AlgorithmChoice, Experiment, ProblemChoice
from bench.execute import built
from bench.fingerprint import fingerprint
from bench.lookup import find_algorithm
from bench.params import parse_params
from bench.trial import Trial
from problem.errors import InputError
from problem.registry import ProblemSettings, parse_problem


@dataclass(frozen=True)
class Entry:
    """A trial, its key in the run store, and the labels of its problem and algorithm."""

    problem: str
    algorithm: str
    trial: Trial
    key: str


@dataclass(frozen=True)
class _Contestant:
    """An algorithm with its hyper-parameters and its label."""

    label: str
    algorithm: AnyAlgorithm
    name: str
    params: Any


def plan(experiment: Experiment, where: str) -> list[Entry]:
    """All trials in the order of the configuration: problem, swarm size, budget, algorithm, repetition.

    Raises InputError, in one line, for a problem, an algorithm or a hyper-parameter that is not right.
    """
    problems = [(choice.label, _problem(choice, where)) for choice in experiment.problem]
    contestants = [_contestant(choice, where) for choice in experiment.algorithms]
    codes = {
        (label, contestant.label): fingerprint(contestant.algorithm, problem.model_dump(mode="json"))
        for (label, problem), contestant in product(problems, contestants)
    }
    return [
        Entry(label, contestant.label, trial, trial.key(codes[label, contestant.label]))
        for label, problem in problems
        for swarm_size in experiment.swarm_size
        for evaluations in experiment.budgets(swarm_size)
        for contestant in contestants
        for trial in _repeated(experiment, problem, contestant, swarm_size, evaluations)
    ]


def _problem(choice: ProblemChoice, where: str) -> ProblemSettings:
    """The problem's settings, after it was built once: not all mistakes show before."""
    place = f"problem of {where}"
    settings = parse_problem(choice.settings, place)
    try:
        built(settings)
    except InputError as error:
        raise InputError(f"{place}: {error}") from None
    return settings


def _contestant(choice: AlgorithmChoice, where: str) -> _Contestant:
    algorithm = find_algorithm(choice.name, f"'algorithms' in {where}")
    params = parse_params(algorithm.Params, choice.params, f"params of {choice.name} in {where}")
    return _Contestant(choice.label or choice.name, algorithm, choice.name, params)


def _repeated(
    experiment: Experiment, problem: ProblemSettings, contestant: _Contestant, swarm_size: int, evaluations: int
) -> list[Trial]:
    return [
        Trial(
            problem=problem,
            algorithm=contestant.name,
            params=contestant.params,
            swarm_size=swarm_size,
            evaluations=evaluations,
            bounds=experiment.bounds,
            seed=experiment.seed,
            repetition=repetition,
        )
        for repetition in range(experiment.repetitions)
    ]
