"""Suspicions that are reported and not repaired, and silence about sound recordings."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from recording_folders import ARM, POSITION, RATE_HZ, SETTINGS, TORQUE, folder_with, frame

from armlab.recordings.check import check_channels, check_recording
from armlab.recordings.load import load_recording
from armlab.recordings.recording import Run


def run_of(table: pd.DataFrame) -> Run:
    columns = (table[names].to_numpy() for names in (POSITION, TORQUE))
    velocity = table[["v1", "v2", "v3"]].to_numpy() if "v1" in table else None
    return Run("run.csv", "identify", table["t"].to_numpy(), *columns, velocity=velocity)


def said(run: Run) -> list[tuple[str, int | None]]:
    return [(finding.kind, finding.joint) for finding in check_channels(run, ARM)]


def with_velocity() -> pd.DataFrame:
    table = frame()
    table[["v1", "v2", "v3"]] = np.gradient(table[POSITION].to_numpy(), table["t"].to_numpy(), axis=0)
    return table


def test_a_sound_run_gives_no_suspicion() -> None:
    run = run_of(with_velocity())
    assert said(run) == []


def test_a_dead_torque_channel_is_named() -> None:
    table = frame()
    table["tau2"] = 0.0
    assert said(run_of(table)) == [("dead_channel", 2)]


def test_a_joint_that_stands_still_is_named() -> None:
    table = frame()
    table["q3"] = 0.25
    assert said(run_of(table)) == [("still_joint", 3)]


def test_the_velocity_of_a_joint_that_rests_is_no_suspicion() -> None:
    table, rng = with_velocity(), np.random.default_rng(0)
    table["q3"] = 0.25 + 1e-6 * rng.standard_normal(len(table))
    table["v3"] = 1e-5 * rng.standard_normal(len(table))
    assert said(run_of(table)) == []
    table["v3"] = table["v2"]  # the channel of another joint
    assert said(run_of(table)) == [("velocity_mismatch", 3)]


def test_a_torque_that_freezes_while_the_joint_moves_is_named() -> None:
    table = frame()
    table.loc[400:600, "tau1"] = table["tau1"][400]
    assert said(run_of(table)) == [("frozen_channel", 1)]


def test_a_log_that_is_written_faster_than_its_positions_are_read_is_named() -> None:
    table = frame()
    held = np.arange(len(table)) // 4 * 4
    table[POSITION] = table[POSITION].to_numpy()[held]
    assert said(run_of(table)) == [("held_rows", None)]
    table[POSITION] = np.round(frame()[POSITION], 2)  # of a coarse encoder: the steps follow the speed
    assert said(run_of(table)) == []


def test_positions_in_degrees_that_were_called_radians_pass_the_limits() -> None:
    table = frame()
    table["q1"] = np.rad2deg(table["q1"])
    assert said(run_of(table)) == [("beyond_limits", 1)] * 2  # position and speed


def test_a_joint_that_is_faster_than_it_can_be_is_named() -> None:
    table = frame()
    table["t"] /= 100
    assert {kind for kind, _ in said(run_of(table))} == {"beyond_limits"}


def test_rows_that_are_missing_behind_even_stamps_are_the_cause_of_a_velocity_that_is_too_small() -> None:
    table = with_velocity()
    kept = table[np.arange(len(table)) % 30 < 20].reset_index(drop=True)
    kept["t"] = np.arange(len(kept)) / RATE_HZ
    texts = [finding.text for finding in check_channels(run_of(kept), ARM) if finding.kind == "lost_rows"]
    assert len(texts) == 3
    assert all("one every 0.1 s: rows are missing there" in text for text in texts)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"v1": "v2", "v2": "v1"}, "follows the position of joint 2"),
        ({"v1": -1.0}, "opposite sign"),
        ({"v1": 57.3}, "57.3 times"),
    ],
)
def test_a_velocity_channel_at_odds_with_its_position_is_named(change: dict, words: str) -> None:
    table = with_velocity()
    for name, source in change.items():
        original = with_velocity()
        table[name] = original[source] if isinstance(source, str) else source * original[name]
    assert words in check_channels(run_of(table), ARM)[0].text


def test_a_refused_run_is_reported_beside_the_others(tmp_path: Path) -> None:
    check = check_recording(folder_with(tmp_path, "t,q1\n"))
    assert [file for file, _ in check.refused] == ["run.csv"]
    assert [run.file for run in check.recording.runs] == ["check.csv"]
    assert check.lines[0].startswith("run.csv: refused: ")


def test_checking_changes_no_number(tmp_path: Path) -> None:
    folder = folder_with(tmp_path, frame(), SETTINGS)
    before = load_recording(folder).runs[0]
    after = check_recording(folder).recording.runs[0]
    assert np.array_equal(before.torque, after.torque)
    assert np.array_equal(before.position, after.position)
