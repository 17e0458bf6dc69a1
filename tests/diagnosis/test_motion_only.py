"""Diagnoses of recordings of motion only: named servos, honest nulls, files that reproduce the replay, bad input."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from servo_arms import RATE_HZ, arm_text, commands, simulate, write_recording

from armlab.cli.main import main
from armlab.common.files import write_texts
from armlab.diagnosis.formats import read_verdict_file
from armlab.diagnosis.motion.arm_fit import ArmFit, fine_enough, fit_arm
from armlab.diagnosis.motion.calm_windows import confirm_in_calm_windows, find_calm_windows
from armlab.diagnosis.motion.choose import ChosenServo, GainOfNumber, choose_servo, learned_errors
from armlab.diagnosis.motion.couple import coupled_windows
from armlab.diagnosis.motion.diagnose_motion import diagnose_motion, split_runs
from armlab.diagnosis.motion.encoder_steps import is_made_by_encoder_steps
from armlab.diagnosis.motion.estimate import ServoFit, fit_servo
from armlab.diagnosis.motion.export import mjcf_text
from armlab.diagnosis.motion.held_out import JointTrials, replay_named, replays_as_well
from armlab.diagnosis.motion.hold import hold_commands
from armlab.diagnosis.motion.joint_replay import joint_errors, replay_joint
from armlab.diagnosis.motion.motion_result import MotionDiagnosis, ServoFinding
from armlab.diagnosis.motion.motion_tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.replay import joint_rms, replay
from armlab.diagnosis.motion.separate import confused_parameters
from armlab.diagnosis.motion.servo import NEUTRAL, PARAMETERS, USUAL, Key, Servos, place
from armlab.diagnosis.motion.servo_simulation import ServoSimulation, read_servo_simulation
from armlab.diagnosis.motion.shared_number import COMMON_DELAY, TOOL_MASS, JointModel, estimate_shared, weigh
from armlab.diagnosis.motion.windows import Windows, make_windows
from armlab.identification.model_file import read_model
from armlab.recordings.motion import load_motion_recording
from armlab.recordings.recording import MotionRun
from armlab.report.motion.motion_page import joint_table, motion_page, untold_table
from armlab.report.motion.motion_verdict import make_motion_verdict, motion_texts
from armlab.report.motion.motion_words import error_phrase, motion_lines, remarks
from armlab.report.verdict import verdict_of
from problem.motion import Motion
from problem.regressor import rigid_body_torque

SECONDS = 20.0
COARSE = 1024  # counts of an encoder: replays of finer ones take shorter steps, and several times as long
TRUTH = {"kp": 8.0, "kv": 0.0, "damping": 0.5, "frictionloss": 0.1}


@pytest.fixture(scope="module")
def soft(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording whose servos are softer than the simulation's, with friction and a late command."""
    return write_recording(tmp_path_factory.mktemp("soft") / "servo", {**TRUTH, "delay": 0.02}, seconds=SECONDS)


@pytest.fixture(scope="module")
def diagnosis(soft: Path) -> MotionDiagnosis:
    return diagnose_motion(load_motion_recording(soft))


def found(diagnosis: MotionDiagnosis) -> dict[tuple[str, int], float]:
    return {(each.effect, each.joint): each.value for each in diagnosis.findings}


def test_gain_friction_and_delay_are_named_with_their_numbers(diagnosis: MotionDiagnosis) -> None:
    numbers = found(diagnosis)
    assert diagnosis.status == "mismatch"
    for joint in (1, 2):
        assert numbers["controller_gain_error", joint] == pytest.approx(8.0, rel=0.05)
        assert numbers["coulomb_friction", joint] == pytest.approx(0.1, rel=0.15)
        assert numbers["command_delay", joint] == pytest.approx(0.02, abs=0.003)
    assert not {effect for effect, _ in numbers} & {"torque_saturation", "controller_dead_band", "rotor_inertia"}


def test_a_live_verdict_draws_positions_measured_and_replayed(diagnosis: MotionDiagnosis) -> None:
    verdict = verdict_of(make_motion_verdict(diagnosis), diagnosis, None)
    (axes,) = verdict.plot(joint=2).axes
    assert [line.get_label() for line in axes.lines] == ["measured", "simulation as given", "with what was found"]
    assert verdict.model is None  # of torque
    assert set(verdict.table["joint"]) == {1, 2}


def test_a_finding_is_told_in_the_units_of_a_reader(diagnosis: MotionDiagnosis) -> None:
    lines = list(motion_lines(diagnosis, verbose=True))
    delay = next(each for each in diagnosis.findings if each.effect == "command_delay")
    assert any(f"command delay, {1e3 * delay.value:.3g} ms (" in line for line in lines)
    assert any("controller gain kp, " in line for line in lines)
    told = [line for line in lines if line.startswith("  ") and ("Coulomb" in line or "delay" in line)]
    assert told
    assert not any("_" in line for line in told)


def test_positions_beyond_their_limits_are_told(diagnosis: MotionDiagnosis) -> None:
    run = diagnosis.recording.runs[0]
    far = run.with_signals(run.time, {"position": run.position + 100.0})
    moved = replace(diagnosis, recording=replace(diagnosis.recording, runs=(far,)))
    assert not any("Warning" in each for each in remarks(diagnosis))
    assert any(each.startswith("Warning: position of") for each in remarks(moved))


def test_what_the_motion_does_not_tell_is_told(diagnosis: MotionDiagnosis) -> None:
    """A late command and a late reading look alike; every joint that has a servo has a row of its own."""
    delay = next(each for each in diagnosis.findings if each.effect == "command_delay")
    row = diagnosis.simulation.joints.index(delay.joint - 1)
    assert "channel_skew" in diagnosis.rivals[row][place("delay")]
    said = [line for line in motion_lines(diagnosis, verbose=True) if "not told at" in line]
    assert any("command delay from channel skew" in line for line in said)
    assert len(said) == sum(map(len, diagnosis.rivals)) == len(untold_table(diagnosis).rows)


def test_held_out_replay_comes_near_the_encoder(diagnosis: MotionDiagnosis) -> None:
    for each in diagnosis.errors:
        assert each.replay_before is not None
        assert each.replay_after < 0.1 * each.replay_before
    assert diagnosis.tool[0] is not None
    assert diagnosis.tool[1] < 0.1 * diagnosis.tool[0]


