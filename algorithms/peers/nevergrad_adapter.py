"""nevergrad's particle swarm and differential evolution, as they come; one point at a time.

Coordinates are normalised by the box. The first population is suggested to the package and told.
`nevergrad-pso`: the standard swarm of 2011 in a space that arctan maps into the box (w = 0.72, c = 1.19),
particles move one after the other. `nevergrad-de`: current-to-best/1, F = 0.8, CR = 0.5. Both with the
population size of the swarm. It takes no loss of 5e20 or more: one above 1e20 counts as 1e20.
Its wizard NGOpt is left out: version 1.0.12 fails with numpy 2.4.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from nevergrad.optimization.differentialevolution import DifferentialEvolution
from nevergrad.optimization.optimizerlib import ConfPSO
from nevergrad.parametrization import parameter

from algorithms.peers.peer import Evaluate, Peer, Start

_LARGEST_LOSS = 1e20


@dataclass(frozen=True)
class NevergradParams:
    """There is nothing to set."""


class NevergradPSO(Peer):
    """Standard particle swarm of 2011."""

    name = "nevergrad-pso"
    rival = "spso"
    Params = NevergradParams

    @staticmethod
    def search(params: NevergradParams, start: Start, evaluate: Evaluate) -> None:
        _run_optimiser(ConfPSO(popsize=len(start.X)), start, evaluate)


class NevergradDE(Peer):
    """Differential evolution, current-to-best."""

    name = "nevergrad-de"
    rival = "de"
    Params = NevergradParams
    fewest = 4

    @staticmethod
    def search(params: NevergradParams, start: Start, evaluate: Evaluate) -> None:
        _run_optimiser(DifferentialEvolution(popsize=len(start.X)), start, evaluate)


def _run_optimiser(method: Any, start: Start, evaluate: Evaluate) -> None:
    lower, width = start.box.lower, start.box.upper - start.box.lower
    with _keep_global_random_state():
        unit_box = parameter.Array(shape=width.shape, lower=0.0, upper=1.0)
        unit_box.random_state = np.random.RandomState(start.seed)
        optimiser = method(unit_box, budget=len(start.X) * (start.horizon + 1))
    for point in start.X:
        optimiser.suggest((point - lower) / width)
    for loss in start.loss.tolist():
        optimiser.tell(optimiser.ask(), min(loss, _LARGEST_LOSS))
    while True:
        asked = optimiser.ask()
        loss = float(evaluate(lower + width * asked.value[None])[0])
        optimiser.tell(asked, min(loss, _LARGEST_LOSS))


@contextmanager
def _keep_global_random_state() -> Iterator[None]:
    """nevergrad's space and method draw seeds from numpy's global state when they are made, and never use them."""
    state = np.random.get_state()  # noqa: NPY002
    try:
        yield
    finally:
        np.random.set_state(state)  # noqa: NPY002
