"""Which effects a motion can separate: angles between their columns, after all free columns were projected out."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from armlab.common.arrays import Array
from armlab.effects.contract import Candidate, Scene
from armlab.recordings.filters import Butterworth
from problem.base_parameters import BaseParameters
from problem.regressor import observation_matrix

MIN_VISIBLE_SHARE = 1e-6  # of a column's length: what is left below this is rounding, not a direction


@dataclass(frozen=True, eq=False)
class Confusion:
    """How alike candidates are, in their order, on given motions.

    visible: (candidates,), share of a signal's length that is left outside what is free, for each candidate's most
    visible direction: 0 where base parameters or background friction swallow it all. closest: (candidates,
    candidates), cosine of the smallest angle between two candidates' spans. covered: [a, b] cosine of the largest
    angle from a direction of a to the span of b: 1 where b can do all that a can.
    """

    candidates: tuple[Candidate, ...]
    visible: Array
    closest: Array
    covered: Array

    def rivals(self, index: int, cosine: float) -> list[int]:
        """The other candidates that can do all that one can, to a cosine; the most alike first."""
        order = np.argsort(-self.covered[index], kind="stable").tolist()
        return [other for other in order if other != index and self.covered[index, other] >= cosine]


def compute_confusion(
    candidates: Sequence[Candidate],
    scenes: Sequence[Scene],
    filters: Sequence[Butterworth],
    nuisance: Array | None = None,
    noise: Array | None = None,
) -> Confusion:
    """Angles between candidates on scenes; filters: one a scene, that of the torque.

    nuisance: (rows, columns) of what is free anyway, rows as from `rows_of` (`base_rows` gives those of the rigid
    body); noise: (joints,), standard deviation of each joint's torque, N m: a joint that is measured well counts
    more; all joints alike if left out.
    """
    weights = 1 / np.asarray(noise) if noise is not None else np.ones(len(scenes[0].arm))
    free = _orthonormal(_weight_rows(nuisance, weights)) if nuisance is not None else None
    found = [_part_outside(_weight_rows(candidate_rows(each, scenes, filters), weights), free) for each in candidates]
    closest, covered = _pairwise_cosines([basis for _, basis in found])
    return Confusion(tuple(candidates), np.array([visible for visible, _ in found]), closest, covered)


def candidate_rows(candidate: Candidate, scenes: Sequence[Scene], filters: Sequence[Butterworth]) -> Array:
    """A candidate's filtered columns over all runs and joints: (kept rows * joints, coefficients)."""
    parts = []
    for scene, keep in zip(scenes, filters, strict=True):
        columns = keep(candidate.columns(scene))
        full = np.zeros((len(columns), len(scene.arm), columns.shape[2]))
        full[:, list(candidate.rows)] = columns
        parts.append(full.reshape(-1, columns.shape[2]))
    return np.concatenate(parts)


def base_rows(base: BaseParameters, scenes: Sequence[Scene], filters: Sequence[Butterworth]) -> Array:
    """Filtered columns of the base parameters, rows as from `rows_of`."""
    parts = []
    for scene, keep in zip(scenes, filters, strict=True):
        matrix = observation_matrix(scene.arm, scene.motion)[:, base.columns]
        kept = keep(matrix.reshape(len(scene.time), len(scene.arm), -1))
        parts.append(kept.reshape(-1, len(base)))
    return np.concatenate(parts)


def _weight_rows(rows: Array, weights: Array) -> Array:
    return np.asarray(rows * np.resize(weights, len(rows))[:, None])


def _part_outside(rows: Array, free: Array | None) -> tuple[float, Array]:
    """The most visible share of the columns' span outside what is free, and a basis of what is left."""
    own = _orthonormal(rows)
    if free is not None:
        own = own - free @ (free.T @ own)
    vectors, values, _ = np.linalg.svd(own, full_matrices=False)
    return float(values.max(initial=0.0)), np.asarray(vectors[:, values > MIN_VISIBLE_SHARE])


def _orthonormal(rows: Array) -> Array:
    """A basis of the columns' span, columns of rounding left out."""
    lengths = np.linalg.norm(rows, axis=0)
    kept = lengths > 1e-12 * lengths.max(initial=0.0)
    vectors, values, _ = np.linalg.svd(rows[:, kept] / lengths[kept], full_matrices=False)
    return np.asarray(vectors[:, values > 1e-10])


def _pairwise_cosines(bases: Sequence[Array]) -> tuple[Array, Array]:
    """Cosines of the smallest angle between each two spans, and of the largest from the first to the second."""
    ends = np.cumsum([0, *(basis.shape[1] for basis in bases)])
    every = np.hstack(bases)
    products = every.T @ every
    closest, covered = np.eye(len(bases)), np.eye(len(bases))
    for one, other in combinations(range(len(bases)), 2):
        part = products[ends[one] : ends[one + 1], ends[other] : ends[other + 1]]
        if not part.size:
            continue
        values = np.clip(np.linalg.svd(part, compute_uv=False), 0, 1)
        closest[one, other] = closest[other, one] = values[0]
        rows, columns = part.shape
        covered[one, other] = values[-1] if rows <= columns else 0.0
        covered[other, one] = values[-1] if columns <= rows else 0.0
    return closest, covered
