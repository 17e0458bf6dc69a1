"""Cases of motion only: plans, sizes, files, and how verdicts are judged."""

import json

import numpy as np
import pytest
from jsonschema import Draft202012Validator

from armlab.diagnosis.motion.diagnose_motion import diagnose_motion
from armlab.proof.blind import sealed
from armlab.proof.blind.servo.servo_cases import MadeCase, make_case, write_case
from armlab.proof.blind.servo.servo_hidden import KINDS, Hidden
from armlab.proof.blind.servo.servo_oracle import ServoOracle, find_size
from armlab.proof.blind.servo.servo_plan import MOTIONS, ServoCase, draw_cases
from armlab.proof.blind.servo.servo_score import judge
from armlab.proof.blind.servo.servo_truth import TRUTH_SCHEMA_FILE, truth_schema
from armlab.proof.tiers.motion import MOTION, MotionSet
from armlab.recordings.motion import load_motion_recording


def small_cases(kind, law="pd"):
    """Known cases of two joints."""
    cases = (ServoCase(1990, kind, index) for index in range(1000))
    return (each for each in cases if each.drawn[0].joints == 2 and each.knowledge == "known" and each.law == law)


def small_case(kind, law="pd"):
    """A known case of two joints."""
    return next(small_cases(kind, law))


def test_a_set_hides_every_kind_before_one_comes_twice():
    known = [ServoCase(1990, "one", index) for index in range(84)]
    drawn = {each.draw_hidden(0, 0).kind for each in known if each.knowledge == "known"}
    assert drawn == set(KINDS)


def test_held_out_motions_are_two_or_three_and_two_or_more_are_left():
    for case in draw_cases(1990, 0, 6):
        roles = [run.role for run in case.runs]
        assert 4 <= len(roles) <= 8
        assert roles.count("validate") in (2, 3)
        assert roles.count("identify") >= 2


@pytest.mark.parametrize("kind", ["friction", "gain", "offset"])
def test_a_hidden_size_is_of_about_the_wanted_detection_limits(kind):
    case = small_case("one")
    oracle = ServoOracle(case, case.drawn[0])
    sized, multiple = find_size(oracle, Hidden(kind, 1), 6.0)
    assert multiple == pytest.approx(6.0, rel=0.25)
    assert 0 < sized.size < KINDS[kind].largest


def test_an_arm_without_a_difference_has_no_detection_limit_of_one():
    case = small_case("one")
    arm = case.drawn[0]
    assert ServoOracle(case, arm).multiple(Hidden("offset", 0), arm, arm) == pytest.approx(0.0, abs=1e-9)


def test_a_hidden_delay_is_one_that_the_engine_takes():
    arm = small_case("one").drawn[0]
    hidden = Hidden("delay", 0, size=0.00262)
    assert hidden.parameters(hidden.apply(arm))["seconds"][0] == pytest.approx(arm.servos[0].delay + 0.0025)


def test_a_payload_adds_its_mass_and_the_moments_of_a_point():
    arm = small_case("one").drawn[0]
    before, after = arm.bodies[-1], Hidden("payload", 0, size=0.5).apply(arm).bodies[-1]
    assert after.mass == pytest.approx(1.5 * before.mass)
    moment = before.mass * np.array(before.centre) + 0.5 * before.mass * np.array([2 * before.centre[0], 0, 0])
    np.testing.assert_allclose(after.mass * np.array(after.centre), moment)
    assert after.inertia[0] >= before.inertia[0]


def test_a_written_case_is_a_recording_of_motion_and_its_answer_stays_outside(tmp_path):
    case = small_case("one")
    made = make_case(case)
    write_case(made, tmp_path / "observation", tmp_path / "truth.json")
    recording = load_motion_recording(tmp_path / "observation")
    assert len(recording.joints) == 2
    assert [run.role for run in recording.runs] == [run.role for run in case.runs]
    truth = json.loads((tmp_path / "truth.json").read_text())
    Draft202012Validator(truth_schema()).validate(truth)
    assert [each["kind"] for each in truth["injected"]] == [each.kind for each in made.hidden]
    named = {path.name for path in (tmp_path / "observation").iterdir()}
    assert named == {"arm.xml", "recording.yaml", *(f"run-{each + 1}.csv" for each in range(len(case.runs)))}


def test_the_shipped_schema_of_answers_is_that_of_the_model():
    shipped = json.loads(TRUTH_SCHEMA_FILE.read_text(encoding="utf-8"))
    where = "armlab.proof.blind.servo.servo_truth.truth_schema()"
    assert shipped == truth_schema(), f"write {where} to {TRUTH_SCHEMA_FILE}"


@pytest.mark.parametrize(("commit", "lines"), [(None, 0), ("a" * 40, 1)])
def test_a_judged_set_is_logged_once_and_one_for_development_is_not(tmp_path, commit, lines):
    log = tmp_path / "log.jsonl"
    for _ in range(2):
        list(MOTION.prove(MotionSet(0, 0, 1990), tmp_path / "work", tmp_path / "results", 1, commit, log))
    logged = log.read_text().splitlines() if lines else []
    assert log.is_file() == bool(lines)
    assert len(logged) == lines
    for line in map(json.loads, logged):
        assert (line["set"], line["commit"], line["seed"], line["cases"]) == ("motion", commit, 1990, 0)
        assert line["manifest"] == sealed.file_digest(tmp_path / "work" / "manifest.json")
        assert "nulls_with_a_false_claim" in line["score"]["motion"]


