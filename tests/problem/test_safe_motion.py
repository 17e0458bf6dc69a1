"""Safety rules: ranges and starts, distances as a constraint and as a proof, and bad input in one line."""

import re
import sys
from dataclasses import replace

import numpy as np
import pytest
from refusals import refusal

from armlab.common.arrays import Array
from armlab.common.settings import validate
from problem.arm import Arm, Joint, Limits
from problem.limits import Constraints
from problem.safe_motion import RecordedPlace, SafeConstraints, SafetyRules, SafetySettings, safety_rules
from problem.safety_proof import check_motion
from problem.trajectories import JointFourier
from problem.transforms import rotation_x, translation

LIMITS = Limits((-3.0, 3.0), 2.0, 10.0)
LEVEL = rotation_x(-np.pi / 2)
SERIES = JointFourier(4.0, 3, np.zeros(3), np.full(3, 3.0), np.full(3, 2.0), True)


def lifting_arm() -> Arm:
    """Three links of half a metre in a vertical plane, from a shoulder 1 m above the base; positive angles lower it."""
    shoulder = Joint("shoulder", "revolute", translation(0, 0, 1) @ LEVEL, translation(0.5, 0, 0), LIMITS)
    others = (Joint(name, "revolute", np.eye(4), translation(0.5, 0, 0), LIMITS) for name in ("elbow", "wrist"))
    return Arm("lifting", (shoulder, *others))


def rules(recorded: RecordedPlace | None = None, **given: object) -> SafetyRules:
    settings = validate(SafetySettings, {"radius": 0.05, **given}, "the safety options")
    return safety_rules(lifting_arm(), "none", (LIMITS,) * 3, settings, recorded)


def swing(joint: int, size: float, centre: float = 0.0) -> Array:
    """The point of a motion of one joint: a_1 of the series, about q0."""
    out = np.zeros((3, 5))
    out[joint, 0], out[joint, -1] = size, centre
    return out.ravel()


def path(point: Array) -> Array:
    return SERIES.motions(point[None], np.linspace(0, 4, 4001)).motion.position[0]


def test_a_motion_through_the_floor_is_refused_with_what_when_and_how_deep() -> None:
    told = refusal(check_motion, rules(near=[0, 0, 0], floor=0.2), SERIES, swing(0, 1.5), 4.0)
    form = r"at \d\.\d+ s the motion has the link of wrist 0\.\d+ m inside the floor; 0\.02 m are to be kept"
    assert re.fullmatch(form, told)


def test_the_same_motion_above_the_floor_has_a_report() -> None:
    report = check_motion(rules(near=[0, 0, 0], floor=-1.0), SERIES, swing(0, 1.5), 4.0)
    assert report.least["the floor"] >= 0.02
    assert any(each.startswith("the floor at -1.0 m: 0.02 m are to be kept") for each in report.checked)
    assert not any("floor" in each for each in report.not_checked)
    assert any("payload, tool, cables" in each for each in report.not_checked)


def test_what_was_not_asked_for_is_said_not_to_be_checked() -> None:
    told = check_motion(rules(), SERIES, swing(0, 0.1), 4.0).not_checked
    assert "a floor: none is given (--floor)" in told
    assert "things around the arm: no box is given (--keep-out)" in told


def test_an_arm_that_folds_into_itself_is_refused() -> None:
    fold = swing(1, 2.0) + swing(2, 2.0)
    assert path(fold).max() > 1.5
    assert "link of wrist" in refusal(check_motion, rules(range="robot", near=[0, 0, 0]), SERIES, 2 * fold, 4.0)


def test_a_box_between_two_sampled_poses_is_found() -> None:
    point = swing(0, 1.5)
    places = path(point)[:, 0]
    highest = places.max()
    tip = np.array([1.5 * np.cos(highest), 0.0, 1 - 1.5 * np.sin(highest)])
    low, high = tip - np.array([0.003, 0.003, 0.4]), tip + np.array([0.003, 0.003, -0.06])
    kept = rules(near=[0, 0, 0], keep_out=[[low.tolist(), high.tolist()]])
    assert re.search(
        "the link of wrist .* box 1; 0.02 m are to be kept", refusal(check_motion, kept, SERIES, point, 4.0)
    )


@pytest.mark.parametrize("size", [0.1, 0.4, 0.8, 1.0, 1.2])
def test_a_proof_and_a_refusal_hold_at_poses_that_were_not_looked_at(size: float) -> None:
    kept = rules(near=[0, 0, 0], floor=0.81)
    point = np.random.default_rng(0).uniform(-size, size, 15)
    point[4::5] = 0
    point[4::5] = -path(point)[0]
    assert kept.shape is not None
    least = kept.shape.distances(path(point)).min()
    if size <= 0.8:
        report = check_motion(kept, SERIES, point, 4.0)
        assert least >= 0.02 - 0.001
        assert least >= min(report.least.values()) - report.movement
    else:
        assert least < 0.02
        assert "0.02 m are to be kept" in refusal(check_motion, kept, SERIES, point, 4.0)


