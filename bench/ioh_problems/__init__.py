"""The problems of a suite in IOHprofiler's own package `ioh` (de Nobel et al. 2024), for its loggers and experimenters.

from bench.ioh_problems import ioh_problem, ioh_problems

problem = ioh_problem("suite-2/panda-all-si")
logger = ioh.logger.Analyzer()              # in a variable: ioh keeps no reference to it
problem.attach_logger(logger)
problem(x)                                  # the fitness, to the bit what `evaluate` gives here
"""

from typing import Any

import ioh
import numpy as np

from armlab.common.arrays import Array
from problem.registry import instances, parse_problem


class SuiteProblem(ioh.problem.RealSingleObjective):  # type: ignore[misc]
    """A problem of a suite in its own coordinates and box; what is minimised is its fitness, penalties included."""

    def __init__(self, name: str, number: int) -> None:
        """name: full name of the problem; number: its place in the suite, from 1, as IOH's problem id.

        Raises InputError, in one line, for an unknown name.
        """
        problem = parse_problem({"preset": name}, f"problem '{name}'").build()
        dimension = len(problem.lower)
        bounds = ioh.iohcpp.RealBounds(dimension, float(problem.lower.min()), float(problem.upper.max()))
        shown = name.replace("/", "_")  # loggers make files of that name
        super().__init__(name=shown, n_variables=dimension, instance=1, is_minimization=True, bounds=bounds)
        self.bounds.lb, self.bounds.ub = (
            problem.lower.tolist(),
            problem.upper.tolist(),
        )  # the constructor takes one each
        self.set_id(number)
        self.problem = problem

    def evaluate(self, x: Any) -> float:
        """The fitness of one point (dimension,)."""
        point: Array = np.asarray(x, dtype=np.float64)[None]
        return float(self.problem.evaluate(point).fitness[0])


def ioh_problem(name: str) -> SuiteProblem:
    """The problem of that full name, e.g. `suite-2/panda-all-si`; raises InputError for an unknown one."""
    names = instances(name.partition("/")[0])
    return SuiteProblem(name, names.index(name) + 1 if name in names else 0)


def ioh_problems(suite: str) -> list[SuiteProblem]:
    """All problems of a suite, in its order; raises InputError for an unknown suite."""
    return [SuiteProblem(name, number) for number, name in enumerate(instances(suite), start=1)]
