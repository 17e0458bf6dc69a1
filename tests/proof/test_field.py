"""Field recordings: ranges, determinism, large cases, torque that agrees with the motion, and the score."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from armlab.common.settings import read_json, validate
from armlab.proof.blind.effects.channels import Saturation
from armlab.proof.blind.engine import inverse_dynamics
from armlab.proof.blind.field.field_cases import make_field_case
from armlab.proof.blind.field.field_hidden import FieldEffect
from armlab.proof.blind.field.field_plan import FIELD, FieldPlan, draw_field_plan, new_side
from armlab.proof.blind.field.field_runs import FieldCase, on_same_motion, simulate_field
from armlab.proof.blind.field.field_score import judge_verdict, measure_field
from armlab.proof.blind.field.field_sizes import strength
from armlab.proof.blind.field.field_truth import FieldTruth, make_field_truth
from armlab.proof.blind.field.files import log_field_run, write_field_observation
from armlab.recordings.load import load_recording

SEED = 1000
PLANS = tuple(draw_field_plan(SEED, index, "null") for index in range(60))


def _plan(joints: int) -> FieldPlan:
    """A short null with a number of joints."""
    found = [plan for plan in PLANS if plan.machine.joints == joints]
    return min(found, key=lambda plan: sum(run.length_s for run in plan.runs))


@pytest.fixture(scope="module")
def case() -> FieldCase:
    return simulate_field(_plan(3))


def test_at_most_half_of_the_cases_have_more_than_three_joints_or_twenty_seconds() -> None:
    large = [plan.machine.joints > 3 or sum(run.length_s for run in plan.runs) > 20 for plan in PLANS]
    assert 0.3 <= np.mean(large) <= 0.5


def test_robots_have_one_to_seven_joints_that_turn_or_slide() -> None:
    assert {1, 2, 3, 6, 7} <= {plan.machine.joints for plan in PLANS} <= set(range(1, 8))
    kinds = {joint.type for plan in PLANS for joint in plan.machine.file.joints}
    assert kinds == {"revolute", "prismatic"}


def test_links_are_ten_to_sixty_percent_off_or_not_given() -> None:
    errors = [error for plan in PLANS for error in plan.link_errors]
    assert min(errors) >= 0.1
    assert max(errors) <= 0.6
    assert 0.2 < np.mean([plan.has_links for plan in PLANS]) < 0.9


def test_recordings_have_the_ranges_of_the_field() -> None:
    for plan in PLANS:
        assert 50 <= plan.log.rate_hz <= 500
        assert 4 <= sum(run.length_s for run in plan.runs) <= 60
        assert all(12 <= bits <= 20 for bits in plan.log.encoder_bits)
        assert all(abs(drive.gain - 1) <= FIELD.gain_error for drive in plan.drives)


def test_the_same_seed_and_number_give_the_same_files(tmp_path: Path) -> None:
    for name in ("one", "two"):
        write_field_observation(simulate_field(draw_field_plan(SEED, 0, "null")), tmp_path / name)
    files = sorted(path.name for path in (tmp_path / "one").iterdir())
    assert len(files) >= 4
    for name in files:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes(), name


@pytest.mark.parametrize("joints", [1, 3, 6])
def test_torque_agrees_with_the_motion_by_another_engine_where_nothing_is_soft(joints: int) -> None:
    """What MuJoCo needs for the motion, and friction and rest on top: nothing is left above a ten-thousandth."""
    plan = _plan(joints)
    rigid = replace(plan, drives=tuple(replace(drive, twist=0.0, gap=0.0) for drive in plan.drives))
    run = simulate_field(rigid).runs[0]
    every = slice(None, None, max(len(run.track.time) // 300, 1))
    motion = type(run.track.motion)(run.track.position[every], run.track.velocity[every], run.track.acceleration[every])
    left = run.torque[every] - run.friction[every] - run.rest[every] - inverse_dynamics(plan.true_arm, motion)
    assert np.abs(left).max() < 1e-6 * np.abs(run.torque).max()


def test_velocity_and_acceleration_are_the_derivatives_of_the_position(case: FieldCase) -> None:
    track = case.runs[0].track
    step = track.step_s
    position, inside = track.position, slice(4, -4)
    velocity = (8 * (position[3:-1] - position[1:-3]) - (position[4:] - position[:-4])) / (12 * step)
    speed = np.maximum(np.abs(track.velocity).max(axis=0), 1e-12)
    assert np.max(np.abs(velocity[2:-2] - track.velocity[inside]) / speed) < 1e-3
    change = (8 * (track.velocity[3:-1] - track.velocity[1:-3]) - (track.velocity[4:] - track.velocity[:-4])) / 12
    hardest = np.maximum(np.abs(track.acceleration).max(axis=0), 1e-12)
    assert np.max(np.abs(change[2:-2] / step - track.acceleration[inside]) / hardest) < 1e-2


def test_a_soft_drive_turns_its_motor_by_the_torque_of_its_links() -> None:
    plan = _plan(1)
    drive = replace(plan.drives[0], twist=1e-3, gap=0.0)
    stiff, soft = (simulate_field(replace(plan, drives=(each,))).runs[0] for each in (replace(drive, twist=0.0), drive))
    rotor = np.array(plan.true_arm.rotor_inertia)
    links = stiff.track.load - rotor * stiff.track.acceleration
    assert np.allclose(soft.track.position - stiff.track.position, 1e-3 * links, atol=1e-12)


def test_the_rest_is_the_planned_share_of_the_torque(case: FieldCase) -> None:
    plan = case.plan
    usual = np.std(np.concatenate([run.track.load + run.friction for run in case.runs]), axis=0)
    rest = np.std(np.concatenate([run.rest for run in case.runs]), axis=0)
    assert rest / usual == pytest.approx([each.share for each in plan.rest], rel=1e-6)


def test_friction_keeps_its_value_where_the_joint_stands(case: FieldCase) -> None:
    friction = case.plan.friction[0]
    path = np.concatenate([np.linspace(0, 1, 200), np.ones(200)])
    assert friction.state(path)[-1] == pytest.approx(1.0)
    assert friction.state(-path)[-1] == pytest.approx(-1.0)


def test_logged_torque_is_gain_times_torque_plus_offset_without_noise(case: FieldCase) -> None:
    quiet = replace(
        case.plan.log, jitter=0.0, held=0.0, slow_torque=1, noise=0 * case.plan.log.noise, torque_step=np.zeros(3)
    )
    still = replace(case, plan=replace(case.plan, log=quiet))
    log, run, drives = log_field_run(still, 0), case.runs[0], case.plan.drives
    every = len(run.track.time) // len(log.time)
    wanted = run.torque[::every][: len(log.time)] * [each.gain for each in drives] + [each.offset for each in drives]
    assert log.torque == pytest.approx(wanted, rel=1e-9, abs=1e-9 * float(np.abs(wanted).max()))


def test_strength_grows_in_proportion_to_a_linear_effect(case: FieldCase) -> None:
    small = FieldEffect(("load_dependent_friction",), 1, 0.05, "load_share")
    assert strength(case, replace(small, size=0.1)) == pytest.approx(2 * strength(case, small), rel=1e-6)


def test_an_effect_on_the_same_motion_equals_the_simulation_with_it(case: FieldCase) -> None:
    peak = float(np.abs(case.runs[0].torque[:, 0]).max())
    for effect in (
        FieldEffect(("load_dependent_friction",), 1, 0.1, "load_share"),
        FieldEffect(("torque_saturation",), 1, 0.2, law=Saturation(0, 0.2, 0.6, "clip", {"peak": peak})),
    ):
        quick, whole = on_same_motion(case, effect), simulate_field(case.plan, (effect,), case.rest_factors)
        for one, other in zip(quick.runs, whole.runs, strict=True):
            assert np.allclose(quick.read(one.torque), whole.read(other.torque), rtol=1e-9, atol=1e-9 * peak)


def test_a_new_side_with_nothing_changed_is_the_same_robot_on_another_day() -> None:
    plan = draw_field_plan(SEED, 0, "pair null")
    later = new_side(plan)
    assert later.name == plan.name
    assert [replace(each, running_s=0.0) for each in later.friction] == [
        replace(each, running_s=0.0) for each in plan.friction
    ]
    assert (later.true_arm, later.drives, later.rest) == (plan.true_arm, plan.drives, plan.rest)


@pytest.mark.parametrize("kind", ["hidden", "mistake"])
def test_a_made_case_can_be_read_and_says_what_is_true(kind: str, tmp_path: Path) -> None:
    plan = next(
        each
        for each in (draw_field_plan(SEED, index, kind) for index in range(20))  # type: ignore[arg-type]
        if each.machine.joints <= 3
    )
    answer = make_field_case(plan, tmp_path / "observation", tmp_path / "truth.json")
    assert validate(FieldTruth, read_json(tmp_path / "truth.json"), "truth") == answer
    assert len(answer.hidden) + len(answer.mistakes) == 1
    if kind == "hidden":
        assert len(load_recording(tmp_path / "observation").arm) == answer.joints
    else:
        assert (tmp_path / "observation" / "recording.yaml").is_file()


def test_dropped_rows_are_missing_and_doubled_rows_come_twice(tmp_path: Path) -> None:
    plan = _plan(1)
    log = replace(plan.log, dropped=0.1, doubled=0.1, jitter=0.0, held=0.0, suffix=".csv")
    write_field_observation(simulate_field(replace(plan, log=log)), tmp_path / "it")
    stamps = pd.read_csv(tmp_path / "it" / "run-1.csv")["t"].to_numpy()
    steps = np.rint(np.diff(stamps) * log.rate_hz).astype(int)
    assert {0, 2} <= set(steps.tolist())


def _finding(effect: str, joint: int | None, **more: object) -> dict[str, object]:
    return {"effect": effect, "joint": joint, "kind": "physics", **more}


def test_a_null_is_judged_by_false_names_mistakes_and_open_verdicts(case: FieldCase) -> None:
    truth = make_field_truth(case)
    verdict = {
        "status": "inconclusive",
        "summary": "The recording may be read wrongly.",
        "findings": [
            _finding("coulomb_friction", 1),
            _finding("unknown", 2),
            _finding("channel_skew", 2),
            _finding("torque_sign", 1, kind="setup"),
        ],
    }
    found = judge_verdict(truth, verdict)
    assert found.false == ["channel_skew@2"]
    assert found.false_setup == ["torque_sign@1"]
    assert found.doubt
    texts = {each.name: (each.hits, each.number) for each in measure_field([found])}
    assert texts["nulls: a false reading mistake"] == (1, 1)
    assert texts["nulls: a false name"] == (1, 1)
    assert texts["nulls: inconclusive"] == (1, 1)


def test_that_nothing_is_read_wrongly_is_no_doubt(case: FieldCase) -> None:
    verdict = {"status": "none", "summary": "Nothing is read wrongly.", "findings": []}
    assert not judge_verdict(make_field_truth(case), verdict).doubt


def test_a_hidden_effect_counts_as_named_or_in_a_class(case: FieldCase) -> None:
    effect = FieldEffect(("torque_ripple",), 1, 1.0)
    truth = replace_kind(make_field_truth(case, hidden=(effect, 1.5)), "hidden")
    named = judge_verdict(truth, {"status": "mismatch", "findings": [_finding("torque_ripple", 1)]})
    other = _finding("cable_stiffness", 1, **{"class": [{"effect": "torque_ripple", "joint": 1}]})
    held = judge_verdict(truth, {"status": "mismatch", "findings": [other]})
    assert (named.right, named.in_class, held.right, held.in_class) == (True, True, False, True)


def replace_kind(truth: FieldTruth, kind: str) -> FieldTruth:
    return truth.model_copy(update={"kind": kind})
