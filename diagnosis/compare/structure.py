"""Both recordings fitted under one structure: base parameters and every effect that was found in either."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from armlab.diagnosis.columns import base_columns
from armlab.diagnosis.data import rows_in
from armlab.diagnosis.result import Diagnosis
from armlab.effects.contract import Candidate, Scene
from identification.extras import Extra, torque_with
from identification.scene import scene_of
from problem.arm import Arm
from problem.base_parameters import BaseParameters
from problem.regressor import rigid_body_torque
from recordings.differentiate import Signals
from recordings.run import Array

BLOCK_S = 1.0  # s: errors this far apart count as independent
VISIBLE = 0.05  # of a column's length outside the span of the base parameters: less is theirs


@dataclass(frozen=True, eq=False)
class Fit:
    """values: (columns,), base parameters (as deviations from the simulation's) first, then each effect's coefficients.

    covariance: robust against errors that are correlated within stretches. stretches: how many there were.
    places: columns of each effect.
    """

    values: Array
    covariance: Array
    places: tuple[slice, ...]
    stretches: int


def united(diagnoses: Sequence[Diagnosis]) -> tuple[Candidate, ...]:
    """Candidates of all findings, one a place; the stronger evidence decides on shapes, and laws contain others."""
    claims = [claim for each in diagnoses for claim in each.claims]
    chosen: list[Candidate] = []
    for claim in sorted(claims, key=lambda each: -each.evidence.score):
        candidate = claim.candidate
        if candidate is not None and not claim.in_links and not _known(candidate, chosen):
            chosen = [each for each in chosen if not _contains(candidate, each)] + [candidate]
    return tuple(chosen)


def _known(candidate: Candidate, chosen: Sequence[Candidate]) -> bool:
    same = [each for each in chosen if each.effect == candidate.effect and each.joints == candidate.joints]
    return bool(same) or any(_contains(each, candidate) for each in chosen)


def _contains(one: Candidate, other: Candidate) -> bool:
    return one.joints == other.joints and other.effect in one.replaces


def predicted(diagnosis: Diagnosis, scene: Scene) -> Array:
    """Torque of the model found, (samples, joints): links as fitted, the simulation's own terms, every named effect."""
    simulation = diagnosis.simulation
    inertial = diagnosis.inertial if diagnosis.inertial is not None else np.zeros(10 * len(scene.arm))
    nominal = simulation.inertial if simulation.inertial is not None else np.zeros(len(inertial))
    rigid = simulation.torque(scene) + rigid_body_torque(scene.arm, scene.motion, inertial - nominal)
    return torque_with(_extras(diagnosis), replace(scene, inertial=inertial, torque=rigid))


def _extras(diagnosis: Diagnosis) -> list[Extra]:
    return [
        Extra({"effect": claim.effect}, claim.candidate, claim.coefficients)
        for claim in diagnosis.claims
        if claim.candidate is not None and claim.coefficients is not None and not claim.in_links
    ]


def scenes_of(diagnosis: Diagnosis) -> list[Scene]:
    """The runs with the model found."""
    observed, arm = diagnosis.observed, diagnosis.simulation.arm
    assert observed is not None
    assert diagnosis.inertial is not None
    out = []
    for signals in observed.signals:
        bare = replace(scene_of(signals.run, signals.motion, arm), inertial=diagnosis.inertial)
        out.append(replace(bare, torque=predicted(diagnosis, bare)))
    return out


def separable(diagnosis: Diagnosis, candidates: Sequence[Candidate], base: BaseParameters) -> tuple[Candidate, ...]:
    """Those that the base parameters do not take in on these runs: what they do is in the base parameters."""
    rigid, own, _ = _rows(diagnosis, candidates, base)
    lengths = np.linalg.norm(rigid, axis=0)
    basis = np.linalg.qr(rigid / np.where(lengths > 0, lengths, 1.0))[0]
    kept = []
    for candidate, columns in zip(candidates, own, strict=True):
        left = columns - basis @ (basis.T @ columns)
        lengths = np.linalg.norm(columns, axis=0)
        if np.all(lengths > 0) and np.all(np.linalg.norm(left, axis=0) > VISIBLE * lengths):
            kept.append(candidate)
    return tuple(kept)


def fitted(diagnosis: Diagnosis, candidates: Sequence[Candidate], base: BaseParameters) -> Fit:
    """Least squares weighted by joint, with the covariance of White (1980) over stretches of time."""
    rigid, own, target = _rows(diagnosis, candidates, base)
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
    return Fit(values / scale, spread / np.outer(scale, scale), places, len(sums))


def _rows(
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
    rigid = [_base(diagnosis.simulation.arm, base, signals) for signals in observed.signals]
    scenes = scenes_of(diagnosis)
    own = []
    for candidate in candidates:
        parts = []
        for scene, signals in zip(scenes, observed.signals, strict=True):
            columns = signals.filter(candidate.columns(scene))
            full = np.zeros((len(columns), joints, columns.shape[2]))
            full[:, list(candidate.rows)] = columns
            parts.append(full)
        own.append(_flat(np.concatenate(parts), weights))
    return _flat(np.concatenate(rigid), weights), own, (target * weights).ravel()


def _flat(columns: Array, weights: Array) -> Array:
    return np.asarray((columns * weights[:, :, None]).reshape(-1, columns.shape[2]))


def _base(arm: Arm, base: BaseParameters, signals: Signals) -> Array:
    """Filtered columns of the base parameters, (kept, joints, base)."""
    out = np.zeros((len(signals.torque), len(arm), len(base)))
    for joint, columns in enumerate(base_columns(arm, base, signals)):
        out[:, joint, np.flatnonzero(base.columns >= 10 * joint)] = columns
    return out
