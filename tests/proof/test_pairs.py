"""Pairs of recordings for the proof of a comparison: what changes between them, and how names are counted."""

from pathlib import Path

import numpy as np
import pytest

from armlab.common.errors import InputError
from armlab.common.settings import read_json
from armlab.proof.blind.effects.channels import EncoderOffset, TorqueGain
from armlab.proof.blind.field.field_plan import draw_field_plan
from armlab.proof.blind.pairs.field_pairs import write_field_pair
from armlab.proof.blind.pairs.pair_cases import known_differences
from armlab.proof.blind.pairs.pair_plan import CHANGE_KINDS, PAIRS, DriftingNoise, PairPlan, draw_change, draw_pair
from armlab.proof.blind.pairs.pair_score import (
    BROKEN_YARDSTICK,
    COVERED,
    FALSE,
    MISSED,
    RIGHT,
    PairOutcome,
    count_names,
    judge_intervals,
    measures_of,
    score_page,
)
from armlab.proof.tiers.changes import CHANGES, PairSet


def pair(index: int, changed: bool = True) -> PairPlan:
    return draw_pair(1700, index, "realistic", changed, True)


def finding(effect: str, joint: int | None, *members: tuple[str, int | None]) -> dict[str, object]:
    return {"effect": effect, "joint": joint, "class": [{"effect": name, "joint": at} for name, at in members]}


def test_both_recordings_are_of_one_robot_with_one_background() -> None:
    drawn = pair(0)
    assert drawn.old.true_arm is drawn.new.true_arm
    assert drawn.old.background == drawn.new.background
    assert len(drawn.old.background) > 0


def test_noise_differs_between_the_recordings_and_servos_do_not() -> None:
    drawn = pair(0)
    noise = [side.stream("noise 0").random() for side in (drawn.old, drawn.new)]
    servo = [side.stream("controller").random() for side in (drawn.old, drawn.new)]
    assert noise[0] != noise[1]
    assert servo[0] == servo[1]


def test_motions_are_shared_only_in_pairs_of_the_same_motion() -> None:
    drawn = [pair(index) for index in range(12)]
    shared = [each.old.stream("motion 0").random() == each.new.stream("motion 0").random() for each in drawn]
    assert shared == [each.old.same_motion for each in drawn]
    assert 0 < sum(shared) < len(shared)


def test_friction_grows_by_two_fifths_in_level_and_coefficient() -> None:
    drawn = pair(CHANGE_KINDS.index("friction"))
    change = draw_change(drawn, 0)
    own = [each for each in drawn.old.background if each.joint == change[0].joint]
    sizes = {each.effect: each.size for each in own}
    assert {each.effect for each in change} == {"coulomb_friction", "viscous_friction"}
    assert all(each.size == pytest.approx(PAIRS.friction * sizes[each.effect]) for each in change)


def test_a_drift_has_the_size_that_it_states() -> None:
    drawn = next(each for each in (pair(index, changed=False) for index in range(30)) if each.drifting)
    noise = drawn.old.noise
    assert isinstance(noise, DriftingNoise)
    time = np.arange(400000) / 100
    rng = np.random.default_rng(0)
    whole = noise.sample(rng, np.zeros((len(time), len(noise.drift))), time)
    slow = whole.reshape(-1, 200, whole.shape[1]).mean(axis=1)
    assert np.std(slow, axis=0) == pytest.approx(noise.drift, rel=0.3)


def test_a_name_is_right_where_it_is_in_a_class_of_three() -> None:
    true = [{"effect": "payload", "joint": 3}]
    assert count_names(true, [finding("payload", 3)]) == (True, 0)
    members = [("inertial_parameter_error", 2), ("payload", 2), ("payload", 3)]
    assert count_names(true, [finding("inertial_parameter_error", 2, *members)]) == (True, 0)
    assert count_names(true, [finding("time_delay", None, ("time_delay", None), *members)]) == (False, 1)
    assert count_names([], [finding("payload", 3)]) == (False, 1)
    assert count_names([], [finding("coulomb_friction", 3)], [["coulomb_friction", 3]]) == (False, 0)