def test_a_joint_that_the_simulator_replays_worse_has_its_own_replay_beside_it(diagnosis: MotionDiagnosis) -> None:
    arm, error = diagnosis.recording.recorded_arm, replace(diagnosis.errors[0], before=3e-3, after=1e-3)
    worse, alike = (replace(error, replay_before=2e-3, replay_after=each) for each in (2.1e-3, 2.01e-3))
    assert error_phrase(arm, worse).endswith("; of the joint alone 3 before, 1 after")
    assert "alone" not in error_phrase(arm, alike)


def test_names_that_make_the_replay_of_their_joint_worse_are_withdrawn(diagnosis: MotionDiagnosis) -> None:
    second, spoilt = diagnosis.chosen[1], with_spoilt_gain(diagnosis)
    named = [[each for each in diagnosis.findings if each.joint == joint] for joint in (1, 2)]
    held_out = split_runs(diagnosis.recording)[1]
    both, before = (diagnosis.simulation, diagnosis.simulation), diagnosis.replayed_before
    trials = JointTrials(lambda joint, values: False, fail_if_called)
    _, kept, servos, _ = replay_named(both, (spoilt, second), named, trials, before, held_out)
    assert kept == [[], named[1]]
    np.testing.assert_array_equal(servos.values[0], diagnosis.simulation.nominal.values[0])
    confirmed = replace(trials, is_confirmed=lambda joint, values: joint == 0)
    assert replay_named(both, (spoilt, second), named, confirmed, before, held_out)[1] == named


def with_spoilt_gain(diagnosis: MotionDiagnosis) -> ChosenServo:
    """The servo found at the first joint, with a gain that lets it hang."""
    first = diagnosis.chosen[0]
    assert first is not None
    values = first.fit.values.copy()
    values[place("kp")] = 0.01
    return replace(first, fit=replace(first.fit, values=values))


def fail_if_called(*_: object) -> tuple[ChosenServo, list[ServoFinding]]:
    raise AssertionError("several findings of a joint are not tried one by one")


def test_a_single_finding_whose_replay_is_worse_is_tried_alone_and_kept_where_it_holds(
    diagnosis: MotionDiagnosis,
) -> None:
    (first, second), spoilt = diagnosis.chosen, with_spoilt_gain(diagnosis)
    named = [[each for each in diagnosis.findings if each.joint == joint] for joint in (1, 2)]
    named[0] = named[0][:1]
    held_out = split_runs(diagnosis.recording)[1]
    both, before = (diagnosis.simulation, diagnosis.simulation), diagnosis.replayed_before
    asked: list[tuple[int, ServoFinding, ChosenServo]] = []

    def alone(joint: int, finding: ServoFinding, servo: ChosenServo) -> tuple[ChosenServo, list[ServoFinding]]:
        asked.append((joint, finding, servo))
        assert first is not None
        return first, named[0]

    trials = JointTrials(lambda joint, values: False, alone)
    chosen, kept, _, _ = replay_named(both, (spoilt, second), named, trials, before, held_out)
    assert asked == [(0, named[0][0], spoilt)]
    assert (chosen, kept) == ([first, second], named)


def test_intervals_are_narrow_and_near_the_truth(diagnosis: MotionDiagnosis) -> None:
    for each in diagnosis.findings:
        if each.effect == "controller_gain_error":
            low, high = each.interval
            assert low - 0.3 < 8.0 < high + 0.3
            assert high - low < 1.0


def test_a_simulation_that_is_right_has_nothing_missing(tmp_path: Path) -> None:
    folder = write_recording(tmp_path / "right", {}, seconds=SECONDS, counts=COARSE)
    result = diagnose_motion(load_motion_recording(folder))
    assert (result.status, result.findings) == ("none", ())
    assert result.servos is not None
    np.testing.assert_array_equal(result.servos.values, result.simulation.nominal.values)


def test_what_was_free_when_a_finding_was_judged_is_no_rival_of_it(diagnosis: MotionDiagnosis) -> None:
    for each in diagnosis.findings:
        chosen = diagnosis.chosen[each.joint - 1]
        assert chosen is not None
        free = {PARAMETERS[number].effect for number in np.flatnonzero(chosen.free)} - {each.effect}
        assert not free & (set(each.rivals) - set(each.parameter.rivals) - {"rotor_inertia"})


def test_without_a_controller_and_with_dropped_rows_the_gain_is_found_all_the_same(soft: Path, tmp_path: Path) -> None:
    folder = tmp_path / "unknown"
    folder.mkdir()
    for path in soft.iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    text = (folder / "arm.xml").read_text()
    (folder / "arm.xml").write_text(text[: text.index("<actuator>")] + "</mujoco>")
    for number, path in enumerate(sorted(folder.glob("*.csv"))):
        table = pd.read_csv(path)
        gone = np.random.default_rng(number).choice(np.arange(5, len(table) - 5), 20, replace=False)
        table.drop(index=gone).to_csv(path, index=False)
    result = diagnose_motion(load_motion_recording(folder))
    assert found(result)["controller_gain_error", 1] == pytest.approx(8.0, rel=0.06)
    assert all(np.isnan(each.nominal) for each in result.findings if each.effect == "controller_gain_error")
    limits = [line for line in motion_lines(result, verbose=True) if ": torque saturation," in line]
    assert limits
    assert all("; the simulation has none" in line for line in limits)
    assert all(each.replay_before is None for each in result.errors)


def test_replay_of_one_joint_agrees_with_mujoco(soft: Path) -> None:
    recording = load_motion_recording(soft)
    simulation = read_servo_simulation(recording)
    true = NEUTRAL.copy()
    true[[place("kp"), place("damping"), place("friction"), place("armature")]] = 8.0, 0.5, 0.1, 0.01
    true[[place("limit"), place("delay")]] = 3.0, 0.02
    for windows in make_windows(recording.with_role("identify"), simulation):
        errors = replay_joint(windows, true)[0] - windows.position
        assert np.sqrt(np.mean(errors**2)) < 0.03 * np.std(windows.position)


