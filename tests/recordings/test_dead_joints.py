"""A joint whose torque nobody recorded is left out, and the others are told as if its rows did not exist."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from click.testing import CliRunner
from recording_folders import SETTINGS, folder_with, frame
from refusals import refusal

from armlab.cli.main import main
from armlab.identification.identifier import Identifier
from armlab.recordings.load import load_recording
from armlab.recordings.motion import load_motion_recording
from armlab.recordings.plain_least_squares import NormalEquations, PlainLayout, fit_plain_rows, prepare_rows
from problem.motion import Motion
from problem.regressor import gram_matrix, observation_matrix, rigid_body_torque
from problem.robot_file import load_arm

ALONE = {"runs": SETTINGS["runs"][:1]}
DEAD = {
    "zero": ({"tau2": 0.0}, {1}, "torque of joint 2 is zero throughout: left out"),
    "constant": ({"tau2": 1.5}, {1}, "torque of joint 2 never changes: left out"),
    "two of three": ({"tau1": 0.0, "tau3": 2.0}, {0, 2}, "torque of joint 3 never changes: left out"),
}


def recorded(folder: Path, **changed: float) -> Path:
    return folder_with(folder, frame().assign(**changed), ALONE)


@pytest.mark.parametrize("name", DEAD)
def test_a_joint_without_torque_is_left_out_and_said(name: str, tmp_path: Path) -> None:
    changed, joints, text = DEAD[name]
    recording = load_recording(recorded(tmp_path, **changed))
    assert recording.arm.unmeasured == joints
    assert not recording.runs[0].torque[:, sorted(joints)].any()
    assert text in [each.text for each in recording.findings]


def test_of_two_equal_columns_both_are_left_out(tmp_path: Path) -> None:
    table = frame()
    recording = load_recording(folder_with(tmp_path, table.assign(tau3=table["tau2"]), ALONE))
    assert recording.arm.unmeasured == {1, 2}


def test_the_dynamics_leave_the_rows_of_such_a_joint_zero() -> None:
    arm = load_arm("irb120-arm")
    motion = Motion(*np.random.default_rng(0).uniform(-1, 1, (3, 20, 3)))
    part = replace(arm, unmeasured=frozenset({1}))
    rows = observation_matrix(part, motion).reshape(20, 3, 30)
    whole = observation_matrix(arm, motion).reshape(20, 3, 30)
    assert not rows[:, 1].any()
    np.testing.assert_array_equal(rows[:, [0, 2]], whole[:, [0, 2]])
    np.testing.assert_array_equal(rigid_body_torque(part, motion)[:, [0, 2]], rigid_body_torque(arm, motion)[:, [0, 2]])
    columns, flat = np.arange(30), rows.reshape(60, 30)
    np.testing.assert_allclose(gram_matrix(part, motion, columns), flat.T @ flat)


def test_plain_least_squares_is_that_of_the_other_rows(tmp_path: Path) -> None:
    whole = load_recording(folder_with(tmp_path / "whole", frame(), ALONE))
    part = load_recording(recorded(tmp_path / "part", tau2=0.0))
    rows = prepare_rows(whole.runs[0], 5.0)
    layout = PlainLayout(whole.arm, (0, 1, 2), np.abs(rows.motion.velocity).max(axis=0))
    kept = [0, 2]
    values, _ = NormalEquations.of(layout.matrix(rows.motion)[:, kept], rows.torque[:, kept]).solve()
    expected = (layout.matrix(rows.motion) @ values)[:, kept]
    found = fit_plain_rows(part.arm, [prepare_rows(part.runs[0], 5.0)], 5.0)
    predicted = (found.layout.matrix(rows.motion) @ found.values)[:, kept]
    np.testing.assert_allclose(predicted, expected, atol=1e-6 * np.abs(expected).max())


def test_identification_has_no_component_at_such_a_joint(tmp_path: Path) -> None:
    recording = load_recording(recorded(tmp_path, tau2=0.0))
    model = Identifier(recording.arm, cutoff_hz=5.0).fit(recording.runs).model_
    assert {part.joint for part in model.structure.components} == {1, 3}


def diagnosed(folder: Path, out: Path) -> dict[str, object]:
    done = CliRunner().invoke(main, ["diagnose", str(folder), "--out", str(out)])
    assert done.exit_code == 0, done.output
    return json.loads((out / "verdict.json").read_text())


def test_a_diagnosis_says_it_first_and_tells_the_other_joints(tmp_path: Path) -> None:
    folder = recorded(tmp_path / "recording", tau2=0.0)
    found = diagnosed(folder, tmp_path / "out")
    first, *others = found["findings"]
    assert (first["kind"], first["effect"], first["joint"]) == ("setup", "no_torque", 2)
    assert found["summary"].startswith("Left out: joint 2 has no torque.")
    assert {each["joint"] for each in found["fit"]} == {each["joint"] for each in found["left"]} == {1, 3}
    assert {each["joint"] for each in others if each["kind"] == "physics"} <= {1, 3, None}
    corrected = tmp_path / "out" / "corrected"
    assert yaml.safe_load((corrected / "recording.yaml").read_text())["without_torque"] == [2]
    again = diagnosed(corrected, tmp_path / "again")
    assert "setup" not in {each["kind"] for each in again["findings"]}
    assert [each["effect"] for each in again["findings"]] == [each["effect"] for each in others]


def test_a_file_may_say_that_a_joint_has_no_torque(tmp_path: Path) -> None:
    table = frame()
    noise = np.random.default_rng(0).normal(0, 3.0, len(table))
    folder = folder_with(tmp_path / "said", table.assign(tau2=noise), ALONE | {"without_torque": [2]})
    recording = load_recording(folder)
    assert recording.arm.unmeasured == {1}
    assert "no_torque" not in {each.kind for each in recording.findings}
    empty = folder_with(tmp_path / "empty", table.assign(tau2=np.nan), ALONE | {"without_torque": [2]})
    assert load_recording(empty).runs[0].samples == recording.runs[0].samples


@pytest.mark.parametrize(("joints", "word"), [([4], "names joint 4, but the robot has 3"), ([1, 2, 3], "all joints")])
def test_a_file_that_says_it_of_no_joint_or_of_all_is_refused(joints: list[int], word: str, tmp_path: Path) -> None:
    folder = folder_with(tmp_path, frame(), ALONE | {"without_torque": joints})
    assert word in refusal(load_recording, folder)


def test_a_prediction_judges_the_other_joints(tmp_path: Path) -> None:
    sound, out = folder_with(tmp_path / "sound", frame(), ALONE), tmp_path / "model"
    assert CliRunner().invoke(main, ["identify", str(sound), "--out", str(out)]).exit_code == 0
    part = recorded(tmp_path / "part", tau2=0.0)
    done = CliRunner().invoke(main, ["predict", str(out / "model.yaml"), str(part)])
    assert done.exit_code == 0
    rows = pd.DataFrame(line.split()[:3] for line in done.output.splitlines() if line.startswith("run.csv "))
    assert list(rows[2]) == ["1", "3"]


def test_a_recording_of_motion_only_has_no_joint_to_leave_out(tmp_path: Path) -> None:
    folder = folder_with(tmp_path, frame(), ALONE | {"without_torque": [2]})
    settings = yaml.safe_load((folder / "recording.yaml").read_text())
    settings["columns"]["reference_position"] = settings["columns"].pop("torque")
    settings["units"].pop("torque")
    (folder / "recording.yaml").write_text(yaml.safe_dump(settings))
    assert "a recording of motion only has no torque at all" in refusal(load_motion_recording, folder)
