"""The servos of a diagnosis in other simulators: names as they read them, and the torque that they compute of them.

The names stand in `simulator_fields.yaml`, with source and version. The laws are written here from those sources.
"""

import sys
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, make_dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import mujoco
import numpy as np
import pytest
import yaml
from servo_arms import arm_text, write_recording

from armlab.diagnosis.motion.export import lines_without_field, mjcf_text, servos_json
from armlab.diagnosis.motion.replay import replay
from armlab.diagnosis.motion.robot_learning import isaac_lab_text, mjlab_text
from armlab.diagnosis.motion.ros2_control import controllers_text, ros_urdf_text
from armlab.diagnosis.motion.servo import INFINITE_LIMIT, KEYS, NEUTRAL, Servos
from armlab.diagnosis.motion.servo_plugin import ServoPlugin, installed, read_servos
from armlab.diagnosis.motion.servo_simulation import ServoSimulation, read_servo_simulation
from armlab.diagnosis.motion.windows import smooth_motion
from armlab.recordings.motion import MotionRecording, load_motion_recording
from problem.robot_file import load_arm

SOURCES = yaml.safe_load((Path(__file__).parent / "simulator_fields.yaml").read_text())
STEP_S = 0.001
NUMBERS = {"kp": 8.0, "damping": 0.05, "friction": 0.08, "kd": 0.12, "armature": 0.011, "limit": 1.1, "delay": 0.0214}
BEYOND_FIELDS = {"limit_slope": 0.2, "offset": 0.02, "dead_band": 0.03, "load_friction": 0.15, "static_excess": 0.04}


def make_servos(**numbers: float) -> Servos:
    """Two servos alike, with neutral numbers where none is given."""
    values = np.tile(NEUTRAL, (2, 1))
    for key, value in numbers.items():
        values[:, KEYS.index(key)] = value
    return Servos(values)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> MotionRecording:
    return load_motion_recording(write_recording(tmp_path_factory.mktemp("arm") / "servo", {}, seconds=3.0))


@pytest.fixture(scope="module")
def simulation(recording: MotionRecording) -> ServoSimulation:
    return read_servo_simulation(recording)


def config_class(source: dict[str, Any]) -> type:
    """A class that takes the fields of the source's class, and no others; those without default are required."""
    required = [(name, Any) for name in source["required"]]
    others = [(name, Any, None) for name in source["fields"] if name not in source["required"]]
    return make_dataclass(source["class"], [*required, *others], kw_only=True)


def run_file(text: str, modules: dict[str, dict[str, Any]], folder: Path) -> dict[str, Any]:
    """The names that a written Python file defines, with the classes of the source in place of the package."""
    before = {name: sys.modules.get(name) for name in modules}
    for name, content in modules.items():
        module = ModuleType(name)
        vars(module).update(content)
        sys.modules[name] = module
    names: dict[str, Any] = {"__file__": str(folder / "written.py")}
    try:
        exec(compile(text, "written.py", "exec"), names)
    finally:
        for name, module in before.items():
            sys.modules.pop(name) if module is None else sys.modules.update({name: module})
    return names


def isaac_actuators(text: str, folder: Path) -> list[Any]:
    source = SOURCES["isaaclab"]
    modules = {"isaaclab": {}, "isaaclab.actuators": {source["class"]: config_class(source)}}
    return list(run_file(text, modules, folder)["ACTUATORS"].values())


def mjlab_names(text: str, folder: Path) -> dict[str, Any]:
    @dataclass
    class EntityArticulationInfoCfg:
        actuators: tuple[Any, ...] = ()
        soft_joint_pos_limit_factor: float = 1.0

    source = SOURCES["mjlab"]
    modules = {
        "mjlab": {},
        "mjlab.actuator": {source["class"]: config_class(source)},
        "mjlab.entity": {"EntityArticulationInfoCfg": EntityArticulationInfoCfg},
    }
    return run_file(text, modules, folder)


