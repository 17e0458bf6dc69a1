"""Structure that the library leaves: findings without a name, and names that it contradicts."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.data import rows_in
from armlab.diagnosis.evidence import Evidence
from armlab.diagnosis.fitted_model import FittedModel, initial_link_widths
from armlab.diagnosis.noise import Noise
from armlab.diagnosis.result import Claim, Weighed
from armlab.diagnosis.solver import State
from armlab.diagnosis.surrogate import Structure, feature_banks, find_structure
from armlab.diagnosis.tuning import Tuning, UnknownTuning
from armlab.effects.contract import UNKNOWN

HELD_OUT_WAYS = 2  # that held-out data are taken: validation runs, and identification stretches in turn


def predict_residual_structure(model: FittedModel, noise: Noise) -> tuple[Structure, ...]:
    """What surrogates predict of each joint's residual.

    Friction and offsets are fitted that may not be claimed, and links as far off as those of a simulation are: what
    they explain is not unknown.
    """
    usual = {number for number, unusual in enumerate(model.solver.unusual) if not unusual}
    widths = model.state.widths
    if widths is not None:
        widths = tuple(max(pair) for pair in zip(widths, initial_link_widths(model.design) or widths, strict=True))
    state = State(tuple(sorted({*model.state.groups, *usual})), widths)
    residual = model.residual(model.solver.fit(state))
    return tuple(_surest_structure(model, residual[:, joint], joint, noise) for joint in range(residual.shape[1]))


def _surest_structure(model: FittedModel, residual: Array, joint: int, noise: Noise) -> Structure:
    """What the surest surrogate predicts of a joint's residual (rows,), its p-value that of the best of all."""
    observed, tuning = model.design.observed, model.design.settings.tuning.surrogate
    few = feature_banks(observed, joint, observed.torque[:, joint] - residual, tuning)
    features = (model.design.features[joint], *few)
    tried = [find_structure(residual, joint, each, noise, observed, tuning) for each in features]
    best = min(tried, key=lambda each: (each.gain <= tuning.min_structure_gain, each.p_value))
    return replace(best, p_value=min(1.0, best.p_value * HELD_OUT_WAYS * len(tried)))


def flexible_gain(model: FittedModel, state: State, joint: int) -> float:
    """What the best surrogate explains of what a state leaves at a joint (from 0): see `Structure.gain`."""
    observed, tuning = model.design.observed, model.design.settings.tuning.surrogate
    residual = model.residual_at(joint, model.solver.fit(state))
    few = feature_banks(observed, joint, observed.torque[:, joint] - residual, tuning)
    features = (model.design.features[joint], *few)
    return max(find_structure(residual, joint, each, model.noise, observed, tuning).gain for each in features)


def is_structured(each: Structure, tuning: Tuning) -> bool:
    """Whether it is more than chance, and large enough to matter."""
    return each.gain > tuning.surrogate.min_structure_gain and each.p_value < tuning.unknown.level


def unknown_evidence(model: FittedModel, each: Structure, before: Array, after: Array) -> Evidence:
    """The evidence of structure. before, after: (rows,), N m, what is left at its joint without and with it."""
    observed = model.design.observed
    rows = rows_in(observed.of_role("validate", each.joint), observed.rows)
    return Evidence(
        each.joint,
        each.p_value,
        min(1.0, each.p_value * observed.joints),
        each.gain,
        each.p_value,
        each.validation_gain,
        float(np.sqrt(np.mean(before[rows] ** 2))),
        float(np.sqrt(np.mean(after[rows] ** 2))),
        -0.5 * len(before) * float(np.log(max(1 - each.gain, 1e-6))),
    )


def make_unknown_claim(model: FittedModel, each: Structure, residual: Array, weighed: Weighed) -> Claim:
    """The finding `unknown` at a joint, with its surrogate's prediction. weighed: names that it could have."""
    own = residual[:, each.joint]
    evidence = unknown_evidence(model, each, own, own - each.prediction)
    prediction = np.zeros(residual.shape)
    prediction[:, each.joint] = each.prediction
    return unknown_claim(each.joint + 1, evidence, prediction, each.depends_on, weighed)


def unknown_claim(
    joint: int, evidence: Evidence, prediction: Array, depends_on: tuple[str, ...], weighed: Weighed
) -> Claim:
    """The finding `unknown` at a joint (from 1). prediction: (rows, joints), N m; weighed: names that it could have."""
    return Claim(
        UNKNOWN.id,
        joint,
        (joint,),
        (),
        f"tau_{joint} += f({', '.join(depends_on) or 'the motion'})",
        evidence,
        prediction,
        left_out=prediction,
        next_experiment=UNKNOWN.experiment,
        depends_on=depends_on,
        weighed=weighed,
    )


def names_contradicted_by_residual(
    claimed: Mapping[int, Evidence], left: Sequence[Structure], tuning: Tuning
) -> frozenset[int]:
    """The groups or links whose names do not hold; friction and offsets, which every arm has, keep theirs."""
    over = {each.joint: predicted_share(each) for each in left if is_structured(each, tuning)}
    return frozenset(
        number
        for number, each in claimed.items()
        if not each.usual and over.get(each.joint, 0.0) > tuning.unknown.max_residual_ratio * each.gain
    )


def is_form_error(each: Structure, effects: Mapping[int, Evidence], tuning: UnknownTuning) -> bool:
    """Whether structure is what the form of a law that is named at this joint leaves."""
    explained = [own.gain for own in effects.values() if own.joint == each.joint and not own.usual]
    return predicted_share(each) <= tuning.form_error_share * max(explained, default=0.0)


def predicted_share(each: Structure) -> float:
    """Of what the surrogate predicts, as a share of the error that the model leaves."""
    return each.gain / (1 + each.gain)