def test_loads_of_replayed_joints_end_at_the_motion_of_the_arm(soft: Path) -> None:
    recording = load_motion_recording(soft)
    runs, simulation = recording.with_role("identify"), read_servo_simulation(recording)
    true = NEUTRAL.copy()
    true[[place("kp"), place("damping"), place("friction"), place("armature")]] = 8.0, 0.5, 0.1, 0.01
    true[[place("limit"), place("delay")]] = 3.0, 0.02

    def error(windows: Sequence[Windows]) -> float:
        return float(np.sqrt(np.mean(np.concatenate([joint_errors(joint, true)[0] for joint in windows]) ** 2)))

    measured = error(make_windows(runs, simulation))
    replayed = [
        error(coupled_windows(runs, simulation, [true, true], replace(DEFAULT, coupling_rounds=replays)))
        for replays in (1, 3, 6)
    ]
    assert replayed[1] < 0.85 * measured
    assert replayed[2] == pytest.approx(replayed[1], rel=1e-3)
    held = coupled_windows(runs, simulation, [true, None])[1]
    np.testing.assert_array_equal(held.measured, make_windows(runs, simulation)[1].measured)


def test_a_joint_that_is_read_late_pushes_the_others_when_it_moves(tmp_path: Path) -> None:
    controller = {"type": "pd", "kp": [60, 60], "kd": [0.3, 0.3], "torque_limit": [3, 3]}
    errors = []
    for name, late in (("ignored", 0.0), ("stated", 0.008)):
        given = {"controller": {**controller, "read_delay": [0.0, late]}}
        folder = write_recording(tmp_path / name, {"read_late": 0.008}, seconds=SECONDS, **given)
        recording = load_motion_recording(folder)
        runs, simulation = recording.with_role("identify"), read_servo_simulation(recording)
        true = list(simulation.nominal.values)
        true[1][place("delay")] = late - 0.008  # what a late reading looks like at this joint alone
        windows = coupled_windows(runs, simulation, true)
        errors.append([float(np.std(joint_errors(*each)[0])) for each in zip(windows, true, strict=True)])
    assert errors[1][0] < 0.8 * errors[0][0]
    assert errors[1][1] < 1.05 * errors[0][1]


def test_friction_of_a_loaded_gear_counts_what_accelerates_the_link(soft: Path) -> None:
    recording = load_motion_recording(soft)
    windows = make_windows(recording.with_role("identify"), read_servo_simulation(recording))[0]
    still = {name: np.zeros_like(getattr(windows, name)) for name in ("load", "slope", "measured")}
    inertia, limit, share = 0.02, 1.0, 0.25
    pushed = replace(
        windows,
        **still,
        inertia=np.full_like(windows.inertia, inertia),
        first_velocity=np.zeros(windows.count),
        command=np.full_like(windows.command, 1e6),
    )
    values = NEUTRAL.copy()
    values[[place("kp"), place("limit"), place("load_friction"), place("armature")]] = 1.0, limit, share, 0.01
    time = windows.step_s * (windows.row + windows.fraction)
    expected = 0.5 * limit / (inertia * (1 + share) + 0.01) * time**2
    moved = time > 0.1
    np.testing.assert_allclose(replay_joint(pushed, values)[0][moved], expected[moved], rtol=0.03)


def test_an_unstated_drive_that_integrates_is_recognised(soft: Path) -> None:
    recording = load_motion_recording(soft)
    windows = make_windows(recording.with_role("identify"), read_servo_simulation(recording))[0]
    true = NEUTRAL.copy()
    keys: tuple[Key, ...] = ("kp", "damping", "friction", "armature", "ki", "integral_limit")
    true[[place(key) for key in keys]] = 8.0, 0.5, 0.05, 0.01, 20.0, 0.6
    replayed = replay_joint(windows, true)[0]
    windows = replace(windows, position=np.round(replayed / 1e-4) * 1e-4)
    nominal = NEUTRAL.copy()
    nominal[[place("kp"), place("ki"), place("ki_speed"), place("integral_limit")]] = np.nan
    nominal[place("armature")] = 0.01
    chosen = choose_servo(windows, nominal, 20)
    assert chosen.fit.values[place("kp")] == pytest.approx(8.0, rel=0.02)
    assert chosen.fit.values[place("ki")] == pytest.approx(20.0, rel=0.05)
    stated = np.where(np.isnan(nominal), NEUTRAL, nominal)
    stated[place("kp")] = np.nan
    assert choose_servo(windows, stated, 20).fit.values[place("ki")] == 0


def test_an_unstated_cascade_with_an_integral_has_the_part_that_acts_on_the_velocity(soft: Path) -> None:
    recording = load_motion_recording(soft)
    windows = make_windows(recording.with_role("identify"), read_servo_simulation(recording))[0]
    keys: tuple[Key, ...] = ("kp", "kd", "friction", "armature", "limit", "ki", "ki_speed", "integral_limit")
    position_gain, speed_gain, speed_integral = 12.0, 0.6, 0.8
    kp = position_gain * speed_gain + speed_integral
    true, nominal = NEUTRAL.copy(), NEUTRAL.copy()
    nominal[[place("friction"), place("armature")]] = 0.05, 0.01
    nominal[[place("kp"), place("ki"), place("ki_speed"), place("integral_limit")]] = np.nan
    true[[place(key) for key in keys]] = (
        *(kp, speed_gain, 0.05, 0.01, 1.2),
        *(position_gain * speed_integral, speed_integral, 0.4),
    )
    windows = replace(windows, position=np.round(replay_joint(windows, true)[0] / 1e-4) * 1e-4)
    fitted = choose_servo(windows, nominal, 20).fit.values
    assert fitted[place("kp")] == pytest.approx(kp, rel=0.02)
    assert fitted[place("kd")] == pytest.approx(speed_gain, rel=0.05)
    assert fitted[place("ki_speed")] / fitted[place("ki")] == pytest.approx(1 / position_gain, rel=0.1)


