"""Recording folders: what is read, in which unit, through which gears, and how mistakes are told."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from recording_folders import SETTINGS, folder_with, frame
from refusals import refusal
from shipped_schemas import check_against_schema

from armlab.cli.recording import ASKED_SIGNALS, OPTIONAL_SIGNALS
from armlab.recordings.load import load_recording
from armlab.recordings.recording import SIGNALS
from armlab.recordings.recording_file import FILE_NAME, Columns
from armlab.recordings.units import SIGNAL_QUANTITIES


def test_a_sound_run_is_read_to_the_last_digit_without_a_word(tmp_path: Path) -> None:
    table = frame()
    recording = load_recording(folder_with(tmp_path, table))
    run, check = recording.runs
    assert_array_equal(run.time, table["t"])
    assert_array_equal(run.position, table[["q1", "q2", "q3"]])
    assert_array_equal(run.torque, table[["tau1", "tau2", "tau3"]])
    assert (run.file, run.role, check.role, run.even) == ("run.csv", "identify", "validate", True)
    assert run.findings == recording.findings == ()
    assert recording.arm.name == "irb120-arm"


def test_units_are_converted_to_si_where_the_data_come_in(tmp_path: Path) -> None:
    table = frame()
    table["t"] *= 1000
    table[["q1", "q3"]] = np.rad2deg(table[["q1", "q3"]])
    units = {"time": "ms", "position": ["deg", "rad", "deg"], "torque": "N.m"}
    run = load_recording(folder_with(tmp_path, table, {"units": units})).runs[0]
    assert_allclose(run.time, frame()["t"], atol=1e-12)
    assert_allclose(run.position, frame()[["q1", "q2", "q3"]], atol=1e-12)


def test_transmission_and_gains_bring_motor_signals_to_the_joints(tmp_path: Path) -> None:
    table = frame()
    position = table[["q1", "q2", "q3"]].to_numpy()
    ratio = np.array([[2.0, 0, 0], [0, 3, 0], [0, 1, 4]])
    offset = np.array([0.1, 0.2, 0.3])
    table[["q1", "q2", "q3"]] = np.linalg.solve(ratio, (position - offset).T).T
    gains, torque_matrix = [2.0, 0.5, 1.0], [[1.0, 0, 0], [0, 1, 0], [0, 0.5, 1]]
    table[["tau1", "tau2", "tau3"]] = np.linalg.solve(torque_matrix, frame()[["tau1", "tau2", "tau3"]].T).T / gains
    change = {
        "transmission": {"position": ratio.tolist(), "offset": offset.tolist(), "torque": torque_matrix},
        "gains": gains,
        "units": {"time": "s", "position": "rad", "torque": "A"},
    }
    run = load_recording(folder_with(tmp_path, table, change)).runs[0]
    assert_allclose(run.position, position, atol=1e-12)
    assert_allclose(run.torque, frame()[["tau1", "tau2", "tau3"]], atol=1e-10)


def test_optional_signals_are_kept_and_an_empty_column_is_a_missing_sensor(tmp_path: Path) -> None:
    table = frame()
    table["l1"], table["l2"], table["l3"] = table["q1"], np.nan, table["q3"]
    table["temp"] = 300.0
    columns = {**SETTINGS["columns"], "link_position": ["l1", "l2", "l3"], "temperature": ["temp"]}
    units = {**SETTINGS["units"], "temperature": "K"}
    folder = folder_with(tmp_path, table, {"columns": columns, "units": units, "runs": SETTINGS["runs"][:1]})
    run = load_recording(folder).runs[0]
    assert run.link_position is not None
    assert np.isnan(run.link_position[:, 1]).all()
    assert_array_equal(run.link_position[:, 0], run.position[:, 0])
    assert_allclose(run.temperature, 26.85)
    assert [finding.kind for finding in run.findings] == ["assumed_unit"]


def test_parquet_and_csv_hold_the_same_run(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    folder = folder_with(tmp_path, frame(), {"runs": [{"file": "run.parquet"}]})
    frame().to_parquet(folder / "run.parquet")
    run = load_recording(folder).runs[0]
    assert_array_equal(run.position, frame()[["q1", "q2", "q3"]])


def test_a_broken_parquet_file_is_refused_in_one_line(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    folder = folder_with(tmp_path, frame(), {"runs": [{"file": "run.parquet"}]})
    (folder / "run.parquet").write_bytes(b"PAR1 not really PAR1")
    assert "as Parquet" in refusal(load_recording, folder)


def test_runs_that_only_identify_get_a_note_that_blocks_will_be_held_out(tmp_path: Path) -> None:
    recording = load_recording(folder_with(tmp_path, frame(), {"runs": [{"file": "run.csv"}]}))
    assert [finding.kind for finding in recording.findings] == ["no_validation"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"schema": "recording/2"}, "recording/1"),
        ({"robot": "irb12-arm"}, "did you mean 'irb120-arm'?"),
        ({"robot": "unisa-ur10"}, "3 columns, but the robot has 6 joints"),
        ({"simulation": "nowhere.yaml"}, "no file"),
        ({"sample_rate_hz": -1}, "sample_rate_hz"),
        ({"unit": {}}, "did you mean 'units'?"),
        ({"units": {"time": "s", "position": "degr"}}, "unknown unit 'degr' of position"),
        ({"units": {"time": "s", "position": "mm"}}, "is revolute"),
        ({"units": {"time": "s", "position": ["rad", "rad"]}}, "one unit or 3, not 2"),
        ({"units": {"time": "s", "position": "rad", "torque": "A"}}, "`gains`"),
        ({"units": {"time": "s", "position": "rad", "tork": "N.m"}}, "did you mean 'torque'?"),
        ({"gains": [1.0, 2.0]}, "should hold 3 numbers"),
        ({"transmission": {"position": [[1, 0], [0, 1]]}}, "3 rows of 3 numbers"),
        ({"transmission": {"offset": [0]}}, "should hold 3 numbers"),
        ({"transmission": {"offset": [0, 1e307, 0]}}, "less than or equal to 1000000000"),
        ({"columns": {"time": "t", "position": ["q1", "q2", "q3"]}}, "either torque or current"),
        ({"columns": {**SETTINGS["columns"], "torque": ["tau1", "tau2", "q1"]}}, "'q1' is named twice"),
        ({"columns": {**SETTINGS["columns"], "time": "time"}}, "no column 'time' (columns.time) in run.csv"),
        ({"runs": []}, "runs"),
        ({"runs": [{"file": "run.csv"}, {"file": "run.csv", "role": "validate"}]}, "listed twice"),
        ({"runs": [{"file": "run.csv", "role": "test"}]}, "role"),
        ({"runs": [{"file": "run.mat"}]}, "`armlab recording import` reads other formats"),
        ({"runs": [{"file": "absent.csv"}]}, "cannot read"),
    ],
)
def test_each_mistake_in_recording_yaml_is_told_in_one_line(tmp_path: Path, change: dict, message: str) -> None:
    assert message in refusal(load_recording, folder_with(tmp_path, frame(), change))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "empty"),
        ("t,q1,q2,q3,tau1,tau2,tau3\n", "holds no rows"),
        ("t,q1,q1,q3,tau1,tau2,tau3\n1,2,3,4,5,6,7\n", "'q1' appears twice"),
        ("t,q1,q2,q3,tau1,tau2,tau3\n1,2,3\n1,2,3,4,5,6,7\n", "line 2: 3 cells where the header has 7"),
        ("t,q1,q2,q3,tau1,tau2,tau3\n1,2,3,4,5,6,7,8\n", "line 2: 8 cells"),
        ("t,q1,q2,q3,tau1,tau2,tau3\n1,2,3,4,5,6,7\n", "at least 50 are needed"),
        (b"q\xff\x00\x01", "not UTF-8 text"),
    ],
)
def test_each_mistake_in_a_run_file_is_told_in_one_line(tmp_path: Path, text: str | bytes, message: str) -> None:
    assert message in refusal(load_recording, folder_with(tmp_path, text))


def test_a_folder_without_recording_yaml_is_told_what_a_recording_is(tmp_path: Path) -> None:
    assert FILE_NAME in refusal(load_recording, tmp_path)


def test_file_run_units_and_flags_know_the_same_signals() -> None:
    named = set(Columns.model_fields)
    assert named == set(SIGNAL_QUANTITIES) == {"time", "current", *SIGNALS}
    assert named - {"current"} == {*ASKED_SIGNALS, *OPTIONAL_SIGNALS}


def test_a_reference_velocity_passes_the_gears_and_a_voltage_belongs_to_no_joint(tmp_path: Path) -> None:
    table = frame().assign(w1=1.0, w2=2.0, w3=3.0, supply=12000.0)
    columns = {**SETTINGS["columns"], "reference_velocity": ["w1", "w2", "w3"], "voltage": ["supply"]}
    units = {**SETTINGS["units"], "reference_velocity": "rad/s", "voltage": "mV"}
    gears = {"transmission": {"position": np.diag([1.0, 0.5, 0.1]).tolist()}}
    change = {"columns": columns, "units": units, "runs": SETTINGS["runs"][:1], **gears}
    run = load_recording(folder_with(tmp_path, table, change)).runs[0]
    assert run.reference_velocity is not None
    assert_allclose(run.reference_velocity[0], [1.0, 1.0, 0.3])
    assert_allclose(run.voltage, 12.0)


def test_the_settings_that_the_tests_start_from_follow_the_schema() -> None:
    check_against_schema(SETTINGS, "recording")
