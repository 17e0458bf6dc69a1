"""Small recordings of the built-in three-joint arm with friction that is known, as folders."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from armlab.common.arrays import Array
from problem.motion import Motion
from problem.regressor import rigid_body_torque
from problem.robot_file import load_arm

ARM = load_arm("irb120-arm")
RATE_HZ = 200.0
PARTS = 20  # of a sample
POSITION, TORQUE = ["q1", "q2", "q3"], ["tau1", "tau2", "tau3"]
COULOMB, VISCOUS = (1.0, 1.5, 0.7), (0.8, 1.0, 0.5)
PAYLOAD = (1.0, 0.05, 0.03, 0.1, 0.02, 0.02, 0.01, 0.0, 0.0, 0.0)  # per kg, about the frame of link 3; no body has it
POSSIBLE_PAYLOAD = (1.0, 0.05, 0.03, 0.1, 0.02, 0.02, 0.01, -0.0015, -0.005, -0.003)  # the same, its products as a body


def motion_at(time: Array, seed: int) -> Motion:
    """Five harmonics of 0.2 Hz, derivatives exact."""
    omega = 2 * np.pi * 0.2 * np.arange(1, 6)
    a, b = np.random.default_rng(seed).normal(0, 0.3, (2, 5, 3)) / np.sqrt(np.arange(1, 6))[:, None]
    sine, cosine = np.sin(np.outer(time, omega)), np.cos(np.outer(time, omega))
    velocity = (cosine * omega) @ a - (sine * omega) @ b
    return Motion(sine @ a + cosine @ b, velocity, -(sine * omega**2) @ a - (cosine * omega**2) @ b)


def frame(
    seed: int,
    seconds: float = 10.0,
    viscous: tuple[float, ...] = VISCOUS,
    mass: float = 0.0,
    sampled: bool = False,
    load: tuple[float, ...] = PAYLOAD,
) -> pd.DataFrame:
    """One run: rigid torque, friction, 0.05 N m of noise. mass: of a load at link 3, kg; load: per kg.

    sampled: whether Coulomb friction is that of the instant; else its mean over a sample, as drives report it.
    """
    time = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    motion, phi = motion_at(time, seed), ARM.parameters.copy()
    parts = 1 if sampled else PARTS
    within = ((np.arange(parts) + 0.5) / parts - 0.5) / RATE_HZ
    direction = np.mean([np.sign(motion_at(time + shift, seed).velocity) for shift in within], axis=0)
    phi[20:30] += mass * np.array(load)
    torque = rigid_body_torque(ARM, motion, phi)
    torque += np.array(viscous) * motion.velocity + np.array(COULOMB) * direction
    torque += np.random.default_rng(seed + 500).normal(0, 0.05, torque.shape)
    return pd.DataFrame(np.column_stack([time, motion.position, torque]), columns=["t", *POSITION, *TORQUE])


def recording_in(folder: Path, *runs: pd.DataFrame, validate: bool = True, names: str = "run", **settings: Any) -> Path:
    """A recording folder; the last run validates unless told otherwise. names: how the files' names begin."""
    folder.mkdir(parents=True, exist_ok=True)
    entries = []
    for number, run in enumerate(runs):
        last = validate and number == len(runs) - 1
        run.to_csv(folder / f"{names}-{number}.csv", index=False)
        entries.append({"file": f"{names}-{number}.csv", "role": "validate" if last else "identify"})
    content = {
        "schema": "recording/1",
        "robot": "irb120-arm",
        "columns": {"time": "t", "position": POSITION, "torque": TORQUE},
        "units": {"time": "s", "position": "rad", "torque": "N.m"},
        "runs": entries,
    }
    (folder / "recording.yaml").write_text(yaml.safe_dump({**content, **settings}))
    return folder
