"""`signals.mcap`, read by the package of the format's authors: topics, stamps, names and values of joint states."""

import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from servo_arms import write_recording
from small_recordings import frame, recording_in

from armlab.cli.main import main
from armlab.common.arrays import Array
from armlab.diagnosis.formats import read_verdict_file
from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.torque.diagnose import diagnose
from armlab.recordings.load import load_recording
from armlab.recordings.motion import load_motion_recording
from armlab.recordings.recording import MotionRun
from armlab.report.signals_file import diagnosis_tracks, signals_content, topic_names

Topics = dict[str, dict[str, Array]]


def read_topics(path: Path) -> Topics:
    """By topic: stamps in s, names of the joints, and what the messages hold, one row a message."""
    decoder = pytest.importorskip("mcap_ros2.decoder", reason="needs mcap-ros2-support").DecoderFactory()
    from mcap.reader import make_reader

    found: dict[str, list[Any]] = {}
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[decoder])
        logged = []
        for schema, channel, message, state in reader.iter_decoded_messages(log_time_order=False):
            assert (schema.name, schema.encoding) == ("sensor_msgs/msg/JointState", "ros2msg")
            assert message.log_time == state.header.stamp.sec * 10**9 + state.header.stamp.nanosec
            found.setdefault(channel.topic, []).append((message.log_time / 1e9, state))
            logged.append(message.log_time)
    assert logged == sorted(logged)
    return {topic: dict(_columns(messages)) for topic, messages in found.items()}


