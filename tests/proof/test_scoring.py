"""Scores of verdicts that were written by hand."""

import re
from typing import Any

import pandas as pd
import pytest
from made_answers import COULOMB, NULL, OUTSIDE, effect, judged, scored, truth
from made_verdicts import finding, perfect, verdict

from armlab.common.statistics import wilson_interval
from armlab.proof.blind.formats import Truth
from armlab.proof.blind.score.cases import categorize_finding
from armlab.proof.blind.score.measures import (
    MEASURE_TEXTS,
    Measure,
    compute_measures,
    confusion_table,
    detection_table,
    effect_table,
    engine_table,
)
from armlab.proof.blind.score.rows import ScoreRows, make_rows
from armlab.proof.blind.score.stated import StatedClaim, stated_measures


def measured(table: ScoreRows, id: str) -> Measure:
    return next(each for each in compute_measures(table, "clean") if each.id == id)


def test_each_measure_has_one_id_and_a_title() -> None:
    measures = compute_measures(scored((NULL, verdict())), "clean")
    assert [each.id for each in measures] == list(MEASURE_TEXTS)
    assert all(re.fullmatch("[a-z_]+", each.id) for each in measures)
    assert len({each.title for each in measures}) == len(measures)


def test_perfect_verdicts_score_perfectly() -> None:
    table = scored(*((each, perfect(each)) for each in (NULL, COULOMB, OUTSIDE)))
    assert measured(table, "right_name_or_class").value == 1
    assert measured(table, "right_joint").value == 1
    assert measured(table, "false_claims_on_nulls").value == 0
    assert measured(table, "wrong_names").value == 0
    assert measured(table, "unknown_outside").value == 1
    assert measured(table, "interval_coverage").value == 1


def test_silence_makes_no_false_claim_and_names_nothing() -> None:
    table = scored(*((each, verdict()) for each in (NULL, COULOMB, OUTSIDE)))
    assert measured(table, "right_name_or_class").value == 0
    assert measured(table, "unknown_outside").value == 0
    assert measured(table, "false_claims_on_nulls").value == 0
    assert measured(table, "wrong_names").value is None


def test_wrong_names_are_counted_among_claims_and_on_nulls() -> None:
    wrong = verdict("mismatch", (finding("backlash", 3),))
    table = scored((NULL, wrong), (COULOMB, wrong))
    assert measured(table, "wrong_names").value == 1
    assert measured(table, "false_claims_on_nulls").value == 1
    assert confusion_table(table, "clean").loc["coulomb_friction", "backlash"] == 1
    assert confusion_table(table, "clean").loc["nothing", "backlash"] == 1


def test_the_right_name_at_the_wrong_joint_is_misplaced() -> None:
    table = scored((COULOMB, verdict("mismatch", (finding("coulomb_friction", 3),))))
    assert measured(table, "right_name_all_sizes").value == 1
    assert measured(table, "right_joint").value == 0
    assert table.claims["category"].tolist() == ["misplaced"]


THREE = ("backlash", "coulomb_friction", "cable_stiffness")


@pytest.mark.parametrize(("rivals", "right"), [(THREE, True), ((*THREE, "payload"), False)])
def test_a_class_counts_with_at_most_three_rivals(rivals: tuple[str, ...], right: bool) -> None:
    table = scored((COULOMB, verdict("mismatch", (finding("stribeck_friction", 2, rivals=rivals),))))
    assert measured(table, "right_name_or_class").value == right
    assert measured(table, "right_name").value == 0


def test_findings_of_the_background_are_right_answers() -> None:
    friction = effect("viscous_friction", 3)
    answer = truth(kind="null", background=(friction,), cad=3)
    said = verdict("mismatch", (finding("viscous_friction", 3), finding("inertial_parameter_error", 2)))
    assert measured(scored((answer, said)), "false_claims_on_nulls").value == 0
    elsewhere = verdict("mismatch", (finding("viscous_friction", 1),))
    assert measured(scored((answer, elsewhere)), "false_claims_on_nulls").value == 1