@pytest.mark.parametrize(("friction", "made"), [(0.08, True), (0.06, True), (0.2, False)])
def test_less_friction_is_no_finding_where_steps_of_the_encoder_make_it(
    soft: Path, friction: float, made: bool
) -> None:
    recording = load_motion_recording(soft)
    windows = make_windows(recording.with_role("identify"), read_servo_simulation(recording))[0]
    keys: tuple[Key, ...] = ("kp", "damping", "friction", "armature")
    base, step = NEUTRAL.copy(), 2 * np.pi / 256
    base[[place(key) for key in keys]] = 30.0, 1.0, 0.08, 0.01
    true = base.copy()
    true[place("friction")] = friction
    read = replay_joint(replace(windows, encoder_step=step), true, reads_steps=True)[0]
    windows = replace(windows, encoder_step=step, position=np.rint(read / step) * step)
    fit = fit_servo(windows, true, np.array(USUAL))
    print(f"friction {friction}, fitted {fit.values[place('friction')]:.3g} N m")
    assert is_made_by_encoder_steps(windows, fit, place("friction"), base) == made
    np.testing.assert_array_equal(
        fit.values[~fit.free], true[~fit.free]
    )  # exactly, so that an infinite limit stays infinite
    assert not is_made_by_encoder_steps(replace(windows, encoder_step=0.0), fit, place("friction"), base)


@pytest.mark.parametrize(("steps", "made"), [(0.0, True), (1.0, False), (3.0, False)])
def test_steps_of_the_encoder_make_no_dead_band_that_is_there(soft: Path, steps: float, made: bool) -> None:
    recording = load_motion_recording(soft)
    windows = make_windows(recording.with_role("identify"), read_servo_simulation(recording))[0]
    keys: tuple[Key, ...] = ("kp", "damping", "friction", "armature")
    base, step = NEUTRAL.copy(), 2 * np.pi / 256
    base[[place(key) for key in keys]] = 30.0, 1.0, 0.08, 0.01
    true = base.copy()
    true[place("dead_band")] = steps * step
    read = replay_joint(replace(windows, encoder_step=step), true, reads_steps=True)[0]
    windows = replace(windows, encoder_step=step, position=np.rint(read / step) * step)
    start, free = true.copy(), np.array(USUAL)
    start[place("dead_band")], free[place("dead_band")] = max(steps, 0.5) * step, True
    fit = fit_servo(windows, start, free)
    assert fit.values[place("dead_band")] == pytest.approx(steps * step, abs=0.2 * step)
    assert is_made_by_encoder_steps(windows, fit, place("dead_band"), base) == made


@pytest.mark.parametrize("limit", [0.6, 0.8, 1.2, 2.0])
def test_an_unstated_drive_that_pushes_fully_has_kd_beside_its_limit(soft: Path, limit: float) -> None:
    recording = load_motion_recording(soft)
    runs, simulation = recording.with_role("identify"), read_servo_simulation(recording)
    keys: tuple[Key, ...] = ("kp", "kd", "damping", "friction", "armature", "limit")
    true, nominal = NEUTRAL.copy(), NEUTRAL.copy()
    true[[place(key) for key in keys]] = 8.0, 0.4, 0.1, 0.05, 0.01, limit
    nominal[[place(key) for key in ("damping", "friction", "armature")]] = 0.1, 0.05, 0.01
    nominal[[place("kp"), place("ki"), place("ki_speed"), place("integral_limit")]] = np.nan
    moved = [replace(run, position=replayed_runs(run, simulation, true)) for run in runs]
    windows = make_windows(moved, simulation)[0]
    windows = replace(windows, position=np.round(replay_joint(windows, true)[0] / 1e-4) * 1e-4)
    chosen = choose_servo(windows, nominal, 20)
    found = [place("kp"), place("kd"), place("limit")]
    assert chosen.fit.values[found] == pytest.approx(true[found], rel=0.01)
    assert not chosen.fit.free[place("damping")]


def replayed_runs(run: MotionRun, simulation: ServoSimulation, servo: np.ndarray) -> np.ndarray:
    """Positions (samples, joints) of a run in which each joint alone has one servo, rad."""
    whole = replace(DEFAULT, wanted_windows=1, longest_window_s=np.inf)
    return np.stack([replay_joint(each, servo)[0] for each in make_windows([run], simulation, whole)], axis=1)


def test_another_kd_of_a_known_drive_has_its_own_name_where_its_limit_acts(soft: Path) -> None:
    nominal = strong_servo()
    true = nominal.copy()
    true[place("kd")] = 0.6
    chosen = choose_servo(moved_windows(soft, true), nominal, 20)
    assert list(chosen.gains) == [place("kd")]
    assert chosen.fit.values[place("kd")] == pytest.approx(0.6, rel=0.02)


@pytest.mark.parametrize("slope", [0.02, 0.05])
def test_a_limit_that_falls_with_speed_is_named_alone(soft: Path, slope: float) -> None:
    nominal = strong_servo()
    true = nominal.copy()
    true[place("limit_slope")] = slope
    chosen = choose_servo(moved_windows(soft, true), nominal, 20)
    assert list(chosen.gains) == [place("limit_slope")]
    assert chosen.fit.values[place("limit_slope")] == pytest.approx(slope, rel=0.1)


def test_windows_where_no_limit_acts_refute_a_gain_that_a_limit_makes(soft: Path) -> None:
    nominal, spoilt, true = (strong_servo(4.0) for _ in range(3))
    true[place("limit")] = 3.0
    windows = moved_windows(soft, true)
    free = np.array(USUAL)
    spoilt[place("kp")] = 7.5
    odd, gain = np.zeros(0, dtype=np.intp), GainOfNumber(0.5, 0.02, 1e-9, 2e-3, 1e-3)
    wrong = ChosenServo(nominal, fit_servo(windows, spoilt, free), free, {place("kp"): gain}, odd, cost=0.0)
    confirmed = confirm_in_calm_windows(windows, wrong, 20)
    assert 0 < len(find_calm_windows(windows, nominal[None])) < windows.count
    assert list(confirmed.gains) == [place("limit")]
    assert confirmed.fit.values[place("limit")] == pytest.approx(3.0, rel=0.02)


def test_windows_where_no_limit_acts_keep_a_gain_that_is_true(soft: Path) -> None:
    nominal, true = strong_servo(4.0), strong_servo(4.0)
    true[place("kp")] = 7.5
    windows = moved_windows(soft, true)
    chosen = choose_servo(windows, nominal, 20)
    assert confirm_in_calm_windows(windows, chosen, 20) is chosen
    assert list(chosen.gains) == [place("kp")]


