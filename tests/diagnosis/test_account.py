"""What is said of a diagnosis: names by their probability, causes by their share, nothing that nobody would miss."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import engine_cases as cases
import numpy as np
import pytest

from armlab.diagnosis.result import Claim, JointFriction, Member, Part, Removal
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.columns.design import DesignMatrix
from armlab.diagnosis.torque.columns.solver import State
from armlab.diagnosis.torque.conclude import _beside_friction
from armlab.diagnosis.torque.diagnose import prepare
from armlab.diagnosis.torque.names.findings import (
    Statement,
    causes_of,
    finding_shares,
    leading_causes,
    stated_findings,
    statement_of,
    told_causes,
    with_minor_ones,
    without_lesser_unknowns,
)
from armlab.diagnosis.torque.predict.joint_friction import _Sized
from armlab.diagnosis.torque.predict.parts import (
    _rows_and_units,
    add_in_order,
    cause_of,
    stack_in_units,
    weigh_claims,
)
from armlab.diagnosis.torque.rows.data import Segment
from armlab.diagnosis.torque.search.fitted_model import FittedModel, fit_background
from armlab.effects.contract import UNKNOWN, Effect
from armlab.effects.library import effect_named, library
from armlab.report.account.summary import format_speed, friction_in_words, list_while_short

MISSED = Removal(0, growth=0.5, rms=1.0, torque=10.0, joints=(0, 1))
HARDLY = Removal(0, growth=0.04, rms=1.0, torque=1.0)


def claim(effect: str, joint: int | None = 1, probability: float | None = 0.95, removal: Removal = MISSED) -> Claim:
    """A finding."""
    nothing: Any = None
    return Claim(effect, joint, (), (), "", nothing, nothing, probability=probability, removal=removal)


def part(cause: str, claims: tuple[int, ...], share: float, removal: Removal | None = MISSED, joint: int = 1) -> Part:
    """A part whose claims explain equal shares of it."""
    shares = tuple(share / len(claims) for _ in claims)
    return Part(cause, joint, (), (), claims, removal, share, shares)


def members(**probabilities: float) -> tuple[Member, ...]:
    return tuple(Member(effect, 1, (), chance) for effect, chance in probabilities.items())


@pytest.mark.parametrize(
    ("own", "names", "expected"),
    [
        (0.9, members(), Statement("name", ("coulomb_friction",), 0.9)),
        (
            0.6,
            members(unknown=0.05, coulomb_friction=0.6, asymmetric_friction=0.35),
            Statement("class", ("coulomb_friction", "asymmetric_friction"), 0.95),
        ),
        (
            0.3,
            members(unknown=0.4, coulomb_friction=0.3, stribeck_friction=0.3),
            Statement("cause", ("coulomb_friction",), 0.6),
        ),
        (0.3, members(unknown=0.6, coulomb_friction=0.3), Statement("nothing", ("coulomb_friction",), 0.3)),
        (None, members(), Statement("name", ("coulomb_friction",), 1.0)),
    ],
)
def test_a_name_needs_nine_tenths_a_cause_one_half_and_less_is_not_stated(
    own: float | None, names: tuple[Member, ...], expected: Statement
) -> None:
    found = statement_of(replace(claim("coulomb_friction", probability=own), members=names))
    assert (found.kind, found.effects) == (expected.kind, expected.effects)
    assert found.probability == pytest.approx(expected.probability)


def test_a_finding_without_which_the_error_falls_is_none_nor_one_in_doubt_that_held_out_runs_do_not_need() -> None:
    harmful = claim("torque_offset", removal=replace(MISSED, growth=-0.01))
    not_needed = replace(MISSED, growth=0.0)
    sure, doubtful = claim("torque_saturation", removal=not_needed), claim("payload", 1, 0.6, removal=not_needed)
    improbable = claim("backlash", probability=0.2)
    kept = stated_findings([harmful, sure, doubtful, improbable, claim("payload")], joints=6)
    assert [each.effect for each in kept] == ["torque_saturation", "payload"]


@pytest.mark.parametrize(("joints", "better", "minor"), [((0, 1), (), False), ((0,), (), True), ((0, 1), (2,), True)])
def test_an_effect_of_the_whole_robot_is_minor_unless_two_joints_miss_it_and_none_is_better_without(
    joints: tuple[int, ...], better: tuple[int, ...], minor: bool
) -> None:
    base = claim("flexible_base", None, removal=replace(MISSED, joints=joints, better=better))
    (stated,) = stated_findings([base], joints=7)
    assert stated.minor == minor


def test_minor_is_what_is_missed_by_little_together_with_all_of_its_cause() -> None:
    hidden = [claim("coulomb_friction", removal=HARDLY), claim("viscous_friction", removal=HARDLY)]
    both = with_minor_ones(hidden, [part("friction", (0, 1), 0.9)])
    assert [each.minor for each in both] == [False, False]
    both = with_minor_ones(hidden, [part("friction", (0, 1), 0.9, HARDLY)])
    assert [each.minor for each in both] == [True, True]


def test_a_change_below_one_percent_of_the_torque_is_minor_though_the_error_grows() -> None:
    assert Removal(0, growth=0.5, rms=0.01, torque=1.0).is_minor
    assert not Removal(0, growth=0.5, rms=0.03, torque=1.0).is_minor


def test_of_a_joint_the_two_findings_that_explain_most_are_told_whatever_their_cause() -> None:
    found = [claim(name) for name in ("coulomb_friction", "viscous_friction", "torque_ripple")]
    told = with_minor_ones(found, [part("friction", (0, 1), 0.6), part("torque_ripple", (2,), 0.01)])
    assert [each.effect for each in told if not each.minor] == ["coulomb_friction", "viscous_friction"]
    told = with_minor_ones(found, [part("friction", (0, 1), 0.4), part("torque_ripple", (2,), 0.5)])
    assert [each.effect for each in told if not each.minor] == ["coulomb_friction", "torque_ripple"]


def test_a_told_cause_has_the_share_and_the_joints_of_what_is_told_of_it() -> None:
    found = [claim("coulomb_friction"), replace(claim("coulomb_friction", 2), minor=True)]
    (cause,) = told_causes([part("friction", (0,), 0.6), part("friction", (1,), 0.3, joint=2)], found)
    assert (cause.share, cause.joints, cause.findings) == (0.6, (1,), (0,))


def test_at_most_four_causes_are_told() -> None:
    effects = ("coulomb_friction", "payload", "torque_offset", "backlash", "torque_ripple")
    found = [claim(effect, joint) for joint, effect in enumerate(effects, 1)]
    parts = [part(cause_of(effect_named(each)), (at,), 0.5 / (at + 1), joint=at + 1) for at, each in enumerate(effects)]
    assert [each.minor for each in with_minor_ones(found, parts)] == [False, False, False, False, True]


def test_causes_are_told_by_size_until_nearly_all_is_explained() -> None:
    parts = [part("friction", (0,), 0.7), part("links", (1,), 0.26), part("torque_offset", (2,), 0.03)]
    assert [each.cause for each in leading_causes(causes_of(parts))] == ["friction", "links"]


def test_what_has_no_name_is_a_finding_only_where_it_leads() -> None:
    found = [claim("coulomb_friction"), claim(UNKNOWN.id)]
    lesser = [part("friction", (0,), 0.97), part("unknown", (1,), 0.03)]
    leading = [part("friction", (0,), 0.6), part("unknown", (1,), 0.3)]
    assert [each.effect for each in without_lesser_unknowns(found, lesser)] == ["coulomb_friction"]
    assert len(without_lesser_unknowns(found, leading)) == 2
    tiny = part("unknown", (2,), 0.001, joint=2)
    more = [*found, claim(UNKNOWN.id, 2)]
    assert [each.joint for each in without_lesser_unknowns(more, [*leading, tiny])] == [1, 1]


@pytest.mark.parametrize(("before", "told"), [(1.2, "told"), (1.03, "minor"), (0.99, "none")])
def test_structure_that_no_model_holds_is_missed_by_what_its_own_test_says(before: float, told: str) -> None:
    structure = replace(claim(UNKNOWN.id), evidence=SimpleNamespace(rms_before=before, rms_after=1.0))
    stated = with_minor_ones(stated_findings(weigh_claims(model(), [structure]), joints=3), [])
    assert [("minor" if each.minor else "told") for each in stated] == ([] if told == "none" else [told])


@cache
def model() -> FittedModel:
    """Of an arm from which nothing is hidden, with links alone."""
    design = prepare(cases.recording(), None, Settings(), lambda message: None)
    assert isinstance(design, DesignMatrix)
    fitted = fit_background(design, library(), 0, lambda message: None)
    return FittedModel(fitted.design, fitted.noise, fitted.moments, fitted.solver, State((), (0.0,) * 3))


def test_all_causes_come_before_the_places_of_any() -> None:
    friction = "50 % of the error comes from friction"
    first = (friction, f"{friction} at joints 1, 2, 3, 4, 5 and 6")
    offset = ("20 % from torque offset", "20 % from torque offset at joints 1, 2 and 3")
    backlash = ("25 % from backlash", "25 % from backlash at joint 2")
    assert list_while_short([first, offset]) == f"{first[1]}, {offset[1]}"
    assert list_while_short([first, backlash, offset]) == f"{first[1]}, {backlash[1]}, {offset[0]}"
    more = [first, backlash, offset, ("3 % from cable stiffness of the robot",) * 2]
    assert list_while_short(more).startswith(f"{first[0]}, {backlash[1]}, {offset[0]}, 3 % from")


def test_shares_of_findings_sum_to_that_of_their_cause() -> None:
    parts = [part("friction", (0, 2), 0.6), part("friction", (1,), 0.2, joint=2), part("links", (2,), 0.1)]
    assert sum(finding_shares(parts, 3)) == pytest.approx(0.9)
    assert causes_of(parts)[0].share == pytest.approx(0.8)


def test_the_largest_cause_is_added_first_and_falls_sum_to_the_whole_fall() -> None:
    start = np.array([3.0, 1.0, 0.0])
    falls = add_in_order(start, {"small": np.array([0.0, 1.0, 0.0]), "large": np.array([3.0, 0.0, 0.0])})
    assert list(falls) == ["large", "small"]
    assert falls == pytest.approx({"large": 9.0, "small": 1.0})


def test_torques_that_explain_the_same_error_do_not_count_it_twice() -> None:
    start = np.array([2.0, 0.0])
    falls = add_in_order(start, {"one": np.array([1.5, 0.0]), "other": np.array([0.5, 0.0])})
    assert sum(falls.values()) == pytest.approx(4.0)


def test_each_joint_counts_in_units_of_its_own_torque() -> None:
    torque = np.array([[100.0, 1.0], [-100.0, -1.0]])
    rows = [np.array([True, True])] * 2
    stacked = stack_in_units(torque, rows, np.array([100.0, 1.0]))
    assert stacked @ stacked == pytest.approx(2.0)


def test_a_joint_without_torque_counts_in_units_of_the_largest() -> None:
    torque = np.array([[3.0, 0.0], [-3.0, 1e-12]])
    observed: Any = SimpleNamespace(joints=2, torque=torque, rows_held_out=lambda joint: np.array([True, True]))
    assert _rows_and_units(observed)[1].tolist() == [3.0, 3.0]


def test_friction_that_may_be_none_is_told_by_its_upper_bound() -> None:
    row = JointFriction(1, (0.1, 1.0), (-0.3, 2.1), ((-0.9, 0.3), (1.6, 2.6)))
    assert friction_in_words(row, "N m") == ("at most 0.300 N m", "2.10 N m")


@pytest.mark.parametrize(("claimed", "kept"), [((), (0, 2, 3)), ((1,), (0, 1, 2, 3))])
def test_no_unclaimed_law_of_velocity_stands_beside_friction(claimed: tuple[int, ...], kept: tuple[int, ...]) -> None:
    """Here a coupling; a spring and laws of friction stay."""
    effects = ("coulomb_friction", "joint_coupling", "cable_stiffness", "presliding_hysteresis")
    facts = [effect_named(each) for each in effects]
    candidates = [SimpleNamespace(facts=each, is_friction=each.cause == "friction") for each in facts]
    model: Any = SimpleNamespace(state=SimpleNamespace(groups=(0, 1, 2, 3)), candidate=candidates.__getitem__)
    assert _beside_friction(model, claimed) == kept


def test_friction_is_told_at_speeds_of_the_motion_though_the_joint_rests_for_most_of_the_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    velocity = np.concatenate([np.full(80, 1e-9), np.linspace(0.1, 1.0, 20)])[:, None]
    whole = (Segment(0, "identify", 0, 100),)
    observed = SimpleNamespace(rows=100, used=lambda joint: whole, kept=lambda name: velocity)
    model: Any = SimpleNamespace(design=SimpleNamespace(observed=observed, settings=Settings()))
    monkeypatch.setattr(_Sized, "_size", lambda sized, joint, groups, speed: (speed, 0.0))
    found = _Sized(model, model).friction(1, ())
    assert found.speeds == pytest.approx(tuple(np.quantile(velocity[80:], (0.1, 0.9))))


def test_slow_speeds_are_told_in_thousandths() -> None:
    assert format_speed(0.15, "N m") == "0.15 rad/s"
    assert format_speed(7e-5, "N") == "0.07 mm/s"


@pytest.mark.parametrize(
    ("effect", "cause"),
    [
        ("coulomb_friction", "friction"),
        ("load_dependent_friction", "friction"),
        ("torque_offset", "torque_offset"),
        ("payload", "links"),
        ("inertial_parameter_error", "links"),
        ("time_delay", "time_delay"),
        ("unknown", "unknown"),
    ],
)
def test_a_cause_is_what_a_person_fixes_or_models_at_once(effect: str, cause: str) -> None:
    assert cause_of(effect_named(effect)) == cause


def test_an_effect_of_a_plug_in_gets_its_cause_from_its_facts() -> None:
    assert cause_of(Effect("lip_seal", "friction of a seal", dissipates=True)) == "friction"