def law(error: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Torque of the servo of NUMBERS less its joint's damping."""
    drive = np.clip(NUMBERS["kp"] * error - NUMBERS["kd"] * velocity, -NUMBERS["limit"], NUMBERS["limit"])
    return np.asarray(drive - NUMBERS["damping"] * velocity)


STATES = np.random.default_rng(3).uniform([-0.4, -3.0], [0.4, 3.0], (50, 2)).T  # error, rad; velocity, rad/s


def test_isaac_lab_computes_the_torque_of_the_law(simulation: ServoSimulation, tmp_path: Path) -> None:
    (first, second) = isaac_actuators(isaac_lab_text(simulation, make_servos(**NUMBERS), STEP_S), tmp_path)
    assert (first.joint_names_expr, second.joint_names_expr) == (["shoulder"], ["elbow"])
    error, velocity = STATES
    computed = first.stiffness * error + first.damping * (0.0 - velocity)  # IdealPDActuator.compute
    applied = np.clip(computed, -first.effort_limit, first.effort_limit)
    np.testing.assert_allclose(applied - first.viscous_friction * velocity, law(error, velocity), rtol=1e-6)
    assert (first.armature, first.friction, first.dynamic_friction) == (0.011, 0.08, 0.08)
    assert first.min_delay == first.max_delay == 21
    assert SOURCES["isaaclab"]["units"]["min_delay"] == "physics time-steps"


def test_the_simulation_keeps_the_text_of_the_file_and_takes_a_payload(
    simulation: ServoSimulation, tmp_path: Path
) -> None:
    own = tmp_path / "own.xml"
    own.write_text(simulation.path.read_text().replace("<worldbody>", "<!-- ours --><worldbody>"))
    loaded = replace(simulation, path=own, payload=0.2)
    text, notes = mjcf_text(loaded, make_servos(**NUMBERS))
    assert "<!-- ours --><worldbody>" in text
    assert notes == ()
    np.testing.assert_allclose(
        mujoco.MjModel.from_xml_string(text).body_inertia, loaded.model().body_inertia, rtol=1e-9, atol=1e-15
    )


def test_mjlab_computes_the_torque_of_the_law(simulation: ServoSimulation, tmp_path: Path) -> None:
    servos = make_servos(**NUMBERS)
    (tmp_path / "simulation.xml").write_text(mjcf_text(simulation, servos)[0])
    names = mjlab_names(mjlab_text(simulation, servos, STEP_S), tmp_path)
    spec = names["make_spec"]()
    assert not list(spec.actuators)
    for each in names["ARTICULATION"].actuators:  # create_position_actuator of mjlab/utils/spec.py
        (name,) = each.target_names_expr
        made = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        made.gaintype, made.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
        made.gainprm[0], made.biasprm[1], made.biasprm[2] = each.stiffness, -each.stiffness, -each.damping
        made.forcelimited, made.forcerange = True, [-each.effort_limit, each.effort_limit]
        joint = spec.joint(name)
        joint.armature, joint.frictionloss, joint.damping[0] = each.armature, each.frictionloss, each.viscous_damping
        assert each.delay_min_lag == each.delay_max_lag == 21
    model = spec.compile()
    data = mujoco.MjData(model)
    for error, velocity in STATES.T:
        data.ctrl[:], data.qvel[:] = error, velocity
        mujoco.mj_forward(model, data)
        torque = data.qfrc_actuator + data.qfrc_passive
        np.testing.assert_allclose(torque, law(np.full(2, error), np.full(2, velocity)), rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(model.dof_frictionloss, 0.08)


def test_a_servo_without_limit_has_none_in_each_file(simulation: ServoSimulation, tmp_path: Path) -> None:
    servos = make_servos(**{**NUMBERS, "limit": INFINITE_LIMIT})
    assert isaac_actuators(isaac_lab_text(simulation, servos, STEP_S), tmp_path)[0].effort_limit == 1e9
    assert (
        mjlab_names(mjlab_text(simulation, servos, STEP_S), tmp_path)["ARTICULATION"].actuators[0].effort_limit is None
    )
    assert not list(ElementTree.fromstring(ros_urdf_text(simulation, servos)).iter("param"))


def test_ros_2_files_have_the_names_and_the_torque_of_their_sources(
    simulation: ServoSimulation, tmp_path: Path
) -> None:
    servos, source = make_servos(**NUMBERS), SOURCES["ros2_control"]
    root = ElementTree.fromstring(ros_urdf_text(simulation, servos))
    for element in root.iter():
        assert element.tag in source["elements"]
        assert set(element.attrib) <= set(source["attributes"].get(element.tag, element.attrib))
    control = root.find("ros2_control")
    assert control is not None
    assert control.findtext("hardware/plugin") == source["plugin"]
    assert {each.get("name") for each in control.iter("state_interface")} <= set(source["interfaces"])
    content = yaml.safe_load(controllers_text(simulation, servos, STEP_S))
    servo = content["servo_controller"]["ros__parameters"]
    assert set(servo) <= set(SOURCES["pid_controller"]["fields"])
    gains = servo["gains"]["shoulder"]
    assert set(gains) <= set(SOURCES["pid_controller"]["gains"])
    dynamics = root.find("joint[@name='shoulder']/dynamics")
    (low, high) = (float(each.text or "nan") for each in list(control.iter("param"))[:2])
    assert dynamics is not None
    assert float(dynamics.get("friction", "nan")) == pytest.approx(0.08)
    error, velocity = STATES
    effort = np.clip(gains["p"] * error + gains["d"] * (0.0 - velocity), low, high)
    torque = effort - float(dynamics.get("damping", "nan")) * velocity
    np.testing.assert_allclose(torque, law(error, velocity), rtol=1e-6)
    assert content["controller_manager"]["ros__parameters"]["update_rate"] == 1000


def test_the_integral_gain_stands_where_there_is_a_field_and_is_said_elsewhere(simulation: ServoSimulation) -> None:
    servos = make_servos(**NUMBERS, ki=3.0, integral_limit=0.4)
    content = yaml.safe_load(controllers_text(simulation, servos, STEP_S))
    gains = content["servo_controller"]["ros__parameters"]["gains"]["elbow"]
    assert set(gains) <= set(SOURCES["pid_controller"]["gains"])
    assert (gains["i"], gains["antiwindup"], gains["i_clamp_max"], gains["i_clamp_min"]) == (3.0, True, 0.4, -0.4)
    assert "integral" not in ros_urdf_text(simulation, servos)
    for text in (isaac_lab_text(simulation, servos, STEP_S), mjlab_text(simulation, servos, STEP_S)):
        assert "elbow: add 3 N m/(rad s) times the integral of the error, at most 0.4 N m" in text
        assert "cascade" not in text
    cascade = make_servos(**NUMBERS, ki=3.0, ki_speed=0.5, integral_limit=0.4)
    assert "elbow: subtract 0.5 N m/rad times the error" in isaac_lab_text(simulation, cascade, STEP_S)


def test_the_plug_in_integrates_as_the_replay_of_armlab_does(
    recording: MotionRecording, simulation: ServoSimulation, tmp_path: Path
) -> None:
    servos = make_servos(**{**NUMBERS, "kd": 0.0}, ki=6.0, ki_speed=1.5, integral_limit=0.3)
    (tmp_path / "servos.json").write_text(servos_json(simulation, servos))
    model = mujoco.MjModel.from_xml_string(arm_text(kp=60))
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
    run = recording.runs[0]
    expected = replay(simulation, servos, [run])[0].position
    data = mujoco.MjData(model)
    data.qpos[:] = run.position[0]
    data.qvel[:] = smooth_motion(run, np.zeros(run.position.shape[1])).velocity[0]
    mujoco.mj_forward(model, data)
    weight = data.qfrc_bias - (NUMBERS["kp"] - 1.5) * (run.reference_position[0] - run.position[0])
    with installed(model, read_servos(tmp_path / "servos.json")) as plugin:
        plugin.integral = np.clip(weight, -0.3, 0.3)
        moved = follow(model, run)
    difference = np.abs(moved - expected).max()
    print(f"plug-in with an integral gain against replay, largest difference: {1e6 * difference:.3g} microrad")
    assert difference < 1e-6


def test_the_urdf_is_the_arm_that_it_was_made_of(simulation: ServoSimulation, tmp_path: Path) -> None:
    (tmp_path / "robot.urdf").write_text(ros_urdf_text(simulation, make_servos(**NUMBERS)))
    arm = load_arm("robot.urdf", tmp_path)
    assert [joint.name for joint in arm.joints] == ["shoulder", "elbow"]
    assert arm.joints[0].limits.torque == pytest.approx(1.1)
    assert sum(link.mass for link in arm.links or ()) == pytest.approx(0.5)


def test_each_file_says_what_it_does_not_hold(simulation: ServoSimulation, tmp_path: Path) -> None:
    servos = make_servos(**NUMBERS, **BEYOND_FIELDS)
    texts = [isaac_lab_text(simulation, servos, STEP_S), mjlab_text(simulation, servos, STEP_S)]
    for text in (*texts, ros_urdf_text(simulation, servos), "\n".join(lines_without_field(simulation, servos))):
        assert "shoulder: add 0.02 rad to the command" in text
        assert "dead band" in text
        assert "shoulder: lower the torque limit by 0.2 N m s/rad times the speed" in text
        assert "elbow: add 0.15 |load| to the friction" in text
        assert "elbow: add 0.04 exp(-(velocity / 0.1 rad/s)^2) N m to the friction" in text
    assert all("the delay of 21.4 ms becomes 21 steps of 1 ms, 21 ms" in text for text in texts)
    assert "rotor inertia of 0.011 kg m2" in ros_urdf_text(simulation, servos)
    assert all("nothing" not in text for text in texts)


def follow(model: Any, run: Any) -> np.ndarray:
    """Positions (samples, joints) of a user's own loop: commands as they were logged, one `mj_step` after another."""
    data = mujoco.MjData(model)
    time = run.time - run.time[0]
    data.qpos[:], data.qvel[:] = run.position[0], smooth_motion(run, np.zeros(run.position.shape[1])).velocity[0]
    data.ctrl[:] = run.reference_position[0]
    mujoco.mj_forward(model, data)
    path, steps = [], int(np.ceil(time[-1] / model.opt.timestep)) + 1
    for number in range(steps):
        now = number * model.opt.timestep
        path.append(data.qpos.copy())
        data.ctrl[:] = run.reference_position[np.searchsorted(time, now + 1e-9, side="right") - 1]
        mujoco.mj_step(model, data)
    grid = model.opt.timestep * np.arange(steps)
    return np.stack([np.interp(time, grid, column) for column in np.array(path).T], axis=1)


@pytest.mark.parametrize(("gain", "tolerance"), [(0.0, 1e-6), (0.12, 2e-4)])
def test_the_plug_in_moves_a_users_simulation_as_the_replay_of_armlab_does(
    recording: MotionRecording, simulation: ServoSimulation, tmp_path: Path, gain: float, tolerance: float
) -> None:
    """MuJoCo takes kd out of its implicit step while an actuator saturates: with kd, the paths differ by that."""
    servos = make_servos(**{**NUMBERS, "kd": gain, **BEYOND_FIELDS})
    (tmp_path / "servos.json").write_text(servos_json(simulation, servos))
    model = mujoco.MjModel.from_xml_string(arm_text(kp=60))
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
    run = recording.runs[0]
    expected = replay(simulation, servos, [run])[0].position
    with installed(model, read_servos(tmp_path / "servos.json")):
        moved = follow(model, run)
    assert mujoco.get_mjcb_passive() is None
    difference = np.abs(moved - expected).max()
    print(f"plug-in against replay, largest difference: {1e6 * difference:.3g} microrad")
    assert difference < tolerance
    assert np.abs(follow(model, run) - expected).max() > 1e-3


def test_the_plug_in_adds_the_torque_that_the_supply_voltage_takes(simulation: ServoSimulation) -> None:
    model = mujoco.MjModel.from_xml_string(arm_text())
    entries = [{"joint": name, **make_servos(**NUMBERS).of_joint(0)} for name in ("shoulder", "elbow")]
    plugin = ServoPlugin(model, {"rate_hz": None, "servos": entries})
    plugin.supply, data = 0.5, mujoco.MjData(model)
    data.ctrl[:] = 0.1
    mujoco.set_mjcb_passive(plugin)
    try:
        mujoco.mj_forward(model, data)
    finally:
        mujoco.set_mjcb_passive(None)
    np.testing.assert_allclose(data.qfrc_actuator + data.qfrc_passive, 0.5 * 8.0 * 0.1)


def test_the_plug_in_names_what_a_model_lacks() -> None:
    entry = {"joint": "wrist", **make_servos(**NUMBERS).of_joint(0)}
    with pytest.raises(ValueError, match="no joint 'wrist', only shoulder, elbow"):
        ServoPlugin(mujoco.MjModel.from_xml_string(arm_text()), {"servos": [entry]})
    model = mujoco.MjModel.from_xml_string(arm_text().replace('<position name="elbow" joint="elbow"/>', ""))
    with pytest.raises(ValueError, match="joint 'elbow' has no actuator"):
        ServoPlugin(model, {"servos": [{**entry, "joint": "elbow"}]})
