"""Structure that the library leaves: findings without a name, and evidence against names."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.result import Claim, Weighed
from armlab.diagnosis.torque.belief import Belief
from armlab.diagnosis.torque.columns.blocks import rows_of_fit
from armlab.diagnosis.torque.columns.solver import State
from armlab.diagnosis.torque.evidence.evidence import Evidence
from armlab.diagnosis.torque.rows.data import rows_in
from armlab.diagnosis.torque.rows.features import Features, Load, load_banks
from armlab.diagnosis.torque.rows.noise import Noise
from armlab.diagnosis.torque.search.fitted_model import (
    FittedModel,
    fit_coloured_noise,
    inertial_parameters,
    initial_link_widths,
    torque_of,
)
from armlab.diagnosis.torque.search.surrogate import Remainder, Structure, Surrogate, fit_surrogate, surest
from armlab.diagnosis.tuning import Tuning, UnknownTuning
from armlab.effects.contract import UNKNOWN
from armlab.recordings.recording import ROLES
from problem.regressor import rigid_body_torque

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
    beside = replace(model, state=state)
    load = _load(beside)
    return tuple(_surest_structure(beside, joint, load, noise) for joint in range(model.design.observed.joints))


def _load(model: FittedModel) -> Load:
    """The load of all joints by a model."""
    torque, inertial, design = torque_of(model), inertial_parameters(model), model.design
    bodies = [rigid_body_torque(each.arm, each.motion, inertial) for each in design.calm]
    return Load(np.concatenate([torque(each) for each in design.scenes]), np.concatenate(bodies))


def _surest_structure(model: FittedModel, joint: int, load: Load, noise: Noise) -> Structure:
    """What the surest surrogate predicts of what a model leaves at a joint, its p-value that of the best of all."""
    observed, tuning = model.design.observed, model.design.settings.tuning.surrogate
    features = _features_of(model, joint, load)
    found = surest(_surrogates(model, joint, features, noise), tuning).structure(observed, tuning)
    return replace(found, p_value=min(1.0, found.p_value * HELD_OUT_WAYS * len(features)))


def _features_of(model: FittedModel, joint: int, load: Load) -> tuple[Features, ...]:
    """What a residual may depend on at a joint: many features of everything, and few of one kind each."""
    design = model.design
    banks = load_banks(design.observed, joint, load, design.settings.tuning.surrogate)
    return design.features[joint].features, *design.banks[joint], *banks


def _surrogates(model: FittedModel, joint: int, features: Sequence[Features], noise: Noise) -> Iterator[Surrogate]:
    """The surrogate of each of some features of what a model leaves at a joint; one is in memory at a time."""
    observed, tuning = model.design.observed, model.design.settings.tuning.surrogate
    whole = FitOfAll.of(model, joint)
    for each in features:
        learnt = Remainder(whole.residual, each)
        yield fit_surrogate(learnt, whole.remainder(each), joint, noise, observed, tuning)


@dataclass(frozen=True, eq=False)
class FitOfAll:
    """A fit of a model's columns (rows, columns) to the identification rows, and to the validation rows of a joint.

    residual: (rows,), what the fit of the identification rows leaves there. white: the columns of each role, whitened.
    inverse: (columns, columns), the covariance of the parameters.
    """

    model: FittedModel
    joint: int
    rows: Array
    residual: Array
    white: tuple[Array, ...]
    inverse: Array

    @classmethod
    def of(cls, model: FittedModel, joint: int) -> "FitOfAll":
        """What all rows say of the parameters of a model. joint: from 0."""
        fit, observed = model.fit, model.design.observed
        rows, residual = rows_of_fit(model.columns, fit, model.moments.lengths, joint)
        white = tuple(model.noise.white(rows, joint, observed, role) for role in ROLES)
        held = white[ROLES.index("validate")]
        told = np.eye(len(fit.inverse)) + fit.inverse @ (held.T @ held)
        inverse = np.asarray(np.linalg.solve(told, fit.inverse), dtype=float)  # also of a singular covariance
        return cls(model, joint, rows, residual, white, inverse)

    def remainder(self, made: Features) -> Remainder:
        """What it leaves of the torque and of features: less the columns times shares of them.

        A fit takes from the torque what its columns share with a law that it lacks. What is left resembles the law
        less than the part of the law that no column has (Frisch and Waugh 1933).
        """
        observed, noise = self.model.design.observed, self.model.noise
        towards = np.zeros((len(self.inverse), made.values.shape[1]))
        for own, role in zip(self.white, ROLES, strict=True):
            towards += own.T @ noise.white(made.values, self.joint, observed, role)
        held = noise.white(self.residual[:, None], self.joint, observed, "validate")[:, 0]
        moved = self.inverse @ (self.white[ROLES.index("validate")].T @ held)
        features = Features(made.values - self.rows @ (self.inverse @ towards), made.variables)
        return Remainder(self.residual - self.rows @ moved, features)


def is_structured(each: Structure, tuning: Tuning) -> bool:
    """Whether it is more than chance, and large enough to matter."""
    return each.gain > tuning.surrogate.least_gain and each.p_value < tuning.unknown.level


def remaining(belief: Belief) -> tuple[Structure, ...]:
    """The structure that is left and is more than chance."""
    return tuple(each for each in belief.left if is_structured(each, belief.tuning))


def with_what_is_left(belief: Belief) -> Belief:
    """The belief with the structure that surrogates find in what its model leaves; none without the guard `unknown`."""
    if not belief.model.design.settings.guards.unknown:
        return belief
    return replace(belief, left=predict_residual_structure(belief.model, fit_coloured_noise(belief.model)))


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
        0.5 * len(before) * float(np.log1p(max(each.gain, 0.0))),
    )


def make_unknown_claim(model: FittedModel, each: Structure, residual: Array, weighed: Weighed) -> Claim:
    """The finding `unknown` at a joint, with its surrogate's prediction. weighed: names that it could have."""
    own, joint = residual[:, each.joint], each.joint + 1
    prediction = np.zeros(residual.shape)
    prediction[:, each.joint] = each.prediction
    return Claim(
        UNKNOWN.id,
        joint,
        (joint,),
        (),
        f"tau_{joint} += f({', '.join(each.depends_on) or 'the motion'})",
        unknown_evidence(model, each, own, own - each.prediction),
        prediction,
        left_out=prediction,
        next_experiment=UNKNOWN.experiment,
        depends_on=each.depends_on,
        weighed=weighed,
    )


def is_form_error(each: Structure, effects: Mapping[int, Evidence], tuning: UnknownTuning) -> bool:
    """Whether structure is what the form of a law that is named at this joint leaves."""
    explained = [own.gain for own in effects.values() if own.joint == each.joint and not own.usual]
    return predicted_share(each) <= tuning.form_error_share * max(explained, default=0.0)


def predicted_share(each: Structure) -> float:
    """Of what the surrogate predicts, as a share of the error that the model leaves."""
    return each.gain / (1 + each.gain)
