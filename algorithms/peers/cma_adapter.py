"""Hansen's own CMA-ES, the package `cma`, in the box; a population at once.

Form: as our `cma-es`, which is the package `cmaes`: coordinates normalised by the box, the first population
told as a first generation of the distribution at the centre with the spread of uniform points, the population
size that of the swarm. pycma transforms its points smoothly into the box, so the bound policy moves none of
them. Its stopping tests are not used: only the budget ends it.
"""

import math
from dataclasses import dataclass

import cma
import numpy as np

from algorithms.parameter_types import Positive
from algorithms.peers.peer import Evaluate, Peer, Start


@dataclass(frozen=True)
class PycmaParams:
    """Initial step size as a fraction of the width of the box."""

    first_step_size: Positive = 1.0 / math.sqrt(12.0)


class Pycma(Peer):
    """Covariance matrix adaptation with a transformation into the box."""

    name = "pycma"
    rival = "cma-es"
    Params = PycmaParams
    calls_lapack = True
    fewest = 4

    @staticmethod
    def search(params: PycmaParams, start: Start, evaluate: Evaluate) -> None:
        dimension, width = start.X.shape[1], start.box.upper - start.box.lower
        normal = np.random.default_rng(start.seed).standard_normal
        options = {
            "popsize": len(start.X),
            "bounds": [0.0, 1.0],
            "randn": lambda *shape: normal(shape),
            "seed": float("nan"),
            "verbose": -9,
        }
        strategy = cma.CMAEvolutionStrategy(np.full(dimension, 0.5), params.first_step_size, options)
        strategy.ask()
        strategy.tell(list((start.X - start.box.lower) / width), start.loss.tolist())
        while True:
            U = np.array(strategy.ask())
            strategy.tell(list(U), evaluate(start.box.lower + U * width).tolist())
