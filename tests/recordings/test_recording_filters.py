"""Filters and derivatives: no phase shift, torque and columns alike, a cut-off that the data choose."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from recording_folders import ARM, POSITION, RATE_HZ, TORQUE, frame, motion_at
from scipy.signal import butter, sosfiltfilt

from armlab.recordings.cutoff import choose_cutoff
from armlab.recordings.differentiate import differentiate, resample_evenly
from armlab.recordings.filters import BUTTERWORTH_ORDER, Butterworth
from armlab.recordings.periods import find_period
from armlab.recordings.recording import Run
from problem.regressor import observation_matrix, rigid_body_torque


def run_of(table=None, noise: float = 0.0) -> Run:
    table = frame() if table is None else table
    position = table[POSITION].to_numpy()
    position = position + np.random.default_rng(5).normal(0, noise, position.shape)
    return Run("run.csv", "identify", table["t"].to_numpy(), position, table[TORQUE].to_numpy())


def test_gain_is_one_half_at_the_cut_off_and_there_is_no_phase_shift() -> None:
    time = np.arange(8000) / 1000
    low_pass = Butterworth(1000, 10.0, len(time))
    for frequency in (1.0, 10.0, 40.0):
        wave = np.sin(2 * np.pi * frequency * time)[:, None]
        middle = slice(2000, -2000)
        smooth = low_pass.smooth(wave)
        gain = low_pass.response(np.array([frequency]))[0]
        assert_allclose(smooth[middle], gain * wave[middle], atol=2e-5)
    assert low_pass.response(np.array([10.0]))[0] == pytest.approx(0.5)


@given(cutoff=st.floats(0.5, 60), step=st.integers(1, 7), seed=st.integers(0, 99))
@settings(max_examples=25, deadline=None)
def test_columns_pass_the_very_filter_of_the_torque(cutoff: float, step: int, seed: int) -> None:
    """Torque that is a combination of columns stays the same combination after the filter."""
    run = run_of(frame(seconds=3.0))
    signals = differentiate(run, cutoff_hz=5.0, torque_cutoff_hz=cutoff, step=step)
    matrix = observation_matrix(ARM, signals.motion)
    parameters = np.random.default_rng(seed).normal(size=matrix.shape[1])
    torque = signals.filter((matrix @ parameters).reshape(-1, 3))
    assert_allclose(signals.columns(matrix) @ parameters, torque.ravel(), atol=1e-8)
    assert signals.torque.shape == torque.shape == (len(signals.time), 3)


def test_derivatives_are_those_of_the_motion() -> None:
    signals = differentiate(run_of())
    rows, exact = signals.filter.rows, motion_at(frame()["t"].to_numpy())
    for name in ("position", "velocity", "acceleration"):
        found, wanted = getattr(signals.motion, name)[rows], getattr(exact, name)[rows]
        assert np.abs(found - wanted).max() < 0.01 * np.abs(wanted).max()


def test_a_joint_that_stands_has_no_velocity() -> None:
    run = run_of()
    position = run.position.copy()
    position[:, 1] = 1.234567
    motion = differentiate(replace(run, position=position), cutoff_hz=8.0).motion
    assert not motion.velocity[:, 1].any()
    assert motion.velocity[:, 0].all()


def test_encoder_noise_lowers_the_cut_off_and_the_acceleration_stays_right() -> None:
    clean, noisy = (differentiate(run_of(noise=noise)) for noise in (0.0, 1e-4))
    assert clean.cutoff is not None
    assert noisy.cutoff is not None
    assert noisy.cutoff.cutoff_hz < clean.cutoff.cutoff_hz
    rows, exact = noisy.filter.rows, motion_at(frame()["t"].to_numpy()).acceleration
    error = np.std(noisy.motion.acceleration[rows] - exact[rows])
    assert error < 0.05 * np.std(exact[rows])
    unfiltered = np.diff(run_of(noise=1e-4).position, n=2, axis=0) * RATE_HZ**2
    assert error < 0.1 * np.std(unfiltered - exact[1:-1])


def test_the_chosen_cut_off_is_near_the_best_one() -> None:
    """Candidates judged with the true acceleration, which the choice does not know."""
    run, exact = run_of(noise=1e-4), motion_at(frame()["t"].to_numpy()).acceleration
    errors = {
        cutoff: np.std((differentiate(run, cutoff_hz=cutoff).motion.acceleration - exact)[200:-200])
        for cutoff in np.geomspace(1.5, 40, 25)
    }
    chosen = choose_cutoff(run.position, run.rate_hz).cutoff_hz
    found = np.std((differentiate(run, cutoff_hz=chosen).motion.acceleration - exact)[200:-200])
    assert found < 1.5 * min(errors.values())


def test_the_cut_off_stops_at_ten_times_the_band_of_the_motion() -> None:
    """A shake above the motion is true, and yet no business of a rigid model."""
    run = run_of()
    shake = 1e-4 * np.sin(2 * np.pi * 60 * run.time)[:, None]
    choice = choose_cutoff(run.position + shake, run.rate_hz)
    assert choice.cutoff_hz <= 10 * choice.motion_hz * (1 + 1e-9)
    assert choice.motion_hz == pytest.approx(0.75, rel=0.3)


def test_a_cut_off_above_half_the_rate_is_refused() -> None:
    with pytest.raises(ValueError, match="between 0 and half the rate, 100 Hz"):
        differentiate(run_of(), cutoff_hz=150)


def test_uneven_samples_become_even_ones_of_the_same_motion() -> None:
    time = frame()["t"].to_numpy() + np.random.default_rng(2).uniform(-0.3, 0.3, len(frame())) / RATE_HZ
    run = resample_evenly(replace(run_of(), time=time, position=motion_at(time).position))
    assert run.even
    assert_allclose(run.position, motion_at(run.time).position, atol=2e-6)


def test_lost_samples_are_bridged_where_the_run_is_filtered() -> None:
    run = resample_evenly(run_of(frame().drop(index=[100, 300, 301])))
    assert run.samples == len(frame())
    assert_allclose(run.position, frame()[POSITION], atol=1e-6)


def periodic_run(noise: float, periods: float = 5.3, seed: int = 0) -> Run:
    time = np.arange(round(periods * 4 * RATE_HZ)) / RATE_HZ
    motion = motion_at(time)
    rng = np.random.default_rng(seed)
    torque = rigid_body_torque(ARM, motion)
    correlated = rng.normal(size=torque.shape) @ np.array([[1.0, 0.5, 0], [0, 1, 0], [0, 0, 2]])
    position = motion.position + rng.normal(0, noise, torque.shape)
    return Run("run.csv", "identify", time, position, torque + correlated)


def test_the_period_of_a_repeated_motion_is_found() -> None:
    assert find_period(periodic_run(1e-4)) == pytest.approx(4.0, abs=1e-4)


def test_a_motion_that_does_not_repeat_has_no_period() -> None:
    ramp = replace(run_of(), position=np.linspace(0, 1, len(frame()))[:, None] ** [1.0, 2.0, 3.0])
    assert find_period(ramp) is None


@pytest.mark.parametrize("shape", [(900,), (900, 3), (900, 3, 2)])
def test_butterworth_is_scipys_sosfiltfilt(shape: tuple[int, ...]) -> None:
    signal = np.random.default_rng(1).normal(size=shape).cumsum(axis=0)
    sections = butter(BUTTERWORTH_ORDER, 20, fs=250, output="sos")
    theirs = sosfiltfilt(sections, signal, axis=0, padlen=38)
    np.testing.assert_allclose(Butterworth(250, 20, 900).smooth(signal), theirs, rtol=0, atol=1e-12)