def test_an_integral_drive_whose_simulation_is_right_replays_down_to_its_encoder(tmp_path):
    case = small_case("null", law="pid")
    write_case(make_case(case), tmp_path / "observation", tmp_path / "truth.json")
    result = diagnose_motion(load_motion_recording(tmp_path / "observation"))
    assert result.status == "none"
    floors = [each.after / each.floor for each in result.errors]
    print("replay in windows over the floor of the encoder:", floors)
    assert max(floors) < 3


def test_a_payload_is_named_with_its_mass_and_no_gain_is(tmp_path):
    case = next(each for each in small_cases("null") if len(each.runs) == MOTIONS[0])
    hidden = Hidden("payload", 0, size=0.3)
    arm = hidden.apply(case.drawn[0])
    write_case(MadeCase(case, arm, (), (), (), ()), tmp_path / "observation", tmp_path / "truth.json")
    result = diagnose_motion(load_motion_recording(tmp_path / "observation"))
    mass = hidden.parameters(arm)["mass"][0]
    print([(each.effect, each.joint, each.value, each.interval, mass) for each in result.findings])
    assert [(each.effect, each.joint) for each in result.findings] == [("payload", 2)]
    assert result.findings[0].value == pytest.approx(mass, rel=0.1)


TRUTH = {
    "case": "a",
    "kind": "one",
    "law": "pd",
    "knowledge": "known",
    "counts": 4096,
    "rate_hz": 50.0,
    "injected": [
        {
            "kind": "friction",
            "effect": "coulomb_friction",
            "equivalent": [],
            "part": "",
            "joint": 2,
            "size": 0.5,
            "falling": False,
            "parameters": {"level": 0.3},
            "multiple": 5.0,
        }
    ],
    "drives": [
        {
            "controller_gain_error": {"kp": 5.0, "kd": 0.2},
            "coulomb_friction": {"level": 0.3},
            "viscous_friction": {"coefficient": 0.1},
        }
    ]
    * 2,
}


def finding(effect, joint, rivals=(), **parameters):
    """A finding as a verdict has it; parameters: value, low, high."""
    numbers = {name: {"value": each[0], "ci95": list(each[1:]), "unit": ""} for name, each in parameters.items()}
    others = [{"effect": name, "joint": place} for name, place in rivals]
    return {"effect": effect, "joint": joint, "rivals": others, "parameters": numbers}


def test_a_right_name_counts_with_its_number():
    verdict = {"findings": [finding("coulomb_friction", 2, level=(0.32, 0.29, 0.35))]}
    outcome = judge(TRUTH, verdict)
    assert (outcome.hidden[0].named, outcome.hidden[0].in_class, outcome.wrong) == (True, True, [])
    assert outcome.numbers[0].held
    assert outcome.numbers[0].error == pytest.approx(0.02 / 0.06)


def test_a_right_name_at_another_joint_is_a_wrong_claim():
    outcome = judge(TRUTH, {"findings": [finding("coulomb_friction", 1)]})
    assert (outcome.hidden[0].in_class, outcome.wrong) == (False, ["coulomb_friction@1"])


def test_a_name_among_four_is_a_right_class_and_among_five_is_none():
    rivals = [("coulomb_friction", 2), ("payload", 2), ("rotor_inertia", 2), ("command_delay", 2)]
    four, five = (judge(TRUTH, {"findings": [finding("viscous_friction", 2, rivals[:n])]}) for n in (3, 4))
    assert (four.hidden[0].named, four.hidden[0].in_class) == (False, True)
    assert not five.hidden[0].in_class
    assert four.wrong == ["viscous_friction@2"]


@pytest.mark.parametrize(("falling", "wrong"), [(False, ["torque_saturation@1"]), (True, [])])
def test_limits_of_all_joints_are_lower_where_the_supply_falls(falling, wrong):
    hidden = {**TRUTH["injected"][0], "kind": "saturation", "effect": "torque_saturation", "falling": falling}
    verdict = {"findings": [finding("torque_saturation", 1, limit=(1.0, 0.9, 1.1))]}
    outcome = judge({**TRUTH, "injected": [hidden]}, verdict)
    assert (outcome.wrong, outcome.hidden[0].named, outcome.numbers) == (wrong, False, [])


def test_a_gain_is_no_wrong_claim_where_kp_is_unknown_but_a_single_wrong_number_is_counted():
    verdict = {"findings": [finding("controller_gain_error", 1, kp=(6.0, 5.8, 6.2))]}
    outcome = judge({**TRUTH, "knowledge": "partly"}, verdict)
    assert outcome.wrong == []
    assert outcome.single_wrong_numbers == 1
    assert judge(TRUTH, verdict).wrong == ["controller_gain_error@1"]


def test_damping_is_that_of_joint_and_drive_where_nothing_is_known_of_the_drive():
    verdict = {"findings": [finding("viscous_friction", 1, coefficient=(0.31, 0.29, 0.33))]}
    assert judge({**TRUTH, "knowledge": "unknown"}, verdict).numbers[0].held


def test_damping_is_that_of_the_joint_where_the_drives_kd_has_a_number_of_its_own():
    gains = finding("controller_gain_error", 1, kd=(0.21, 0.19, 0.23))
    verdict = {"findings": [gains, finding("viscous_friction", 1, coefficient=(0.31, 0.29, 0.33))]}
    kd, damping = judge({**TRUTH, "knowledge": "unknown"}, verdict).numbers
    assert (kd.parameter, kd.held, damping.parameter, damping.held) == ("kd", True, "coefficient", False)
