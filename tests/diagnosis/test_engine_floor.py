"""The noise floor from the data."""

import numpy as np
import pytest

from armlab.common.arrays import Array
from armlab.diagnosis.torque.location import period_scatter
from armlab.recordings.differentiate import differentiate
from armlab.recordings.filters import Butterworth
from armlab.recordings.recording import Run


def run_of(position: Array, torque: Array, time: Array) -> Run:
    return Run("run.csv", "identify", time, position[:, None], torque[:, None])


def test_the_scatter_between_periods_is_the_filtered_noise_whatever_the_torque() -> None:
    rng = np.random.default_rng(3)
    time = np.arange(12_000) / 500.0
    position = np.sin(2 * np.pi * time / 4) + 0.3 * np.cos(6 * np.pi * time / 4)
    noise = 0.2 * rng.standard_normal(len(time))
    torque = 5 * np.sign(np.gradient(position)) + 3 * position**3
    signals = differentiate(run_of(position, torque + noise, time), cutoff_hz=30.0, step=6)
    filtered = Butterworth(500.0, 30.0, len(time))(noise[:, None])
    found = period_scatter(signals)
    assert found is not None
    assert found[0] == pytest.approx(np.sqrt(np.mean(filtered**2)), rel=0.05)


def test_a_motion_that_does_not_repeat_itself_has_no_scatter() -> None:
    time = np.arange(5_000) / 500.0
    position = np.sin(2 * np.pi * (0.2 + 0.1 * time) * time)
    assert period_scatter(differentiate(run_of(position, position, time), cutoff_hz=30.0)) is None