def outcome(kind: str, **told: object) -> PairOutcome:
    facts = {"pair": "a", "tier": "clean", "arm": "scara", "same_motion": True, "drifting": False, "changed": []}
    said = {"size": 5.0, "visible": True, "status": "same", "named": [], "right": False, "wrong": 0, "covered": []}
    return PairOutcome(kind=kind, **{**facts, **said, "plain": 2.0, **told})  # type: ignore[arg-type]


def counts(*outcomes: PairOutcome) -> dict[str, tuple[int, int]]:
    return {each.name: (each.hits, each.number) for each in measures_of(outcomes)}


def test_changes_that_are_too_small_do_not_count() -> None:
    seen, unseen = outcome("gain", right=True, named=[["x", 1]]), outcome("gain", visible=False)
    assert counts(seen, unseen)[RIGHT] == (1, 1)


def test_the_same_is_wrong_where_plain_least_squares_sees_a_change() -> None:
    blind, good = outcome("gain", plain=9.0), outcome("gain", plain=9.0, status="changed")
    assert counts(blind, good, outcome("gain"), outcome("gain", plain=None))[MISSED] == (1, 2)


def test_a_yardstick_that_sees_a_change_where_there_is_none_is_said() -> None:
    false = outcome("null", tier="field", wrong=1)
    found = counts(outcome("null", plain=9.0), false, outcome("null", plain=None))
    assert (found[BROKEN_YARDSTICK], found[f"{BROKEN_YARDSTICK}, field"], found[FALSE]) == ((1, 2), (0, 1), (1, 3))


def test_intervals_are_judged_where_the_number_is_named_and_known() -> None:
    true = [{"effect": "payload", "joint": 3, "differences": {"mass": 2.0}}]
    row = {"effect": "payload", "joint": 3, "parameter": "mass", "difference_ci95": [1.8, 2.1], "changed": True}
    others = [{**row, "difference_ci95": [2.1, 3.0]}, {**row, "changed": False}, {**row, "parameter": "centre"}]
    assert list(judge_intervals(true, [row, *others, {**row, "joint": 2}])) == [True, False]
    assert counts(outcome("payload", covered=[True, False]))[COVERED] == (1, 2)


def test_what_is_known_of_a_change_are_differences() -> None:
    assert known_differences(TorqueGain(0, 0.05, 0.5, "factor", {"direction": -1.0})) == {"gain": pytest.approx(-0.05)}
    assert known_differences(EncoderOffset(0, 0.01, 0.08, "constant", {"direction": 1.0})) == {"offset": 0.01}


def test_a_pair_of_the_field_says_what_changed(tmp_path: Path) -> None:
    plans = (draw_field_plan(1700, index, "pair changed") for index in range(20))
    plan = next(each for each in plans if each.machine.joints == 1)
    write_field_pair(plan, tmp_path / "observation", tmp_path / "truth.json")
    answer = read_json(tmp_path / "truth.json")
    assert answer["kind"] in CHANGE_KINDS
    assert len(answer["changed"]) == 1 + (answer["kind"] == "friction")
    assert all((tmp_path / "observation" / side / "recording.yaml").is_file() for side in ("old", "new"))


def test_the_page_says_what_is_wanted_and_lists_what_is_not_right() -> None:
    outcomes = (outcome("null", status="changed", named=[["payload", 3]], wrong=1), outcome("gain", plain=9.0))
    page = score_page(outcomes, tuple(measures_of(outcomes)))
    assert "| nothing changed, something named | 100.0% (20.7% to 100.0%), 1 of 1 | at most 2% |" in page
    assert page.count("| a | ") == 2


def test_a_folder_of_other_pairs_is_refused(tmp_path: Path) -> None:
    (tmp_path / "settings.json").write_text("{}")
    with pytest.raises(InputError, match="holds another set"):
        next(CHANGES.prove(PairSet(1, 0, 0, 0, 1700), tmp_path, tmp_path / "score", 1))