def _columns(messages: list[Any]) -> Iterator[tuple[str, Array]]:
    yield "time", np.array([time for time, _ in messages])
    for name in ("name", "position", "velocity", "effort"):
        yield name, np.array([getattr(state, name) for _, state in messages])


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A verdict with its signals: two runs, of which one is held out."""
    folder = recording_in(tmp_path_factory.mktemp("signals") / "rec", frame(0, 6), frame(1, 6))
    out = folder.parent / "out"
    result = CliRunner().invoke(main, ["diagnose", str(folder), "--out", str(out), "--mcap"])
    assert result.exit_code == 0, result.output
    assert "signals.mcap" in result.output
    return out


@pytest.fixture(scope="module")
def topics(written: Path) -> Topics:
    return read_topics(written / "signals.mcap")


def test_recorded_signals_come_back_with_their_stamps_and_names(written: Path, topics: Topics) -> None:
    for number, run in enumerate(load_recording(written.parent / "rec").runs):
        read = topics[f"/run_{number}/recorded"]
        np.testing.assert_allclose(read["time"], run.time, atol=1e-9)
        np.testing.assert_array_equal(read["position"], run.position)
        np.testing.assert_array_equal(read["effort"], run.torque)
        assert set(map(tuple, read["name"])) == {("joint1", "joint2", "joint3")}


def test_runs_of_the_fit_and_held_out_runs_have_topics_of_their_own(topics: Topics) -> None:
    compared = {topic for topic in topics if not topic.endswith("/recorded")}
    signals = {topic.rpartition("/")[2] for topic in compared}
    assert {"measured", "corrected"} <= signals
    assert compared == {
        f"/run_{number}/{role}/{signal}" for number, role in ((0, "identify"), (1, "validate")) for signal in signals
    }


def test_the_corrected_torque_of_a_held_out_run_is_as_far_off_as_the_verdict_says(
    written: Path, topics: Topics
) -> None:
    measured, corrected = topics["/run_1/validate/measured"], topics["/run_1/validate/corrected"]
    np.testing.assert_array_equal(measured["time"], corrected["time"])
    error = np.sqrt(np.mean((measured["effort"] - corrected["effort"]) ** 2, axis=0))
    for each in read_verdict_file(written / "verdict.json").fit:
        assert error[each.joint - 1] == pytest.approx(each.heldout_rms_after, rel=0.2)


def test_blocks_that_are_held_out_of_one_run_are_told_apart(tmp_path: Path) -> None:
    found = diagnose(load_recording(recording_in(tmp_path, frame(0, 12), validate=False)))
    times = {each.topic: each.time for each in diagnosis_tracks(found)}
    both = [times[f"/run_0/{role}/measured"] for role in ("identify", "validate")]
    assert not np.intersect1d(*both).size
    assert found.observed is not None
    np.testing.assert_array_equal(np.sort(np.concatenate(both)), found.observed.signals[0].time)


def test_a_recording_of_motion_only_has_commands_and_replayed_positions(tmp_path: Path) -> None:
    folder, out = write_recording(tmp_path / "servo", {"kp": 8.0}, seconds=8.0), tmp_path / "out"
    result = CliRunner().invoke(main, ["diagnose", str(folder), "--out", str(out), "--mcap", "--json"])
    assert result.exit_code == 0, result.output
    assert str(out / "signals.mcap") in json.loads(result.stdout)["files"]
    topics = read_topics(out / "signals.mcap")
    own = {f"/run_{number}/{signal}" for number in (1, 2, 3) for signal in ("recorded", "commanded")}
    assert set(topics) == own | {"/run_3/validate/simulated", "/run_3/validate/corrected"}
    run = load_motion_recording(folder).runs[2]
    assert run.reference_position is not None
    np.testing.assert_array_equal(topics["/run_3/commanded"]["position"], run.reference_position)
    assert set(map(tuple, topics["/run_3/commanded"]["name"])) == {("shoulder", "elbow")}
    for each in read_verdict_file(out / "verdict.json").fit:
        error = {
            signal: topics[f"/run_3/validate/{signal}"]["position"][:, each.joint - 1] - run.position[:, each.joint - 1]
            for signal in ("simulated", "corrected")
        }
        assert np.sqrt(np.mean(error["simulated"] ** 2)) == pytest.approx(each.replay_rms_before)
        assert np.sqrt(np.mean(error["corrected"] ** 2)) == pytest.approx(each.replay_rms_after)


def test_a_recording_that_cannot_be_judged_has_its_recorded_signals(tmp_path: Path) -> None:
    still = frame(0, 6).assign(q1=0.0, q2=0.0, q3=0.0)
    folder, out = recording_in(tmp_path / "rec", still, frame(1, 6)), tmp_path / "out"
    result = CliRunner().invoke(main, ["diagnose", str(folder), "--out", str(out), "--mcap"])
    assert result.exit_code == 0, result.output
    assert {"/run_0/recorded", "/run_1/recorded"} <= set(read_topics(out / "signals.mcap"))


@pytest.mark.parametrize("shift", [-3.25, 2.0**31])
def test_stamps_that_a_ros_time_cannot_hold_start_at_the_first_and_a_line_says_so(shift: float, tmp_path: Path) -> None:
    recording = load_recording(recording_in(tmp_path / "rec", frame(0, 2), frame(1, 2)))
    runs = tuple(replace(run, time=run.time + shift) for run in recording.runs)
    diagnosis = Diagnosis(replace(recording, runs=runs), SimpleNamespace(), "inconclusive", "")
    content, line = signals_content(diagnosis_tracks(diagnosis), ["a", "b", "c"])
    (tmp_path / "signals.mcap").write_bytes(content)
    np.testing.assert_allclose(
        read_topics(tmp_path / "signals.mcap")["/run_0/recorded"]["time"], recording.runs[0].time, atol=1e-6
    )
    assert line is not None
    assert f"{shift:g} s" in line


def test_topics_are_names_that_ros_allows_and_no_two_are_the_same() -> None:
    files = ["run-1.csv", "run 1.csv", "a/run__2.parquet", "3.csv", "ä.csv"]
    runs = [MotionRun(file, "identify", np.zeros(2), np.zeros((2, 1))) for file in files]
    runs += [replace(runs[0], part=part) for part in (1, 2)]
    names = topic_names(runs)
    assert list(names.values()) == ["run_1", "run_1_2", "a_run_2", "run_3", "run", "run_1_part_1", "run_1_part_2"]


@pytest.mark.parametrize("more", [["--compare", "{rec}"], []])
def test_signals_that_cannot_be_written_are_refused_before_any_work(
    more: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, out = recording_in(tmp_path / "rec", frame(0, 2), frame(1, 2)), tmp_path / "out"
    if not more:
        monkeypatch.setitem(sys.modules, "rosbags", None)
    options = [each.format(rec=folder) for each in more]
    result = CliRunner().invoke(main, ["diagnose", str(folder), "--out", str(out), "--mcap", *options])
    assert result.exit_code == 2
    assert "--mcap" in result.output
    assert len(result.output.splitlines()) == 1
    assert not out.exists()
