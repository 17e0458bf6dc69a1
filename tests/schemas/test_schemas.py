"""The formats: shipped schemas are those of the models, and hold what was valid before and what is written now."""

import copy
import json
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
import yaml
from refusals import refusal
from shipped_schemas import check_against_schema

from armlab.common.errors import InputError
from armlab.common.settings import validate
from armlab.diagnosis.formats import ComparisonFile, VerdictFile, kind_of_effect, read_verdict_file
from armlab.effects.library import effect_named
from armlab.recordings.load import load_recording
from armlab.recordings.recording_file import Draft, DraftRun, RecordingFile, read_recording_file, write_recording
from armlab.schemas import FORMATS, generate_schema, schema_path
from problem.robot_file import RobotFile, load_arm

LINK = {"mass": 5.2, "first_moment": [0.01, 0.31, 0.02], "inertia": [0.1, 0.2, 0.1, 0, 0, 0]}
ROBOT: dict[str, Any] = {
    "name": "swing",
    "dh_convention": "standard",
    "joints": [{"name": "joint1", "type": "revolute", "a": 0.0, "d": 0.29, "alpha": -1.5708}],
}
LONG_ROBOT = {
    **ROBOT,
    "gravity": [0, 0, -9.81],
    "joints": [
        {
            **ROBOT["joints"][0],
            "theta_offset": 0.1,
            "position_limits": [-2.88, 2.88],
            "velocity_limit": 4.36,
            "acceleration_limit": 20,
            "torque_limit": 80,
        },
        {"name": "slide", "type": "prismatic", "a": 0, "d": 0, "alpha": 0},
    ],
    "links": [LINK, LINK],
    "rotor_inertia": [0, 0.1],
}
RECORDING: dict[str, Any] = {
    "schema": "recording/1",
    "robot": "robot.yaml",
    "columns": {"time": "t", "position": ["q1"], "torque": ["tau1"]},
    "units": {"time": "s", "position": "rad", "torque": "N.m"},
    "runs": [{"file": "run-1.csv"}],
}
LONG_RECORDING = {
    **RECORDING,
    "simulation": "model.yaml",
    "sample_rate_hz": 500,
    "columns": {
        "time": "t",
        "position": ["q1", "q2"],
        "current": ["i1", "i2"],
        "velocity": ["v1", "v2"],
        "temperature": ["motor"],
        "link_position": ["l1", "l2"],
        "reference_position": ["r1", "r2"],
        "simulated_torque": ["s1", "s2"],
        "simulated_position": ["p1", "p2"],
    },
    "units": {"time": "s", "position": ["rad", "deg"], "current": "A"},
    "transmission": {"position": [[1, 0], [0, 1]], "offset": [0, 0], "torque": [[1, 0], [0, 1]]},
    "gains": [1.0, 2],
    "runs": [{"file": "run-1.csv", "role": "identify"}, {"file": "run-3.csv", "role": "validate"}],
}
VISCOUS = {"coefficient": {"value": 2.31, "ci95": [2.27, 2.35], "unit": "N.m.s/rad"}}
TILT = {"gravity": {"value": [0, 0.1, -9.8], "ci95": [[0, 0.1], [0.1, 0.2], [-9.9, -9.7]], "unit": "m/s2"}}
MODEL: dict[str, Any] = {"schema": "model/1", "robot": "irb120-arm", "links": [LINK], "components": []}
BASE_MODEL = {
    "schema": "model/1",
    "robot": "robot.yaml",
    "base_parameters": {"names": ["Izz1"], "values": [0.4], "covariance": [[0.01]]},
    "components": [
        {"effect": "viscous_friction", "joint": 2, "joints": [2], "parameters": VISCOUS},
        {"effect": "base_tilt", "joint": None, "parameters": TILT},
    ],
    "provenance": {"recording": "r", "runs": ["run-1.csv"], "settings": {}, "version": "0.1"},
}
FINDING: dict[str, Any] = {
    "effect": "viscous_friction",
    "joint": 2,
    "joints": [2],
    "parameters": VISCOUS,
    "equation": "tau_2 += 2.31 qd_2",
    "heldout_rms_before": 1.9,
    "heldout_rms_after": 0.06,
    "p_value": 1e-9,
    "rivals": [{"effect": "time_delay", "joint": None}],
    "next_experiment": None,
}
FIT: dict[str, Any] = {
    "joint": 2,
    "heldout_rms_before": 1.9,
    "heldout_rms_after": 0.06,
    "noise_floor": 0.05,
    "gap_closed": 0.99,
}
VERDICT: dict[str, Any] = {
    "schema": "verdict/1",
    "status": "mismatch",
    "summary": "Viscous friction at joint 2 is missing.",
    "located": [
        {
            "joint": 2,
            "share": 0.93,
            "where": {"variable": "velocity", "regime": "above 0.1 rad/s", "runs": ["run-1.csv"], "time": None},
        },
        {"joint": 3, "share": 0, "where": {"variable": None, "regime": "everywhere", "time": [1.0, 2.5]}},
    ],
    "findings": [FINDING],
    "unexplained": [{"joint": 3, "share": 0.4, "depends_on": ["position_1", "velocity_2"]}],
    "fit": [FIT],
}
SHORT_FINDING = {
    **{key: value for key, value in FINDING.items() if key not in ("joints", "p_value", "next_experiment")},
    "effect": "effect_of_a_user",
    "joint": None,
    "parameters": TILT,
    "rivals": [],
}
EMPTY_VERDICT = {
    **VERDICT,
    "status": "inconclusive",
    "located": [],
    "findings": [SHORT_FINDING],
    "unexplained": [],
    "fit": [{**FIT, "gap_closed": None}],
    "version": "0.1",
}
VALID_BEFORE = [
    ("robot", ROBOT),
    ("robot", LONG_ROBOT),
    ("recording", RECORDING),
    ("recording", LONG_RECORDING),
    ("model", MODEL),
    ("model", BASE_MODEL),
    ("verdict", VERDICT),
    ("verdict", EMPTY_VERDICT),
]

