"""Two recordings fitted in one structure (base parameters and every effect found in either), and the parameters that
differ by more than chance.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.stats import t as student

from armlab.common.arrays import Array
from armlab.common.statistics import adjust_by_holm
from armlab.diagnosis.columns import base_columns
from armlab.diagnosis.data import rows_in
from armlab.diagnosis.found_model import model_found
from armlab.diagnosis.result import Diagnosis
from armlab.effects.contract import Candidate, Scene
from armlab.effects.parameters import half_widths, parameter_slopes
from armlab.effects.scene import scene_of
from armlab.recordings.differentiate import Signals
from problem.arm import PARAMETER_UNITS, Arm
from problem.base_parameters import BaseParameters, base_parameters

BLOCK_S = 1.0  # s: errors this far apart count as independent
MIN_VISIBLE_SHARE = 0.05  # of a column's length outside the span of the base parameters: less is theirs


@dataclass(frozen=True, eq=False)
class StructureFit:
    """values: (columns,), base parameters (as deviations from the simulation's) first, then each effect's coefficients.

    covariance: robust against errors that are correlated within stretches. stretches: how many there were.
    places: columns of each effect.
    """

    values: Array
    covariance: Array
    places: tuple[slice, ...]
    stretches: int


def unite_candidates(diagnoses: Sequence[Diagnosis]) -> tuple[Candidate, ...]:
    """Candidates of all findings, each effect once at a place, without laws that another candidate contains.

    Where two findings name the same effect at a place, the one with the stronger evidence gives the shape.
    """
    claims = [claim for each in diagnoses for claim in each.claims]
    chosen: list[Candidate] = []
    for claim in sorted(claims, key=lambda each: -each.evidence.score):
        candidate = claim.candidate
        if candidate is not None and not claim.in_links and not _is_covered(candidate, chosen):
            chosen = [each for each in chosen if not _contains(candidate, each)] + [candidate]
    return tuple(chosen)


def _is_covered(candidate: Candidate, chosen: Sequence[Candidate]) -> bool:
    same = [each for each in chosen if each.effect == candidate.effect and each.joints == candidate.joints]
    return bool(same) or any(_contains(each, candidate) for each in chosen)


def _contains(one: Candidate, other: Candidate) -> bool:
    return one.joints == other.joints and other.effect in one.replaces


def scenes_of(diagnosis: Diagnosis) -> list[Scene]:
    """The runs as effects see them, each with the torque of the model found."""
    observed, arm = diagnosis.observed, diagnosis.simulation.arm
    assert observed is not None
    assert diagnosis.inertial is not None
    model, out = model_found(diagnosis), []
    for signals in observed.signals:
        bare = replace(scene_of(signals.run, signals.motion, arm), inertial=diagnosis.inertial)
        out.append(replace(bare, torque=model.torque_in(bare)))
    return out


def select_separable(
    diagnosis: Diagnosis, candidates: Sequence[Candidate], base: BaseParameters
) -> tuple[Candidate, ...]:
    """The candidates whose torque the base parameters cannot imitate on these runs."""
    rigid, own, _ = _weighted_rows(diagnosis, candidates, base)
    lengths = np.linalg.norm(rigid, axis=0)
    basis = np.linalg.qr(rigid / np.where(lengths > 0, lengths, 1.0))[0]
    kept = []
    for candidate, columns in zip(candidates, own, strict=True):
        left = columns - basis @ (basis.T @ columns)
        lengths = np.linalg.norm(columns, axis=0)
        if np.all(lengths > 0) and np.all(np.linalg.norm(left, axis=0) > MIN_VISIBLE_SHARE * lengths):
            kept.append(candidate)
    return tuple(kept)


def fit_structure(diagnosis: Diagnosis, candidates: Sequence[Candidate], base: BaseParameters) -> StructureFit:
    """Least squares weighted by joint, with the covariance of White (1980) over stretches of time."""
    rigid, own, target = _weighted_rows(diagnosis, candidates, base)
    matrix = np.column_stack([rigid, *own])
    lengths = np.linalg.norm(matrix, axis=0)
    scale = np.where(lengths > 0, lengths, 1.0)
    scaled = matrix / scale
    inverse = np.linalg.pinv(scaled.T @ scaled, rcond=1e-12, hermitian=True)
    values = inverse @ (scaled.T @ target)
    scores = scaled * (target - scaled @ values)[:, None]
    observed = diagnosis.observed
    assert observed is not None
    joints, width = observed.joints, max(int(BLOCK_S * observed.rate_hz), 1)
    sums = [scores[at : at + width * joints].sum(axis=0) for at in range(0, len(scores), width * joints)]
    meat = np.array(sums).T @ np.array(sums) * (len(sums) / max(len(sums) - 1, 1))
    spread = inverse @ meat @ inverse
    ends = np.cumsum([rigid.shape[1], *(each.shape[1] for each in own)]).tolist()
    places = tuple(slice(start, end) for start, end in pairwise(ends))
    return StructureFit(values / scale, spread / np.outer(scale, scale), places, len(sums))


def _weighted_rows(
    diagnosis: Diagnosis, candidates: Sequence[Candidate], base: BaseParameters
) -> tuple[Array, list[Array], Array]:
    """Weighted columns of base parameters and of each candidate, and the target: (rows * joints, ...)."""
    observed, final, target = diagnosis.observed, diagnosis.final, diagnosis.nominal
    assert observed is not None
    assert final is not None
    assert target is not None
    joints = observed.joints
    moving = np.column_stack([rows_in(observed.used(joint), observed.rows) for joint in range(joints)])
    weights = moving / np.sqrt(np.mean(final**2, axis=0))
    rigid = [_filtered_base_columns(diagnosis.simulation.arm, base, signals) for signals in observed.signals]
    scenes = scenes_of(diagnosis)
    own = []
    for candidate in candidates:
        parts = []
        for scene, signals in zip(scenes, observed.signals, strict=True):
            columns = signals.filter(candidate.columns(scene))
            full = np.zeros((len(columns), joints, columns.shape[2]))
            full[:, list(candidate.rows)] = columns
            parts.append(full)
        own.append(_weight_and_flatten(np.concatenate(parts), weights))
    return _weight_and_flatten(np.concatenate(rigid), weights), own, (target * weights).ravel()


def _weight_and_flatten(columns: Array, weights: Array) -> Array:
    return np.asarray((columns * weights[:, :, None]).reshape(-1, columns.shape[2]))


def _filtered_base_columns(arm: Arm, base: BaseParameters, signals: Signals) -> Array:
    """Filtered columns of the base parameters, (kept, joints, base)."""
    out = np.zeros((len(signals.torque), len(arm), len(base)))
    for joint, columns in enumerate(base_columns(arm, base, signals)):
        out[:, joint, np.flatnonzero(base.columns >= 10 * joint)] = columns
    return out


SIGNIFICANCE_LEVEL = 0.01
BASE_PARAMETER = "base_parameter"  # in place of an effect: a parameter of the rigid body


@dataclass(frozen=True)
class Change:
    """One parameter in both recordings. effect: `base_parameter` for one of the rigid body, named by its sum.

    interval: 95 %, of the difference. p_value: of no difference, after Holm's correction over all parameters.
    """

    effect: str
    joint: int | None
    joints: tuple[int, ...]
    parameter: str
    old: float
    new: float
    interval: tuple[float, float]
    unit: str
    p_value: float

    @property
    def changed(self) -> bool:
        """Whether the difference is more than chance."""
        return self.p_value < SIGNIFICANCE_LEVEL


def changes_between(old: Diagnosis, new: Diagnosis) -> tuple[Change, ...]:
    """Every parameter of the common structure in both recordings, with its difference."""
    base = base_parameters(old.simulation.arm)
    candidates = unite_candidates((old, new))
    for each in (old, new):
        candidates = select_separable(each, candidates, base)
    fits = fit_structure(old, candidates, base), fit_structure(new, candidates, base)
    rows = [*_effect_changes(candidates, *fits), *_base_changes(old, base, *fits)]
    adjusted = adjust_by_holm(np.array([each.p_value for each in rows]))
    return tuple(replace(each, p_value=float(p)) for each, p in zip(rows, adjusted, strict=True))


def _degrees_of_freedom(old: StructureFit, new: StructureFit) -> int:
    return max(min(old.stretches, new.stretches) - 1, 1)


def _effect_changes(candidates: tuple[Candidate, ...], old: StructureFit, new: StructureFit) -> list[Change]:
    rows = []
    degrees = _degrees_of_freedom(old, new)
    for candidate, place in zip(candidates, old.places, strict=True):
        before, after = candidate.parameters(old.values[place]), candidate.parameters(new.values[place])
        errors_before, errors_after = _standard_errors(candidate, old, place), _standard_errors(candidate, new, place)
        where = candidate.effect, candidate.joint, candidate.joints
        for name, one in before.items():
            other = after[name]
            if isinstance(one, float) and isinstance(other, float):
                error = float(np.hypot(errors_before[name], errors_after[name]))
                rows.append(_build_change(*where, name, one, other, error, candidate.unit(name), degrees))
    return rows


def _standard_errors(candidate: Candidate, fit: StructureFit, place: slice) -> dict[str, float]:
    """Standard error of the first component of each parameter."""
    values = fit.values[place]
    slopes = parameter_slopes(candidate, values, len(values))
    return {name: float(half_widths(each, fit.covariance[place, place], 1.0)[0]) for name, each in slopes.items()}


def _base_changes(old: Diagnosis, base: BaseParameters, first: StructureFit, second: StructureFit) -> list[Change]:
    nominal = old.simulation.inertial
    start = np.zeros(len(base)) if nominal is None else base.values(nominal)
    degrees = _degrees_of_freedom(first, second)
    out = []
    for index, name in enumerate(base.sums):
        error = float(np.sqrt(first.covariance[index, index] + second.covariance[index, index]))
        before, after = float(start[index] + first.values[index]), float(start[index] + second.values[index])
        unit = PARAMETER_UNITS[base.columns[index] % 10]
        out.append(_build_change(BASE_PARAMETER, None, (), name, before, after, error, unit, degrees))
    return out


def _build_change(
    effect: str,
    joint: int | None,
    joints: tuple[int, ...],
    name: str,
    old: float,
    new: float,
    error: float,
    unit: str,
    degrees: int,
) -> Change:
    half = float(student.ppf(0.975, degrees)) * error
    p_value = float(2 * student.sf(abs(new - old) / max(error, 1e-300), degrees))
    return Change(effect, joint, joints, name, old, new, (new - old - half, new - old + half), unit, p_value)
