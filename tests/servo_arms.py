"""A two-joint arm with position servos as MJCF, and recordings of it that MuJoCo simulates."""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pandas as pd
import yaml

ARM = """<mujoco model="two-joint">
  <compiler angle="radian"/>
  <option timestep="0.001" integrator="implicitfast"/>
  <default>
    <joint damping="{damping}" frictionloss="{frictionloss}" armature="{armature}"
           solimpfriction="0.9999 0.9999 0.001"/>
    <position kp="{kp}" kv="{kv}" forcerange="-{limit} {limit}"/>
  </default>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" axis="0 1 0" range="-3 3"/>
      <inertial pos="0.1 0 0" mass="0.3" diaginertia="0.0002 0.001 0.001"/>
      <body name="lower" pos="0.2 0 0">
        <joint name="elbow" axis="0 1 0" range="-3 3"/>
        <inertial pos="0.08 0 0" mass="0.2" diaginertia="0.0001 0.0006 0.0006"/>
        <site name="tool" pos="0.16 0 0"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="shoulder" joint="shoulder"/>
    <position name="elbow" joint="elbow"/>
  </actuator>
</mujoco>
"""
NOMINAL = {"damping": 0.1, "frictionloss": 0.02, "armature": 0.01, "kp": 60, "kv": 0.3, "limit": 3.0}
COUNTS = 4096  # of an encoder, a turn
RATE_HZ = 50.0


def arm_text(**changes: float) -> str:
    """The MJCF with other numbers than the nominal ones."""
    return ARM.format(**{**NOMINAL, **changes})


def commands(seed: int, seconds: float) -> np.ndarray:
    """Commands (samples, 2) at RATE_HZ, rad: steps, slow ramps and sines by turns, smoothly scaled."""
    rng = np.random.default_rng(seed)
    time = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    held = np.repeat(rng.uniform(-0.5, 0.5, (len(time) // 75 + 1, 2)), 75, axis=0)[: len(time)]
    sines = np.stack([np.sin(2 * np.pi * f * time + p) for f, p in ((0.31, 0.3), (0.47, 1.1))], axis=1)
    fast = np.stack([np.sin(2 * np.pi * f * time**1.3) for f in (0.13, 0.17)], axis=1)
    blend = (np.arange(len(time)) // 250 % 3)[:, None]
    return np.select([blend == 0, blend == 1], [held, 0.6 * sines], 0.25 * fast)


def simulate(
    text: str,
    command: np.ndarray,
    delay: float = 0.0,
    offset: float = 0.0,
    dead_band: float = 0.0,
    read_late: float = 0.0,
    counts: int = COUNTS,
) -> np.ndarray:
    """Positions (samples, 2) that encoders read; the command is held between samples and late.

    read_late: of the second joint after the first one, s.
    """
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    steps, late = round(1 / RATE_HZ / model.opt.timestep), round(delay / model.opt.timestep)
    stream = np.concatenate([np.repeat(command[:1], late, axis=0), np.repeat(command, steps, axis=0)])
    data.qpos[:] = command[0]
    mujoco.mj_forward(model, data)
    read = []
    for number in range(len(command) * steps):
        if number % steps == 0:
            read.append(data.qpos.copy())
        if number % steps == round(read_late / model.opt.timestep):
            read[-1][1] = data.qpos[1]
        wanted = stream[number] + offset - data.qpos
        data.ctrl[:] = data.qpos + np.sign(wanted) * np.maximum(np.abs(wanted) - dead_band / 2, 0)
        mujoco.mj_step(model, data)
    step = 2 * np.pi / counts
    return np.round(np.array(read) / step) * step


def write_recording(
    folder: Path, truth: dict[str, float] | None = None, seconds: float = 40.0, counts: int = COUNTS, **changes: Any
) -> Path:
    """A recording of the arm with other numbers; its simulation is the nominal MJCF. changes: keys of its YAML."""
    numbers = dict(truth or {})
    drive = {name: numbers.pop(name, 0.0) for name in ("delay", "offset", "dead_band", "read_late")}
    folder.mkdir(parents=True)
    (folder / "arm.xml").write_text(arm_text())
    runs = []
    for seed, role in ((1, "identify"), (2, "identify"), (3, "validate")):
        command = commands(seed, seconds)
        position = simulate(arm_text(**numbers), command, **drive, counts=counts)
        table = np.column_stack([np.arange(len(command)) / RATE_HZ, command, position])
        names = ["t", "c1", "c2", "q1", "q2"]
        pd.DataFrame(table, columns=names).to_csv(folder / f"run-{seed}.csv", index=False)
        runs.append({"file": f"run-{seed}.csv", "role": role})
    settings = {
        "schema": "recording/1",
        "robot": "arm.xml",
        "columns": {"time": "t", "reference_position": ["c1", "c2"], "position": ["q1", "q2"]},
        "units": {"time": "s", "position": "rad", "reference_position": "rad"},
        "runs": runs,
        **changes,
    }
    (folder / "recording.yaml").write_text(yaml.safe_dump(settings))
    return folder
