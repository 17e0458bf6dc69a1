"""Effects that passed take the likeliest names of their findings."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import engine_cases as cases
import numpy as np
import pytest

from armlab.common.arrays import Array
from armlab.diagnosis.choice import Weights
from armlab.diagnosis.settings import Settings, vary
from armlab.diagnosis.torque.belief import Belief
from armlab.diagnosis.torque.columns.design import DesignMatrix
from armlab.diagnosis.torque.columns.solver import State
from armlab.diagnosis.torque.diagnose import prepare
from armlab.diagnosis.torque.evidence.evidence import Judge
from armlab.diagnosis.torque.names.likeliest_names import (
    Found,
    _added,
    with_likeliest_names,
)
from armlab.diagnosis.torque.names.weighing import _is_of_no_arm, _NameTrial, _weighed, weigh_effect
from armlab.diagnosis.torque.search.fitted_model import FittedModel, fit_background
from armlab.diagnosis.torque.search.search import Search
from armlab.effects.library import library
from problem.motion import Motion


def spring(motion: Motion, time: Array) -> Array:
    torque = np.zeros(motion.position.shape)
    torque[:, 1] = 3.0 * motion.position[:, 1]
    return torque


def spring_from(rest: float) -> cases.Hidden:
    """A spring at joint 1, which feels no gravity, that pulls with 3 N m at zero."""

    def pull(motion: Motion, time: Array) -> Array:
        torque = np.zeros(motion.position.shape)
        torque[:, 0] = 3.0 * (1 - motion.position[:, 0] / rest)
        return torque

    return pull


@pytest.fixture(scope="module")
def model() -> FittedModel:
    """A model that holds nothing, beside a hidden spring at joint 2."""
    return model_beside(spring)


def model_beside(hidden: cases.Hidden) -> FittedModel:
    """A model that holds nothing, beside what is hidden."""
    design = prepare(cases.recording(hidden, seconds=6.0), None, Settings(), lambda message: None)
    assert isinstance(design, DesignMatrix)
    fitted = fit_background(design, library(), 0, lambda message: None)
    return FittedModel(fitted.design, fitted.noise, fitted.moments, fitted.solver, State((), (0.0,) * 3))


def found_as(model: FittedModel, effect: str) -> Found:
    """The first form of an effect at joint 2, added."""
    search = Search(model.solver, model.design.settings, True, 0)
    candidates = [each.candidate for each in model.solver.groups]
    named = (at for at, each in enumerate(candidates) if (each.effect, each.joint) == (effect, 2))
    found = next(each for each in (_added(model, search, at) for at in named) if each is not None)
    assert found[2].score > 0
    return found


def holding(model: FittedModel, effect: str) -> FittedModel:
    """The model with an effect at joint 2."""
    return replace(model, state=found_as(model, effect)[1])


@pytest.mark.parametrize("effect", ["gravity_compensator", "cable_stiffness"])
def test_what_passed_takes_its_likeliest_name(model: FittedModel, monkeypatch: pytest.MonkeyPatch, effect: str) -> None:
    monkeypatch.setattr(
        "armlab.diagnosis.torque.names.decide.calibrated_weights", lambda: Weights({"is cable_stiffness": 9.0})
    )
    held = holding(model, effect)
    belief = with_likeliest_names(Belief(held, Judge(held, held.state).effects()))
    named = belief.model
    (group,) = belief.effects
    assert named.state.groups == (group,)
    assert named.solver.groups[group].candidate.effect == "cable_stiffness"
    assert len(named.steps) == (effect != "cable_stiffness")


def test_what_passed_keeps_its_name_where_the_numbers_of_a_likelier_one_cannot_be_believed(
    model: FittedModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "armlab.diagnosis.torque.names.decide.calibrated_weights", lambda: Weights({"is cable_stiffness": 9.0})
    )
    monkeypatch.setattr(
        "armlab.diagnosis.torque.names.likeliest_names.doubtful_names",
        lambda model, effects, exact: dict.fromkeys(effects, "stiffness may be zero"),
    )
    held = holding(model, "gravity_compensator")
    known = Judge(held, held.state).effects()
    belief = Belief(held, known)
    assert with_likeliest_names(belief) is belief


def test_what_passed_keeps_its_name_where_none_is_likelier(model: FittedModel, monkeypatch: pytest.MonkeyPatch) -> None:
    held = holding(model, "gravity_compensator")
    known = Judge(held, held.state).effects()
    for weights in ({"is cable_stiffness": 8.5, "is gravity_compensator": 9.0}, {"found none": 9.0}):
        monkeypatch.setattr(
            "armlab.diagnosis.torque.names.decide.calibrated_weights",
            lambda weights=weights: Weights(weights),
        )
        belief = Belief(held, known)
        assert with_likeliest_names(belief) is belief


@pytest.mark.parametrize("effect", ["gravity_compensator", "cable_stiffness"])
def test_the_law_that_was_found_is_always_among_its_names(model: FittedModel, effect: str) -> None:
    settings = vary(model.design.settings, "naming.names", 1)
    held = holding(replace(model, design=replace(model.design, settings=settings)), effect)
    (group,) = held.state.groups
    names = weigh_effect(held, group, Judge(held, held.state).effects(), ())
    assert (effect, 2) in {(each.effect, each.joint) for each in names}


@pytest.mark.parametrize(("joint", "speaks"), [(2, "found beside friction"), (3, "found usual")])
def test_usual_friction_is_expected_only_where_the_simulation_has_none(
    model: FittedModel, joint: int, speaks: str
) -> None:
    """The simulation has friction of joint 2 alone."""
    friction = SimpleNamespace(is_friction=True, joints=(2,))
    known: Any = SimpleNamespace(structure=SimpleNamespace(components=(friction,)), effects=())
    simulation = replace(model.design.simulation, model=known)
    places = [(each.candidate.effect, each.candidate.joint) for each in model.solver.groups]
    group = places.index(("coulomb_friction", joint))
    held = replace(model, design=replace(model.design, simulation=simulation), state=model.state.plus(group))
    none = weigh_effect(held, group, Judge(held, held.state).effects(), ())[-1]
    assert [each for each in ("found usual", "found beside friction") if each in none.numbers] == [speaks]


def test_numbers_weigh_once_more_beside_a_simulation_that_was_fitted(model: FittedModel) -> None:
    held = holding(model, "cable_stiffness")
    (group,) = held.state.groups
    fitted = replace(held, design=replace(held.design, simulation=replace(held.design.simulation, is_fitted=True)))
    without, beside = (weigh_effect(each, group, Judge(each, each.state).effects(), ()) for each in (held, fitted))
    for one, other in zip(without, beside, strict=True):
        more = other.numbers.keys() - one.numbers.keys()
        assert more
        assert all(other.numbers[key] == one.numbers[key.replace("fitted", "found")] for key in more)


def test_a_law_that_predicts_held_out_rows_worse_than_none_is_no_name(model: FittedModel) -> None:
    """What was found keeps its place, and is judged by its own tests."""
    held, without = holding(model, "cable_stiffness"), model.state
    error = model.moments.heldout_error(model.fit.coefficients)
    trials = [
        _NameTrial("torque_ripple", 2, (2,), 1.0, error),
        _NameTrial("backlash", 2, (2,), 2.0, 1.01 * error),
        _NameTrial("cable_stiffness", 2, (2,), 1.5, 1.01 * error, own=True),
    ]
    names = _weighed("found", trials, {}, (2, (2,)), held, without)
    assert {each.effect for each in names} == {"torque_ripple", "cable_stiffness", "unknown"}


@pytest.mark.parametrize(("rest", "refused"), [(5.0, False), (30.0, True)])
def test_a_spring_with_its_rest_where_no_joint_turns_is_no_name(rest: float, refused: bool) -> None:
    model = model_beside(spring_from(rest))
    places = [(each.candidate.effect, each.candidate.joint) for each in model.solver.groups]
    spring = places.index(("cable_stiffness", 1))
    fit = model.solver.fit(State((spring,), model.state.widths))
    assert _is_of_no_arm(model.solver, fit, spring, model.candidate(spring)) == refused
