"""Pairs of recordings for the proof of a comparison: what changes between them, and how names are counted."""

from pathlib import Path

import numpy as np
import pytest

from armlab.common.errors import InputError
from armlab.proof.blind.pairs.pair_plan import CHANGE_KINDS, PAIRS, DriftingNoise, PairPlan, draw_change, draw_pair
from armlab.proof.blind.pairs.pair_score import PairOutcome, count_names, measures_of
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


def test_changes_below_three_detection_limits_do_not_count() -> None:
    facts = {"pair": "a", "tier": "clean", "arm": "scara", "same_motion": True, "drifting": False, "changed": []}
    seen = PairOutcome(kind="gain", multiple=5.0, status="changed", named=[["x", 1]], right=True, wrong=0, **facts)
    unseen = PairOutcome(kind="gain", multiple=2.0, status="same", named=[], right=False, wrong=0, **facts)
    right = next(each for each in measures_of([seen, unseen]) if each.name == "right name or class of three")
    assert (right.hits, right.number) == (1, 1)


def test_a_folder_of_other_pairs_is_refused(tmp_path: Path) -> None:
    (tmp_path / "settings.json").write_text("{}")
    with pytest.raises(InputError, match="holds another set"):
        next(CHANGES.prove(PairSet(1, 0, 1700), tmp_path, tmp_path / "score", 1))
