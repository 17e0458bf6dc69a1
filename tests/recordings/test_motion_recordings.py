"""Recordings of motion only: read, checked and imported; a robot from MJCF is the arm that MuJoCo simulates."""

import json
from pathlib import Path

import mujoco
import numpy as np
import pandas as pd
import pytest
import yaml
from click.testing import CliRunner
from refusals import refusal
from servo_arms import arm_text, commands, simulate, write_recording

from armlab.cli.main import main
from armlab.recordings.check import check_recording
from armlab.recordings.imports.lerobot import read_lerobot
from armlab.recordings.motion import load_motion_recording
from problem.mjcf import read_mjcf
from problem.motion import Motion
from problem.regressor import rigid_body_torque


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_recording(tmp_path_factory.mktemp("motion") / "servo", {"kp": 6.0}, seconds=6.0)


def rewritten(folder: Path, new: Path, **changes: object) -> Path:
    """The same recording with other keys."""
    new.mkdir()
    for path in folder.iterdir():
        (new / path.name).write_bytes(path.read_bytes())
    settings = yaml.safe_load((new / "recording.yaml").read_text())
    (new / "recording.yaml").write_text(yaml.safe_dump({**settings, **changes}))
    return new


def test_an_arm_from_mjcf_has_the_torques_of_mujoco(tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    path.write_text(arm_text(damping=0, frictionloss=0, armature=0))
    arm, model = read_mjcf(path), mujoco.MjModel.from_xml_path(str(path))
    model.opt.disableflags = mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.qacc[:] = motion = np.random.default_rng(0).normal(size=(3, 2))
    mujoco.mj_inverse(model, data)
    ours = rigid_body_torque(arm, Motion(*(each[None] for each in motion)), arm.parameters)
    np.testing.assert_allclose(ours[0], data.qfrc_inverse, atol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        (
            '<joint name="elbow" axis="0 1 0" range="-3 3"/>',
            '<joint name="elbow" type="ball"/>',
            "only hinge and slide joints",
        ),
        ('<body name="upper">', '<body name="upper"><freejoint/>', "MuJoCo cannot compile"),
        ("</worldbody>", '<body><joint name="x"/><geom size="1"/></body></worldbody>', "a second branch"),
        ("<worldbody>", "<worldbod>", "MuJoCo cannot compile"),
    ],
)
def test_an_mjcf_that_is_no_arm_is_refused_in_one_line(tmp_path: Path, old: str, new: str, reason: str) -> None:
    path = tmp_path / "arm.xml"
    path.write_text(arm_text().replace(old, new))
    assert reason in refusal(read_mjcf, path)


def test_a_motion_recording_is_read_in_si_units(folder: Path) -> None:
    recording = load_motion_recording(folder)
    run = recording.runs[0]
    assert [len(recording.with_role(role)) for role in ("identify", "validate")] == [2, 1]
    assert run.position.shape == (300, 2)
    assert run.reference_position is not None
    np.testing.assert_allclose(run.reference_position, commands(1, 6.0), atol=1e-12)


def test_excluded_stretches_are_left_out_and_cut_the_run(folder: Path, tmp_path: Path) -> None:
    runs = [{"file": "run-1.csv", "exclude": [[2.0, 2.5]]}]
    parts = load_motion_recording(rewritten(folder, tmp_path / "cut", runs=runs)).runs
    assert [part.name for part in parts] == ["run-1.csv part 1", "run-1.csv part 2"]
    assert parts[0].time[-1] == pytest.approx(1.98)
    assert parts[1].time[0] == pytest.approx(2.52)
    assert any(finding.kind == "excluded" for finding in parts[0].findings)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"joints": ["shoulder", "wrist"]}, "no joint 'wrist'"),
        ({"joints": ["shoulder"]}, "names 2 columns, but the robot has 1 joints"),
        ({"controller": {"type": "pd", "kp": [1.0], "kd": [None]}}, "controller.kp"),
        ({"simulation": "model.yaml"}, "compared with the MJCF of `robot` and `controller`"),
        ({"runs": [{"file": "run-1.csv", "exclude": [[7.0, 8.0]]}]}, "holds no row"),
        ({"runs": [{"file": "run-1.csv", "exclude": [[3.0, 2.0]]}]}, "should hold [first, last]"),
    ],
)
def test_a_faulty_motion_recording_is_refused_in_one_line(
    folder: Path, tmp_path: Path, changes: dict[str, object], reason: str
) -> None:
    assert reason in refusal(load_motion_recording, rewritten(folder, tmp_path / "new", **changes))


def test_a_joint_that_was_not_recorded_may_be_left_out(folder: Path, tmp_path: Path) -> None:
    columns = {"time": "t", "reference_position": ["c2"], "position": ["q2"]}
    recording = load_motion_recording(rewritten(folder, tmp_path / "one", joints=["elbow"], columns=columns))
    assert (recording.joints, len(recording.arm), len(recording.recorded_arm)) == ((1,), 2, 1)


