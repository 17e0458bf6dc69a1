"""Grasshopper optimisation algorithm (Saremi, Mirjalili and Lewis 2017).

Update of grasshopper i in coordinate d; T is the target, the best point so far, lb and ub are the limits of the box:

    x_i^d = c sum_(j != i) c (ub_d - lb_d) / 2 s(r_ij^d) (x_j^d - x_i^d) / d_ij + T^d     eq. 2.7
    s(r) = f exp(-r / l) - exp(-r),   f = 0.5, l = 1.5                                    eq. 2.3
    c = c_max - t (c_max - c_min) / horizon,   c_max = 1, c_min = 4e-5 (Table 2)          eq. 2.8

The whole swarm moves together. It draws no random numbers: all chance is in the first population (and, in the
reading `program`, in the extra coordinate).

Where this differs from the source: there r_ij^d = |x_j^d - x_i^d| is a plain number, so the units of the coordinates
matter, and the source maps distances into [1, 4] without an equation. Here coordinates are normalised by the box,
u = (x - lb) / (ub - lb), and

    r_ij^d = 1 + 3 |u_j^d - u_i^d|,   (x_j^d - x_i^d) / d_ij  becomes  (u_j^d - u_i^d) / ||u_j - u_i||,

so that the units do not matter. Two grasshoppers at one point exert no force on each other.

Other readings (`reading`):
- `text`: eq. 2.7 as printed, r_ij^d = |x_j^d - x_i^d| in the units of the coordinates.
- `program`, the authors' MATLAB: it works on pairs of coordinates, each as a plane of its own, with
  r_ij = 2 + (d_ij mod 2) and d_ij the distance in the plane, in the units of the coordinates; where their number is
  odd it adds one coordinate from -100 to 100 that the objective does not see; c = c_max - (t + 1) (c_max - c_min) /
  (horizon + 1).

How peers differ: mealpy multiplies by an extra normal number.
"""

from dataclasses import dataclass

import numpy as np

from algorithms.contract import Box, as_loss
from algorithms.leaders import Leaders, leader, no_leaders, promote
from algorithms.parameter_types import OURS, NotNegative, Positive, Reading
from armlab.common.arrays import Array

PAIR_COORDINATES = 2**15  # 256 KiB an array
EXTRA_LIMIT = 100.0  # of the coordinate that the authors' program adds


@dataclass(frozen=True)
class GOAParams:
    """Table 2 for c; attraction f and its length l as in the paper."""

    first_c: NotNegative = 1.0
    last_c: NotNegative = 4e-5
    attraction: NotNegative = 0.5
    attraction_length: Positive = 1.5
    reading: Reading = OURS


@dataclass
class GOAState:
    params: GOAParams
    position: Array
    leaders: Leaders
    box: Box
    horizon: int
    extra: Array  # (n,): the coordinate that the reading `program` adds
    extra_target: float = 0.0
    iteration: int = 0


class GOA:
    """Grasshoppers that repel each other when near, attract when far, and are drawn to the target."""

    name = "goa"
    Params = GOAParams

    @staticmethod
    def init(params: GOAParams, population: Array, box: Box, horizon: int, rng: np.random.Generator) -> GOAState:
        adds = params.reading == "program" and population.shape[1] % 2 == 1
        extra = rng.uniform(-EXTRA_LIMIT, EXTRA_LIMIT, len(population)) if adds else np.zeros(0)
        return GOAState(params, population.copy(), no_leaders(population, 1), box, horizon, extra)

    @staticmethod
    def ask(state: GOAState) -> tuple[Array, GOAState]:
        if state.iteration > 0:
            state.position = _hop_in_planes(state) if state.params.reading == "program" else _hop(state)
        return state.position.copy(), state

    @staticmethod
    def tell(state: GOAState, X: Array, fitness: Array) -> GOAState:
        if len(state.extra) and len(X) and as_loss(fitness).min() < state.leaders.fitness[0]:
            state.extra_target = float(state.extra[as_loss(fitness).argmin()])
        promote(state.leaders, X, fitness)
        state.position[...] = X
        state.iteration += 1
        return state

    @staticmethod
    def incumbent(state: GOAState) -> tuple[Array, float]:
        return leader(state.leaders)

    @staticmethod
    def finished(state: GOAState) -> bool:
        return False


