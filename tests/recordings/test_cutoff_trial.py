"""The cut-off of an identification by what it predicts on blocks of the runs that identify."""

from dataclasses import replace

import numpy as np
import pytest

from armlab.common.errors import DataError
from armlab.recordings.cutoff_trial import BLOCKS, HARMONICS_JUDGED, HeldOutBlocks, choose_cutoff_hz
from armlab.recordings.plain_least_squares import suggested_cutoff_hz
from armlab.recordings.recording import Run
from problem.presets import load_arm

ARM = load_arm("irb120-arm")
RATE_HZ = 500.0


def run_with_vibration(amplitude: float) -> Run:
    """Motion of about 1 Hz behind encoders of no noise, friction, and torque that vibrates with the arm at 60 Hz."""
    time = np.arange(0, 12, 1 / RATE_HZ)
    rng = np.random.default_rng(0)
    waves = [(0.4, rate, phase) for rate, phase in zip((0.5, 0.8, 1.1), rng.uniform(0, 6, 3), strict=True)]
    slow = np.column_stack([a * np.sin(2 * np.pi * f * time + p) for a, f, p in waves])
    fast = amplitude * np.sin(2 * np.pi * 60 * time)[:, None] * np.ones(3)
    speed = np.gradient(slow, 1 / RATE_HZ, axis=0)
    torque = 2.0 * np.sign(speed) + 1.5 * speed + 3.0 * np.gradient(speed, 1 / RATE_HZ, axis=0)
    torque = torque + 0.2 * rng.standard_normal(torque.shape)
    return Run("run.csv", "identify", time, slow + fast, torque=torque)


def test_vibrations_that_the_torque_does_not_follow_are_filtered_away() -> None:
    shaken = run_with_vibration(1e-3)
    assert suggested_cutoff_hz([shaken]) > 60
    assert choose_cutoff_hz(ARM, [shaken]) < 40


def test_vibrations_above_the_motion_do_not_hide_what_models_differ_in_below() -> None:
    quiet = run_with_vibration(0.0)
    shaking = 5.0 * np.sin(2 * np.pi * 40 * quiet.time)[:, None]
    held_out = HeldOutBlocks.of([replace(quiet, torque=quiet.torque + shaking)])
    speed = np.gradient(held_out.runs[0].position, 1 / RATE_HZ, axis=0)
    rest = 2.0 * np.sign(speed) + 3.0 * np.gradient(speed, 1 / RATE_HZ, axis=0)
    models = [rest + slope * speed for slope in (1.5, 0.0)]
    right, wrong = (held_out.scores(lambda number, place, part, torque=torque: torque[part]) for torque in models)
    assert np.all(wrong > right + 0.05)


def test_cutoffs_are_tried_from_the_harmonics_of_the_travel_down_to_ten_periods_of_the_longest_run() -> None:
    tried = HeldOutBlocks.of([run_with_vibration(0.0)]).low_passes_hz
    assert tried[0] == pytest.approx(HARMONICS_JUDGED * 1.1, rel=0.1)
    assert 10 / 12 <= tried[-1] < 2 * 10 / 12


def test_cutoffs_go_on_upwards_as_far_as_the_rate_carries_and_no_further_than_asked() -> None:
    tried = HeldOutBlocks.of([run_with_vibration(0.0)])
    top = tried.low_passes_hz[0]
    assert tried.up_to(1.9 * top) is tried
    assert tried.up_to(2 * top).low_passes_hz == (2 * top, *tried.low_passes_hz)
    assert tried.up_to(1e6).low_passes_hz[0] <= 0.4 * RATE_HZ < 2 * tried.up_to(1e6).low_passes_hz[0]


def test_slow_travel_that_starts_sharply_asks_for_higher_cutoffs() -> None:
    time = np.arange(0, 24, 1 / RATE_HZ)
    speed = np.column_stack([np.clip(20 * np.sin(2 * np.pi * time / period), -1, 1) for period in (4.0, 3.1, 4.7)])
    position, change = np.cumsum(speed, axis=0) / RATE_HZ, np.gradient(speed, 1 / RATE_HZ, axis=0)
    noise = 0.05 * np.random.default_rng(0).standard_normal(speed.shape)
    run = Run("run.csv", "identify", time, position, torque=3.0 * change + 1.5 * speed + noise)
    assert choose_cutoff_hz(ARM, [run]) > HeldOutBlocks.of([run]).low_passes_hz[0]


def test_a_run_that_stands_most_of_the_time_is_cut_into_blocks_that_all_move() -> None:
    moving = run_with_vibration(0.0)
    time = np.arange(0, 60, 1 / RATE_HZ)
    held = [
        np.pad(each, ((0, len(time) - len(each)), (0, 0)), mode="edge") for each in (moving.position, moving.torque)
    ]
    run = Run("run.csv", "identify", time, held[0], torque=held[1])
    assert HeldOutBlocks.of([run]).numbers == list(range(BLOCKS))
    assert choose_cutoff_hz(ARM, [run]) < 60


def test_without_a_run_there_is_no_cutoff() -> None:
    with pytest.raises(DataError, match="no run identifies"):
        choose_cutoff_hz(ARM, [])


def test_an_arm_that_stands_has_no_cutoff() -> None:
    time = np.arange(0, 4, 1 / RATE_HZ)
    run = Run("run.csv", "identify", time, np.zeros((len(time), 3)), torque=np.ones((len(time), 3)))
    with pytest.raises(DataError, match="move too little"):
        choose_cutoff_hz(ARM, [run])
