"""MuPSO: a particle swarm whose whole swarm mutates when it stagnates (the paper's eq. 1-8 and Table 2).

Update of a particle with position x, velocity v and personal best p; g is the global best, `it` the number of
populations that the algorithm was told, `horizon` the planned iterations:

    v(it + 1) = w_it v(it) + c1 r1 (p - x(it)) + c2_it r2 (g - x(it))             eq. 2
    x(it + 1) = x(it) + v(it + 1)                                                 eq. 1
    w_it  = 2.1 n^it,    n = (0.6 / 2.1)^(1 / horizon)                            eq. 3
    c2_it = 1.8 / m^it,  m = (1.8 / 3.9)^(1 / horizon)                            eq. 4

so that both schedules reach their last value at the last planned iteration; c1 = 2.24. Stagnation of the global
best F:

    e_it = F_(it-1) - F_it                                                        eq. 5
    q = q + 1 if e_(it-1) - e_it < E, else 0                                      eq. 6
    at q >= Q: end if F <= E; draw the whole swarm anew if F > 1e-3               eq. 7
    x = uniform in the box                                                        eq. 8

with E = 1e-8 and Q = 10. After eq. 8 the particles are at rest, their personal bests and their global best are
forgotten, q and e are 0, and the schedules run on.

What the paper leaves open, and how it is read here:
- F in eq. 5-7 is that of the swarm's present global best, which a mutation forgets.
- Eq. 6 is literal by default: an iteration whose improvement grows counts as stagnant too.
  `stagnation="no_improvement"` counts while e_it < E. The error before a swarm's first step is 0.
- Eq. 7 names nothing for E < F <= 1e-3 at q >= Q: the swarm then flies on as it is.
- No speed limit is named, but w > 1 makes the swarm explode without one. Here it is half of the box width,
  Vmax = Xmax, which Shi and Eberhart 1998b advise together with a weight that falls in time. It is the same in SPSO.
- Speeds at the start, walls and the order of updates: as in `algorithms.spso`, and so is its reading `text`.
No other package has this algorithm; `algorithms.spso` says how particle swarms differ.
"""

from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge

from algorithms.contract import Box, uniform_points
from algorithms.parameter_types import OURS, NotNegative, Positive, TextReading
from algorithms.spso import Swarm, fly, global_best, land, new_swarm
from armlab.common.arrays import Array


@dataclass(frozen=True)
class MuPSOParams:
    """Table 2, E and Q of eq. 6-7; velocity_limit is a fraction of the width of the box."""

    first_inertia: Positive = 2.1
    last_inertia: Positive = 0.6
    cognitive: NotNegative = 2.24
    first_social: Positive = 1.8
    last_social: Positive = 3.9
    abandonment_threshold: NotNegative = 1e-8
    abandonment_limit: Annotated[int, Ge(1)] = 10
    mutation_threshold: NotNegative = 1e-3
    stagnation: Literal["second_difference", "no_improvement"] = "second_difference"
    velocity_limit: Positive = 0.5
    reading: TextReading = OURS

    def __post_init__(self) -> None:
        if self.stagnation not in ("second_difference", "no_improvement"):
            raise ValueError(f"stagnation is {self.stagnation!r}: second_difference or no_improvement")


@dataclass
class MuPSOState:
    """iteration: populations told; q: abandonment counter; mutations: iterations with a swarm drawn anew."""

    params: MuPSOParams
    swarm: Swarm
    box: Box
    horizon: int
    rng: np.random.Generator
    iteration: int = 0
    fitness: float | None = None  # of the present global best; None for a swarm that was not evaluated yet
    fitness_error: float = 0.0
    q: int = 0
    mutations: list[int] = field(default_factory=list)


class MuPSO:
    """Mutating particle swarm optimisation."""

    name = "mupso"
    Params = MuPSOParams

    @staticmethod
    def init(params: MuPSOParams, population: Array, box: Box, horizon: int, rng: np.random.Generator) -> MuPSOState:
        swarm = new_swarm(population, box, params.velocity_limit, params.reading)
        return MuPSOState(params, swarm, box, horizon, rng)

    @staticmethod
    def ask(state: MuPSOState) -> tuple[Array, MuPSOState]:
        if _must_mutate(state):
            _mutate(state)
        elif state.iteration > 0:
            _fly(state)
        return state.swarm.position.copy(), state

    @staticmethod
    def tell(state: MuPSOState, X: Array, fitness: Array) -> MuPSOState:
        land(state.swarm, X, fitness)
        state.iteration += 1
        _count_stagnation(state)
        return state

    @staticmethod
    def incumbent(state: MuPSOState) -> tuple[Array, float]:
        x, fitness = global_best(state.swarm)
        return x.copy(), fitness

    @staticmethod
    def finished(state: MuPSOState) -> bool:
        return _is_abandoned(state) and global_best(state.swarm)[1] <= state.params.abandonment_threshold  # eq. 7


def _fly(state: MuPSOState) -> None:
    """Eq. 1-2 with w and c2 of the iteration (eq. 3-4)."""
    params = state.params
    progress = min(state.iteration / max(state.horizon, 1), 1.0)
    w = _geometric_schedule(params.first_inertia, params.last_inertia, progress)  # eq. 3
    c2 = _geometric_schedule(params.first_social, params.last_social, progress)  # eq. 4
    fly(state.swarm, w, params.cognitive, c2, state.rng)


def _geometric_schedule(first: float, last: float, progress: float) -> float:
    """first * n**it with n chosen so that `last` is reached at the horizon; progress = it / horizon."""
    return first * float((last / first) ** progress)


def _count_stagnation(state: MuPSOState) -> None:
    """Eq. 5-6, after a population was told."""
    fitness = global_best(state.swarm)[1]
    if state.fitness is not None:
        error = 0.0 if fitness == state.fitness else state.fitness - fitness  # eq. 5; inf - inf is no progress
        literal = state.params.stagnation == "second_difference"
        slowing = state.fitness_error - error if literal else error
        state.q = state.q + 1 if slowing < state.params.abandonment_threshold else 0  # eq. 6
        state.fitness_error = error
    state.fitness = fitness


def _is_abandoned(state: MuPSOState) -> bool:
    return state.q >= state.params.abandonment_limit


def _must_mutate(state: MuPSOState) -> bool:
    return _is_abandoned(state) and global_best(state.swarm)[1] > state.params.mutation_threshold  # eq. 7


def _mutate(state: MuPSOState) -> None:
    """Draw the whole swarm anew, at rest; it remembers nothing (eq. 8)."""
    position = uniform_points(len(state.swarm.position), state.box, state.rng)  # eq. 8
    state.swarm = new_swarm(position, state.box, state.params.velocity_limit, state.params.reading)
    state.fitness, state.fitness_error, state.q = None, 0.0, 0
    state.mutations.append(state.iteration)