IDENTICAL = [
    (truth(effect("asymmetric_friction", 2)), finding("torque_offset", 2)),
    (truth(effect("rotor_inertia", 2)), finding("inertial_parameter_error", 3)),
    (truth(effect("cable_stiffness", 2)), finding("gravity_compensator", 2)),
    (truth(effect("payload", 3)), finding("inertial_parameter_error", 3)),
    (truth(effect("time_delay", None)), finding("viscous_friction", 1)),
    (truth(kind="null", cad=3), finding("rotor_inertia", 1)),
    (truth(effect("coulomb_friction", 1), effect("torque_offset", 1)), finding("asymmetric_friction", 1)),
    (truth(effect("stribeck_friction", 1)), finding("coulomb_friction", 1)),
]
NOT_IDENTICAL = [
    (truth(effect("asymmetric_friction", 2)), finding("torque_offset", 1)),
    (truth(kind="null", cad=3), finding("rotor_inertia", 3)),
    (truth(kind="null", cad=3), finding("torque_gain_error", 3)),
    (truth(kind="null"), finding("rotor_inertia", 1)),
    (truth(effect("coulomb_friction", 1)), finding("asymmetric_friction", 1)),
    (truth(effect("encoder_offset", 2)), finding("inertial_parameter_error", 2)),
    (truth(effect("coulomb_friction", 1)), finding("stribeck_friction", 1)),
]


@pytest.mark.parametrize(("answer", "said"), IDENTICAL)
def test_what_no_motion_separates_is_no_wrong_name(answer: Truth, said: dict[str, Any]) -> None:
    assert categorize_finding(judged(answer, verdict("mismatch", (said,))), said) == "identical"


@pytest.mark.parametrize(("answer", "said"), NOT_IDENTICAL)
def test_what_motion_can_separate_is_a_wrong_name(answer: Truth, said: dict[str, Any]) -> None:
    assert categorize_finding(judged(answer, verdict("mismatch", (said,))), said) == "wrong"


@pytest.mark.parametrize(("engine", "category"), [("sticking", "background"), ("mujoco", "wrong")])
def test_friction_turns_early_where_joints_stick(engine: str, category: str) -> None:
    answer, said = truth(effect("coulomb_friction", 1)), finding("early_friction", 1)
    answer = answer.model_copy(update={"engine": engine})
    assert categorize_finding(judged(answer, verdict("mismatch", (said,))), said) == category


def test_unknown_is_right_for_an_effect_outside_and_false_where_nothing_is() -> None:
    said = verdict("mismatch", (finding("unknown", 1),))
    assert categorize_finding(judged(OUTSIDE, said), said["findings"][0]) == "injected"
    assert categorize_finding(judged(NULL, said), said["findings"][0]) == "unknown"
    assert measured(scored((NULL, said)), "false_claims_on_nulls").value == 1


@pytest.mark.parametrize(("unknown", "counts"), [(0.6, 1), (0.4, 0)])
def test_unknown_counts_where_it_has_half_of_the_probability(unknown: float, counts: int) -> None:
    members = [
        {"effect": "coulomb_friction", "joint": 1, "probability": 1 - unknown},
        {"effect": "unknown", "joint": 1, "probability": unknown},
    ]
    said = finding("coulomb_friction", 1) | {"probability": 1 - unknown, "class": members}
    assert measured(scored((OUTSIDE, verdict("mismatch", (said,)))), "unknown_outside").value == counts


def test_engines_are_compared_without_effects_that_one_of_them_lacks() -> None:
    def told(engine: str, said: dict[str, Any], name: str = "coulomb_friction") -> tuple[Truth, dict[str, Any]]:
        return truth(effect(name, 2)).model_copy(update={"engine": engine}), said

    right = verdict("mismatch", (finding("coulomb_friction", 2),))
    lost = told("mujoco", verdict(), "backlash")
    table = engine_table(scored(told("sticking", right), told("mujoco", right), told("mujoco", verdict()), lost))
    row = table[table["measure"].str.startswith("right name or class")].iloc[0]
    assert (row["second engine"], row["MuJoCo"]) == ("1 of 1", "1 of 2")
    assert not len(engine_table(scored(told("mujoco", right))))


def test_a_class_is_no_wrong_claim_where_one_of_its_names_is_there() -> None:
    said = finding("stribeck_friction", 2, rivals=("coulomb_friction",))
    table = scored((COULOMB, verdict("mismatch", (said,))))
    assert measured(table, "wrong_names_beyond_background").value == 0
    alone = scored((COULOMB, verdict("mismatch", (finding("stribeck_friction", 2),))))
    assert measured(alone, "wrong_names_beyond_background").value == 1


