"""Recordings from DataFrames and files in Python, and signals back as frames: what a user of pandas tries first."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from numpy.testing import assert_array_equal
from refusals import refusal

import armlab
from armlab.recordings.recording import Recording
from problem.robot_file import BUILT_IN_FOLDER

UNITS = {"position": "rad", "torque": "N.m"}


def frame_of(run):
    columns = np.column_stack([run.time, run.position, run.torque])
    return pd.DataFrame(columns, columns=["t", "q1", "q2", "q3", "tau1", "tau2", "tau3"])


@pytest.fixture(scope="module")
def frames(recording):
    return [frame_of(run) for run in recording.runs]


def from_frames(frame, **options):
    return Recording.from_dataframe(frame, robot="irb120-arm", **{"units": UNITS, **options})


def roles(recording):
    return {run.name: (run.role, run.samples) for run in recording.runs}


def test_a_frame_gives_the_numbers_of_the_recording_that_it_was_made_of(recording, frames):
    made = from_frames(frames[0], validate=frames[1])
    assert roles(made) == {"run-1.csv": ("identify", 1200), "validate-1.csv": ("validate", 1200)}
    for ours, theirs in zip(made.runs, recording.runs, strict=True):
        assert_array_equal(ours.position, theirs.position)
        assert_array_equal(ours.torque, theirs.torque)
    assert made.name == "recording"
    assert made.folder.is_dir()
    assert "position: q1, q2, q3 [rad] (usual names; unit given with units=)" in [each.text for each in made.findings]


def test_columns_are_named_by_lists_and_patterns_and_units_are_converted(frames):
    odd = frames[0].rename(columns=lambda name: name.replace("q", "winkel").replace("tau", "moment").replace("t", "t"))
    odd = odd.assign(**{name: np.rad2deg(odd[name]) for name in odd if name.startswith("winkel")})
    made = from_frames(
        odd,
        position=["winkel1", "winkel2", "winkel3"],
        torque="moment*",
        units={"position": "deg", "torque": "N.m"},
    )
    assert np.allclose(made.runs[0].position, frames[0][["q1", "q2", "q3"]])


@pytest.mark.parametrize("name", ["t", None])
def test_time_may_be_the_index(frames, name):
    indexed = frames[0].set_index(pd.to_timedelta(frames[0]["t"], unit="s").rename(name)).drop(columns="t")
    assert np.allclose(from_frames(indexed).runs[0].time, frames[0]["t"])


def test_rows_and_names_say_which_runs_validate(frames):
    by_rows = from_frames(frames[0], validate=frames[0]["t"] > 8)
    assert roles(by_rows) == {"run-1.csv": ("identify", 801), "validate-2.csv": ("validate", 399)}
    named = from_frames({"morning": frames[0]}, validate={"noon shift": frames[1]})
    assert list(roles(named)) == ["morning.csv", "noon_shift.csv"]
    assert [run.role for run in from_frames(frames).runs] == ["identify", "identify"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"units": {"position": "rad"}}, "no unit is known for torque: give units={'torque': 'UNIT'}"),
        ({"torques": "tau*"}, "unknown option 'torques': did you mean 'torque'"),
        ({"position": "x*"}, "no column 'x*' for position"),
        ({"units": "rad"}, "units should be a dictionary like {'position': 'deg'}"),
        ({"gear_ratio": [100, 100]}, "gear_ratio= holds 2 numbers for 3 columns of position"),
        ({"lock": {"joint3": 0.0}}, "lock makes a robot file of its own: give out, a new folder that keeps it"),
        ({"position": ["q1", "q,2"]}, "the name 'q,2' holds a comma"),
        ({"validate": [1, 2]}, "validate should be a DataFrame"),
        ({"validate": np.full(1200, True)}, "validate holds every row of the frame: mark those that take no part"),
        ({"validate": np.full(1200, False)}, "validate holds no row of the frame: mark those that take no part"),
        ({"validate": np.arange(1200) % 2 == 0}, "cuts the frame into 1200 stretches, the shortest of 1 rows"),
    ],
)
def test_a_mistake_is_one_line_that_names_the_keyword(frames, options, message):
    assert message in refusal(from_frames, frames[0], **options)


@pytest.mark.parametrize(
    ("act", "given", "message"),
    [
        (armlab.read_recording, frame_of, "not DataFrame: armlab.Recording.from_dataframe makes a recording"),
        (armlab.read_verdict, frame_of, "not DataFrame: to diagnose DataFrames, give what armlab.Recording.from_"),
        (armlab.import_recording, frame_of, "not DataFrame: armlab.Recording.from_dataframe takes DataFrames"),
        (armlab.import_recording, lambda run: [frame_of(run)], "not DataFrame: armlab.Recording.from_dataframe takes"),
        (from_frames, lambda _: "log.csv", "not of str: armlab.import_recording takes the path of a log"),
        (from_frames, lambda _: [Path("log.csv")], "Path: armlab.import_recording takes the path of a log"),
        (from_frames, lambda run: run.position, "not of ndarray: give pd.DataFrame(x, columns=[...])"),
        (from_frames, lambda _: 42, "made of DataFrames, one a run, not of int"),
    ],
)
def test_data_given_to_another_function_is_answered_by_the_name_of_the_right_one(recording, act, given, message):
    assert message in refusal(act, given(recording.runs[0]))


def test_what_is_no_frame_and_no_robot_is_refused(frames):
    assert "made of DataFrames, one a run, not of dict" in refusal(from_frames, [{"t": 0.0}])
    arm = armlab.read_robot("irb120-arm")
    assert "the path of a robot file" in refusal(Recording.from_dataframe, frames[0], robot=arm, units=UNITS)
    assert "the robot is missing: give robot= with one of" in refusal(Recording.from_dataframe, frames[0], units=UNITS)


def test_a_log_is_imported_and_written_where_a_folder_is_given(frames, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for number, frame in enumerate(frames, 1):
        frame.to_csv(f"log-{number}.csv", index=False)
    options = {"robot": "irb120-arm", "units": UNITS}
    held = armlab.import_recording("log-1.csv", validate="log-2.csv", **options)
    assert roles(held) == {"log-1.csv": ("identify", 1200), "log-2.csv": ("validate", 1200)}
    assert sorted(path.name for path in tmp_path.iterdir()) == ["log-1.csv", "log-2.csv"]
    written = armlab.import_recording([Path("log-1.csv")], out="rec", **options)
    assert_array_equal(armlab.read_recording("rec").runs[0].torque, written.runs[0].torque)
    assert "rec is there already" in refusal(armlab.import_recording, "log-1.csv", out="rec", **options)
    assert "should be paths of logs, not int" in refusal(armlab.import_recording, 42, **options)


def test_a_model_of_frames_names_the_robot_file_that_was_given(frames, tmp_path):
    robot = tmp_path / "arm.yaml"
    robot.write_text((BUILT_IN_FOLDER / "irb120-arm.yaml").read_text())
    made = Recording.from_dataframe(frames[0], robot=robot, units=UNITS)
    path = armlab.identify(made).save(tmp_path / "model.yaml")
    assert yaml.safe_load(path.read_text())["robot"] == "arm.yaml"


def test_a_log_without_torque_is_a_recording_of_motion_only(frames):
    moved = frames[0].drop(columns=["tau1", "tau2", "tau3"])
    moved = moved.assign(**{f"cmd{k}": moved[f"q{k}"].shift(2, fill_value=moved[f"q{k}"].iloc[0]) for k in (1, 2, 3)})
    units = {"position": "rad", "reference_position": "rad"}
    made = from_frames(moved, reference_position="cmd*", units=units)
    assert isinstance(made, armlab.MotionRecording)
    assert made["reference_position"].shape == (1200, 3)
    assert "only `armlab.diagnose` takes it" in refusal(armlab.identify, made)
    assert made.plot()._repr_png_().startswith(b"\x89PNG")


def test_a_signal_is_a_frame_by_run_and_time_with_a_column_a_joint(recording):
    torque = recording["torque"]
    assert torque.index.names == ["run", "time"]
    assert list(torque.columns) == ["joint1", "joint2", "joint3"]
    assert_array_equal(torque.loc["validate.csv"].to_numpy(), recording.runs[1].torque)
    assert "no signal 'positions' in this recording: did you mean 'position'" in refusal(lambda: recording["positions"])


def test_a_recording_draws_a_run_for_a_notebook(recording):
    figure = recording.plot("validate.csv")
    assert figure._repr_png_().startswith(b"\x89PNG")
    assert len(figure.axes) == 6
    assert "no run 'other': known: identify.csv, validate.csv" in refusal(recording.plot, "other")


def test_functions_take_the_path_of_a_folder(recording, recording_folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    recording_folder(tmp_path / "rec")
    model = armlab.identify("rec")
    model.save("model.yaml")
    assert armlab.predict("model.yaml", Path("rec")).errors == armlab.predict(model, recording).errors
    assert "no recording.yaml in nowhere" in refusal(armlab.identify, "nowhere")
    assert "should be the path of its folder" in refusal(armlab.identify, 42)
    assert "the path of a model.yaml, not NoneType" in refusal(armlab.predict, None, "rec")
