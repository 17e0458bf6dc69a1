"""pymoo's particle swarm and differential evolution, as they come; a population at once.

`pymoo-pso`: w and c adapted by fuzzy states, speed limit a fifth of the box width, the best particle is
perturbed. Ours: constant coefficients, half of the width.
`pymoo-de`: best/1/bin, F = 0.5, CR = 0.2, and polynomial mutation after it. Ours: rand/1/bin, F = 0.85, CR = 1.
"""

from dataclasses import dataclass
from typing import Any

from pymoo.algorithms.soo.nonconvex.de import DE
from pymoo.algorithms.soo.nonconvex.pso import PSO
from pymoo.core.evaluator import Evaluator
from pymoo.core.problem import Problem
from pymoo.core.termination import NoTermination
from pymoo.problems.static import StaticProblem

from algorithms.peers.peer import Evaluate, Peer, Start, answer_first_population


@dataclass(frozen=True)
class PymooPSOParams:
    """pymoo's defaults."""

    w: float = 0.9
    c1: float = 2.0
    c2: float = 2.0
    adaptive: bool = True
    max_velocity_rate: float = 0.2


class PymooPSO(Peer):
    """Particle swarm that adapts its coefficients."""

    name = "pymoo-pso"
    rival = "spso"
    Params = PymooPSOParams
    fewest = 2

    @staticmethod
    def search(params: PymooPSOParams, start: Start, evaluate: Evaluate) -> None:
        _run_optimiser(PSO(pop_size=len(start.X), sampling=start.X, **vars(params)), start, evaluate)


@dataclass(frozen=True)
class PymooDEParams:
    """pymoo's defaults."""

    variant: str = "DE/best/1/bin"
    F: float = 0.5
    CR: float = 0.2


class PymooDE(Peer):
    """Differential evolution with polynomial mutation."""

    name = "pymoo-de"
    rival = "de"
    Params = PymooDEParams
    fewest = 4

    @staticmethod
    def search(params: PymooDEParams, start: Start, evaluate: Evaluate) -> None:
        _run_optimiser(DE(pop_size=len(start.X), sampling=start.X, **vars(params)), start, evaluate)


def _run_optimiser(method: Any, start: Start, evaluate: Evaluate) -> None:
    answer = answer_first_population(start, evaluate)
    problem = Problem(n_var=start.X.shape[1], n_obj=1, xl=start.box.lower, xu=start.box.upper)
    method.setup(problem, termination=NoTermination(), seed=start.seed, verbose=False)
    while method.has_next():
        asked = method.ask()
        Evaluator().eval(StaticProblem(problem, F=answer(asked.get("X"))[:, None]), asked)
        method.tell(infills=asked)
