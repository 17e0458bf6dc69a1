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
  (horizon + 1). Compared with public copies of its `GOA.m` (demo V1.0): planes, remainder, extra coordinate, c and the
  update of the target agree.

How peers differ: mealpy multiplies by an extra normal number.
"""

from dataclasses import dataclass

import numpy as np

from algorithms.contract import Box
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
    """position, box: with the coordinate that the reading `program` may add as the last one.

    seen: coordinates that the objective sees.
    """

    params: GOAParams
    position: Array
    leaders: Leaders
    box: Box
    seen: int
    horizon: int
    iteration: int = 0


class GOA:
    """Grasshoppers that repel each other when near, attract when far, and are drawn to the target."""

    name = "goa"
    Params = GOAParams

    @staticmethod
    def init(params: GOAParams, population: Array, box: Box, horizon: int, rng: np.random.Generator) -> GOAState:
        position, seen = population.copy(), population.shape[1]
        if params.reading == "program" and seen % 2 == 1:
            position = np.column_stack([position, rng.uniform(-EXTRA_LIMIT, EXTRA_LIMIT, len(position))])
            box = Box(np.append(box.lower, -EXTRA_LIMIT), np.append(box.upper, EXTRA_LIMIT))
        return GOAState(params, position, no_leaders(position, 1), box, seen, horizon)

    @staticmethod
    def ask(state: GOAState) -> tuple[Array, GOAState]:
        if state.iteration > 0:
            state.position = _hop(state)
        return state.position[:, : state.seen].copy(), state

    @staticmethod
    def tell(state: GOAState, X: Array, fitness: Array) -> GOAState:
        state.position[:, : state.seen] = X
        promote(state.leaders, state.position, fitness)
        state.iteration += 1
        return state

    @staticmethod
    def incumbent(state: GOAState) -> tuple[Array, float]:
        position, fitness = leader(state.leaders)
        return position[: state.seen], fitness

    @staticmethod
    def finished(state: GOAState) -> bool:
        return False


def _hop(state: GOAState) -> Array:
    """New positions (n, d): c^2 (ub - lb) / 2 times the social forces, from the target (eq. 2.7)."""
    params, X, width = state.params, state.position, state.box.upper - state.box.lower
    ahead = 1 if params.reading == "program" else 0
    progress = min((state.iteration + ahead) / max(state.horizon + ahead, 1), 1.0)
    c = params.first_c - progress * (params.first_c - params.last_c)  # eq. 2.8
    if params.reading == "program":
        forces = plane_forces(X, params)
    elif params.reading == "text":
        forces = plain_forces(X, params)
    else:
        forces = social_forces((X - state.box.lower) / width, params)
    moved: Array = c * (c * width / 2.0 * forces) + state.leaders.position[0]  # eq. 2.7
    moved[:, state.seen :] = np.clip(moved[:, state.seen :], -EXTRA_LIMIT, EXTRA_LIMIT)
    return moved


def plain_forces(X: Array, params: GOAParams) -> Array:
    """sum_j s(|x_j^d - x_i^d|) (x_j^d - x_i^d) / ||x_j - x_i|| of eq. 2.7 as printed, (n, d) -> (n, d)."""
    difference = X[None] - X[:, None]  # x_j - x_i: (i, j, d)
    distance = np.linalg.norm(difference, axis=2, keepdims=True)
    distance[distance == 0.0] = 1.0  # itself or a twin: the difference is zero already
    return np.asarray((_social(np.abs(difference), params) * difference / distance).sum(axis=1))


def plane_forces(X: Array, params: GOAParams) -> Array:
    """sum_j s(2 + (d_ij mod 2)) (x_j - x_i) / d_ij in each plane of two coordinates, (n, d) -> (n, d), d even."""
    forces = np.empty_like(X)
    for k in range(0, X.shape[1], 2):
        difference = X[None, :, k : k + 2] - X[:, None, k : k + 2]  # x_j - x_i: (i, j, 2)
        distance = np.linalg.norm(difference, axis=2, keepdims=True)
        pull = _social(2.0 + np.mod(distance, 2.0), params) * difference / (distance + np.finfo(float).eps)
        forces[:, k : k + 2] = pull.sum(axis=1)
    return forces


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
