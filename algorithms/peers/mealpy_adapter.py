"""mealpy's `Original...` PSO, GWO, WOA, GOA and DE, as they come; all evaluate one point at a time.

`mealpy-pso`: w = 0.4, c = 2.05, random first velocities; a particle moves only if the new place is better, and
a coordinate outside is drawn anew in the box. Ours: w = 0.72, c = 1.45, at rest first, always moves, clipped.
`mealpy-gwo`: accepts only better places; ours moves always.
`mealpy-woa`: one random number for A and C, and a fresh uniform point in place of another whale.
`mealpy-goa`: c from 2 (ours 1), and an extra normal number on every step.
`mealpy-de`: rand/1/bin with F = 0.1, CR = 0.9 and no forced coordinate; ours F = 0.85, CR = 1.
mealpy has no MuPSO.
"""

from dataclasses import dataclass
from typing import Any

from mealpy import DE, GOA, GWO, PSO, WOA, FloatVar

from algorithms.peers.peer import Evaluate, Peer, Start, answer_first_population
from armlab.common.arrays import Array


@dataclass(frozen=True)
class MealpyPSOParams:
    """mealpy's defaults."""

    c1: float = 2.05
    c2: float = 2.05
    w: float = 0.4


@dataclass(frozen=True)
class MealpyGOAParams:
    """mealpy's defaults."""

    c_min: float = 0.00004
    c_max: float = 2.0


@dataclass(frozen=True)
class MealpyDEParams:
    """mealpy's defaults; strategy 0 is rand/1/bin."""

    wf: float = 0.1
    cr: float = 0.9
    strategy: int = 0


@dataclass(frozen=True)
class MealpyNoParams:
    """There is nothing to set."""


class _Mealpy(Peer):
    """It refuses fewer than five points."""

    fewest = 5


class MealpyPSO(_Mealpy):
    """Particle swarm that moves only to better places."""

    name = "mealpy-pso"
    rival = "spso"
    Params = MealpyPSOParams

    @staticmethod
    def search(params: MealpyPSOParams, start: Start, evaluate: Evaluate) -> None:
        _run_optimiser(PSO.OriginalPSO, start.horizon + 1, params, start, evaluate)


class MealpyGWO(_Mealpy):
    """Grey wolves that accept only better places."""

    name = "mealpy-gwo"
    rival = "gwo"
    Params = MealpyNoParams

    @staticmethod
    def search(params: MealpyNoParams, start: Start, evaluate: Evaluate) -> None:
        _run_optimiser(GWO.OriginalGWO, start.horizon, params, start, evaluate)


class MealpyWOA(_Mealpy):
    """Whales with one random number for two coefficients."""

    name = "mealpy-woa"
    rival = "woa"
    Params = MealpyNoParams

    @staticmethod
    def search(params: MealpyNoParams, start: Start, evaluate: Evaluate) -> None:
        _run_optimiser(WOA.OriginalWOA, start.horizon, params, start, evaluate)


class MealpyGOA(_Mealpy):
    """Grasshoppers with normal noise."""

    name = "mealpy-goa"
    rival = "goa"
    Params = MealpyGOAParams

    @staticmethod
    def search(params: MealpyGOAParams, start: Start, evaluate: Evaluate) -> None:
        _run_optimiser(GOA.OriginalGOA, start.horizon, params, start, evaluate)


class MealpyDE(_Mealpy):
    """Differential evolution with a small step."""

    name = "mealpy-de"
    rival = "de"
    Params = MealpyDEParams

    @staticmethod
    def search(params: MealpyDEParams, start: Start, evaluate: Evaluate) -> None:
        _run_optimiser(DE.OriginalDE, start.horizon + 1, params, start, evaluate)


def _run_optimiser(method: Any, epochs: int, params: Any, start: Start, evaluate: Evaluate) -> None:
    answer = answer_first_population(start, evaluate)

    def objective(point: Array) -> float:
        return float(answer(point[None])[0])

    problem = {"bounds": FloatVar(*start.box), "obj_func": objective, "minmax": "min", "log_to": None}
    optimiser = method(epoch=max(epochs, 1), pop_size=len(start.X), **vars(params))
    optimiser.solve(problem, starting_solutions=start.X, seed=start.seed)
