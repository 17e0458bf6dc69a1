"""The particle swarm that SPSO and MuPSO share: how it moves (eq. 1-2) and what it remembers.

What the equations leave open, one way for both:
- velocities start at zero (Engelbrecht 2012);
- a velocity is limited, coordinate by coordinate, to a fraction of the width of the box;
- a coordinate that the bound policy moved loses its velocity (Clerc's Standard PSO 2007; "absorbing wall",
  Robinson and Rahmat-Samii 2004), or the particle would push against the wall from then on;
- the swarm moves as one: all bests are updated after the whole population is evaluated.
"""

from dataclasses import dataclass

import numpy as np

from algorithms.contract import Array, Box, as_loss


@dataclass
class Swarm:
    """Particles (n, d) with velocities, and each one's best point and fitness (n,) so far.

    speed_limit (n, d): the same row for all, since numpy adds equal shapes several times faster than rows.
    """

    position: Array
    velocity: Array
    speed_limit: Array
    personal_best: Array
    personal_best_fitness: Array


def new_swarm(position: Array, box: Box, velocity_limit: float) -> Swarm:
    """Particles at rest that remember nothing; velocity_limit is a fraction of the width of the box."""
    limit = np.tile(velocity_limit * (box.upper - box.lower), (len(position), 1))
    unknown = np.full(len(position), np.inf)
    return Swarm(position.copy(), np.zeros_like(position), limit, position.copy(), unknown)


def fly(swarm: Swarm, w: float, c1: float, c2: float, rng: np.random.Generator) -> None:
    """Move all particles by eq. 1-2 with fresh r1, r2 for every coordinate."""
    r1, r2 = rng.random((2, *swarm.position.shape))
    r1 *= swarm.personal_best - swarm.position
    r1 *= c1
    r2 *= global_best(swarm)[0] - swarm.position
    r2 *= c2
    velocity = swarm.velocity
    velocity *= w
    velocity += r1
    velocity += r2
    np.minimum(velocity, swarm.speed_limit, out=velocity)
    np.maximum(velocity, -swarm.speed_limit, out=velocity)
    swarm.position += velocity


def land(swarm: Swarm, X: Array, fitness: Array) -> None:
    """Take the positions where the bound policy put them and remember what is better than before."""
    loss = as_loss(fitness)
    np.copyto(swarm.velocity, 0.0, where=swarm.position != X)
    swarm.position[...] = X
    better = loss < swarm.personal_best_fitness
    np.copyto(swarm.personal_best, X, where=better[:, None])
    np.minimum(swarm.personal_best_fitness, loss, out=swarm.personal_best_fitness)


def global_best(swarm: Swarm) -> tuple[Array, float]:
    """The best personal best (d,), the first of equals, and its fitness."""
    leader = swarm.personal_best_fitness.argmin()
    return swarm.personal_best[leader], float(swarm.personal_best_fitness[leader])