def test_a_finding_alone_keeps_its_kd_and_its_stribeck_speed(soft: Path) -> None:
    nominal, true = strong_servo(100.0), strong_servo(100.0)
    true[[place("kd"), place("static_excess"), place("stribeck_speed")]] = 0.6, 0.05, 0.03
    windows = moved_windows(soft, true)
    free, odd = np.zeros(len(nominal), dtype=bool), np.zeros(0, dtype=np.intp)
    free[[place("damping"), place("static_excess")]] = True
    outside = true.copy()
    outside[[place("kd"), place("damping")]] = 0.4, 0.3
    gains = dict.fromkeys(np.flatnonzero(free).tolist(), GainOfNumber(0.5, 0.02, 1e-9, 2e-3, 1e-3))
    inside = ChosenServo(nominal, fit_servo(windows, outside, free), free, gains, odd, cost=0.0).with_damping_inside()
    assert inside is not None
    damped = inside.with_one_finding(place("damping"), windows).fit.values
    assert (damped[place("damping")], damped[place("static_excess")]) == (0.1, 0.0)
    assert damped[place("kd")] == pytest.approx(0.6, rel=0.2)
    sticking = inside.with_one_finding(place("static_excess"), windows).fit.values
    assert (sticking[place("kd")], sticking[place("stribeck_speed")]) == (0.4, 0.03)


def test_a_limit_falls_with_speed_where_the_drive_does_work_and_not_where_it_brakes(soft: Path) -> None:
    """Against the closed form of a push: m v' = limit - slope v forwards, m v' = limit backwards."""
    recording = load_motion_recording(soft)
    windows = make_windows(recording.with_role("identify")[:1], read_servo_simulation(recording))[0]
    windows = windows.select(np.array([0]))
    limit, slope, mass, first = 0.5, 0.2, 0.02, -2.0
    servo = NEUTRAL.copy()
    servo[[place("kp"), place("limit"), place("limit_slope")]] = 1.0, limit, slope
    nothing = np.zeros_like(windows.load)
    pushed = replace(
        windows,
        command=np.full_like(windows.command, 1e3),
        inertia=np.full_like(windows.inertia, mass),
        load=nothing,
        slope=nothing,
        measured=nothing,
        first_velocity=np.array([first]),
    )
    time = windows.step_s * (windows.row + windows.fraction)
    turned = -first * mass / limit  # when it stops going backwards
    back = np.minimum(time, turned)
    after = np.maximum(time - turned, 0.0)
    settling = mass / slope
    forwards = limit / slope * (after - settling * (1 - np.exp(-after / settling)))
    expected = first * back + 0.5 * limit / mass * back**2 + forwards
    np.testing.assert_allclose(replay_joint(pushed, servo)[0], expected, atol=2e-4)


def strong_servo(limit: float = 0.5) -> np.ndarray:
    """Numbers (parameters,) of a servo whose torque limit, N m, acts now and then."""
    keys: tuple[Key, ...] = ("kp", "kd", "damping", "friction", "armature", "limit")
    servo = NEUTRAL.copy()
    servo[[place(key) for key in keys]] = 8.0, 0.4, 0.1, 0.1, 0.01, limit
    return servo


def moved_windows(soft: Path, servo: np.ndarray) -> Windows:
    """Windows of the first joint, as it moves with a servo, read in steps of 0.1 mrad."""
    recording = load_motion_recording(soft)
    windows = make_windows(recording.with_role("identify"), read_servo_simulation(recording))[0]
    return replace(windows, position=np.round(replay_joint(windows, servo)[0] / 1e-4) * 1e-4)


