"""Models with missing physics as MJCF: MuJoCo itself says whether the torque is the same."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose
from small_recordings import TORQUE, frame, motion_at, recording_in

from armlab.common.errors import InputError
from armlab.diagnosis.torque.diagnose import diagnose
from armlab.identification.model_file import read_model
from armlab.identification.write_simulator import export_model
from armlab.recordings.load import load_recording
from armlab.report.verdict_files import write_verdict
from problem.motion import Motion
from problem.robot_file import load_arm

ARM = load_arm("irb120-arm")
ROBOT = Path(__file__).parents[2] / "problem" / "robots" / "irb120-arm.yaml"


def component(effect: str, joint: int | None, **parameters: object) -> dict[str, object]:
    named = {name: {"value": value, "unit": "1"} for name, value in parameters.items()}
    return {"effect": effect, "joint": joint, "joints": [] if joint is None else [joint], "parameters": named}


def model_with(folder: Path, *components: dict[str, object]) -> Path:
    assert ARM.links is not None
    links = [
        {"mass": each.mass, "first_moment": list(each.first_moment), "inertia": list(each.inertia)}
        for each in ARM.links
    ]
    content = {"schema": "model/1", "robot": "irb120-arm", "links": links, "components": list(components)}
    path = folder / "model.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


def states(count: int = 20) -> Motion:
    return Motion(*np.random.default_rng(3).uniform(-1, 1, (3, count, len(ARM))))


def torque(path: Path, motion: Motion) -> np.ndarray:
    """Of a model file at single instants."""
    return read_model(path).torque(motion)


def mujoco_torque(path: Path, motion: Motion) -> np.ndarray:
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_path(str(path))
    data, out = mujoco.MjData(model), []
    for position, velocity, acceleration in zip(motion.position, motion.velocity, motion.acceleration, strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = position, velocity, acceleration
        mujoco.mj_inverse(model, data)
        out.append(data.qfrc_inverse.copy())
    return np.array(out)


def test_mujoco_has_the_torque_of_a_model_with_payload_spring_rotor_and_viscous_friction(tmp_path: Path) -> None:
    path = model_with(
        tmp_path,
        component("payload", 3, mass=1.2, centre=[0.05, 0.02, 0.1], inertia=[0.02, 0.02, 0.01, 0.0, 0.0, 0.0]),
        component("cable_stiffness", 2, stiffness=3.0, rest=0.2),
        component("rotor_inertia", 1, inertia=0.4),
        component("viscous_friction", 3, coefficient=1.5),
    )
    lines = list(export_model(path, tmp_path / "arm.xml"))
    motion = states()
    assert lines == [str(tmp_path / "arm.xml")]
    expected = torque(path, motion)
    assert_allclose(mujoco_torque(tmp_path / "arm.xml", motion), expected, atol=1e-9)


def test_a_tilt_of_the_base_becomes_the_simulators_gravity_which_the_diagnosis_knows_to_first_order(
    tmp_path: Path,
) -> None:
    tilted = [0.17, -0.1, -float(np.sqrt(9.81**2 - 0.17**2 - 0.1**2))]
    path = model_with(tmp_path, component("base_tilt", None, gravity=tilted))
    list(export_model(path, tmp_path / "arm.xml"))
    motion = states()
    found = mujoco_torque(tmp_path / "arm.xml", motion)
    assert_allclose(found, torque(path, motion), atol=5e-3)
    assert np.abs(found - torque(model_with(tmp_path), motion)).max() > 0.05


def test_effects_without_a_place_in_the_simulator_are_named_in_one_line(tmp_path: Path) -> None:
    offset = component("torque_offset", 1, offset=0.4)
    path = model_with(tmp_path, offset, component("time_delay", None, seconds=0.004))
    lines = list(export_model(path, tmp_path / "arm.xml"))
    assert lines[1] == "not in the file: torque offset at joint 1 (0.4); time delay of the whole robot (0.004)"


def test_a_model_read_again_adds_each_effect_once(tmp_path: Path) -> None:
    motion = states()
    plain = torque(model_with(tmp_path), motion)
    path = model_with(tmp_path, component("coulomb_friction", 2, level=2.0))
    with_friction = torque(path, motion)
    assert_allclose((with_friction - plain)[:, 1], 2.0 * np.sign(motion.velocity[:, 1]))


def test_an_effect_that_nobody_knows_is_refused_in_one_line(tmp_path: Path) -> None:
    path = model_with(tmp_path, component("phlogiston", 1, level=2.0))
    with pytest.raises(InputError, match=r"components\[0\] \(phlogiston\): unknown effect"):
        list(export_model(path, tmp_path / "arm.xml"))


def test_the_model_file_predicts_what_the_report_shows_rotors_of_the_robot_file_included(tmp_path: Path) -> None:
    rotors = [0.3, 0.2, 0.1]
    runs = [frame(seed, 6) for seed in (0, 1)]
    for seed, table in enumerate(runs):
        table[TORQUE] += np.array(rotors) * motion_at(table["t"].to_numpy(), seed).acceleration
    folder = recording_in(tmp_path / "recording", *runs, robot="robot.yaml")
    robot = yaml.safe_load(ROBOT.read_text()) | {"rotor_inertia": rotors}
    (folder / "robot.yaml").write_text(yaml.safe_dump(robot))
    found = diagnose(load_recording(folder))
    (path,) = (each for each in write_verdict(found, tmp_path / "out") if each.name == "model.yaml")
    assert found.observed is not None
    assert found.final is not None
    model = read_model(path)
    predicted = np.concatenate([model.filtered_torque(each) for each in found.observed.signals])
    surrogates = sum(claim.prediction for claim in found.claims if claim.effect == "unknown")  # in no model file
    apart = predicted - (found.observed.torque - found.final - surrogates)
    assert np.all(np.sqrt(np.mean(apart**2, axis=0)) < 0.1)  # they may differ within the encoder's noise of a reversal


def test_a_link_that_is_a_point_is_thickened_so_that_the_simulator_takes_it_and_the_torque_stays(
    tmp_path: Path,
) -> None:
    path = model_with(tmp_path)
    content = yaml.safe_load(path.read_text())
    content["links"][2] = {"mass": 2.0, "first_moment": [0.2, 0.0, 0.0], "inertia": [0.0, 0.02, 0.02, 0.0, 0.0, 0.0]}
    path.write_text(yaml.safe_dump(content))
    lines = list(export_model(path, tmp_path / "arm.xml"))
    assert lines[-1] == "given a little extent, as simulators want it: link 3"
    motion = states()
    assert_allclose(mujoco_torque(tmp_path / "arm.xml", motion), torque(path, motion), atol=1e-3)
