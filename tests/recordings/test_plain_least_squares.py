"""The yardstick: what plain least squares finds and leaves, on exact motions, and as stated for real recordings."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose
from recording_folders import ARM, folder_with, frame, motion_at

from armlab.common.arrays import Array
from armlab.common.errors import DataError
from armlab.recordings.motion import MotionRecording
from armlab.recordings.plain_least_squares import (
    compare_plain,
    fit_plain,
    fit_plain_recording,
    runs_of_motion,
    split_runs,
)
from armlab.recordings.public import LOCAL_COPIES_VARIABLE, local_copies
from armlab.recordings.recording import MotionRun, Run, Transmission
from armlab.recordings.recording_file import ControllerEntry
from problem.regressor import rigid_body_torque

MAX_PERCENT_APART = 0.25  # of torque: what another resampling and other frames of the links change


def exact_run(role: str = "identify", seconds: float = 8.0, seed: int = 0) -> Run:
    """Rigid links, 2 N m of Coulomb friction at joint 2, 0.5 N m s/rad, an offset of 0.3 N m; no noise."""
    time = np.arange(0, seconds, 0.005)
    motion = motion_at(time, seed)
    torque = rigid_body_torque(ARM, motion) + 0.5 * motion.velocity + 0.3
    torque[:, 1] += 2 * np.tanh(motion.velocity[:, 1] / 0.02)
    return Run("run.csv", role, time, motion.position, torque=torque)  # type: ignore[arg-type]


def test_friction_and_offset_are_found_and_little_is_left() -> None:
    fit = fit_plain(ARM, [exact_run(), exact_run("validate", seed=1)], 20.0)
    assert_allclose(fit.value("coulomb", 2), 2.0, atol=0.05)
    assert_allclose(fit.value("coulomb", 3), 0.0, atol=0.02)
    assert_allclose([fit.value("viscous", joint) for joint in (1, 2, 3)], 0.5, atol=0.05)
    assert_allclose(fit.value("offset", 1), 0.3, atol=0.02)
    assert np.all(fit.percent[[0, 2]] < 0.1)  # joint 2 keeps what the filter rounds off the jumps of its torque


def test_friction_that_grew_is_seen_beyond_eight_standard_errors_and_nothing_else_is() -> None:
    noise = np.random.default_rng(0)
    runs = [exact_run(seed=seed) for seed in range(6)]
    noisy = [
        run.with_signals(run.time, {"torque": run.torque + noise.normal(0, 0.5, run.torque.shape)}) for run in runs
    ]
    old, new = noisy[:3], noisy[3:]
    drags = [0.5 * np.tanh(_speed(run) / 0.02) for run in new]
    grown = [
        run.with_signals(run.time, {"torque": run.torque + np.outer(drag, [0, 1, 0])})
        for run, drag in zip(new, drags, strict=True)
    ]
    same, changed = (compare_plain(ARM, old, each, 10.0) for each in (new, grown))
    assert np.abs(same.in_errors).max() < 8
    place = changed.names.index("coulomb2")
    assert np.argmax(np.abs(changed.in_errors)) == place
    assert changed.in_errors[place] > 8
    assert changed.new[place] - changed.old[place] == pytest.approx(0.5, abs=0.1)


def _speed(run: Run) -> Array:
    return np.gradient(run.position[:, 1], 0.005)


def test_links_of_the_robot_file_are_not_used() -> None:
    runs = [exact_run(), exact_run("validate", seed=1)]
    known, unknown = (fit_plain(arm, runs, 20.0) for arm in (ARM, replace(ARM, links=None)))
    assert_allclose(known.percent, unknown.percent)


def test_the_last_two_fifths_are_held_out_where_no_run_validates() -> None:
    first, second = split_runs([exact_run(seconds=10.0)])
    assert (first.role, second.role) == ("identify", "validate")
    assert (first.samples, second.samples) == (1200, 800)
    assert second.time[0] == pytest.approx(6.0)
    fit = fit_plain(ARM, [exact_run(seconds=10.0)], 10.0)
    assert fit.held_out[0].rows.time[0] == pytest.approx(6.2, abs=0.006)  # two periods of the cut-off later


def test_held_out_rows_belong_to_their_torque_and_time() -> None:
    fit = fit_plain(ARM, [exact_run(), exact_run("validate", seed=1), exact_run("validate", seed=2)], 10.0)
    assert [len(each.residual) for each in fit.held_out] == [len(each.rows.time) for each in fit.held_out]
    assert fit.residual.shape == fit.torque.shape == (2 * len(fit.held_out[0].residual), 3)
    assert_allclose(fit.percent, 100 * np.linalg.norm(fit.residual, axis=0) / np.linalg.norm(fit.torque, axis=0))


def test_a_run_shorter_than_four_periods_of_the_cutoff_is_refused_in_words() -> None:
    with pytest.raises(DataError, match="no run that validates is longer than 4 periods of 2 Hz"):
        fit_plain(ARM, [exact_run(), exact_run("validate", seconds=1.5)], 2.0)


def test_torque_of_motion_only_is_gain_times_error_and_an_unknown_gain_counts_as_one() -> None:
    position = np.zeros((5, 3))
    run = MotionRun("m.csv", "identify", np.arange(5) / 10, position, reference_position=position + 0.1)
    controller = ControllerEntry(type="pd", kp=(20.0, None, 5.0), kd=(None, None, None))
    side = Transmission(np.eye(3), np.zeros(3), np.eye(3), np.ones(3))
    recording = MotionRecording(Path("folder"), "irb120-arm", ARM, (0, 1, 2), (run,), side, controller)
    (made,) = runs_of_motion(recording)
    assert_allclose(made.torque, np.tile([2.0, 0.1, 0.5], (5, 1)))


def test_a_folder_is_fitted_at_the_cutoff_that_its_positions_suggest(tmp_path: Path) -> None:
    folder = folder_with(tmp_path / "recording", frame(0))
    fit = fit_plain_recording(folder)
    assert 1.0 < fit.cutoff_hz < 80.0
    assert_allclose([fit.value("coulomb", joint) for joint in (1, 2, 3)], 1.0, atol=0.1)


@pytest.mark.skipif(
    not os.environ.get(LOCAL_COPIES_VARIABLE) or not (local_copies() or Path()).joinpath("facts.yaml").is_file(),
    reason=f"{LOCAL_COPIES_VARIABLE} names no folder with facts.yaml",
)
def test_percentages_that_another_program_found_on_real_recordings_are_reproduced() -> None:
    recordings = local_copies() or Path()
    singles = yaml.safe_load((recordings / "facts.yaml").read_text())["singles"]
    stated = {name: facts for name, facts in singles.items() if isinstance(facts.get("percent"), list)}
    assert stated
    for name, facts in stated.items():
        found = fit_plain_recording(recordings / name, facts["low_pass"]).percent
        assert_allclose(found, facts["percent"], rtol=0.012, atol=MAX_PERCENT_APART, err_msg=name)