def test_drives_that_hold_commands_share_the_phase_that_explains_all_joints(soft: Path) -> None:
    recording = load_motion_recording(soft)
    run, simulation = recording.with_role("identify")[0], read_servo_simulation(recording)
    samples, phase = 5, 3
    tick = np.maximum((np.arange(run.samples) - phase) // samples * samples + phase, 0)
    held = replace(run, reference_position=np.asarray(run.reference_position)[tick])
    true = NEUTRAL.copy()
    true[[place("kp"), place("damping"), place("friction"), place("armature")]] = 8.0, 0.5, 0.05, 0.01
    position = replayed_runs(held, simulation, true)
    far = true.copy()
    far[place("kp")] = 4.0  # alone it would take another phase
    slow = replace(simulation, rate_hz=run.rate_hz / samples)
    taken = hold_commands([replace(run, position=position)], slow, [true, far])[0]
    np.testing.assert_array_equal(taken.reference_position, held.reference_position)


@pytest.mark.parametrize(
    ("key", "value"), [("load_friction", 0.4), ("static_excess", 0.1), ("limit", 0.4), ("armature", 0.03)]
)
def test_one_wrong_number_is_not_explained_by_several_others(soft: Path, key: Key, value: float) -> None:
    recording = load_motion_recording(soft)
    windows = make_windows(recording.with_role("identify"), read_servo_simulation(recording))[0]
    nominal = NEUTRAL.copy()
    known: tuple[Key, ...] = ("kp", "kd", "damping", "friction", "armature", "limit")
    nominal[[place(each) for each in known]] = 8.0, 0.4, 0.1, 0.1, 0.01, 3.0
    true = nominal.copy()
    true[place(key)] = value
    replayed = replay_joint(windows, true)[0]
    chosen = choose_servo(replace(windows, position=np.round(replayed / 1e-4) * 1e-4), nominal, 20)
    assert list(chosen.gains) == [place(key)]
    assert chosen.fit.values[place(key)] == pytest.approx(value, rel=0.02)


def test_a_joint_whose_replay_runs_away_moves_as_measured_for_the_others(soft: Path) -> None:
    recording = load_motion_recording(soft)
    runs, simulation = recording.with_role("identify"), read_servo_simulation(recording)
    true = NEUTRAL.copy()
    true[[place("kp"), place("damping"), place("friction")]] = 8.0, 0.5, 0.1
    wild = true.copy()
    wild[place("damping")] = -50.0
    first, second = coupled_windows(runs, simulation, [true, wild])
    still = coupled_windows(runs, simulation, [true, None])[0]
    np.testing.assert_allclose(first.load, still.load, atol=1e-9)
    assert np.isfinite(joint_errors(second, wild)).all()


def test_a_limit_acts_on_the_command_before_and_after_its_change_within_a_step(soft: Path) -> None:
    recording = load_motion_recording(soft)
    runs, simulation = recording.with_role("identify"), read_servo_simulation(recording)
    runs = tuple(
        replace(run, reference_position=np.where(run.time[:, None] % 0.2 < 0.1, 0.5, 0.0) + 0 * run.position)
        for run in runs
    )
    true = NEUTRAL.copy()
    true[[place("kp"), place("damping"), place("friction"), place("limit")]] = 8.0, 0.5, 0.1, 1.0
    for delay in (0.0207, 0.0203):
        true[place("delay")] = delay
        paths = [
            replay_joint(make_windows(runs, simulation, replace(DEFAULT, longest_step_s=step))[0], true)[0]
            for step in (DEFAULT.longest_step_s, DEFAULT.longest_step_s / 20)
        ]
        assert np.sqrt(np.mean((paths[0] - paths[1]) ** 2)) < 0.002 * np.std(paths[1])


def fit_first_joint(folder: Path) -> tuple[Windows, ServoFit]:
    recording = load_motion_recording(folder)
    windows = make_windows(recording.with_role("identify"), read_servo_simulation(recording))[0]
    start = NEUTRAL.copy()
    start[[place("kp"), place("damping"), place("friction"), place("delay")]] = 8.0, 0.5, 0.1, 0.0203
    fit = fit_servo(windows, start, np.array(USUAL))
    return windows, fit


def test_a_mass_that_all_joints_tell_is_no_rival_at_one_joint(soft: Path) -> None:
    windows, fit = fit_first_joint(soft)
    tuning = replace(DEFAULT, class_factor=1.01)
    rivals = [
        {each for own in confused_parameters(windows, fit, error, tuning).values() for each in own}
        for error in (np.inf, 1e3, 1e-9)
    ]
    assert place("payload") in rivals[0]
    assert rivals[1] == rivals[0]
    assert rivals[2] == rivals[0] - {place("payload")}


def test_a_limit_that_was_free_and_never_acts_has_no_rivals(soft: Path) -> None:
    windows, fit = fit_first_joint(soft)
    free = fit.free.copy()
    free[place("limit")] = True
    assert confused_parameters(windows, replace(fit, free=free)).keys() == confused_parameters(windows, fit).keys()


def test_windows_that_are_replayed_together_do_not_touch_each_other(soft: Path) -> None:
    recording = load_motion_recording(soft)
    windows = make_windows(recording.with_role("identify"), read_servo_simulation(recording))[0]
    values = np.stack([NEUTRAL, NEUTRAL])
    values[:, [place("kp"), place("damping"), place("friction"), place("delay")]] = 8.0, 0.5, 0.1, 0.0203
    values[1, [place("limit"), place("dead_band"), place("payload")]] = 0.5, 0.01, 0.1
    alone = [replay_joint(windows.select(np.array([window])), values) for window in range(windows.count)]
    np.testing.assert_array_equal(np.concatenate(alone, axis=1), replay_joint(windows, values))


def test_an_integral_at_the_start_of_a_run_is_settled_where_it_is_judged(soft: Path) -> None:
    recording = load_motion_recording(soft)
    windows = make_windows(recording.with_role("identify"), read_servo_simulation(recording))[0]
    values = NEUTRAL.copy()
    values[[place("kp"), place("damping"), place("ki")]] = 8.0, 0.5, 1.0
    loaded = windows.with_integral(np.array([0.2, -0.2]))
    windows = replace(windows, position=replay_joint(loaded, values)[0])
    halves = windows.select(np.flatnonzero(windows.run == 0)), windows.select(np.flatnonzero(windows.run == 1))
    errors = learned_errors(halves, values, np.zeros(len(values), dtype=bool), MotionTuning())
    assert np.sqrt(np.mean(errors**2)) < 1e-5


def test_mujoco_replays_its_own_recording_down_to_the_encoder(soft: Path) -> None:
    recording = load_motion_recording(soft)
    simulation = read_servo_simulation(recording)
    true = np.tile(NEUTRAL, (2, 1))
    true[:, [place("kp"), place("damping"), place("friction"), place("armature")]] = 8.0, 0.5, 0.1, 0.01
    true[:, [place("limit"), place("delay")]] = 3.0, 0.02
    replayed = replay(simulation, Servos(true), recording.with_role("validate"))
    assert joint_rms(replayed).max() < 2e-3
    banded = true.copy()
    banded[:, place("dead_band")] = 1e-12  # the same law, step by step
    again = replay(simulation, Servos(banded), recording.with_role("validate"))
    np.testing.assert_allclose(again[0].position, replayed[0].position, atol=1e-8)


def test_the_exported_mjcf_replays_as_the_found_servos(diagnosis: MotionDiagnosis, tmp_path: Path) -> None:
    assert diagnosis.servos is not None
    values = diagnosis.servos.values.copy()
    values[:, place("delay")] = 0.0
    path = tmp_path / "found.xml"
    path.write_text(mjcf_text(diagnosis.simulation, Servos(values))[0])
    model = mujoco.MjModel.from_xml_path(str(path))
    command = commands(7, 8.0)
    ours = simulate(path.read_text(), command)
    recording = load_motion_recording(diagnosis.recording.folder)
    run = recording.runs[0]
    time = np.arange(len(command)) / RATE_HZ
    again = replay(
        diagnosis.simulation,
        Servos(values),
        [run.with_signals(time, {"position": ours, "reference_position": command, **rest(run, len(command))})],
    )
    assert np.abs(again[0].error[50:]).max() < 1e-3  # both start apart by the speed that an encoder gives
    assert model.actuator_gainprm[0, 0] == pytest.approx(float(diagnosis.servos.get("kp")[0]), rel=1e-5)
    delayed = mujoco.MjModel.from_xml_string(mjcf_text(diagnosis.simulation, diagnosis.servos)[0])
    np.testing.assert_allclose(delayed.actuator_delay, diagnosis.servos.get("delay"), rtol=1e-5)


def rest(run: MotionRun, count: int) -> dict[str, np.ndarray]:
    """The other signals of a run, cut to a length."""
    return {name: each[:count] for name, each in run.signals.items() if name not in ("position", "reference_position")}


def test_verdict_model_simulation_and_page_are_written(diagnosis: MotionDiagnosis, tmp_path: Path) -> None:
    texts = motion_texts(diagnosis, tmp_path) | {"report.html": motion_page(diagnosis, "armlab diagnose")}
    write_texts(texts, tmp_path)
    verdict = read_verdict_file(tmp_path / "verdict.json")
    assert verdict.status == "mismatch"
    assert verdict.fit[0].replay_rms_after is not None
    assert len(verdict.summary.split(". ")[0].split()) <= 30
    assert verdict.story is not None
    assert sum(each.share_of_gap for each in verdict.story) == pytest.approx(1.0)
    assert len(read_model(tmp_path / "model.yaml").effects) >= 4
    assert "<svg" in texts["report.html"]
    assert "DelayedPDActuatorCfg" in texts["isaaclab_actuators.py"]
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "simulation.xml")).nu == 2
    assert any("mrad" in line for line in motion_lines(diagnosis))


