"""Rows in states that all recordings were in: their weights, and comparisons of recordings of other places."""

from pathlib import Path

import numpy as np
import pandas as pd
from numpy.testing import assert_allclose

from armlab.common.arrays import Array
from armlab.diagnosis.changes.comparison import OTHER_STATES, Comparison, compare
from armlab.diagnosis.changes.shared_states import shared_weights
from armlab.recordings.load import load_recording

RATE_HZ, INERTIA, COULOMB = 200.0, 0.5, 1.0
ROBOT = """name: turntable
dh_convention: standard
gravity: [0.0, 0.0, -9.81]
joints:
- {name: joint1, type: revolute, a: 0.3, d: 0.0, alpha: 0.0, theta_offset: 0.0}
"""


def test_the_same_states_count_whole() -> None:
    states = np.random.default_rng(0).normal(size=(200, 3))
    weights = shared_weights(np.concatenate([states, states]), np.repeat([0, 1], 200), 40)
    assert_allclose(weights, 1.0, atol=1e-3)


def test_states_of_one_recording_alone_hardly_count() -> None:
    position = np.concatenate([np.linspace(0, 1, 200), np.linspace(3, 4, 300)])[:, None]
    assert shared_weights(position, np.repeat([0, 1], [200, 300]), 40).max() < 0.5
    assert shared_weights(position, np.repeat([0, 1], [200, 300]), 40).mean() < 0.2


def test_where_all_of_three_recordings_were_rows_count_more() -> None:
    position = np.concatenate([np.linspace(start, start + 2, 300) for start in (0, 0.5, 1)])[:, None]
    weights = shared_weights(position, np.repeat([0, 1, 2], 300), 100)
    shared = (position[:, 0] > 1) & (position[:, 0] < 2)
    assert weights[shared].mean() > 0.8
    assert weights[shared].mean() > weights[~shared].mean() + 0.2
    assert weights.max() <= 1


def turntable(folder: Path, middle: float, seed: int, coulomb: float = COULOMB) -> Path:
    """Two runs about a place. The axis has a torque of its place that no law of an arm describes."""
    folder.mkdir()
    (folder / "robot.yaml").write_text(ROBOT)
    rng, names = np.random.default_rng(seed), ["identify", "validate"]
    for name in names:
        time = np.arange(round(12 * RATE_HZ)) / RATE_HZ
        phases, sizes = rng.uniform(0, 2 * np.pi, 4), rng.uniform(0.1, 0.2, 4)
        speeds = 2 * np.pi * np.array([0.2, 0.35, 0.5, 0.7])
        angles = np.outer(time, speeds) + phases
        position: Array = middle + np.sin(angles) @ sizes
        velocity, acceleration = np.cos(angles) @ (sizes * speeds), -np.sin(angles) @ (sizes * speeds**2)
        torque = INERTIA * acceleration + coulomb * np.tanh(velocity / 0.01) + 0.8 * np.cos(position)
        torque += 0.2 * np.cos(3 * position) * np.sign(velocity) + rng.normal(0, 0.02, len(time))
        columns = {"t": time, "q1": position, "tau1": torque}
        pd.DataFrame(columns).to_csv(folder / f"{name}.csv", index=False)
    runs = "\n".join(f"- {{file: {name}.csv, role: {name}}}" for name in names)
    units = "units: {time: s, position: rad, torque: N.m}"
    columns_of = "columns: {time: t, position: [q1], torque: [tau1]}"
    head = f"schema: recording/1\nrobot: robot.yaml\n{columns_of}\n{units}\nruns:\n{runs}\n"
    (folder / "recording.yaml").write_text(head)
    return folder


def compared(tmp_path: Path, middles: tuple[float, float], coulomb: float = COULOMB) -> Comparison:
    old, new = turntable(tmp_path / "old", middles[0], 1), turntable(tmp_path / "new", middles[1], 2, coulomb)
    return compare(load_recording(old), load_recording(new))


def test_what_differs_between_other_places_is_no_change(tmp_path: Path) -> None:
    found = compared(tmp_path, (0.0, 1.6))
    assert found.status == "inconclusive"
    assert found.reason == OTHER_STATES


def test_friction_that_changed_is_named_where_the_motion_is_another_one_in_the_same_place(tmp_path: Path) -> None:
    found = compared(tmp_path, (0.0, 0.0), 1.6 * COULOMB)
    assert [(each.effect, each.joint) for each in found.findings] == [("coulomb_friction", 1)]
