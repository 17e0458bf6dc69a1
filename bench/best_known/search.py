"""Many starts for one problem: from random points, from the ends of CMA-ES, and from kicks of the best known.

Where no derivatives are known, CMA-ES does it alone: in the whole box, and in a smaller one about the best known.
"""

from dataclasses import dataclass, replace

import numpy as np

from algorithms.cmaes import CMAESParams
from algorithms.contract import Box, uniform_points
from algorithms.driver import minimise
from bench.best_known.descent import End, descend, judge
from bench.lookup import find_algorithm
from bench.seeds import named_generator
from problem.excitation_problem import ExcitationProblem
from problem.fitness import Criterion
from problem.transforms import Array

TURNS = ("cma-es", "gradient", "kick", "cma-es", "kick", "kick")  # one after the other
WITHOUT_SLOPES = ("cma-es", "kick")  # the same where there are no derivatives
EVALUATIONS = 10_000  # of such a start: these problems are dear
DRAWS = 200  # random points, the best of which is a start
POPULATION, DOUBLINGS = 25, 4  # of CMA-ES: doubled from one restart to the next (Auger and Hansen 2005), then anew
BUDGET = 600  # generations
KICKS = (0.05, 0.6)  # range of their standard deviations, in halves of the box
KICKED = 4  # kicked points, the best of which is a start: of more, the best would be the least moved one


@dataclass(frozen=True)
class Start:
    """One start of a problem's search: decided by seed, name and number (and for a kick by the best known)."""

    seed: int
    name: str
    number: int

    def run(self, problem: ExcitationProblem, best: Array | None) -> tuple[str, End]:
        """How this start began, and its end; best: the point (dimension,) to kick, if there is one yet."""
        rng = self._stream()
        box = Box(problem.lower, problem.upper)
        if not problem.spectral:
            return self._without_slopes(problem, box, best, rng)
        plain = _plain(problem)
        turn = TURNS[self.number % len(TURNS)]
        if turn == "cma-es":
            return turn, self._evolved(plain, box, rng)
        if turn == "kick" and best is not None:
            return turn, self.kicked(problem, best)
        return "gradient", _from_best_of(plain, uniform_points(DRAWS, box, rng))

    def kicked(self, problem: ExcitationProblem, best: Array) -> End:
        """The end of a descent from the surroundings of the best known point (dimension,)."""
        rng = self._stream()
        spread = np.exp(rng.uniform(*np.log(KICKS))) * (problem.upper - problem.lower) / 2
        touched = rng.random((KICKED, len(best))) < rng.random((KICKED, 1))  # few numbers or many
        points = best + spread * touched * rng.normal(size=(KICKED, len(best)))
        return _from_best_of(_plain(problem), np.clip(points, problem.lower, problem.upper))

    def _without_slopes(
        self, problem: ExcitationProblem, box: Box, best: Array | None, rng: np.random.Generator
    ) -> tuple[str, End]:
        turn = WITHOUT_SLOPES[self.number % len(WITHOUT_SLOPES)] if best is not None else "cma-es"
        if turn == "kick" and best is not None:
            reach = np.exp(rng.uniform(*np.log(KICKS))) * (box.upper - box.lower) / 2
            box = Box(np.maximum(best - reach, box.lower), np.minimum(best + reach, box.upper))
        return turn, _evolution(problem, box, POPULATION, EVALUATIONS, rng)

    def _stream(self) -> np.random.Generator:
        return named_generator("best known", self.seed, self.name, self.number)

    def _evolved(self, plain: ExcitationProblem, box: Box, rng: np.random.Generator) -> End:
        restarts = sum(TURNS[number % len(TURNS)] == "cma-es" for number in range(self.number))
        size = POPULATION * 2 ** (restarts % DOUBLINGS)
        before = _evolution(plain, box, size, BUDGET * size, rng)
        after = descend(plain, before.point)
        best = after if after.better_than(before) else replace(before, gradients=after.gradients)
        return replace(best, evaluations=before.evaluations + after.evaluations)


def _evolution(problem: ExcitationProblem, box: Box, size: int, evaluations: int, rng: np.random.Generator) -> End:
    """Where CMA-ES ends in a box."""
    algorithm, population = find_algorithm("cma-es", "best-known"), uniform_points(size, box, rng)
    with np.errstate(over="ignore"):  # in the package, when every point of a generation is as good
        found = minimise(
            algorithm, CMAESParams(), lambda X: problem.evaluate(X).fitness, box, population, evaluations, rng
        )
    return _add(judge(problem, found.best_x), found.evaluations - 1)


def _plain(problem: ExcitationProblem) -> ExcitationProblem:
    """The same with nothing to minimise but the condition number and the penalty."""
    return replace(problem, criterion=Criterion("eq44"))


def _from_best_of(plain: ExcitationProblem, points: Array) -> End:
    return _add(descend(plain, points[np.argmin(plain.evaluate(points).fitness)]), len(points))


def _add(end: End, evaluations: int) -> End:
    return replace(end, evaluations=end.evaluations + evaluations)