MOTION_ONLY = {
    **{key: value for key, value in RECORDING.items() if key not in ("columns", "units")},
    "robot": "arm.xml",
    "columns": {
        "time": "t",
        "reference_position": ["cmd1"],
        "position": ["q1"],
        "velocity": ["v1"],
        "reference_velocity": ["cv1"],
        "current": ["i1"],
        "temperature": ["temp1"],
        "voltage": ["supply"],
    },
    "units": {"time": "s", "position": "rad", "reference_position": "deg", "voltage": "V"},
    "controller": {
        "type": "pd",
        "kp": [7.8],
        "kd": [None],
        "ki": [0.1],
        "ki_speed": [0.01],
        "reference_velocity": "zero",
        "feedforward": "gravity",
        "torque_limit": [2.9],
        "integral_limit": [0.5],
        "delay": 0.0,
        "read_delay": [0.001],
        "rate_hz": 50,
        "velocity_filter_hz": 20,
        "supply": 12,
        "kt": [1.2],
        "resistance": [3.4],
    },
}
FULL_FINDING = {
    **FINDING,
    "kind": "setup",
    "effect": "joint_direction",
    "form": "position",
    "share_of_gap": 0.9,
    "probability": 0.8,
    "class": [{"effect": "joint_direction", "joint": 2, "probability": 0.8}],
}
FULL_VERDICT = {
    **VERDICT,
    "story": [{"cause": "friction", "joints": [1, 2], "share_of_gap": 0.91, "findings": [0]}],
    "findings": [FULL_FINDING],
    "fit": [
        {
            **FIT,
            "heldout_rms_named": 0.07,
            "heldout_rms_identify": 0.08,
            "replay_rms_before": 0.2,
            "replay_rms_after": 0.01,
        }
    ],
}
CHANGE = {
    "effect": "viscous_friction",
    "joint": 2,
    "joints": [2],
    "parameter": "coefficient",
    "old": 2.3,
    "new": 1.1,
    "difference_ci95": [-1.3, -1.1],
    "unit": "N.m.s/rad",
    "p_value": 0.0,
    "changed": True,
}
COMPARISON: dict[str, Any] = {
    "schema": "comparison/1",
    "status": "changed",
    "summary": "Friction of joint 2 fell.",
    "old": "before",
    "new": "after",
    "level": 0.01,
    "changes": [CHANGE],
}
FULL_COMPARISON = {
    **COMPARISON,
    "findings": [FINDING],
    "smallest_detectable": [
        {"effect": "viscous_friction", "joint": 2, "parameter": "coefficient", "change": 0.02, "unit": "N.m.s/rad"}
    ],
    "recordings": ["before", "after"],
    "notes": ["The columns of simulated_position are not used."],
}


