"""The best trajectory that an algorithm found in an experiment."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bench.execute import built
from bench.plan import Entry
from bench.store import RunStore
from problem.errors import InputError
from problem.excitation_problem import ExcitationProblem
from problem.motion import Motion
from problem.transforms import Array


@dataclass(frozen=True, eq=False)
class BestRun:
    """point: (dimension,), the best feasible end of all repetitions; value: its condition number."""

    problem: ExcitationProblem
    algorithm: str
    repetition: int
    point: Array
    value: float

    def motion(self, times: Array) -> Motion:
        """The joint motion (samples, joints) at instants (samples,), s."""
        return self.problem.trajectory.motions(self.point[None], times).motion.select(np.intp(0))

    @property
    def title(self) -> str:
        """Where it comes from, for the reader of a figure."""
        return f"repetition {self.repetition} of the search, condition number {self.value:.3g}"


def best_run(entries: Sequence[Entry], store: RunStore, algorithm: str) -> BestRun:
    """The run with the least condition number among the feasible ends of an algorithm.

    Raises InputError where there is none, or the problem is no excitation.
    """
    ends = [(entry, store.get(entry.key)) for entry in entries if entry.algorithm == algorithm]
    feasible = [(entry, end) for entry, end in ends if end.violation == 0 and np.isfinite(end.value)]
    if not feasible:
        raise InputError(f"no feasible run of '{algorithm}' to show: name another algorithm of the experiment")
    entry, end = min(feasible, key=lambda pair: pair[1].value)
    problem = built(entry.trial.problem)
    if not isinstance(problem, ExcitationProblem):
        raise InputError(f"'{entry.problem}' is no excitation problem in its own coordinates")
    return BestRun(problem, algorithm, entry.trial.repetition, end.best_x, end.value)
