"""The trials of a configuration, each with its labels and its key in the run store, and the pairs of our algorithms and
their peers.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, cast, overload

from algorithms.contract import AnyAlgorithm, AsksDerivatives, Box, fewest_points
from algorithms.driver import check_box
from algorithms.registry import load, peer_names
from armlab.common.errors import InputError
from bench.config import AlgorithmChoice, Experiment, ProblemChoice, find_algorithm, parse_params
from bench.execute import Trial, build_problem
from bench.fingerprint import fingerprint
from bench.memory import check_counts, check_memory
from problem.contract import why_not_differentiable
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
    """The repetitions of one algorithm on one problem, with their labels; code: its `fingerprint`."""

    problem: str
    algorithm: str
    first: Trial
    code: str

    def entry(self, repetition: int) -> Entry:
        """The entry of one repetition."""
        trial = replace(self.first, repetition=repetition)
        return Entry(self.problem, self.algorithm, trial, trial.key(self.code))


@dataclass(frozen=True)
class Plan(Sequence[Entry]):
    """All trials of an experiment. Each is made when it is needed, so a million take no more memory than ten."""

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

    def first_entries(self) -> list[Entry]:
        """The first repetition of each series; together they hold all labels and settings."""
        return [series.entry(0) for series in self.series]


def plan_trials(experiment: Experiment, where: str) -> Plan:
    """All trials in the order of the configuration: problem, swarm size, budget, algorithm, repetition.

    Raises InputError, in one line, for a problem, an algorithm or a hyper-parameter that is not right, and for output
    'rivals' without a pair to compare.
    """
    problems = [(choice.label, _parse_problem(choice, experiment, where)) for choice in experiment.problem]
    contestants = [_make_contestant(choice, where) for choice in experiment.algorithms]
    _check_points(contestants, experiment.swarm_size, where)
    for (label, problem), contestant in product(problems, contestants):
        _check_derivatives(label, problem, contestant, where)
    codes = {
        (label, contestant.label): fingerprint(contestant.algorithm, problem)
        for (label, problem), contestant in product(problems, contestants)
    }
    series = [
        Series(
            label,
            contestant.label,
            _first_trial(experiment, problem, contestant, swarm_size, evaluations),
            codes[label, contestant.label],
        )
        for label, problem in problems
        for swarm_size in experiment.swarm_size
        for evaluations in experiment.budgets(swarm_size)
        for contestant in contestants
    ]
    plan = Plan(tuple(series), experiment.repetitions)
    if experiment.output == "rivals" and not rival_pairs(plan.first_entries()):
        raise InputError(
            f"output 'rivals' of {where} should have a peer and, in 'algorithms', our algorithm of the same kind"
        )
    return plan


def _parse_problem(choice: ProblemChoice, experiment: Experiment, where: str) -> ProblemSettings:
    """The problem's settings. The problem is built once, because some mistakes show only then."""
    place = f"problem of {where}"
    settings = parse_problem(choice.settings, place)
    check_counts(settings, place)
    try:
        problem = build_problem(settings)
        check_box(Box(problem.lower, problem.upper))
    except (InputError, ValueError) as error:
        raise InputError(f"problem '{choice.label}' of {where}: {error}") from None
    for swarm_size in experiment.swarm_size:
        check_memory(problem, swarm_size, max(experiment.budgets(swarm_size)), where)
    return settings


def _make_contestant(choice: AlgorithmChoice, where: str) -> _Contestant:
    algorithm = find_algorithm(choice.name, f"'algorithms' in {where}")
    params = parse_params(algorithm.Params, choice.params, f"params of {choice.name} in {where}")
    return _Contestant(choice.label or choice.name, algorithm, choice.name, params)


def _check_points(contestants: Sequence[_Contestant], swarm_sizes: Sequence[int], where: str) -> None:
    """Raises InputError where a first population has fewer points than an algorithm takes, all of them named."""
    lacking = [
        f"{each.label} takes {fewest_points(each.algorithm)} points or more, not {swarm_size}"
        for each, swarm_size in product(contestants, swarm_sizes)
        if swarm_size < fewest_points(each.algorithm)
    ]
    if lacking:
        raise InputError(f"'swarm_size' in {where}: {'; '.join(lacking)}")


def _check_derivatives(label: str, problem: ProblemSettings, contestant: _Contestant, where: str) -> None:
    if not issubclass(contestant.algorithm, AsksDerivatives):
        return
    reason = why_not_differentiable(build_problem(problem))
    if reason:
        raise InputError(
            f"'{contestant.label}' in {where} asks for derivatives, and problem '{label}' offers none: {reason}"
        )


def _first_trial(
    experiment: Experiment, problem: ProblemSettings, contestant: _Contestant, swarm_size: int, evaluations: int
) -> Trial:
    return Trial(
        problem=problem,
        algorithm=contestant.name,
        params=contestant.params,
        swarm_size=swarm_size,
        evaluations=evaluations,
        bounds=experiment.bounds,
        seed=experiment.seed,
        repetition=0,
        derivative_price=experiment.derivative_price if issubclass(contestant.algorithm, AsksDerivatives) else None,
    )


def rival_pairs(entries: Iterable[Entry]) -> list[tuple[str, str]]:
    """Labels of our algorithm and of the peer, for every peer whose counterpart takes part."""
    labels = dict.fromkeys((entry.algorithm, entry.trial.algorithm) for entry in entries)
    ours = {name: label for label, name in reversed(labels)}
    peers = [(label, _rival_name(name)) for label, name in labels if name in peer_names()]
    return [(ours[rival], label) for label, rival in peers if rival in ours]


def _rival_name(name: str) -> str:
    from algorithms.peers.peer import Peer  # only where a peer takes part

    return cast(type[Peer], load(name)).rival
