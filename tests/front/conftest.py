"""A small recording of the built-in three-joint arm with friction that is known: in memory, and as a folder."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from armlab.recordings.recording import Recording, Run, Transmission
from problem.motion import Motion
from problem.regressor import rigid_body_torque
from problem.robot_file import load_arm

RATE_HZ = 100.0


def run_of(arm, role, seed):
    """A run of 12 s with exact derivatives, friction and 0.02 N m of noise."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(12 * RATE_HZ)) / RATE_HZ
    omega = 2 * np.pi * 0.15 * np.arange(1, 6)
    a, b = rng.normal(0, 0.3, (2, 5, 3))
    sine, cosine = np.sin(np.outer(time, omega)), np.cos(np.outer(time, omega))
    velocity = (cosine * omega) @ a - (sine * omega) @ b
    motion = Motion(sine @ a + cosine @ b, velocity, -(sine * omega**2) @ a - (cosine * omega**2) @ b)
    torque = rigid_body_torque(arm, motion) + 0.8 * np.sign(velocity) + 0.5 * velocity
    return Run(f"{role}.csv", role, time, motion.position, torque + rng.normal(0, 0.02, torque.shape))


@pytest.fixture(scope="module")
def recording():
    arm = load_arm("irb120-arm")
    runs = (run_of(arm, "identify", 1), run_of(arm, "validate", 2))
    same = Transmission(np.eye(3), np.zeros(3), np.eye(3), np.ones(3))
    return Recording(Path("my-recording"), "irb120-arm", arm, runs, same)


@pytest.fixture
def recording_folder(recording):
    """Writes the recording as a folder."""

    def write(folder):
        folder.mkdir()
        position, torque = ["q1", "q2", "q3"], ["tau1", "tau2", "tau3"]
        for run in recording.runs:
            columns = np.column_stack([run.time, run.position, run.torque])
            pd.DataFrame(columns, columns=["t", *position, *torque]).to_csv(folder / run.file, index=False)
        content = {
            "schema": "recording/1",
            "robot": "irb120-arm",
            "columns": {"time": "t", "position": position, "torque": torque},
            "units": {"time": "s", "position": "rad", "torque": "N.m"},
            "runs": [{"file": run.file, "role": run.role} for run in recording.runs],
        }
        (folder / "recording.yaml").write_text(yaml.safe_dump(content))

    return write