def test_a_search_is_given_the_distances_as_a_constraint() -> None:
    kept = rules(near=[0, 0, 0], floor=0.2)
    safe = SafeConstraints(kept.arm, kept.limits, rules=kept)
    plain = Constraints(kept.arm, kept.limits)
    down, still = swing(0, 1.5), swing(0, 0.0)
    motions = SERIES.motions(np.array([down, still]), np.linspace(0, 4, 401))
    more = safe.violation(motions) - plain.violation(motions)
    assert more[0] > 0.1
    assert more[1] == 0


PLACE = RecordedPlace(np.array([-0.5, -1.0, 0.2]), np.array([0.5, 1.0, 0.2]), np.array([0.1, 0.0, 0.2]))


def test_a_motion_stays_a_little_beyond_what_was_recorded_and_starts_where_the_recording_starts() -> None:
    kept = rules(PLACE)
    ranges = [each for limit in kept.limits for each in limit.position]
    assert ranges == pytest.approx([-0.6, 0.6, -1.2, 1.2, 0.1, 0.3])
    assert kept.start == pytest.approx(PLACE.start)
    assert "outside the range of the first recording" in refusal(check_motion, kept, SERIES, swing(0, 0.0, -1.0), 4.0)


def test_a_given_range_replaces_that_of_the_recording() -> None:
    assert rules(PLACE, range="robot").limits == (LIMITS,) * 3
    given = rules(PLACE, range=[[-1, 1], [-1, 1], [0, 1]])
    assert [limit.position for limit in given.limits] == [(-1, 1), (-1, 1), (0, 1)]


def test_a_motion_that_starts_elsewhere_is_refused() -> None:
    told = refusal(check_motion, rules(near=[0.5, 0, 0]), SERIES, swing(0, 0.0), 4.0)
    assert told == "shoulder starts or ends at 0, not within 0.1 of 0.5"


def test_parts_that_are_close_where_the_recording_starts_are_left_out_and_named() -> None:
    folded = RecordedPlace(np.full(3, -2.9), np.full(3, 2.9), np.array([0.0, 2.3, 2.8]))
    kept = rules(folded)
    assert kept.left_out == (
        "the link of shoulder and the link of wrist: they are closer than 0.02 m where the recording starts",
    )
    assert kept.left_out[0] in check_motion(kept, SERIES, path_start(kept.start), 4.0).not_checked


def path_start(start: Array | None) -> Array:
    out = np.zeros((3, 5))
    out[:, -1] = start
    return out.ravel()


def test_without_mujoco_the_card_says_that_the_arm_itself_is_not_checked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    told = check_motion(rules(), SERIES, swing(0, 0.1), 4.0).not_checked
    assert "the arm itself: MuJoCo is missing (pip install 'armlab[motion]')" in told
    assert "armlab[motion]" in refusal(rules, floor=0.0)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"keep_out": [[[0.5, 0, 0], [0.3, 1, 1]]]}, "the lower corner comes first, but x goes from 0.5 to 0.3"),
        ({"keep_out": [[[0.5, 0], [0.3, 1]]]}, "keep_out"),
        ({"range": [[1, -1], [0, 1], [0, 1]]}, "range should be lower, upper: not 1.0 to -1.0"),
        ({"range": [[-1, 1]]}, "range should have 3 entries, one a joint of 'lifting', has 1"),
        ({"range": [[4, 5], [0, 1], [0, 1]]}, "range of shoulder: 4 to 5 is outside its limits, -3 to 3"),
        ({"near": [0.0, 0.0]}, "near should have 3 entries"),
        ({"near": [0.0, 4.0, 0.0]}, "near: elbow at 4 is outside its range, -3 to 3 rad"),
        ({"near": [0.0, 0.0, 0.0], "floor": 0.98}, "is too close to the floor in every pose"),
        ({"near": [1.57, 0.0, 0.0], "floor": 0.2}, "the link of wrist 0.750 m inside the floor"),
        ({"near": [0.0, 2.6, 2.6]}, "the pose where the motion starts (0, 2.6, 2.6) has the link of wrist"),
        ({"keep_out": [[[-3, -3, -3], [3, 3, 3]]]}, "is too close to box 1 in every pose"),
        ({"floor": float("nan")}, "floor"),
        ({"clearance": -1.0}, "clearance"),
        ({"flor": 0.0}, "did you mean 'floor'?"),
    ],
)
def test_what_leaves_no_room_is_told_in_one_line(given: dict[str, object], told: str) -> None:
    assert told in refusal(rules, **given)


def test_the_travel_of_a_sliding_joint_has_to_be_known() -> None:
    slide = Joint("slide", "prismatic", translation(0, 0, 0.2), translation(0.1, 0, 0), Limits())
    arm = Arm("slider", (slide, replace(lifting_arm().joints[1])))
    limits = tuple(joint.limits for joint in arm.joints)
    told = refusal(safety_rules, arm, "none", limits, SafetySettings(floor=0.0), None)
    assert "position_limits" in told