def without(content: dict[str, Any], *path: str | int) -> dict[str, Any]:
    """The content without the key at the end of a path."""
    out = copy.deepcopy(content)
    place: Any = out
    for step in path[:-1]:
        place = place[step]
    del place[path[-1]]
    return out


@pytest.mark.parametrize("name", list(FORMATS))
def test_the_shipped_schema_is_the_one_that_the_model_generates(name: str) -> None:
    shipped = json.loads(schema_path(name).read_text(encoding="utf-8"))
    assert shipped == json.loads(generate_schema(name)), "run `python -m armlab.schemas`"


@pytest.mark.parametrize("name", list(FORMATS))
def test_each_schema_is_a_valid_json_schema(name: str) -> None:
    jsonschema.Draft202012Validator.check_schema(json.loads(schema_path(name).read_text(encoding="utf-8")))


@pytest.mark.parametrize(("name", "content"), VALID_BEFORE)
def test_what_was_valid_against_the_first_schemas_is_valid_still(name: str, content: dict[str, Any]) -> None:
    check_against_schema(content, name)
    validate(FORMATS[name], content, name)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("recording", MOTION_ONLY),
        ("recording", {**MOTION_ONLY, "controller": None}),
        ("verdict", FULL_VERDICT),
        ("comparison", COMPARISON),
        ("comparison", FULL_COMPARISON),
    ],
)
def test_each_key_of_the_contracts_has_its_place(name: str, content: dict[str, Any]) -> None:
    check_against_schema(content, name)
    validate(FORMATS[name], content, name)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("robot", without(ROBOT, "joints", 0, "alpha"), "missing key 'joints[0].alpha'"),
        ("robot", {**ROBOT, "joint": []}, "did you mean 'joints'?"),
        ("recording", without(RECORDING, "runs"), "missing key 'runs'"),
        ("recording", without(RECORDING, "columns", "torque"), "either torque or current"),
        ("recording", {**MOTION_ONLY, "controller": {"type": "pd", "kp": 7.8, "kd": [0]}}, "controller.kp"),
        ("recording", {**MOTION_ONLY, "controller": {"type": "pid", "kp": [7.8], "kd": [0]}}, "controller.type"),
        ("model", without(BASE_MODEL, "components", 0, "parameters"), "missing key 'components[0].parameters'"),
        ("verdict", without(VERDICT, "findings", 0, "rivals"), "missing key 'findings[0].rivals'"),
        ("verdict", {**VERDICT, "status": "maybe"}, "'status'"),
        ("verdict", {**VERDICT, "findings": [{**FINDING, "joint": 0}]}, "'findings[0].joint'"),
        ("verdict", {**VERDICT, "findings": [{**FINDING, "kind": "magic"}]}, "'findings[0].kind'"),
        ("comparison", without(COMPARISON, "changes", 0, "unit"), "missing key 'changes[0].unit'"),
    ],
)
def test_schema_and_model_refuse_the_same_mistakes(name: str, content: dict[str, Any], message: str) -> None:
    with pytest.raises(jsonschema.ValidationError):
        check_against_schema(content, name)
    with pytest.raises(InputError) as caught:
        validate(FORMATS[name], content, name)
    assert message in str(caught.value)


