"""Covariance of a fit that holds where errors are uneven or still tied together: by the scatter between blocks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as fisher

from diagnosis.engine.columns import Columns
from diagnosis.engine.noise import Noise
from diagnosis.engine.observed import Observed
from diagnosis.engine.solver import Fit
from recordings.run import ROLES, Array

UNTOLD = 1e5  # times the least variance: directions that other columns hold as well are not tested
TINY = 1e-14  # of the largest variance: rounding
LEAST_BLOCKS = 60  # of the identification rows
BLOCK_S = 0.5  # s: longer than what whitening leaves of any tie between errors


@dataclass(frozen=True, eq=False)
class Rows:
    """Whitened identification rows of a fit, per joint: the design (rows, parameters) and the errors (rows,)."""

    designs: tuple[Array, ...]
    errors: tuple[Array, ...]
    blocks: tuple[NDArray[np.intp], ...]


@dataclass(frozen=True, eq=False)
class Scatter:
    """covariance: (parameters, parameters), the larger of the model's and that of blocks; degrees: of freedom."""

    covariance: Array
    degrees: float

    def p_value(self, values: Array, place: Sequence[int]) -> float:
        """Chance of values at these places at least as large, were they zero (Wald's test, F distribution)."""
        variances, vectors = np.linalg.eigh(self.covariance[np.ix_(place, place)])
        told = (variances > 0) & (variances < UNTOLD * max(variances[0], TINY * variances[-1]))
        wald = float(np.sum((vectors[:, told].T @ values) ** 2 / variances[told]))
        rank = max(int(np.sum(told)), 1)
        return float(fisher.sf(wald / rank, rank, max(self.degrees - rank, 1)))


def whitened_rows(
    columns: Columns, extra: dict[int, Array], fit: Fit, lengths: Array, noise: Noise, observed: Observed
) -> Rows:
    """Design and errors of a fit: links, effects in their order, then the extra columns (rows, count) by joint."""
    designs, errors, blocks = [], [], []
    base, stretches = len(fit.links), block_numbers(observed, BLOCK_S, LEAST_BLOCKS)
    for joint, (matrix, index) in enumerate(zip(columns.matrices, columns.index, strict=True)):
        scaled = matrix[:, :-1] / lengths[index[:-1]]
        loading = index[:-1] < base
        links = scaled[:, loading] @ fit.links[index[:-1][loading]]
        effects = np.zeros((len(matrix), len(fit.columns)))
        at = {int(column): place for place, column in enumerate(index[:-1])}
        for place, column in enumerate(fit.columns):
            if int(column) in at:
                effects[:, place] = scaled[:, at[int(column)]]
        left = matrix[:, -1] - scaled @ fit.coefficients[index[:-1]]
        design = np.column_stack([links, effects, *([extra[joint]] if joint in extra else [])])
        designs.append(noise.white(design, joint, observed, "identify"))
        errors.append(noise.white(left[:, None], joint, observed, "identify")[:, 0])
        blocks.append(noise.numbers(stretches, joint, observed, "identify"))
    return Rows(tuple(designs), tuple(errors), tuple(blocks))


def block_numbers(observed: Observed, length_s: float, least: int = 12) -> NDArray[np.intp]:
    """Number of the stretch of time of each row, (rows,); none reaches over the end of a segment.

    Stretches are shorter in a short recording, so that each role has some `least` of them.
    """
    numbers, start = np.empty(observed.rows, dtype=np.intp), 0
    rows = {role: sum(each.stop - each.start for each in observed.of_role(role)) for role in ROLES}
    for each in observed.segments:
        count = each.stop - each.start
        length = min(length_s, rows[each.role] / observed.rate_hz / least)
        blocks = max(int(count / observed.rate_hz / length), 1)
        numbers[each.start : each.stop] = start + np.arange(count) * blocks // count
        start += blocks
    return numbers


def scatter(rows: Rows, precision: Array, robust: bool) -> Scatter:
    """Covariance of the parameters. precision: (parameters, parameters) of their prior."""
    gram = sum(design.T @ design for design in rows.designs) + precision
    inverse = np.linalg.pinv(gram, rcond=1e-12, hermitian=True)
    count = len(np.unique(np.concatenate(rows.blocks)))
    degrees = float(max(count - 1, 1))
    variance = sum(float(error @ error) for error in rows.errors) / max(sum(map(len, rows.errors)) - len(gram), 1)
    model = np.asarray(inverse * max(variance, 1.0), dtype=np.float64)
    if not robust:
        return Scatter(model, degrees)
    sums = np.zeros((int(max(block.max() for block in rows.blocks)) + 1, len(gram)))
    for design, error, block in zip(rows.designs, rows.errors, rows.blocks, strict=True):
        np.add.at(sums, block, design * error[:, None])
    meat = sums.T @ sums * count / max(count - 1, 1) + precision
    spread = np.asarray(inverse @ meat @ inverse, dtype=np.float64)
    ratio = np.sqrt(np.maximum(np.diag(model), 0) / np.maximum(np.diag(spread), 1e-300))
    scale = np.maximum(ratio, 1.0)
    return Scatter(np.asarray(spread * np.outer(scale, scale)), degrees)