def test_joints_are_counted_as_in_the_robot_whatever_the_order_of_the_columns(tmp_path: Path) -> None:
    columns = {"time": "t", "reference_position": ["c2", "c1"], "position": ["q2", "q1"]}
    order = {"joints": ["elbow", "shoulder"], "columns": columns}
    folder = write_recording(tmp_path / "other", seconds=SECONDS, counts=COARSE, **order)
    text = (folder / "arm.xml").read_text()
    (folder / "arm.xml").write_text(text.replace('<position name="elbow"', '<position name="elbow" kp="30"'))
    result = diagnose_motion(load_motion_recording(folder))
    verdict = make_motion_verdict(result)
    (gain,) = (each for each in verdict.findings if each.form == "kp")
    assert (gain.joint, gain.parameters["kp"].value) == (2, pytest.approx(60.0, rel=0.05))
    assert all(each.joint == 2 and each.equation.startswith("tau_2 ") for each in verdict.findings)
    assert ([each.joint for each in verdict.located], [each.joint for each in verdict.fit]) == ([2], [2, 1])
    assert "at elbow" in verdict.summary
    assert joint_table(result).rows[0][0] == "2\N{NO-BREAK SPACE}elbow"


def test_the_command_says_why_nothing_can_be_said(tmp_path: Path) -> None:
    folder = write_recording(tmp_path / "still", {"kp": 40.0}, seconds=4.0)
    for path in folder.glob("*.csv"):
        pd.read_csv(path).assign(q1=0.1, q2=0.1, c1=0.1, c2=0.1).to_csv(path, index=False)
    result = CliRunner().invoke(main, ["diagnose", str(folder), "--out", str(tmp_path / "out")])
    assert result.exit_code == 0, result.output
    assert "INCONCLUSIVE: Nothing can be said: no joint moves" in result.output
    assert json.loads((tmp_path / "out" / "verdict.json").read_text())["status"] == "inconclusive"


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (lambda table: table.assign(c1=np.degrees(table["c1"]), c2=np.degrees(table["c2"])), "degrees for radians"),
        (lambda table: table.assign(c1=table["c1"] * 4096 / (2 * np.pi)), "counts of 4096 a turn for radians"),
        (lambda table: table.rename(columns={"c1": "c2", "c2": "c1"}), "exchanged columns"),
        (lambda table: table.assign(c1=0.1, c2=0.1, q1=0.1, q2=0.1), "no joint moves"),
        (lambda table: table.assign(q1=table["c1"].cumsum() / 50, q2=table["c2"].cumsum() / 50), "no joint follows"),
        (lambda table: table.assign(q1=np.sin(table["t"] * 1.7), q2=np.cos(table["t"] * 2.9)), "no joint follows"),
    ],
)
def test_bad_input_is_inconclusive_with_a_reason_in_one_line(tmp_path: Path, damage: object, reason: str) -> None:
    folder = write_recording(tmp_path / "bad", {"kp": 40.0}, seconds=3.0)
    for path in folder.glob("*.csv"):
        damage(pd.read_csv(path)).to_csv(path, index=False)
    result = diagnose_motion(load_motion_recording(folder))
    assert result.status == "inconclusive"
    assert reason in make_motion_verdict(result).summary
    assert "\n" not in result.reason


def test_an_integral_that_acts_on_more_velocity_than_kp_holds_is_refused(tmp_path: Path) -> None:
    controller = {"type": "pd", "kp": [8.0, 8.0], "kd": [0.0, 0.0], "ki": [1.0, 1.0], "ki_speed": [0.5, 8.0]}
    folder = write_recording(tmp_path / "cascade", {}, seconds=4.0, controller=controller)
    result = CliRunner().invoke(main, ["diagnose", str(folder), "--out", str(tmp_path / "out")])
    assert result.exit_code != 0
    assert "controller.ki_speed" in result.output
    assert "less than kp" in result.output


def test_the_step_follows_the_error_that_it_makes(soft: Path, diagnosis: MotionDiagnosis) -> None:
    simulation = read_servo_simulation(load_motion_recording(soft))
    runs = load_motion_recording(soft).with_role("identify")
    starts = [None if each is None else each.fit.values for each in diagnosis.chosen]
    windows = coupled_windows(runs, simulation, starts)

    def longest(share: float) -> float:
        tuning = replace(DEFAULT, max_step_error=share)
        fit = ArmFit(runs, simulation, starts, windows, list(diagnosis.chosen), tuning)
        return fine_enough(fit).longest_step_s

    steps = [longest(share) for share in (1e3, 0.05, 0.02, 0.01, 1e-9)]
    print(f"steps, ms: {[round(1e3 * each, 3) for each in steps]}")
    assert steps == sorted(steps, reverse=True)
    assert (steps[0], steps[-1]) == (DEFAULT.longest_step_s, DEFAULT.shortest_step_s)