def test_probabilities_are_held_against_how_often_they_are_right() -> None:
    right = finding("coulomb_friction", 2) | {"probability": 0.8}
    wrong = finding("stribeck_friction", 2) | {"probability": 0.6}
    table = scored(*[(COULOMB, verdict("mismatch", (right,)))] * 4, (COULOMB, verdict("mismatch", (wrong,))))
    assert measured(table, "right_when_likely").value == 1
    assert measured(table, "right_when_doubtful").value == 0
    assert measured(table, "right_when_sure").number == 0
    base = 0.8 * 0.2
    brier = (4 * 0.2**2 + 0.6**2) / 5
    assert measured(table, "brier_skill").value == pytest.approx(1 - brier / base)


def test_intervals_that_miss_the_truth_are_counted() -> None:
    def said(low: float, high: float) -> dict[str, Any]:
        values = {"level": {"value": 2.2, "ci95": [low, high], "unit": "N.m"}}
        return verdict("mismatch", (finding("coulomb_friction", 2, values),))

    table = scored((COULOMB, said(1.9, 2.5)), (COULOMB, said(2.1, 2.3)))
    assert measured(table, "interval_coverage").value == 0.5
    assert table.parameters["relative_error"].tolist() == pytest.approx([0.1, 0.1])


def test_gap_closed_is_taken_from_the_verdict_where_nothing_was_predicted() -> None:
    fit = [{"joint": 2, "heldout_rms_before": 1.1, "heldout_rms_after": 0.3, "noise_floor": 0.1, "gap_closed": 0.8}]
    table = scored((COULOMB, verdict("mismatch", (), fit=fit)))
    assert table.cases["gap_closed"].tolist() == pytest.approx([0.8])
    assert table.cases["gap_source"].tolist() == ["reported"]


def test_detection_curve_sorts_by_size() -> None:
    small, large = truth(effect("coulomb_friction", 2, 0.7)), truth(effect("coulomb_friction", 2, 12.0))
    curve = detection_table(scored((small, verdict()), (large, perfect(large))), "clean")
    first = curve[curve["name"] == "named_first"].set_index("from")["value"]
    assert first[0.5] == 0
    assert first[10.0] == 1


def test_names_by_effect_count_hidden_found_and_wrongly_claimed() -> None:
    wrong = verdict("mismatch", (finding("backlash", 3),))
    table = effect_table(scored((COULOMB, perfect(COULOMB)), (COULOMB, wrong)), "clean").set_index("effect")
    assert table.loc["coulomb_friction", ["above", "first"]].tolist() == [2, 1]
    assert table.loc["backlash", "wrong_claims"] == 1


def test_wilson_intervals_are_those_of_the_textbook() -> None:
    assert wilson_interval(0, 100) == pytest.approx((0.0, 0.036995), abs=1e-5)  # Newcombe 1998, method 3
    assert wilson_interval(81, 263) == pytest.approx((0.2553, 0.3662), abs=1e-4)  # Newcombe 1998, table I


def test_rows_of_no_case_keep_their_columns() -> None:
    empty = make_rows([])
    assert isinstance(empty.effects, pd.DataFrame)
    assert "multiple" in empty.effects
    assert not len(empty.claims)


def test_levels_by_direction_are_named_by_a_level_and_an_offset_together() -> None:
    hidden = effect("asymmetric_friction", 2).model_copy(update={"equivalent": ("coulomb_friction", "torque_offset")})
    parts = (finding("coulomb_friction", 2), finding("torque_offset", 2))
    both = scored((truth(hidden), verdict("mismatch", parts)))
    one = scored((truth(hidden), verdict("mismatch", parts[:1])))
    assert measured(both, "right_name").value == 1
    assert measured(both, "right_joint").value == 1
    assert measured(one, "right_name").value == 0


def test_probabilities_of_a_set_without_tables_are_judged_as_those_of_torque() -> None:
    sure = [StatedClaim("payload", 0.95, right=number > 0, in_class=number > 0) for number in range(20)]
    doubtful = [StatedClaim("time_delay", 0.6, right=False, in_class=True), StatedClaim("unknown", 0.6, False, False)]
    found = {each.id: each for each in stated_measures([*sure, *doubtful])}
    assert found["wrong_names_beyond_background"].value == pytest.approx(1 / 22)
    assert found["right_when_sure"].value == pytest.approx(0.95)
    assert found["right_when_doubtful"].value == 0
    assert found["right_when_likely"].value is None
    assert found["brier_skill"].number == 22
