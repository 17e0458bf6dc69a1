"""Nonlinear parameters of the chosen effects, by variable projection (Golub and Pereyra 1973).

The linear coefficients of the whole model are eliminated, so that only the shape of one effect is searched: a bounded
local search from the best of the shapes that the family offered.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from armlab.common.arrays import Array
from armlab.diagnosis.torque.columns.blocks import whitened_rows
from armlab.diagnosis.torque.columns.columns import Block
from armlab.diagnosis.torque.columns.design import DesignMatrix
from armlab.diagnosis.torque.columns.solver import Fit, Solver, State
from armlab.diagnosis.torque.rows.noise import Noise
from armlab.effects.contract import Candidate


@dataclass(frozen=True, eq=False)
class Profile:
    """What the rest of a model leaves to one effect: designs and errors of its joints, and the rest's covariance."""

    designs: dict[int, Array]
    errors: dict[int, Array]
    inverse: Array

    def gain(self, block: Block, whiten: Callable[[Array, int], Array]) -> float:
        """Half the chi-square that the block's columns explain beyond the rest of the model."""
        width = block.values.shape[2]
        own, cross, towards = np.zeros((width, width)), np.zeros((width, len(self.inverse))), np.zeros(width)
        for number, joint in enumerate(block.candidate.rows):
            white = whiten(block.values[:, number], joint)
            own += white.T @ white
            cross += white.T @ self.designs[joint]
            towards += white.T @ self.errors[joint]
        left = own - cross @ self.inverse @ cross.T
        lengths = np.sqrt(np.maximum(np.diag(own), 1e-300))
        left, towards = left / np.outer(lengths, lengths), towards / lengths
        return 0.5 * float(towards @ np.linalg.pinv(left, rcond=1e-6, hermitian=True) @ towards)


def refine_shapes(
    design: DesignMatrix, noise: Noise, solver: Solver, state: State, but: Collection[int] = ()
) -> dict[int, Block]:
    """Blocks with better shapes for the state's groups that have any, by their number. but: groups that stay."""
    out = {}
    for group in (each for each in state.groups if each not in but):
        candidate = solver.candidate(group)
        if candidate.shape:
            profile = profile_without(design, noise, solver, state.minus(group))
            found = _search_shape(design, noise, profile, design.blocks[group])
            if found is not None:
                out[group] = found
    return out


def profile_without(design: DesignMatrix, noise: Noise, solver: Solver, rest: State) -> Profile:
    """What a state leaves to an effect that is not in it."""
    fit, columns = solver.fit(rest), design.columns
    rows = whitened_rows(columns, {}, fit, solver.moments.lengths, noise, design.observed)
    joints = range(columns.joints)
    return Profile(
        dict(zip(joints, rows.designs, strict=True)), dict(zip(joints, rows.errors, strict=True)), fit.inverse
    )


def _search_shape(design: DesignMatrix, noise: Noise, profile: Profile, block: Block) -> Block | None:

    def whiten(matrix: Array, joint: int) -> Array:
        return noise.white(matrix, joint, design.observed, "identify")

    tuning = design.settings.tuning.refine
    to_shape, to_unit = _unit_cube_maps(block.candidate, tuning.logarithmic_ratio)
    best = (profile.gain(block, whiten), block)

    def loss(unit: Array) -> float:
        nonlocal best
        candidate = block.candidate.with_shape(to_shape(np.clip(unit, 0, 1)))
        tried = design.block(candidate, block.variant)
        if not np.isfinite(tried.values).all():
            return 0.0
        gain = profile.gain(tried, whiten)
        if gain > best[0] + 1e-9:
            best = (gain, tried)
        return -gain

    start = to_unit(block.candidate.shape)
    steps = np.diag(np.where(start > 0.5, -tuning.first_step, tuning.first_step))
    options = {
        "maxfev": tuning.evaluations_per_shape * len(start),
        "initial_simplex": np.vstack([start, *(start + step for step in steps)]),
    }
    minimize(loss, start, method="Nelder-Mead", options=options)
    return best[1] if best[1] is not block else None


def _unit_cube_maps(
    candidate: Candidate, logarithmic_ratio: float
) -> tuple[Callable[[Array], tuple[float, ...]], Callable[[tuple[float, ...]], Array]]:
    """Between the unit cube and shapes; by logarithm where the bounds are `logarithmic_ratio` apart."""
    low, high = np.array(candidate.bounds, dtype=float).T
    logarithmic = (low > 0) & (high > logarithmic_ratio * low)
    a = np.where(logarithmic, np.log(np.where(low > 0, low, 1)), low)
    b = np.where(logarithmic, np.log(np.where(high > 0, high, 1)), high)

    def to_shape(unit: Array) -> tuple[float, ...]:
        value = a + unit * (b - a)
        return tuple(np.where(logarithmic, np.exp(np.where(logarithmic, value, 0.0)), value).tolist())

    def to_unit(shape: tuple[float, ...]) -> Array:
        value = np.array(shape, dtype=float)
        value = np.where(logarithmic, np.log(np.maximum(value, 1e-300)), value)
        return np.asarray(np.clip((value - a) / (b - a), 0, 1))

    return to_shape, to_unit


def prior_precision(solver: Solver, fit: Fit, size: int) -> Array:
    """Prior precision of a fit's parameters, the links' first, then the effects', (size, size)."""
    links = fit.links.shape[1]
    diagonal = np.zeros(size)
    diagonal[:links] = solver.links(fit.state.widths).precision
    diagonal[links : links + len(fit.columns)] = solver.precisions[fit.columns]
    return np.diag(diagonal)
