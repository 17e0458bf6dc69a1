"""Standard particle swarm: global best, constant inertia weight, with the constants of Table 2.

Update of a particle with position x, velocity v and personal best p; g is the global best (the paper's eq. 1-2;
Kennedy and Eberhart 1995 with the inertia weight of Shi and Eberhart 1998a):

    v(t + 1) = w v(t) + c1 r1 (p - x(t)) + c2 r2 (g - x(t))            eq. 2
    x(t + 1) = x(t) + v(t + 1)                                         eq. 1

with r1 and r2 uniform in [0, 1), drawn anew for every particle and coordinate, and w = 0.72, c1 = c2 = 1.45
(Table 2). This is the constriction form of Clerc and Kennedy 2002 written with an inertia weight, near its usual
constants chi = 0.7298 and 2.05 chi = 1.4962.

What the equations leave open, one way for SPSO and MuPSO:
- velocities start at zero (Engelbrecht 2012);
- between eq. 2 and eq. 1 a velocity is limited, coordinate by coordinate, to a fraction of the width of the box:
  one half, Vmax = Xmax, as Eberhart and Shi 2000 advise beside constriction;
- a coordinate that the bound policy moved loses its velocity (Clerc 2012, the form of 2007; the "absorbing wall" of
  Robinson and Rahmat-Samii 2004), because the particle would push against the wall from then on;
- the swarm moves as one: all bests are updated after the whole population is evaluated.
`flight.c` has both equations, particle by particle.

Another reading (`reading`), of both: `text` adds nothing to eq. 1-2, no limit of the velocity, and a velocity that goes
on at the bounds. The paper's program is not published, so there is no reading of it.

How peers differ: pygmo defaults to a ring of neighbours (local best) with constriction; mealpy moves a particle only
if the new place is better; NiaPy sets w = 1; pymoo adapts its constants; evosax has no bounds.
"""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from algorithms._flight import ffi, lib
from algorithms.contract import Box
from algorithms.parameter_types import OURS, NotNegative, Positive, TextReading
from armlab.common.arrays import Array

_pointer = partial(ffi.from_buffer, ffi.typeof("double *"))


@dataclass
class Swarm:
    """Particles (n, d) with velocities, and each one's best point and fitness (n,) so far.

    velocity_limit (d,): infinite in the reading `text`, in which a velocity goes on at the bounds. leader: the particle
    whose personal best is the global best, the first of equals. The arrays are changed in place and never replaced,
    since `flight.c` knows where they are.
    """

    position: Array
    velocity: Array
    personal_best: Array
    personal_best_fitness: Array
    velocity_limit: Array
    leader: int = 0

    def __post_init__(self) -> None:
        self.memory = ffi.new("Particles *", (*self.position.shape, *map(_pointer, self._arrays())))

    def __reduce__(self) -> tuple[Any, ...]:
        return Swarm, (*self._arrays(), self.leader)

    def _arrays(self) -> tuple[Array, ...]:
        return self.position, self.velocity, self.personal_best, self.personal_best_fitness, self.velocity_limit


def new_swarm(position: Array, box: Box, velocity_limit: float, reading: TextReading) -> Swarm:
    """Particles at rest that remember nothing; velocity_limit is a fraction of the width of the box."""
    position = np.array(position, dtype=np.float64, order="C")
    limit = np.multiply(np.inf if reading == "text" else velocity_limit, box.upper - box.lower, dtype=np.float64)
    return Swarm(position, np.zeros(position.shape), position.copy(), np.full(len(position), np.inf), limit)


def fly(swarm: Swarm, w: float, c1: float, c2: float, rng: np.random.Generator) -> None:
    """Move all particles: v = w v + c1 r1 (p - x) + c2 r2 (g - x), limited (eq. 2); x = x + v (eq. 1)."""
    r = rng.random((2, *swarm.position.shape))
    lib.fly(swarm.memory, swarm.leader, w, c1, c2, _pointer(r))


def land(swarm: Swarm, X: Array, fitness: Array) -> None:
    """Take the positions where the bound policy put them and remember what is better than before."""
    if X.shape != swarm.position.shape or fitness.shape != X.shape[:1]:
        raise ValueError(f"particles {swarm.position.shape} were told points {X.shape} with fitness {fitness.shape}")
    told, losses = np.ascontiguousarray(X, np.float64), np.ascontiguousarray(fitness, np.float64)
    swarm.leader = lib.land(swarm.memory, _pointer(told), _pointer(losses))


def global_best(swarm: Swarm) -> tuple[Array, float]:
    """The best personal best (d,) and its fitness."""
    return swarm.personal_best[swarm.leader], float(swarm.personal_best_fitness[swarm.leader])


@dataclass(frozen=True)
class SPSOParams:
    """Table 2; velocity_limit is a fraction of the width of the box."""

    inertia: NotNegative = 0.72
    cognitive: NotNegative = 1.45
    social: NotNegative = 1.45
    velocity_limit: Positive = 0.5
    reading: TextReading = OURS


@dataclass
class SPSOState:
    params: SPSOParams
    swarm: Swarm
    rng: np.random.Generator
    started: bool = False


class SPSO:
    """Particle swarm of eq. 1-2 with constant coefficients."""

    name = "spso"
    Params = SPSOParams

    @staticmethod
    def init(params: SPSOParams, population: Array, box: Box, horizon: int, rng: np.random.Generator) -> SPSOState:
        return SPSOState(params, new_swarm(population, box, params.velocity_limit, params.reading), rng)

    @staticmethod
    def ask(state: SPSOState) -> tuple[Array, SPSOState]:
        if state.started:
            params = state.params
            fly(state.swarm, params.inertia, params.cognitive, params.social, state.rng)
        return state.swarm.position.copy(), state

    @staticmethod
    def tell(state: SPSOState, X: Array, fitness: Array) -> SPSOState:
        land(state.swarm, X, fitness)
        state.started = True
        return state

    @staticmethod
    def incumbent(state: SPSOState) -> tuple[Array, float]:
        x, fitness = global_best(state.swarm)
        return x.copy(), fitness

    @staticmethod
    def finished(state: SPSOState) -> bool:
        return False