@pytest.mark.parametrize(
    ("changes", "kind"),
    [
        ({"units": {"reference_position": "deg"}}, "command_unit"),
        ({"columns": {"time": "t", "reference_position": ["c2", "c1"], "position": ["q1", "q2"]}}, "exchanged_columns"),
        ({"columns": {"time": "t", "reference_position": ["c1", "c2"], "position": ["z1", "q2"]}}, "still_joint"),
    ],
)
def test_the_check_names_what_was_mistaken(tmp_path: Path, changes: dict[str, object], kind: str) -> None:
    whole = write_recording(tmp_path / "whole", {"kp": 40.0}, seconds=6.0)
    for path in whole.glob("*.csv"):
        table = pd.read_csv(path)
        still = kind == "still_joint"
        table.assign(z1=0.1, c1=0.1 if still else table["c1"]).to_csv(path, index=False)
    found = check_recording(rewritten(whole, tmp_path / "new", **changes))
    assert kind in {finding.kind for _, finding in found.findings}
    sound = check_recording(whole)
    assert kind == "still_joint" or kind not in {finding.kind for _, finding in sound.findings}


def test_the_command_checks_a_motion_recording(folder: Path, tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["recording", "check", str(folder), "--out", str(tmp_path / "page.html")])
    assert result.exit_code == 0, result.output
    assert "command and position of run-1.csv" in (tmp_path / "page.html").read_text()


def test_a_log_of_commands_and_positions_is_imported(folder: Path, tmp_path: Path) -> None:
    options = [
        "--robot",
        str(folder / "arm.xml"),
        "--time",
        "t",
        "--position",
        "q1,q2",
        "--reference-position",
        "c1,c2",
    ]
    options += ["--unit", "time=s", "--unit", "position=rad", "--unit", "reference_position=rad"]
    command = ["recording", "import", str(folder / "run-1.csv"), "--out", str(tmp_path / "new"), *options]
    result = CliRunner().invoke(main, command)
    assert result.exit_code == 0, result.output
    assert load_motion_recording(tmp_path / "new").runs[0].samples == 300


def test_a_lerobot_dataset_is_imported_an_episode_a_run(folder: Path, tmp_path: Path) -> None:
    data = tmp_path / "dataset"
    (data / "meta").mkdir(parents=True)
    (data / "data" / "chunk-000").mkdir(parents=True)
    names = ["shoulder.pos", "elbow.pos", "gripper.pos"]
    features = {key: {"dtype": "float32", "shape": [3], "names": names} for key in ("action", "observation.state")}
    (data / "meta" / "info.json").write_text(json.dumps({"codebase_version": "v3.0", "features": features}))
    command = commands(5, 6.0)
    position = simulate(arm_text(), command)
    row = {"timestamp": np.tile(np.arange(150) / 50.0, 2), "episode_index": np.repeat([0, 1], 150)}
    for key, values in (("action", command), ("observation.state", position)):
        row[key] = [[*np.degrees(each), 0.0] for each in values]
    pd.DataFrame(row).to_parquet(data / "data" / "chunk-000" / "file-000.parquet")
    options = ["--robot", str(folder / "arm.xml"), "--joints", "shoulder,elbow"]
    options += ["--unit", "position=deg", "--unit", "reference_position=deg"]
    result = CliRunner().invoke(main, ["recording", "import", str(data), "--out", str(tmp_path / "new"), *options])
    assert result.exit_code == 0, result.output
    recording = load_motion_recording(tmp_path / "new")
    assert [run.name for run in recording.runs] == ["episode-000000.csv", "episode-000001.csv"]
    np.testing.assert_allclose(recording.runs[1].position, position[150:], atol=1e-9)
    (data / "meta" / "info.json").write_text(json.dumps({"codebase_version": "v1.6"}))
    result = CliRunner().invoke(main, ["recording", "import", str(data), "--out", str(tmp_path / "old"), *options])
    assert result.exit_code == 2
    assert "no LeRobot dataset of version 2 or 3" in result.output


@pytest.mark.parametrize(
    ("features", "episode", "message"),
    [
        ({"action": None}, 0.0, "features.action.names should be a list of names"),
        ({}, None, "episode_index has rows without a number"),
    ],
)
def test_a_broken_lerobot_dataset_is_told_in_one_line(
    tmp_path: Path, features: dict, episode: float | None, message: str
) -> None:
    (tmp_path / "meta").mkdir()
    (tmp_path / "data").mkdir()
    usual = {key: {"names": ["a", "b"]} for key in ("action", "observation.state")}
    info = {"codebase_version": "v3.0", "features": usual | features}
    (tmp_path / "meta" / "info.json").write_text(json.dumps(info))
    row = {"timestamp": [0.0], "episode_index": [episode], "action": [[0.0, 0.0]], "observation.state": [[0.0, 0.0]]}
    pd.DataFrame(row).astype({"episode_index": float}).to_parquet(tmp_path / "data" / "file.parquet")
    assert message in refusal(read_lerobot, tmp_path)
