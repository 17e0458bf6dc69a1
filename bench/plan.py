"""From a configuration to its trials, each with the names under which it stands in tables and figures."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, overload

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


@dataclass(frozen=True)
class Series:
    """The repetitions of one algorithm on one problem, by their labels; code: its `fingerprint`."""

    problem: str
    algorithm: str
    first: Trial
    code: str

    def entry(self, repetition: int) -> Entry:
        """One of them."""
        trial = replace(self.first, repetition=repetition)
        return Entry(self.problem, self.algorithm, trial, trial.key(self.code))


@dataclass(frozen=True)
class Plan(Sequence[Entry]):
    """All trials of an experiment, each made when it is looked at: a million take no more memory than ten."""

    series: tuple[Series, ...]
    repetitions: int

    def __len__(self) -> int:
        return len(self.series) * self.repetitions

    def __iter__(self) -> Iterator[Entry]:
        for series in self.series:
            for repetition in range(self.repetitions):
                yield series.entry(repetition)

    @overload
    def __getitem__(self, index: int) -> Entry: ...
    @overload
    def __getitem__(self, index: slice) -> list[Entry]: ...
    def __getitem__(self, index: int | slice) -> Entry | list[Entry]:
        if isinstance(index, slice):
            return [self[place] for place in range(len(self))[index]]
        series, repetition = divmod(range(len(self))[index], self.repetitions)
        return self.series[series].entry(repetition)

    def of(self, problem: str, swarm_size: int, evaluations: int) -> list[Entry]:
        """The trials on a problem, by its label, with a swarm size and a budget."""
        cell = (problem, swarm_size, evaluations)
        found = [one for one in self.series if (one.problem, one.first.swarm_size, one.first.evaluations) == cell]
        return [one.entry(repetition) for one in found for repetition in range(self.repetitions)]

    def firsts(self) -> list[Entry]:
        """The first repetition of each series: all labels and settings that there are."""
        return [series.entry(0) for series in self.series]


def plan(experiment: Experiment, where: str) -> Plan:
    """All trials in the order of the configuration: problem, swarm size, budget, algorithm, repetition.

    Raises InputError, in one line, for a problem, an algorithm or a hyper-parameter that is not right.
    """
    problems = [(choice.label, _problem(choice, where)) for choice in experiment.problem]
    contestants = [_contestant(choice, where) for choice in experiment.algorithms]
    codes = {
        (label, contestant.label): fingerprint(contestant.algorithm, problem.model_dump(mode="json"))
        for (label, problem), contestant in product(problems, contestants)
    }
    series = [
        Series(
            label,
            contestant.label,
            _trial(experiment, problem, contestant, swarm_size, evaluations),
            codes[label, contestant.label],
        )
        for label, problem in problems
        for swarm_size in experiment.swarm_size
        for evaluations in experiment.budgets(swarm_size)
        for contestant in contestants
    ]
    return Plan(tuple(series), experiment.repetitions)


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


def _trial(
    experiment: Experiment, problem: ProblemSettings, contestant: _Contestant, swarm_size: int, evaluations: int
) -> Trial:
    """The first repetition."""
    return Trial(
        problem=problem,
        algorithm=contestant.name,
        params=contestant.params,
        swarm_size=swarm_size,
        evaluations=evaluations,
        bounds=experiment.bounds,
        seed=experiment.seed,
        repetition=0,
    )
