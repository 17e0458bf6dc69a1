"""Identification of an arm whose file holds weight and has springs: the model predicts the torque of its drives."""

from pathlib import Path

import numpy as np
import pytest
from robot_file_table import FILES

from armlab.identification.identifier import Identifier
from armlab.recordings.recording import Run
from problem.drive_torque import drive_torque
from problem.motion import Motion
from problem.robot_file import load_arm


def run_of(name: str, seed: int) -> tuple[Run, np.ndarray]:
    arm, rng = load_arm(str(FILES / name)), np.random.default_rng(seed)
    time = np.arange(0, 10, 0.01)
    speed, phase = rng.uniform(1, 4, (len(arm), 3)), rng.uniform(0, 6, (len(arm), 3))
    angle = time[:, None, None] * speed + phase
    motion = Motion(
        0.3 * np.sin(angle).sum(axis=2),
        0.3 * (speed * np.cos(angle)).sum(axis=2),
        -0.3 * (speed**2 * np.sin(angle)).sum(axis=2),
    )
    torque = drive_torque(arm, motion)
    return Run(f"run-{seed}.csv", "identify", time, motion.position, torque), torque


@pytest.mark.parametrize("name", ["gravity_partly_compensated.xml", "ref_and_springref.xml"])
def test_an_identified_model_predicts_the_drives_of_an_arm_with_springs_and_held_weight(name: str) -> None:
    arm = load_arm(str(FILES / name))
    identifier = Identifier(arm, robot=str(Path(FILES / name))).fit([run_of(name, 1)[0]])
    run, torque = run_of(name, 2)
    error = identifier.model_.predict(run)[50:-50] - torque[50:-50]
    assert np.sqrt(np.mean(error**2, axis=0)).max() < 0.02 * np.abs(torque).max()
