"""The log of a simulated arm with physics that its robot file lacks, to try the commands without a robot."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.files import refuse_existing, write_texts
from armlab.common.streams import named_generator
from armlab.effects.contract import Scene, Value
from armlab.effects.library import family_named
from armlab.effects.model import FittedEffect, torque_of_model
from problem.arm import Arm
from problem.motion import Motion
from problem.regressor import rigid_body_torque
from problem.robot_file import BUILT_IN_FOLDER, load_arm

ARM_NAME = "irb120-arm"
RATE_HZ, DURATION_S = 250, 20
FIRST_STAMP_NS = 1_767_225_600 * 10**9  # 2026-01-01, UTC
HARMONICS, FUNDAMENTAL_HZ = 6, 0.1
TRAVEL_SHARE, SPEED_SHARE = 0.6, 0.4  # of what the limits of a joint allow
ENCODER_STEP, TORQUE_NOISE = 2e-5, 0.05  # rad; N m, standard deviation
_PAYLOAD: dict[str, Value] = {
    "mass": 1.5,
    "centre": (0.05, 0.0, 0.08),
    "inertia": (0.0136, 0.01735, 0.00775, 0.0, -0.006, 0.0),  # of a body, 0.004 kg m2 about each axis of its centre
}
HIDDEN: tuple[tuple[str, tuple[int, ...], dict[str, Value]], ...] = (
    ("coulomb_friction", (1,), {"level": 2.4}),
    ("coulomb_friction", (2,), {"level": 3.1}),
    ("coulomb_friction", (3,), {"level": 1.2}),
    ("viscous_friction", (1,), {"coefficient": 1.8}),
    ("viscous_friction", (2,), {"coefficient": 2.6}),
    ("viscous_friction", (3,), {"coefficient": 0.9}),
    ("payload", (3,), _PAYLOAD),
)


def write_example(folder: Path) -> tuple[Path, ...]:
    """Writes two logs as a driver writes them, the robot file, and what was hidden; returns the paths.

    Columns of a log: `timestamp_ns` since 1970, positions `q1_rad` .., torques `tau1_Nm` ...
    Raises InputError if a file is there already or cannot be written.
    """
    arm = load_arm(ARM_NAME)
    effects = [
        FittedEffect(*family_named(name).from_parameters(arm, joints, values)) for name, joints, values in HIDDEN
    ]
    logs = {f"run-{number}.csv": _log(arm, effects, number) for number in (1, 2)}
    truth = [
        {
            "effect": name,
            "joints": list(joints),
            "parameters": {key: np.asarray(value).tolist() for key, value in values.items()},
        }
        for name, joints, values in HIDDEN
    ]
    texts = {
        **{name: log.to_csv(index=False, float_format="%.6g") for name, log in logs.items()},
        "robot.yaml": (BUILT_IN_FOLDER / f"{ARM_NAME}.yaml").read_text(encoding="utf-8"),
        "hidden.yaml": yaml.safe_dump(truth, sort_keys=False),
    }
    refuse_existing(folder / name for name in texts)
    return write_texts(texts, folder)


def _log(arm: Arm, effects: list[FittedEffect], number: int) -> pd.DataFrame:
    """The log of a run: stamps, positions with the steps of an encoder, torques with noise."""
    rng = named_generator("example", number)
    time = np.arange(DURATION_S * RATE_HZ) / RATE_HZ
    motion = random_motion(arm, time, rng)
    rigid = rigid_body_torque(arm, motion)
    torque = torque_of_model(effects, Scene(f"run-{number}", time, motion, arm, arm.parameters, rigid))
    measured = torque + rng.normal(0.0, TORQUE_NOISE, torque.shape)
    position = np.round(motion.position / ENCODER_STEP) * ENCODER_STEP
    stamps = FIRST_STAMP_NS + number * 60 * 10**9 + np.round(time * 1e9).astype(np.int64)
    joints = range(1, len(arm) + 1)
    columns: dict[str, NDArray[Any]] = {"timestamp_ns": stamps}
    columns |= {f"q{joint}_rad": position[:, joint - 1] for joint in joints}
    columns |= {f"tau{joint}_Nm": measured[:, joint - 1] for joint in joints}
    return pd.DataFrame(columns)


def random_motion(arm: Arm, time: Array, rng: np.random.Generator) -> Motion:
    """A Fourier series a joint about the middle of its limits, within shares of its travel and of its speed.

    time: (samples,), s. The joints need limits of position and speed.
    """
    omega = 2 * np.pi * FUNDAMENTAL_HZ * np.arange(1, HARMONICS + 1)
    sine, cosine = np.sin(np.outer(time, omega)), np.cos(np.outer(time, omega))
    a, b = rng.normal(0.0, 1.0, (2, HARMONICS, len(arm)))
    position, velocity = sine @ a + cosine @ b, (cosine * omega) @ a - (sine * omega) @ b
    acceleration = -(sine * omega**2) @ a - (cosine * omega**2) @ b
    low, high = np.array([joint.limits.position for joint in arm.joints]).T
    speed = np.array([joint.limits.velocity for joint in arm.joints])
    travel = TRAVEL_SHARE * (high - low) / 2 / np.abs(position).max(axis=0)
    size = np.minimum(travel, SPEED_SHARE * speed / np.abs(velocity).max(axis=0))
    return Motion((low + high) / 2 + size * position, size * velocity, size * acceleration)