def test_a_controller_that_the_replay_lacks_is_refused(tmp_path: Path) -> None:
    controller = {"type": "pd", "kp": [8.0, 8.0], "kd": [0.0, 0.0], "velocity_filter_hz": 20.0}
    folder = write_recording(tmp_path / "filtered", {}, seconds=4.0, controller=controller)
    result = CliRunner().invoke(main, ["diagnose", str(folder), "--out", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert "controller.velocity_filter_hz" in result.output


def test_a_limit_that_rises_with_speed_is_refused(tmp_path: Path) -> None:
    controller = {"type": "pd", "kp": [8.0, 8.0], "kd": [0.0, 0.0], "limit_slope": [0.1, -0.1]}
    folder = write_recording(tmp_path / "rising", {}, seconds=4.0, controller=controller)
    result = CliRunner().invoke(main, ["diagnose", str(folder), "--out", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert "controller.limit_slope" in result.output


def test_a_payload_at_the_tool_loads_arm_and_model_alike(soft: Path) -> None:
    simulation = read_servo_simulation(load_motion_recording(soft)).with_payload(0.15)
    model, position = simulation.model(), np.array([[0.4, -0.3]])
    data = mujoco.MjData(model)
    data.qpos[:] = position[0]
    mujoco.mj_forward(model, data)
    still = np.zeros_like(position)
    np.testing.assert_allclose(
        rigid_body_torque(simulation.arm, Motion(position, still, still))[0], data.qfrc_bias, rtol=1e-6
    )
    assert sum(model.body_mass) == pytest.approx(0.65)
    assert not simulation.with_payload(-1.0).is_physical()


def test_a_mass_is_refused_by_replays_that_are_worse_with_short_steps_too(diagnosis: MotionDiagnosis) -> None:
    assert diagnosis.servos is not None
    off = tuple(replace(each, position=each.position + 0.1) for each in diagnosis.replayed_after)
    assert replays_as_well(replace(diagnosis, replayed_after=off), diagnosis, DEFAULT)
    stiffer = Servos(diagnosis.servos.values.copy())
    stiffer.values[:, place("kp")] *= 2
    worse = replace(diagnosis, replayed_after=off, servos=stiffer)
    assert not replays_as_well(worse, diagnosis, DEFAULT)
    rise = 1e-6 * (10 + np.arange(len(diagnosis.replayed_alone)))[:, None]
    assert replays_as_well(worse, replace(diagnosis, replayed_alone=diagnosis.replayed_alone + rise), DEFAULT)
    assert not replays_as_well(worse, replace(diagnosis, replayed_alone=diagnosis.replayed_alone - rise), DEFAULT)
    assert not replays_as_well(replace(worse, servos=None), diagnosis, DEFAULT)


def test_a_joint_that_does_not_carry_the_tool_says_nothing_of_a_mass_there(soft: Path) -> None:
    recording = load_motion_recording(soft)
    windows = make_windows(recording.with_role("identify"), read_servo_simulation(recording))[1]
    values, free = NEUTRAL.copy(), np.zeros(len(NEUTRAL), dtype=bool)
    values[place("kp")] = TRUTH["kp"]
    carrying = JointModel(windows, values, free)
    rounding = 1e-18 * np.ones_like(windows.unit_load)
    upright = JointModel(replace(windows, unit_load=rounding, unit_inertia=rounding), values, free)
    alone = estimate_shared(TOOL_MASS, [carrying], DEFAULT)
    assert alone[1] > 1e-6
    assert estimate_shared(TOOL_MASS, [upright, carrying], DEFAULT) == alone
    assert estimate_shared(TOOL_MASS, [upright], DEFAULT) == (0.0, np.inf)


def test_a_delay_that_no_joint_has_of_its_own_is_one_number_of_all(tmp_path: Path) -> None:
    folder = write_recording(tmp_path / "late", {"delay": 0.006}, seconds=10.0, counts=COARSE)
    recording = load_motion_recording(folder)
    runs, simulation = recording.with_role("identify"), read_servo_simulation(recording)
    start = simulation.nominal.values.copy()
    start[:, COMMON_DELAY.place] = 0.006
    fit = fit_arm(lambda servos: runs, simulation, list(start), lambda message: None)
    assert weigh(COMMON_DELAY, lambda servos: runs, fit, lambda message: None) is None  # each joint has its own
    chosen = [
        None if each is None else each.without(COMMON_DELAY.place, windows)
        for each, windows in zip(fit.chosen, fit.windows, strict=True)
    ]
    found = weigh(COMMON_DELAY, lambda servos: runs, replace(fit, chosen=chosen), lambda message: None)
    assert found is not None
    late, shared = found
    assert shared.simulation.delay == pytest.approx(0.006, abs=1e-3)
    np.testing.assert_allclose(late.simulation.nominal.get("delay"), late.simulation.delay)
    assert not any(COMMON_DELAY.place in each.gains for each in late.chosen if each is not None)


def test_a_delay_of_all_commands_is_named_at_each_joint_of_coarse_encoders(tmp_path: Path) -> None:
    folder = write_recording(tmp_path / "late", {"delay": 0.006}, seconds=10.0)
    coarse = 2 * np.pi / 256
    for file in folder.glob("run-*.csv"):
        table = pd.read_csv(file)
        table[["q1", "q2"]] = np.round(table[["q1", "q2"]] / coarse) * coarse
        table.to_csv(file, index=False)
    found = diagnose_motion(load_motion_recording(folder))
    assert [(each.effect, each.joint) for each in found.findings] == [("command_delay", 1), ("command_delay", 2)]
    assert all(each.interval[0] < 0.006 < each.interval[1] for each in found.findings)
    assert np.all(found.simulation.nominal.get("delay") == 0)
    assert found.simulation.delay == 0


def test_joints_that_do_not_agree_make_a_shared_number_uncertain(soft: Path) -> None:
    recording = load_motion_recording(soft)
    windows = make_windows(recording.with_role("identify"), read_servo_simulation(recording))[1]
    values, free = NEUTRAL.copy(), np.zeros(len(NEUTRAL), dtype=bool)
    values[place("kp")] = TRUTH["kp"]
    joint = JointModel(windows, values, free)
    alike = estimate_shared(COMMON_DELAY, [joint, joint], DEFAULT)
    apart = [joint.with_more(COMMON_DELAY.place, more) for more in (-0.004, 0.004)]
    assert estimate_shared(COMMON_DELAY, apart, DEFAULT)[1] > 2 * alike[1]


def test_an_arm_text_has_the_numbers_that_it_is_given() -> None:
    model = mujoco.MjModel.from_xml_string(arm_text(kp=7.0))
    assert model.actuator_gainprm[0, 0] == 7.0