def _hop(state: GOAState) -> Array:
    """New positions (n, d): c^2 (ub - lb) / 2 times the social forces, from the target (eq. 2.7)."""
    params, width = state.params, state.box.upper - state.box.lower
    progress = min(state.iteration / max(state.horizon, 1), 1.0)
    c = params.first_c - progress * (params.first_c - params.last_c)  # eq. 2.8
    if params.reading == "text":
        return np.asarray(c * (c * width / 2.0 * plain_forces(state.position, params)) + state.leaders.position[0])
    forces = social_forces((state.position - state.box.lower) / width, params)
    X: Array = c * (c * width / 2.0 * forces) + state.leaders.position[0]  # eq. 2.7
    return X


def plain_forces(X: Array, params: GOAParams) -> Array:
    """sum_j s(|x_j^d - x_i^d|) (x_j^d - x_i^d) / ||x_j - x_i|| of eq. 2.7 as printed, (n, d) -> (n, d)."""
    difference = X[None] - X[:, None]  # x_j - x_i: (i, j, d)
    distance = np.linalg.norm(difference, axis=2, keepdims=True)
    distance[distance == 0.0] = 1.0  # itself or a twin: the difference is zero already
    return np.asarray((_social(np.abs(difference), params) * difference / distance).sum(axis=1))


def _hop_in_planes(state: GOAState) -> Array:
    """New positions (n, d) of the authors' program, plane by plane; moves the extra coordinate in place."""
    params = state.params
    progress = min((state.iteration + 1) / (state.horizon + 1), 1.0)
    c = params.first_c - progress * (params.first_c - params.last_c)
    X, width = state.position, state.box.upper - state.box.lower
    target = state.leaders.position[0]
    if len(state.extra):
        X, width = np.column_stack([X, state.extra]), np.append(width, 2.0 * EXTRA_LIMIT)
        target = np.append(target, state.extra_target)
    moved = np.empty_like(X)
    for k in range(0, X.shape[1], 2):
        difference = X[None, :, k : k + 2] - X[:, None, k : k + 2]
        distance = np.linalg.norm(difference, axis=2, keepdims=True)
        force = _social(2.0 + np.mod(distance, 2.0), params) * difference / (distance + np.finfo(float).eps)
        moved[:, k : k + 2] = c * (c * width[k : k + 2] / 2.0 * force.sum(axis=1)) + target[k : k + 2]
    if len(state.extra):
        state.extra = np.clip(moved[:, -1], -EXTRA_LIMIT, EXTRA_LIMIT)
        moved = moved[:, :-1]
    return np.ascontiguousarray(moved)


def social_forces(U: Array, params: GOAParams) -> Array:
    """sum_j s(r_ij) (u_j - u_i) / ||u_j - u_i|| of eq. 2.7, in normalised coordinates, (n, d) -> (n, d).

    A few grasshoppers at a time against all, so that the pairs stay in the processor's cache.
    """
    others = np.ascontiguousarray(U.T)
    few = max(PAIR_COORDINATES // U.size, 1)
    return np.concatenate([_forces_on(others[:, i : i + few], others, params) for i in range(0, len(U), few)])


def _forces_on(some: Array, others: Array, params: GOAParams) -> Array:
    """Forces on some (d, m) of the others (d, n), (m, d)."""
    difference = others[:, None, :] - some[:, :, None]  # x_j - x_i: (d, i, j)
    squared_distance = np.square(difference).sum(axis=0)
    squared_distance[squared_distance == 0.0] = 1.0  # itself or a twin: the difference is zero already
    r = np.abs(difference)
    r *= 3.0
    r += 1.0
    force = _social(r, params)
    difference /= np.sqrt(squared_distance)
    force *= difference
    return np.ascontiguousarray(np.add.reduce(force, axis=2).T)


def _social(r: Array, params: GOAParams) -> Array:
    """Eq. 2.3, s(r) = f exp(-r / l) - exp(-r); overwrites r."""
    force: Array = r * (-1.0 / params.attraction_length)
    np.exp(force, out=force)
    force *= params.attraction
    force -= np.exp(np.negative(r, out=r), out=r)
    return force
