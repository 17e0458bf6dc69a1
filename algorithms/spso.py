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

Another reading (`reading`), of both: `text` adds nothing to eq. 1-2, no limit of the velocity, and a velocity that goes
on at the bounds. The paper's program is not published, so there is no reading of it.

How peers differ: pygmo defaults to a ring of neighbours (local best) with constriction; mealpy moves a particle only
if the new place is better; NiaPy sets w = 1; pymoo adapts its constants; evosax has no bounds.
"""

from dataclasses import dataclass

import numpy as np

from algorithms.contract import Box, as_loss
from algorithms.parameter_types import OURS, NotNegative, Positive, TextReading
from armlab.common.arrays import Array


@dataclass
class Swarm:
    """Particles (n, d) with velocities, and each one's best point and fitness (n,) so far.

    velocity_limits (n, d) each: the same rows for all, since numpy adds equal shapes several times faster than rows;
    infinite in the reading `text`, in which a velocity goes on at the bounds.
    """

    position: Array
    velocity: Array
    velocity_limits: Box
    personal_best: Array
    personal_best_fitness: Array


def new_swarm(position: Array, box: Box, velocity_limit: float, reading: TextReading) -> Swarm:
    """Particles at rest that remember nothing; velocity_limit is a fraction of the width of the box."""
    velocity_limit = np.inf if reading == "text" else velocity_limit
    limit = np.tile(velocity_limit * (box.upper - box.lower), (len(position), 1))
    unknown = np.full(len(position), np.inf)
    return Swarm(position.copy(), np.zeros_like(position), Box(-limit, limit), position.copy(), unknown)


def fly(swarm: Swarm, w: float, c1: float, c2: float, rng: np.random.Generator) -> None:
    """Move all particles: v = w v + c1 r1 (p - x) + c2 r2 (g - x), limited (eq. 2); x = x + v (eq. 1)."""
    r1, r2 = rng.random((2, *swarm.position.shape))
    r1 *= swarm.personal_best - swarm.position
    r1 *= c1
    pull = np.empty_like(swarm.position)
    pull[...] = global_best(swarm)[0]
    pull -= swarm.position
    r2 *= pull
    r2 *= c2
    velocity = swarm.velocity
    velocity *= w
    velocity += r1
    velocity += r2
    np.minimum(velocity, swarm.velocity_limits.upper, out=velocity)
    np.maximum(velocity, swarm.velocity_limits.lower, out=velocity)
    swarm.position += velocity


def land(swarm: Swarm, X: Array, fitness: Array) -> None:
    """Take the positions where the bound policy put them and remember what is better than before."""
    loss = as_loss(fitness)
    if swarm.velocity_limits.upper[0, 0] < np.inf:
        np.copyto(swarm.velocity, 0.0, where=swarm.position != X)
    swarm.position[...] = X
    better = loss < swarm.personal_best_fitness
    np.copyto(swarm.personal_best, X, where=better[:, None])
    np.minimum(swarm.personal_best_fitness, loss, out=swarm.personal_best_fitness)


def global_best(swarm: Swarm) -> tuple[Array, float]:
    """The best personal best (d,), the first of equals, and its fitness."""
    leader = swarm.personal_best_fitness.argmin()
    return swarm.personal_best[leader], float(swarm.personal_best_fitness[leader])


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
