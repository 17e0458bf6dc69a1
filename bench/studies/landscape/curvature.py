"""Curvature at the best point: eigenvalues of the Hessian along the directions that no active limit closes.

    L(x) = f(x) - l' g(x),    Z' (d2L / dx2) Z    with    A Z = 0                 (Nocedal and Wright 2006, eq. 12.58)

f is the smooth criterion, g are the distances to the active limits, A their slopes, l >= 0 their multipliers.
Coordinates run from -1 to 1 over the box. Second derivatives are central differences of exact first ones.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import null_space
from scipy.optimize import nnls

from armlab.common.arrays import Array
from armlab.common.derivatives import Question
from bench.studies.landscape.basins import SHARPNESS
from bench.studies.landscape.sampling import in_box, in_shares
from problem.excitation import ExcitationProblem

ACTIVE = 1e-4  # distance to a limit, in halves of its range, or to a wall of the box
STEP = 1e-5  # of the differences, in halves of the box
FLAT = 1e-6  # of the largest curvature: below, a direction counts as flat


@dataclass(frozen=True)
class Curvature:
    """condition: largest over least curvature, in size, of the directions that are free and not flat; NaN for none.

    free: directions that no active limit closes. flat: of them, those without curvature. negative: those with a
    negative one, which a true minimum of the smooth criterion does not have.
    """

    condition: float
    free: int
    flat: int
    negative: int


def measure_curvature(problem: ExcitationProblem, point: Array) -> Curvature:
    """At a point (dimension,) within all limits."""
    half = (problem.upper - problem.lower) / 2
    first = problem.differentiate(point, Question(SHARPNESS, np.zeros(0, dtype=np.intp), ACTIVE))
    share = in_shares(problem, point)
    walls = np.flatnonzero(np.abs(share) > 1 - ACTIVE)
    slopes = np.vstack([first.margin_slopes * half, -np.sign(share[walls])[:, None] * np.eye(len(share))[walls]])
    multipliers = nnls(slopes.T, first.slope * half)[0][: len(first.watched)] if len(slopes) else np.zeros(0)
    free = null_space(slopes) if len(slopes) else np.eye(len(share))

    def slope(at: Array) -> Array:
        found = problem.differentiate(in_box(problem, at), Question(SHARPNESS, first.watched, -np.inf))
        return np.asarray((found.slope - multipliers @ found.margin_slopes) * half)

    columns = [(slope(share + STEP * z) - slope(share - STEP * z)) / (2 * STEP) for z in free.T]
    if not columns:
        return Curvature(float("nan"), 0, 0, 0)
    reduced = free.T @ np.array(columns).T
    return curvature_of((reduced + reduced.T) / 2)


def curvature_of(hessian: Array) -> Curvature:
    """The figures of a symmetric matrix (n, n)."""
    values = np.linalg.eigvalsh(hessian)
    sizes = np.abs(values)
    curved = sizes[sizes > FLAT * sizes.max()]
    condition = float(curved.max() / curved.min()) if len(curved) else float("nan")
    return Curvature(condition, len(values), len(values) - len(curved), int((values < -FLAT * sizes.max()).sum()))
