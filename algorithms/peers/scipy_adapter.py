"""scipy's differential evolution, `scipy.optimize.differential_evolution`, as it comes.

Form: best/1/bin, F drawn anew for each generation from [0.5, 1) (dither), CR = 0.7, a trial replaces its
target at once (`immediate`), points outside are drawn anew in the box. Ours is rand/1/bin with F = 0.85 and
CR = 1 and replaces a whole generation. Set aside here: the polish at the end, which evaluates beyond the
budget, and the end when the population has converged.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import differential_evolution

from algorithms.peers.peer import Evaluate, Peer, Start, answer_first_population


@dataclass(frozen=True)
class ScipyDEParams:
    """scipy's defaults; mutation: the range that F is drawn from."""

    strategy: str = "best1bin"
    mutation: tuple[float, float] = (0.5, 1.0)
    recombination: float = 0.7


class ScipyDE(Peer):
    """One point at a time."""

    name = "scipy-de"
    rival = "de"
    Params = ScipyDEParams
    fewest = 5

    @staticmethod
    def search(params: ScipyDEParams, start: Start, evaluate: Evaluate) -> None:
        answer = answer_first_population(start, evaluate)

        def objective(point: Any) -> float:
            return float(answer(point[None])[0])

        differential_evolution(
            objective,
            list(zip(*start.box, strict=True)),
            strategy=params.strategy,
            mutation=params.mutation,
            recombination=params.recombination,
            maxiter=start.horizon + 1,  # it is the budget that ends it
            init=start.X,
            tol=0.0,
            atol=-1.0,  # no spread is below it: it never counts as converged
            polish=False,
            rng=np.random.default_rng(start.seed),
        )
