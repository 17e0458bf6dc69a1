"""Real clients: what they write is read, and what is written they read, with their own package where it is small."""

import json
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from client_versions import BEGIN, END, PAGE, client_table
from joint_state_bags import write_bag
from numpy.testing import assert_allclose
from recording_folders import IMPORT_OPTIONS, POSITION, TORQUE, frame
from refusals import refusal
from servo_arms import arm_text, write_recording

from armlab.cli.main import main
from armlab.diagnosis.motion.robot_learning import isaac_lab_text
from armlab.diagnosis.motion.servo import KEYS, NEUTRAL, Servos
from armlab.diagnosis.motion.servo_simulation import read_servo_simulation
from armlab.recordings.imports.files import import_files
from armlab.recordings.imports.isaac_lab import read_isaac_lab
from armlab.recordings.load import load_recording
from armlab.recordings.motion import load_motion_recording
from armlab.report.signals_file import recorded_track, signals_content

JOINTS = ("shoulder", "elbow")
ISAAC_LAB = """
from isaaclab.actuators import DCMotorCfg, ImplicitActuatorCfg
import isaaclab.sim as sim_utils

ARM_CFG = ArticulationCfg(
    spawn=sim_utils.UsdFileCfg(usd_path=f"{NUCLEUS}/arm.usd"),
    actuators={
        "upper": ImplicitActuatorCfg(
            joint_names_expr=["shou.*"], effort_limit_sim={"shou.*": 3.0}, stiffness=60.0, damping={".*": 0.3},
            armature=0.01,
        ),
        "lower": actuators.IdealPDActuatorCfg(joint_names_expr=["elbow"], stiffness=40.0, damping=None),
        "hand": DCMotorCfg(joint_names_expr=["finger_.*"], stiffness=25.0, damping=0.5, saturation_effort=23.5),
    },
)
"""