@pytest.mark.parametrize("content", [VERDICT, EMPTY_VERDICT, FULL_VERDICT])
def test_a_verdict_is_written_with_the_keys_that_were_set_and_no_others(content: dict[str, Any]) -> None:
    written = json.loads(validate(VerdictFile, content, "verdict").to_json())
    assert written == {key: value for key, value in content.items() if key != "version"}


def test_a_comparison_is_written_with_the_keys_that_were_set_and_no_others() -> None:
    for content in (COMPARISON, FULL_COMPARISON):
        assert json.loads(validate(ComparisonFile, content, "comparison").to_json()) == content


@pytest.mark.parametrize(
    ("effect", "kind"),
    [
        ("viscous_friction", "physics"),
        ("base_tilt", "physics"),
        ("payload", "link"),
        ("inertial_parameter_error", "link"),
        ("unknown", "unknown"),
    ],
)
def test_each_effect_has_its_kind(effect: str, kind: str) -> None:
    assert kind_of_effect(effect_named(effect)) == kind


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "not valid JSON"),
        ("[]", "is no verdict"),
        ('{"schema": "next/1"}', "should be verdict/1"),
        ('{"schema": "verdict/1", "status": "none"}', "missing key 'summary'"),
    ],
)
def test_a_file_that_is_no_verdict_is_refused_in_one_line(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "verdict.json"
    path.write_text(text)
    assert message in refusal(read_verdict_file, path)
    assert "cannot read" in refusal(read_verdict_file, tmp_path / "absent.json")


def write_folder(folder: Path) -> Path:
    """A recording of one swinging joint beside its robot file, as an engineer lays it out."""
    time = np.arange(200) / 100
    position = np.sin(2 * np.pi * time)
    values = np.column_stack([time, position, 3 * np.cos(position)])
    names = ("t", "q1", "tau1")
    runs = (DraftRun("run-1.csv", "identify", names, values), DraftRun("run-2.csv", "validate", names, values))
    draft = Draft("robot.yaml", RECORDING["columns"], RECORDING["units"], runs, {"sample_rate_hz": 100.0})
    write_recording(draft, folder)
    (folder / "robot.yaml").write_text(yaml.safe_dump({**ROBOT, "links": [LINK]}))
    return folder


def test_a_written_recording_folder_follows_the_schemas(tmp_path: Path) -> None:
    folder = write_folder(tmp_path / "swing")
    check_against_schema(yaml.safe_load((folder / "recording.yaml").read_text()), "recording")
    check_against_schema(yaml.safe_load((folder / "robot.yaml").read_text()), "robot")
    assert [run.samples for run in load_recording(folder).runs] == [200, 200]


def test_a_recording_of_motion_only_is_understood_and_what_needs_torque_refuses_it(tmp_path: Path) -> None:
    (tmp_path / "recording.yaml").write_text(yaml.safe_dump(MOTION_ONLY))
    file = read_recording_file(tmp_path)
    assert file.controller is not None
    assert (file.controller.kp, file.controller.kd) == ((7.8,), (None,))
    message = refusal(load_recording, tmp_path)
    assert "`armlab recording check` take a recording of motion only" in message
    assert str(tmp_path / "recording.yaml") in message


def test_a_current_with_gains_is_a_torque_and_without_them_beside_a_command_is_none() -> None:
    assert validate(RecordingFile, LONG_RECORDING, "r").has_torque
    assert not validate(RecordingFile, without(LONG_RECORDING, "gains"), "r").has_torque
    assert not validate(RecordingFile, MOTION_ONLY, "r").has_torque


def test_the_robot_file_of_the_examples_is_read(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(yaml.safe_dump(LONG_ROBOT))
    assert len(load_arm("robot.yaml", tmp_path)) == len(validate(RobotFile, LONG_ROBOT, "r").joints) == 2
