"""Currents of unknown scale and sign beside a recording of motion only: what they say of the drives that were found."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from servo_arms import RATE_HZ, arm_text, write_recording

from armlab.diagnosis.motion.servo import NEUTRAL, Key, place
from armlab.diagnosis.motion.servo_simulation import ServoSimulation, read_servo_simulation
from armlab.diagnosis.motion.witness import correlate_currents
from armlab.recordings.motion import load_motion_recording
from armlab.recordings.recording import MotionRun

TRUTH = {"kp": 8.0, "kv": 0.4, "damping": 0.1, "frictionloss": 0.1}
SCALE = -0.7  # A per N m


def actuator_torques(command: np.ndarray) -> np.ndarray:
    """Torques (samples, 2) of the actuators of MuJoCo at the samples of a command."""
    model = mujoco.MjModel.from_xml_string(arm_text(**TRUTH))
    data = mujoco.MjData(model)
    data.qpos[:] = command[0]
    torques = []
    for wanted in command:
        data.ctrl[:] = wanted
        mujoco.mj_forward(model, data)
        torques.append(data.actuator_force.copy())
        for _ in range(round(1 / RATE_HZ / model.opt.timestep)):
            mujoco.mj_step(model, data)
    return np.array(torques)


@pytest.fixture(scope="module")
def heard(tmp_path_factory: pytest.TempPathFactory) -> tuple[ServoSimulation, MotionRun, np.ndarray]:
    """The simulation, a run, and the torques of its drives, (samples, 2), N m."""
    folder: Path = write_recording(tmp_path_factory.mktemp("arm") / "servo", TRUTH, seconds=12.0)
    recording = load_motion_recording(folder)
    run = recording.with_role("validate")[0]
    return read_servo_simulation(recording), run, actuator_torques(np.asarray(run.reference_position))


def servos(kd: float, damping: float) -> np.ndarray:
    """Both servos with the true kp and friction, (2, parameters)."""
    keys: tuple[Key, ...] = ("kp", "kd", "damping", "friction", "armature", "limit")
    values = NEUTRAL.copy()
    values[[place(key) for key in keys]] = 8.0, kd, damping, 0.1, 0.01, 3.0
    return np.stack([values, values])


def test_a_current_with_any_sign_follows_the_right_drive(heard: tuple[ServoSimulation, MotionRun, np.ndarray]) -> None:
    simulation, run, torques = heard
    for each in correlate_currents([replace(run, current=SCALE * torques)], simulation, servos(0.4, 0.1)):
        assert each.form == "signed"
        assert each.found > 0.97
        assert each.given is not None
        assert each.given < each.found
        assert each.inside is None


def test_a_current_tells_damping_of_the_drive_from_that_of_the_joint(
    heard: tuple[ServoSimulation, MotionRun, np.ndarray],
) -> None:
    simulation, run, torques = heard
    for each in correlate_currents([replace(run, current=SCALE * torques)], simulation, servos(0.0, 0.5)):
        assert each.inside is not None
        assert each.inside > each.found + 0.02


@pytest.mark.parametrize(("form", "power"), [("size", 1), ("squared", 2)])
def test_a_current_without_sign_goes_with_the_size_or_the_square_of_the_torque(
    heard: tuple[ServoSimulation, MotionRun, np.ndarray], form: str, power: int
) -> None:
    simulation, run, torques = heard
    current = 3 * np.abs(torques) ** power
    for each in correlate_currents([replace(run, current=current)], simulation, servos(0.4, 0.1)):
        assert each.form == form
        assert each.found > 0.95


def test_without_a_current_that_varies_nothing_is_said(heard: tuple[ServoSimulation, MotionRun, np.ndarray]) -> None:
    simulation, run, torques = heard
    assert correlate_currents([run], simulation, servos(0.4, 0.1)) == ()
    missing = replace(run, current=np.stack([np.full(run.samples, np.nan), torques[:, 1]], axis=1))
    assert [each.joint for each in correlate_currents([missing], simulation, servos(0.4, 0.1))] == [2]
    assert correlate_currents([replace(run, current=np.ones_like(torques))], simulation, servos(0.4, 0.1)) == ()
