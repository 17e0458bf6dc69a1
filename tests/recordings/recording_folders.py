"""Small recordings of the built-in three-joint arm, made from its own equations, to be broken on purpose."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from problem.motion import Motion
from problem.regressor import rigid_body_torque
from problem.robot_file import load_arm

ARM = load_arm("irb120-arm")
RATE_HZ = 200.0
POSITION, TORQUE = ["q1", "q2", "q3"], ["tau1", "tau2", "tau3"]
SETTINGS: dict[str, Any] = {
    "schema": "recording/1",
    "robot": "irb120-arm",
    "columns": {"time": "t", "position": POSITION, "torque": TORQUE},
    "units": {"time": "s", "position": "rad", "torque": "N.m"},
    "runs": [{"file": "run.csv", "role": "identify"}, {"file": "check.csv", "role": "validate"}],
}
IMPORT_OPTIONS: dict[str, Any] = {  # of an import to which nothing is told but the robot
    **dict.fromkeys(("tip", "gains", "gear_ratio", "motor_side", "joints", "separator", "decimal", "topic", "time")),
    **dict.fromkeys(("position", "torque", "reference_position", "command_topic", "repair")),
    "robot": "irb120-arm",
    "lock": (),
    "validate": (),
    "units": (),
}


def motion_at(time: np.ndarray, seed: int = 0) -> Motion:
    """A smooth motion of three joints, with its exact derivatives."""
    rng = np.random.default_rng(seed)
    omega = 2 * np.pi * np.array([0.25, 0.5, 0.75])
    sine, cosine = rng.uniform(-0.35, 0.35, (2, 3, 3))
    angle = np.outer(time, omega)
    position = np.sin(angle) @ sine + np.cos(angle) @ cosine
    velocity = np.cos(angle) * omega @ sine - np.sin(angle) * omega @ cosine
    acceleration = -np.sin(angle) * omega**2 @ sine - np.cos(angle) * omega**2 @ cosine
    return Motion(position, velocity, acceleration)


def frame(seed: int = 0, seconds: float = 8.0, friction: float = 1.0, coulomb: float = 1.0) -> pd.DataFrame:
    """One run as a table: rigid torque, Coulomb and viscous friction, a little noise.

    coulomb: N m, times friction. A torque that jumps between two rows is known to half a row, which intervals of
    parameters do not contain: 0 for tests that compare numbers with intervals.
    """
    time = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    motion = motion_at(time, seed)
    torque = rigid_body_torque(ARM, motion) + friction * (coulomb * np.sign(motion.velocity) + 0.5 * motion.velocity)
    noise = np.random.default_rng(seed).normal(0, 0.02, torque.shape)
    return pd.DataFrame(np.column_stack([time, motion.position, torque + noise]), columns=["t", *POSITION, *TORQUE])


def folder_with(folder: Path, run: pd.DataFrame | str | bytes, settings: dict[str, Any] | None = None) -> Path:
    """A recording folder with the given run beside a sound one that validates."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "recording.yaml").write_text(yaml.safe_dump({**SETTINGS, **(settings or {})}))
    frame(1).to_csv(folder / "check.csv", index=False)
    if isinstance(run, pd.DataFrame):
        run.to_csv(folder / "run.csv", index=False)
    else:
        (folder / "run.csv").write_bytes(run if isinstance(run, bytes) else run.encode())
    return folder
