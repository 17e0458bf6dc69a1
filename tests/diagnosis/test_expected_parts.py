"""Friction of a joint that a search missed: claimed where predictions need it, and only there."""

from dataclasses import replace

import engine_cases as cases
import numpy as np
import pytest

from armlab.common.arrays import Array
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.belief import Belief
from armlab.diagnosis.torque.columns.design import DesignMatrix
from armlab.diagnosis.torque.columns.solver import State
from armlab.diagnosis.torque.diagnose import prepare
from armlab.diagnosis.torque.evidence.evidence import Judge
from armlab.diagnosis.torque.evidence.plausibility import unclaim_implausible
from armlab.diagnosis.torque.names import expected_parts
from armlab.diagnosis.torque.names.expected_parts import claim_expected_parts
from armlab.diagnosis.torque.predict.prediction import fit_prediction
from armlab.diagnosis.torque.search.fitted_model import FittedModel, fit_background
from armlab.diagnosis.torque.search.search import FailedTest
from armlab.diagnosis.torque.stages import find_names
from armlab.effects.library import effect_named, library
from problem.motion import Motion


def friction_of_joint_2(motion: Motion, time: Array) -> Array:
    """Coulomb and viscous friction of one joint; of another what noise hides."""
    out = np.zeros(motion.position.shape)
    out[:, 1] = 3.0 * motion.velocity[:, 1] + 2.0 * np.sign(motion.velocity[:, 1])
    out[:, 2] = 0.001 * motion.velocity[:, 2]
    return out


@pytest.fixture(scope="module")
def nothing_named() -> FittedModel:
    """Links as simulated, and no effect."""
    recording = cases.recording(friction_of_joint_2)
    design = prepare(recording, None, Settings(), lambda message: None)
    model = fit_background(design, library(), 0, lambda message: None)
    return replace(model, state=State((), model.state.widths))


def group_at_joint_2(model: FittedModel, effect: str) -> int:
    groups = [each.candidate for each in model.solver.groups]
    return next(number for number, each in enumerate(groups) if (each.effect, each.joint) == (effect, 2))


def test_friction_that_predictions_need_is_claimed_by_its_likeliest_law_and_no_other(
    nothing_named: FittedModel,
) -> None:
    belief = claim_expected_parts(Belief(nothing_named, prediction=fit_prediction(nothing_named)))
    model, effects = belief.model, belief.effects
    named = [model.candidate(group) for group in effects]
    assert [(each.effect, each.joint) for each in named] == [("viscous_friction", 2)]
    assert set(effects) <= set(model.state.groups)
    assert "which predicts" in model.steps[-1].what


def test_a_joint_whose_friction_is_named_gets_no_second_law(nothing_named: FittedModel) -> None:
    own = group_at_joint_2(nothing_named, "coulomb_friction")
    named = replace(nothing_named, state=nothing_named.state.plus(own))
    evidence = Judge(named, named.state).effects()
    belief = Belief(named, effects=evidence, prediction=fit_prediction(named))
    assert claim_expected_parts(belief) is belief


def test_friction_whose_law_has_numbers_that_nobody_believes_is_claimed_as_friction_of_no_formula(
    nothing_named: FittedModel,
) -> None:
    law = group_at_joint_2(nothing_named, "nonlinear_viscous_friction")
    named = replace(nothing_named, state=nothing_named.state.plus(law))
    evidence = Judge(named, named.state).effects()[law]
    doubted = {law: FailedTest("numbers that can be believed", "no arm has them")}
    belief = Belief(named, present={law: evidence}, prediction=fit_prediction(named))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(expected_parts, "doubtful_names", lambda model, effects: doubted)
        claimed = claim_expected_parts(belief)
    assert set(claimed.effects) == {law}
    assert claimed.present == {}
    assert [each.effect for each in claimed.weighed[law]] == ["unknown"]


def test_friction_that_predictions_need_is_friction_of_its_joint_by_whatever_law(nothing_named: FittedModel) -> None:
    belief = claim_expected_parts(Belief(nothing_named, prediction=fit_prediction(nothing_named)))
    ((_, names),) = belief.weighed.items()
    laws = [each for each in names if each.effect != "unknown"]
    assert {each.joint for each in laws} == {2}
    assert {effect_named(each.effect).cause for each in laws} == {"friction"}


def test_friction_stays_in_the_model_though_no_claim_holds_it() -> None:
    design = prepare(cases.recording(friction_of_joint_2), None, Settings(), lambda message: None)
    assert isinstance(design, DesignMatrix)
    belief = find_names(design, 0, lambda message: None)
    solver = belief.model.solver
    laws = {(solver.candidate(each).effect, solver.candidate(each).joint) for each in solver.expected}
    assert laws == {(law, joint) for law in ("coulomb_friction", "viscous_friction") for joint in (1, 2, 3)}
    assert {solver.candidate(each).joint for each in belief.effects} == {2}
    assert belief.present
    assert set(belief.present) <= solver.expected & set(belief.model.state.groups)
    log = [each.what for each in unclaim_implausible(belief).model.steps]
    for law in map(solver.candidate, belief.present):
        assert any(each.startswith(f"present, not claimed: {law.effect} {law.joint}") for each in log)


def test_usual_friction_leaves_where_another_law_of_friction_stands(nothing_named: FittedModel) -> None:
    solver = nothing_named.solver
    usual = group_at_joint_2(nothing_named, "coulomb_friction")
    special = group_at_joint_2(nothing_named, "load_dependent_friction")
    elsewhere = group_at_joint_2(nothing_named, "torque_gain_error")
    state = State((), nothing_named.state.widths).plus(usual)
    assert solver.is_held(state, usual)
    assert solver.is_held(state.plus(elsewhere), usual)
    assert not solver.is_held(state.plus(special), usual)
    assert not solver.is_held(state.plus(elsewhere), elsewhere)