@pytest.fixture(scope="module")
def servo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of motion only, of an arm with two position servos."""
    return write_recording(tmp_path_factory.mktemp("clients") / "servo", {"kp": 40.0}, seconds=4.0)


def test_the_table_of_clients_has_the_versions_that_are_installed() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert text[text.index(BEGIN) + len(BEGIN) : text.index(END)].strip() == client_table().strip()


@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_a_ros_2_bag_goes_in_and_its_signals_come_out_as_one(tmp_path: Path, storage: str) -> None:
    robot = tmp_path / "arm.yaml"
    from problem.robot_file import BUILT_IN_FOLDER

    text = (BUILT_IN_FOLDER / "irb120-arm.yaml").read_text()
    robot.write_text(text.replace("name: joint", "name: j"))
    bag = write_bag(tmp_path / "bag", storage, frame())
    options = {**IMPORT_OPTIONS, "robot": str(robot)}
    run = load_recording(import_files([bag], tmp_path / "first", options).folder).runs[0]
    assert_allclose(run.torque, frame()[TORQUE], atol=1e-9)
    content, _ = signals_content([recorded_track(run, "log", run.torque)], ("j1", "j2", "j3"))
    (tmp_path / "signals.mcap").write_bytes(content)
    again = load_recording(import_files([tmp_path / "signals.mcap"], tmp_path / "second", options).folder).runs[0]
    assert_allclose(again.position, frame()[POSITION], atol=1e-9)
    assert_allclose(again.torque, run.torque, atol=1e-9)
    decoder = pytest.importorskip("mcap_ros2.decoder").DecoderFactory()
    from mcap.reader import make_reader

    with (tmp_path / "signals.mcap").open("rb") as stream:
        messages = list(make_reader(stream, decoder_factories=[decoder]).iter_decoded_messages())
    assert {channel.topic for _, channel, _, _ in messages} == {"/log/recorded"}
    assert_allclose([state.effort for *_, state in messages], run.torque, atol=1e-12)


def test_a_recording_goes_out_as_a_lerobot_dataset_and_comes_back(servo: Path, tmp_path: Path) -> None:
    dataset = tmp_path / "dataset"
    done = CliRunner().invoke(main, ["recording", "export", str(servo), str(dataset), "--task", "Reach."])
    assert done.exit_code == 0, done.output
    options = {**IMPORT_OPTIONS, "robot": str(servo / "arm.xml"), "units": ("position=deg", "reference_position=deg")}
    back = load_motion_recording(import_files([dataset], tmp_path / "back", options).folder)
    before = load_motion_recording(servo)
    assert len(back.runs) == len(before.runs)
    for new, old in zip(back.runs, before.runs, strict=True):
        count = min(new.samples, old.samples)
        assert_allclose(new.position[:count], old.position[:count], atol=1e-5)
        assert new.reference_position is not None
        assert old.reference_position is not None
        assert_allclose(new.reference_position[:count], old.reference_position[:count], atol=1e-5)


def test_a_lerobot_dataset_has_the_files_and_columns_that_lerobot_looks_up(servo: Path, tmp_path: Path) -> None:
    dataset = tmp_path / "dataset"
    assert CliRunner().invoke(main, ["recording", "export", str(servo), str(dataset), "--fps", "30"]).exit_code == 0
    info = json.loads((dataset / "meta/info.json").read_text())
    data = pd.read_parquet(dataset / info["data_path"].format(chunk_index=0, file_index=0))
    assert set(data) == set(info["features"])
    assert (info["codebase_version"], info["fps"], info["total_frames"]) == ("v3.0", 30, len(data))
    assert_allclose(data["timestamp"], data["frame_index"] / 30, atol=1e-4)  # lerobot's tolerance
    episodes = pd.read_parquet(dataset / "meta/episodes/chunk-000/file-000.parquet")
    places = ["data/chunk_index", "data/file_index", "meta/episodes/chunk_index", "meta/episodes/file_index"]
    assert not episodes[places].to_numpy().any()
    for _, episode in episodes.iterrows():
        own = data.iloc[episode["dataset_from_index"] : episode["dataset_to_index"]]
        assert set(own["episode_index"]) == {episode["episode_index"]}
        assert len(own) == episode["length"]
    tasks = pd.read_parquet(dataset / "meta/tasks.parquet")
    assert (tasks.index.name, tasks.loc["Move the arm.", "task_index"]) == ("task", 0)
    stats = json.loads((dataset / "meta/stats.json").read_text())
    assert_allclose(stats["action"]["mean"], np.stack(data["action"].tolist()).mean(axis=0), rtol=1e-5)


def test_a_lerobot_dataset_of_version_2_1_goes_in(servo: Path, tmp_path: Path) -> None:
    new, old = tmp_path / "new", tmp_path / "old"
    assert CliRunner().invoke(main, ["recording", "export", str(servo), str(new)]).exit_code == 0
    info = json.loads((new / "meta/info.json").read_text())
    (old / "meta").mkdir(parents=True)
    (old / "data/chunk-000").mkdir(parents=True)
    path = "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet"
    (old / "meta/info.json").write_text(json.dumps({**info, "codebase_version": "v2.1", "data_path": path}))
    data = pd.read_parquet(new / "data/chunk-000/file-000.parquet")
    for number, rows in data.groupby("episode_index"):
        rows.to_parquet(old / path.format(episode_chunk=0, episode_index=number))
    options = {**IMPORT_OPTIONS, "robot": str(servo / "arm.xml"), "units": ("position=deg", "reference_position=deg")}
    back = load_motion_recording(import_files([old], tmp_path / "back", options).folder)
    assert [run.samples for run in back.runs] == data.groupby("episode_index").size().tolist()


def test_an_mjcf_goes_in_and_what_comes_out_moves_alike_in_mujoco(servo: Path, tmp_path: Path) -> None:
    from armlab.diagnosis.motion.export import mjcf_text

    recording = load_motion_recording(servo)
    simulation = read_servo_simulation(recording)
    values = simulation.nominal.values.copy()
    values[:, KEYS.index("kp")] = 30.0
    (tmp_path / "simulation.xml").write_text(mjcf_text(simulation, Servos(values))[0])
    written = mujoco.MjModel.from_xml_path(str(tmp_path / "simulation.xml"))
    ends = []
    for model in (mujoco.MjModel.from_xml_string(arm_text(kp=30.0)), written):
        data = mujoco.MjData(model)
        data.ctrl[:] = [0.4, -0.3]
        mujoco.mj_step(model, data, 500)
        ends.append(data.qpos.copy())
    assert_allclose(ends[1], ends[0], atol=1e-6)


def test_actuators_of_isaac_lab_go_in_as_text_that_is_not_run(servo: Path, tmp_path: Path) -> None:
    (tmp_path / "arm_cfg.py").write_text(ISAAC_LAB)
    assert read_isaac_lab(tmp_path / "arm_cfg.py", JOINTS) == {
        "kp": [60.0, 40.0],
        "kd": [0.3, None],
        "torque_limit": [3.0, None],
    }
    table = pd.read_csv(servo / "run-1.csv")
    (tmp_path / "arm.xml").write_text(arm_text())
    table.to_csv(tmp_path / "log.csv", index=False)
    options = {
        **IMPORT_OPTIONS,
        "robot": str(tmp_path / "arm.xml"),
        "position": "q1,q2",
        "reference_position": "c1,c2",
        "units": ("position=rad", "reference_position=rad"),
        "controller": str(tmp_path / "arm_cfg.py"),
    }
    folder = import_files([tmp_path / "log.csv"], tmp_path / "new", options).folder
    controller = load_motion_recording(folder).controller
    assert controller is not None
    assert (controller.kp, controller.kd, controller.torque_limit) == ((60.0, 40.0), (0.3, None), (3.0, None))


def test_actuators_that_go_out_to_isaac_lab_come_back_with_their_numbers(servo: Path, tmp_path: Path) -> None:
    simulation = read_servo_simulation(load_motion_recording(servo))
    values = np.tile(NEUTRAL, (2, 1))
    for key, numbers in {"kp": (8.0, 9.0), "kd": (0.12, 0.2), "limit": (1.1, 2.2)}.items():
        values[:, KEYS.index(key)] = numbers
    (tmp_path / "isaaclab_actuators.py").write_text(isaac_lab_text(simulation, Servos(values), 0.001))
    back = read_isaac_lab(tmp_path / "isaaclab_actuators.py", JOINTS)
    assert back == {"kp": [8.0, 9.0], "kd": [0.12, 0.2], "torque_limit": [1.1, 2.2]}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x = 1", "has no actuators of Isaac Lab"),
        ("a = (", "as Python"),
        ("DCMotorCfg(joint_names_expr=['.*'], stiffness=1.0)", "the law of DCMotorCfg of joint 'shoulder' is no PD"),
        ("ImplicitActuatorCfg(joint_names_expr=['elbow'], stiffness=1.0)", "no actuators for joint 'shoulder'"),
        ("ImplicitActuatorCfg(joint_names_expr=['.*'], stiffness=STIFF)", "line 1: stiffness should be written out"),
        ("ImplicitActuatorCfg(stiffness=1.0)", "has no joint_names_expr"),
    ],
)
def test_a_configuration_that_tells_no_pd_is_refused(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "cfg.py").write_text(text)
    assert words in refusal(read_isaac_lab, tmp_path / "cfg.py", JOINTS)


def test_a_recording_with_torque_is_no_lerobot_dataset(tmp_path: Path) -> None:
    from recording_folders import folder_with

    folder: Any = folder_with(tmp_path / "rec", frame())
    done = CliRunner().invoke(main, ["recording", "export", str(folder), str(tmp_path / "out")])
    assert done.exit_code == 2
    assert "reference_position" in done.output
