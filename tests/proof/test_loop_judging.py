"""The closed loop's judgement: small verdicts, and tables of small results."""

from pathlib import Path
from typing import Any

import pytest
from made_answers import effect, truth

from armlab.proof.blind.loop.case import TrueNames, find_suspects, judge_end, judge_start, true_names
from armlab.proof.blind.loop.counts import (
    LoopShare,
    MotionComparison,
    brier_scores,
    compare_motions,
    count_shares,
    make_table,
    mean_chances,
    reliability_bins,
)
from armlab.proof.blind.loop.loop_page import Seals, render_page, write_page
from armlab.proof.blind.loop.run import LoopSettings

LATE = ("time_delay", None)
VISCOUS = ("viscous_friction", 2)
TRUTH = TrueNames(LATE)


def verdict(*findings: tuple[tuple[str, int | None], list[tuple[str, int | None]]]) -> dict[str, Any]:
    """A verdict with findings and their rivals."""
    return {
        "findings": [
            {"effect": own[0], "joint": own[1], "rivals": [{"effect": e, "joint": j} for e, j in rivals]}
            for own, rivals in findings
        ]
    }


@pytest.mark.parametrize(
    ("given", "start"),
    [
        (verdict((VISCOUS, [LATE])), "ambiguous"),
        (verdict((LATE, [VISCOUS])), "ambiguous"),
        (verdict((LATE, [])), "one name"),
        (verdict((VISCOUS, [])), "another class"),
        (verdict(), "nothing"),
    ],
)
def test_a_first_verdict_is_ambiguous_only_with_the_hidden_effect_among_rivals(
    given: dict[str, Any], start: str
) -> None:
    assert judge_start(given, TRUTH) == start


def test_suspects_are_all_names_of_the_groups_with_the_hidden_effect() -> None:
    given = verdict((VISCOUS, [LATE]), (("torque_offset", 1), [("asymmetric_friction", 1)]))
    assert find_suspects(given, TRUTH) == {LATE, VISCOUS}


@pytest.mark.parametrize(
    ("given", "end"),
    [
        (verdict((LATE, [])), "right"),
        (verdict((LATE, [VISCOUS])), "open"),
        (verdict((VISCOUS, [LATE])), "open"),
        (verdict((VISCOUS, [])), "wrong"),
        (verdict((LATE, []), (VISCOUS, [])), "wrong"),
        (verdict(), "open"),
        (verdict((LATE, []), (("torque_offset", 1), [])), "right"),
    ],
)
def test_only_the_hidden_name_alone_is_right(given: dict[str, Any], end: str) -> None:
    assert judge_end(given, TRUTH, frozenset({LATE, VISCOUS})) == end


def test_a_suspect_that_is_there_as_well_may_be_named() -> None:
    given = verdict((LATE, []), (VISCOUS, []))
    assert judge_end(given, TrueNames(LATE, frozenset({VISCOUS})), frozenset({LATE, VISCOUS})) == "right"


def test_background_and_links_that_are_off_count_as_there() -> None:
    answer = truth(effect("time_delay", None), background=(effect("viscous_friction", 2),), cad=1)
    assert true_names(answer) == TrueNames(LATE, frozenset({VISCOUS, ("inertial_parameter_error", 1)}))


def result(number: int, start: str, designed: str, random: str, condition: str) -> dict[str, Any]:
    """One result as a case gives it."""
    ends = {"designed": designed, "random": random, "condition": condition}
    pair, suspected = ["time_delay", "viscous_friction"], [["time_delay", None], ["viscous_friction", 2]]
    return {
        "case": number,
        "name": f"case{number}",
        "tier": "clean",
        "pair": pair,
        "multiple": 2.0,
        "start": start,
        "suspected": suspected,
        "ends": ends,
        "passed": [{"pair": pair, "start": "nothing"}],
        "forecast": {"designed": [0.9, 0.0, 0.1], "random": [0.3, 0.2, 0.5]},
    }


FOUND = [
    result(0, "told", "right", "open", "wrong"),
    result(1, "mistaken", "right", "right", "open"),
    result(2, "told", "right", "ran away", "open"),
    {"case": 3, "name": "case3", "ends": {}, "passed": [{"pair": ["a", "b"], "start": "one name"}]},
]


def test_cases_that_ran_away_or_never_were_ambiguous_are_left_out_whole() -> None:
    assert set(make_table(FOUND)["case"]) == {"case0", "case1"}


def test_shares_count_by_kind_of_motion_and_by_beginning() -> None:
    assert count_shares(make_table(FOUND))["designed", "right"] == LoopShare(2, 2)
    assert count_shares(make_table(FOUND), "told")["random", "open"] == LoopShare(1, 1)


def test_a_share_is_told_with_wilsons_interval() -> None:
    assert str(LoopShare(5, 10)) == "50 % (24-76)"
    assert str(LoopShare(0, 0)) == "-"


def test_a_motion_is_compared_case_by_case() -> None:
    assert compare_motions(make_table(FOUND), "random") == MotionComparison(1, 0)
    assert compare_motions(make_table(FOUND), "condition") == MotionComparison(2, 0)
    assert MotionComparison(5, 0).p_value == pytest.approx(2 * 0.5**5)
    assert MotionComparison(0, 0).p_value == 1.0


def test_forecasts_are_held_against_what_came() -> None:
    table = make_table(FOUND)
    low, high = reliability_bins(table)
    assert (low.expected, low.observed) == (pytest.approx(0.3), LoopShare(1, 2))
    assert (high.expected, high.observed) == (pytest.approx(0.9), LoopShare(2, 2))
    assert mean_chances(table)["right"] == (pytest.approx(0.6), 0.75)
    assert brier_scores(table)[0] == pytest.approx((0.01 + 0.01 + 0.09 + 0.49) / 4)


def test_the_page_tells_shares_comparisons_forecasts_and_draws_that_were_passed_over(tmp_path: Path) -> None:
    seal = Seals("abc", "def")
    page = render_page(LoopSettings(4, 1001), FOUND, seal)
    assert "Seed 1001, 2 ambiguous cases of 4" in page
    assert "printed before the first diagnosis: abc" in page
    assert "| designed motion | 100 % (34-100) |" in page
    assert "| random motion | decided rightly | 1 | 0 | 1 |" in page
    assert "| time_delay | viscous_friction | 2 | 2, 0, 0 | 1, 0, 1 | 0, 1, 1 |" in page
    assert "| 0.8 to 1.0 | 2 | 90 % | 100 % (34-100) |" in page
    assert "- nothing: 3" in page
    names = [path.name for path in write_page(LoopSettings(4, 1001), FOUND, seal, tmp_path)]
    assert names == ["loop.md", "loop.csv", "loop.png"]
