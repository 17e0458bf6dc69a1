"""One servo without torque: another load is told from another gain."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from armlab.common.arrays import Array
from armlab.diagnosis.motion.compare_load import compare_load, load_against_gain, newton_metres
from armlab.recordings.motion import MotionRecording, load_motion_recording
from armlab.recordings.plain_least_squares import PlainChanges

STEP_S = 0.001
ROBOT = {
    "name": "pendulum",
    "dh_convention": "standard",
    "gravity": [9.81, 0, 0],
    "joints": [{"name": "joint1", "type": "revolute", "a": 0.0, "d": 0.0, "alpha": 0.0}],
    "links": [{"mass": 1.0, "first_moment": [0.1, 0, 0], "inertia": [1e-5, 0.02, 0.02, 0, 0, 0]}],
}
RECORDING = {
    "schema": "recording/1",
    "robot": "robot.yaml",
    "sample_rate_hz": 100.0,
    "columns": {"time": "t", "reference_position": ["r1"], "position": ["q1"]},
    "units": {"time": "s", "position": "rad"},
    "controller": {"type": "pd", "kp": [None], "kd": [None], "reference_velocity": "zero"},
    "runs": [{"file": f"run-{number}.csv", "role": "identify"} for number in (1, 2, 3)],
}


def follow(command: Array, kp: float, load: float) -> Array:
    """Positions of a pendulum, 0.1 kg m times the load at a drive of 0.03 kg m2; 0.8 N m s/rad, 0.2 N m of friction."""
    position, speed, out = 0.0, 0.0, np.zeros(len(command))
    for number, target in enumerate(command):
        torque = kp * (target - position) - 0.8 * speed - 0.2 * np.tanh(speed / 0.02)
        speed += STEP_S * (torque - 0.981 * load * np.sin(position)) / (0.03 + 0.01 * load)
        position += STEP_S * speed
        out[number] = position
    return out


def pendulum(folder: Path, kp: float, load: float, seed: int = 0) -> MotionRecording:
    folder.mkdir()
    generator = np.random.default_rng(seed)
    time = np.arange(0, 8, STEP_S)
    for number in (1, 2, 3):
        waves = [np.sin(2 * np.pi * generator.uniform(0.2, 1.2) * time + generator.uniform(0, 6)) for _ in range(3)]
        command = 0.5 * np.sum(waves, axis=0)
        position = follow(command, kp, load)
        rows = np.column_stack([time, command, position + generator.normal(0, 5e-4, len(time))])[::10]
        np.savetxt(folder / f"run-{number}.csv", rows, delimiter=",", header="t,r1,q1", comments="")
    (folder / "robot.yaml").write_text(yaml.safe_dump(ROBOT))
    (folder / "recording.yaml").write_text(yaml.safe_dump(RECORDING))
    return load_motion_recording(folder)


def test_another_load_is_named_in_newton_metres_by_the_known_load_of_the_old_recording(tmp_path: Path) -> None:
    found = compare_load(pendulum(tmp_path / "old", 8.0, 1.0), pendulum(tmp_path / "new", 8.0, 2.2, seed=1))
    assert found is not None
    assert [(each.effect, each.joint) for each in found.findings] == [("payload", 1)]
    (moment,) = (each for each in found.changes if (each.effect, each.parameter) == ("payload", "mcx"))
    assert moment.ratio is not None
    assert moment.ratio[1] < 2.2 < moment.ratio[2]
    assert moment.old == pytest.approx(0.1, rel=0.15)


def test_a_load_that_grew_at_the_third_recording_is_a_step_there(tmp_path: Path) -> None:
    loads = {"first": 1.0, "second": 1.0, "third": 2.2}
    servos = [pendulum(tmp_path / name, 8.0, load, seed) for seed, (name, load) in enumerate(loads.items())]
    found = compare_load(*servos)
    assert found is not None
    assert [(each.effect, each.joint) for each in found.findings] == [("payload", 1)]
    assert [each.change_point for each in found.trends if each.movement.parameter == "mcx"] == [2]


def test_another_gain_is_no_load(tmp_path: Path) -> None:
    """Half the gain doubles all that is read over it."""
    assert compare_load(pendulum(tmp_path / "old", 8.0, 1.0), pendulum(tmp_path / "new", 4.0, 1.0, seed=1)) is None


def plain(new: tuple[float, ...], errors: tuple[float, ...] = (0.01, 0.01, 0.01)) -> PlainChanges:
    return PlainChanges(("mcx1", "coulomb1", "viscous1"), np.array([0.1, 0.2, 0.4]), np.array(new), np.array(errors))


def test_friction_that_stays_while_gravity_doubles_speaks_for_the_load() -> None:
    """f = 1, l = 2 at 1 rad/s: errors sqrt(2) / 60 and 0.1, odds (1 / (0.1^2 + 2 / 3600)) / 2."""
    assert load_against_gain(plain((0.2, 0.2, 0.4)), 1.0) == pytest.approx(1 / (0.01 + 2 / 3600) / 2)


def test_all_terms_by_one_factor_speak_for_the_gain() -> None:
    assert load_against_gain(plain((0.2, 0.4, 0.8)), 1.0) < -100


def test_a_recording_without_gravity_speaks_for_neither() -> None:
    nothing = PlainChanges(("coulomb1", "viscous1"), np.ones(2), np.ones(2), np.ones(2))
    assert load_against_gain(nothing, 1.0) == 0


def test_the_load_of_the_robot_file_sets_the_scale(tmp_path: Path) -> None:
    arm = pendulum(tmp_path / "old", 8.0, 1.0).arm
    assert newton_metres(arm, plain((0.1, 0.2, 0.4))) == pytest.approx(1.0)
    small = PlainChanges(("mcx1",), np.array([0.0125]), np.array([0.0125]), np.array([0.01]))
    assert newton_metres(arm, small) == pytest.approx(8.0)
