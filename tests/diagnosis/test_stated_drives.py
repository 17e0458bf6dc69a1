"""A controller that the recording states is the drive, whatever actuators the MJCF has."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from refusals import refusal

from armlab.diagnosis.motion.servo import place
from armlab.diagnosis.motion.servo_simulation import ServoSimulation, read_servo_simulation
from armlab.recordings.check import check_recording
from armlab.recordings.motion import load_motion_recording

ARM = """<mujoco><compiler angle="radian"/><worldbody><body name="a"><joint name="j" axis="0 1 0" damping=".1"/>
<inertial mass="1" pos=".1 0 0" diaginertia=".01 .01 .01"/></body></worldbody><actuator>{drives}</actuator>
<sensor><jointpos joint="j"/></sensor></mujoco>"""
CONTROLLER = {"type": "pd", "kp": [20.0], "kd": [0.5]}
MOTOR = '<motor name="m" joint="j" gear="6"/>'
FILTERED = '<position name="m" joint="j" kp="9" timeconst="0.1"/>'


def folder_with(folder: Path, drives: str, controller: dict[str, object] | None) -> Path:
    (folder / "arm.xml").write_text(ARM.format(drives=drives))
    time = np.arange(0, 5, 0.01)
    wave = np.column_stack([time, np.sin(time), np.sin(time - 0.1)])
    np.savetxt(folder / "run.csv", wave, delimiter=",", header="t,c1,q1", comments="")
    content = {
        "schema": "recording/1",
        "robot": "arm.xml",
        "columns": {"time": "t", "reference_position": ["c1"], "position": ["q1"]},
        "units": {"time": "s", "position": "rad", "reference_position": "rad"},
        "runs": [{"file": "run.csv", "role": "identify"}],
    }
    (folder / "recording.yaml").write_text(yaml.safe_dump(content | ({"controller": controller} if controller else {})))
    return folder


def simulation(folder: Path) -> ServoSimulation:
    return read_servo_simulation(load_motion_recording(folder))


@pytest.mark.parametrize("drives", [MOTOR, FILTERED, MOTOR + '<velocity name="v" joint="j" kv="3"/>'])
def test_a_stated_controller_replaces_the_actuators_of_the_file(tmp_path: Path, drives: str) -> None:
    found = simulation(folder_with(tmp_path, drives, CONTROLLER))
    assert found.nominal.values[0, [place("kp"), place("kd"), place("damping")]].tolist() == [20.0, 0.5, 0.1]
    model = found.model()
    assert (model.nu, model.actuator_gear[0, 0], model.actuator_dyntype[0]) == (1, 1.0, 0)


@pytest.mark.parametrize(
    ("drives", "reason"),
    [
        (MOTOR, "is a motor, which takes torques"),
        (FILTERED, "filters its"),
        ('<position name="p" joint="j" kp="9"/><velocity name="v" joint="j" kv="2"/>', "is not alone (p, v)"),
    ],
)
def test_without_a_controller_check_and_diagnosis_refuse_such_actuators_alike(
    tmp_path: Path, drives: str, reason: str
) -> None:
    folder = folder_with(tmp_path, drives, None)
    told = refusal(check_recording, folder)
    assert f"the actuator of joint 'j' {reason}" in told
    assert "needs columns of torque, or the key `controller`" in told
    assert refusal(simulation, folder) == told


def test_a_servo_behind_a_gear_is_the_servo_at_its_joint(tmp_path: Path) -> None:
    drive = '<position name="m" joint="j" kp="2" kv="0.1" gear="-5" forcerange="-1 3"/>'
    found = simulation(folder_with(tmp_path, drive, None))
    assert found.nominal.values[0, [place("kp"), place("kd")]].tolist() == pytest.approx([50.0, 2.5])
    model = found.model()
    np.testing.assert_allclose(model.actuator_forcerange[0], [-15, 5])
