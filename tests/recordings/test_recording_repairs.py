"""Broken data: repaired only where that is safe, and then said so."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from recording_folders import POSITION, RATE_HZ, SETTINGS, TORQUE, folder_with, frame, motion_at
from refusals import refusal

from armlab.common.errors import InputError
from armlab.recordings.load import load_recording
from armlab.recordings.recording import Run


def loaded(folder: Path, table: pd.DataFrame | str) -> tuple[Run, ...]:
    runs = load_recording(folder_with(folder, table)).runs
    return tuple(run for run in runs if run.file == "run.csv")


def kinds(run: Run) -> list[tuple[str, str]]:
    return [(finding.kind, finding.severity) for finding in run.findings]


@pytest.mark.parametrize("cut", ["", "0.1,0.2", "0.1,0.2,0.3,0.4,0.5,0.6,0."])
def test_a_last_row_that_was_cut_off_is_left_out(tmp_path: Path, cut: str) -> None:
    text = frame().to_csv(index=False) + cut
    (run,) = loaded(tmp_path, text)
    assert run.samples == len(frame())
    assert kinds(run) == ([("broken_last_row", "repaired")] if cut else [])


@pytest.mark.parametrize("value", ["nan", "inf", "1e300", "ERR", "", "-1e251"])
def test_a_row_with_a_value_that_is_no_measurement_is_left_out_and_named(tmp_path: Path, value: str) -> None:
    lines = frame().to_csv(index=False).splitlines()
    cells = lines[400].split(",")
    lines[400] = ",".join([*cells[:2], value, *cells[3:]])
    (run,) = loaded(tmp_path, "\n".join(lines) + "\n")
    assert ("bad_value", "repaired") in kinds(run)
    assert "line 401: q2" in run.findings[0].text
    assert run.samples == len(frame()) - 1
    assert frame()["t"][399] not in run.time


def test_too_many_bad_rows_are_refused_rather_than_dropped(tmp_path: Path) -> None:
    table = frame()
    table.loc[::9, "tau2"] = np.nan
    assert "too many to repair" in refusal(loaded, tmp_path, table)


def test_rows_in_the_wrong_order_are_sorted_by_their_stamps(tmp_path: Path) -> None:
    table = frame()
    order = np.arange(len(table))
    order[[300, 301]] = 301, 300
    (run,) = loaded(tmp_path, table.iloc[order])
    assert_array_equal(run.position, table[POSITION])
    assert kinds(run) == [("time_order", "repaired")]


def test_a_row_written_twice_counts_once(tmp_path: Path) -> None:
    table = frame()
    (run,) = loaded(tmp_path, table.iloc[np.sort(np.append(np.arange(len(table)), [10, 500]))])
    assert run.samples == len(table)
    assert kinds(run) == [("duplicate_row", "repaired")]


def test_single_lost_samples_are_reported_and_the_others_keep_their_stamps(tmp_path: Path) -> None:
    table = frame().drop(index=[100, 700, 701])
    (run,) = loaded(tmp_path, table)
    assert kinds(run) == [("time_gap", "repaired")]
    assert "3 single samples are missing" in run.findings[0].text
    assert_allclose(run.time, table["t"], atol=1e-9)


def test_a_run_is_cut_at_a_long_gap_so_that_no_filter_runs_across_it(tmp_path: Path) -> None:
    table = frame().drop(index=range(600, 700))
    first, second = loaded(tmp_path, table)
    assert (first.samples, second.samples) == (600, len(frame()) - 700)
    assert (first.name, second.name) == ("run.csv part 1", "run.csv part 2")
    assert kinds(first) == kinds(second) == [("time_gap", "repaired")]


def test_a_gap_hidden_by_a_much_longer_one_is_found_too(tmp_path: Path) -> None:
    table = frame().drop(index=[*range(400, 420), *range(1000, 1100)])
    table.loc[1100:, "t"] += 1e4
    assert len(loaded(tmp_path, table)) == 3


def test_a_leap_of_the_clock_alone_is_taken_out_where_the_signals_go_on_without_a_jump(tmp_path: Path) -> None:
    table = frame()
    table.loc[1000:, "t"] += 1.2
    (run,) = loaded(tmp_path, table)
    assert kinds(run) == [("clock_leap", "repaired")]
    assert_allclose(run.time, frame()["t"], atol=1e-9)


def test_a_run_is_cut_where_the_clock_steps_back(tmp_path: Path) -> None:
    table = frame()
    table.loc[800:, "t"] -= 1.0
    first, second = loaded(tmp_path, table)
    assert (first.samples, second.samples) == (800, len(table) - 800)
    assert kinds(first) == [("time_backwards", "repaired")]


def test_stamps_that_were_only_written_late_are_made_even(tmp_path: Path) -> None:
    table = frame()
    table["t"] += np.random.default_rng(2).uniform(-0.3, 0.3, len(table)) / RATE_HZ
    (run,) = loaded(tmp_path, table)
    assert run.even
    assert kinds(run) == [("time_jitter", "repaired")]
    assert np.abs(run.time - frame()["t"]).max() < 0.05 / RATE_HZ
    assert_array_equal(run.position, table[POSITION])


def test_samples_that_were_really_taken_at_uneven_times_keep_their_stamps(tmp_path: Path) -> None:
    time = frame()["t"].to_numpy() + np.random.default_rng(2).uniform(-0.3, 0.3, len(frame())) / RATE_HZ
    table = frame()
    table["t"], table[POSITION] = time, motion_at(time).position
    (run,) = loaded(tmp_path, table)
    assert_array_equal(run.time, time)
    assert kinds(run) == [("time_jitter", "warning")]


@pytest.mark.parametrize("read_hz", [0.97 * RATE_HZ, 0.3 * RATE_HZ])
def test_rows_that_were_written_again_before_the_next_was_read_are_put_on_the_times_of_reading(
    tmp_path: Path, read_hz: float
) -> None:
    """The log is written evenly: no stamp says when a row was read."""
    table = frame()
    last_read = np.floor(table["t"].to_numpy() * read_hz) / read_hz
    torque = [name for name in table if name not in ("t", *POSITION)]
    table[POSITION] = motion_at(last_read).position
    table[torque] = motion_at(last_read).velocity
    (run,) = loaded(tmp_path, table)
    repeated = int(np.sum(np.diff(last_read) == 0))
    assert kinds(run) == [("repeated_row", "repaired")]
    assert f"{repeated} rows" in run.findings[0].text
    assert run.even
    assert run.samples == len(table) - repeated
    assert run.rate_hz == pytest.approx(read_hz, rel=2e-3)
    off = run.time - np.unique(last_read)
    assert np.abs(off - off.mean()).max() < 0.2 / RATE_HZ


def test_repeated_rows_are_found_where_an_encoder_wraps(tmp_path: Path) -> None:
    table = frame()
    last_read = np.floor(table["t"].to_numpy() * 0.97 * RATE_HZ) / (0.97 * RATE_HZ)
    torque = [name for name in table if name not in ("t", *POSITION)]
    table[POSITION] = motion_at(last_read).position
    turned = table[POSITION[0]] + 2 * last_read
    table[POSITION[0]] = (turned + np.pi) % (2 * np.pi) - np.pi
    assert 0 < np.sum(np.abs(np.diff(table[POSITION[0]])) > np.pi) < 4
    table[torque] = motion_at(last_read).velocity
    (run,) = loaded(tmp_path, table)
    assert ("repeated_row", "repaired") in kinds(run)


def test_a_single_repeated_row_leaves_stamps_that_are_late(tmp_path: Path) -> None:
    table = frame()
    table.loc[800, table.columns != "t"] = table.loc[799, table.columns != "t"]
    table["t"] += np.random.default_rng(2).uniform(0, 0.6, len(table)) / RATE_HZ
    (run,) = loaded(tmp_path, table)
    assert kinds(run) == [("time_jitter", "repaired")]
    off = run.time - frame()["t"]
    assert np.abs(off - off.mean()).max() < 0.05 / RATE_HZ


def test_samples_at_uneven_times_keep_their_stamps_though_the_arm_rests_most_of_the_time(tmp_path: Path) -> None:
    time = frame()["t"].to_numpy() + np.random.default_rng(2).uniform(-0.3, 0.3, len(frame())) / RATE_HZ
    table = frame()
    table["t"], table[POSITION] = time, motion_at(time).position
    rests = table.index > 0.4 * len(table)
    table.loc[rests, POSITION] = table.loc[rests, POSITION].iloc[0].to_numpy()
    (run,) = loaded(tmp_path, table)
    assert_array_equal(run.time, time)


def test_a_joint_that_rests_may_read_the_same_twice(tmp_path: Path) -> None:
    table = frame()
    table.loc[600:700] = table.loc[600].to_numpy()
    table["t"] = frame()["t"]
    (run,) = loaded(tmp_path, table)
    assert run.samples == len(table)
    assert kinds(run) == []


def test_stamps_of_a_clock_that_is_coarser_than_the_sampling_are_made_even(tmp_path: Path) -> None:
    table = frame()
    table["t"] = np.floor(table["t"] * 100) / 100
    (run,) = loaded(tmp_path, table)
    assert run.even
    assert run.rate_hz == pytest.approx(RATE_HZ, rel=1e-4)
    assert run.samples == len(table)


def test_of_rows_with_one_stamp_the_one_that_fits_to_no_side_is_left_out(tmp_path: Path) -> None:
    table = frame()
    rng = np.random.default_rng(0)
    steps = rng.uniform(0.2, 1.8, len(table))
    steps[499:501] = 0.5  # no tick is missing beside the row
    table["t"] = np.cumsum(steps) / RATE_HZ
    table[POSITION] = motion_at(table["t"].to_numpy()).position
    table.loc[499.5] = table.loc[499]
    table.loc[499.5, "q1"] += 1.0
    (run,) = loaded(tmp_path, table.sort_index())
    assert run.samples == len(table) - 1
    assert ("duplicate_stamp", "repaired") in kinds(run)
    assert np.abs(np.diff(run.position[:, 0])).max() < 0.1


@pytest.mark.parametrize("seconds", [4.0, 40.0])
def test_equal_stamps_are_spread_where_the_clock_lost_a_tick_in_short_and_long_runs(
    tmp_path: Path, seconds: float
) -> None:
    """As one joint's log has them, once a second: 0.363, 0.363, 0.365."""
    table = frame(seconds=seconds)
    late = np.arange(100, len(table), round(RATE_HZ))
    true = table["t"].to_numpy(copy=True)
    table.loc[late, "t"] = true[late - 1]
    (run,) = loaded(tmp_path, table)
    assert kinds(run) == [("equal_stamps", "repaired")]
    assert f"{len(late)} rows" in run.findings[0].text
    assert_allclose(run.time, true, atol=1e-9)


@pytest.mark.parametrize("lengths", [(800, 800), (800, 800, 800, 800), (800, 800, 800), (500, 1100, 700)])
def test_episodes_whose_clock_starts_anew_are_runs_of_their_own_whatever_their_lengths(
    tmp_path: Path, lengths: tuple[int, ...]
) -> None:
    episodes = [frame(seed).iloc[:rows] for seed, rows in enumerate(lengths)]
    runs = loaded(tmp_path, pd.concat(episodes))
    assert [run.samples for run in runs] == list(lengths)
    for run, episode in zip(runs, episodes, strict=True):
        assert_array_equal(run.position, episode[POSITION])
        assert kinds(run) == [("time_backwards", "repaired")]


def test_episodes_of_one_motion_are_not_mixed_though_their_values_are_alike(tmp_path: Path) -> None:
    first, second = frame(0), frame(0)
    second[POSITION] += 1e-4
    runs = loaded(tmp_path, pd.concat([first, second]))
    assert [run.samples for run in runs] == [len(first), len(second)]


def test_rows_out_of_place_are_sorted_within_each_of_several_episodes(tmp_path: Path) -> None:
    order = np.arange(1600)
    order[[300, 301]] = 301, 300
    order[900:910] = order[900:910][::-1]
    runs = loaded(tmp_path, pd.concat([frame(0).iloc[order], frame(1).iloc[order]]))
    assert [run.samples for run in runs] == [1600, 1600]
    assert_array_equal(runs[1].position, frame(1)[POSITION])


def test_rows_in_no_order_at_all_are_sorted_where_that_makes_the_motion_smooth(tmp_path: Path) -> None:
    table = frame().sample(frac=1.0, random_state=0)
    (run,) = loaded(tmp_path, table)
    assert_array_equal(run.position, frame()[POSITION])


def test_rows_that_stand_last_first_are_turned_round(tmp_path: Path) -> None:
    (run,) = loaded(tmp_path, frame().iloc[::-1])
    assert_array_equal(run.position, frame()[POSITION])


def test_rows_of_two_episodes_in_no_order_are_refused(tmp_path: Path) -> None:
    table = pd.concat([frame(0), frame(1)]).sample(frac=1.0, random_state=0)
    assert "do several logs or drivers share the file?" in refusal(loaded, tmp_path, table)


def test_a_few_rows_of_another_clock_among_rows_in_no_order_are_refused(tmp_path: Path) -> None:
    late = frame(1).iloc[:800].sample(n=60, random_state=0)
    table = pd.concat([frame(0), late.assign(t=late["t"] + 0.4 / RATE_HZ)]).sample(frac=1.0, random_state=0)
    assert "do several logs or drivers share the file?" in refusal(loaded, tmp_path, table)


def test_a_stamp_that_is_wrong_is_not_sorted_into_other_values(tmp_path: Path) -> None:
    table = frame()
    table.loc[900, "t"] = 1.0024
    runs = loaded(tmp_path, table)
    assert [run.samples for run in runs] == [900, 700]
    assert max(np.abs(np.diff(run.position, axis=0)).max() for run in runs) < 0.05


def test_a_clock_of_whole_seconds_is_refused_with_what_would_be_right(tmp_path: Path) -> None:
    table = frame()
    table["t"] = np.floor(table["t"])
    said = refusal(loaded, tmp_path, table)
    assert "1592 of 1600 rows have the stamp of the row before" in said
    assert "steps of 1 s" in said


def test_stamps_in_single_precision_are_refused_with_the_reason(tmp_path: Path) -> None:
    table = frame()
    table["t"] = (table["t"] + 1_767_225_600).astype("float32").astype(float)
    said = refusal(loaded, tmp_path, table)
    assert "single precision" in said
    assert "128 s" in said


def test_rows_of_zeros_between_rows_of_motion_are_left_out_and_counted(tmp_path: Path) -> None:
    table = frame()
    zeros = table.iloc[::20].copy()
    zeros["t"] += 0.2 / RATE_HZ
    zeros[[*POSITION, "tau1", "tau2", "tau3"]] = 0.0
    (run,) = loaded(tmp_path, pd.concat([table, zeros]).sort_values("t"))
    assert kinds(run) == [("bad_value", "repaired")]
    assert f"{len(zeros)} of {len(table) + len(zeros)} rows hold zeros alone" in run.findings[0].text
    assert_array_equal(run.position, table[POSITION])


def test_a_row_of_zeros_is_left_out_where_no_column_jumps_to_it_if_others_do(tmp_path: Path) -> None:
    table = frame()
    near = table[[*POSITION, *TORQUE]].abs().sum(axis=1).idxmin()
    table.loc[near, [*POSITION, *TORQUE]] = table.loc[[near - 1, near + 1], [*POSITION, *TORQUE]] = 1e-4
    table.loc[[near, *range(15, len(table), 40)], [*POSITION, *TORQUE]] = 0.0
    (run,) = loaded(tmp_path, table)
    assert not np.any(np.all(run.position == 0, axis=1))


def test_a_log_that_starts_and_ends_in_zeros_keeps_them(tmp_path: Path) -> None:
    table = frame()
    ramp = np.clip((np.arange(len(table)) - 200) / 400, 0, 1) * np.clip((1400 - np.arange(len(table))) / 400, 0, 1)
    table[[*POSITION, "tau1", "tau2", "tau3"]] *= ramp[:, None]
    (run,) = loaded(tmp_path, table)
    assert run.samples == len(table)
    assert kinds(run) == []


@pytest.mark.parametrize(("column", "value"), [("q2", 253.0), ("tau3", 40000.0), ("q1", 65535.0)])
def test_a_few_values_beyond_ten_times_a_limit_are_left_out_and_named(
    tmp_path: Path, column: str, value: float
) -> None:
    table = frame()
    table.loc[[300, 700, 701], column] = value
    (run,) = loaded(tmp_path, table)
    assert run.samples == len(table) - 3
    assert "3 of 1600 rows" in run.findings[0].text


def test_repairs_that_would_take_more_than_a_tenth_together_are_refused(tmp_path: Path) -> None:
    table = frame()
    table.loc[::15, "tau2"] = np.nan
    table.loc[5::15, "q1"] = 500.0
    assert "more than a tenth" in refusal(loaded, tmp_path, table)


def test_the_least_number_of_samples_is_asked_after_all_repairs(tmp_path: Path) -> None:
    table = frame().iloc[:60]
    held = table.copy()
    held[:] = np.repeat(table.to_numpy()[::2], 2, axis=0)
    held["t"] = table["t"]
    assert "at least 50 are needed" in refusal(loaded, tmp_path, held)


def test_a_wrapped_encoder_is_unwrapped(tmp_path: Path) -> None:
    table = frame()
    table["q2"] = (6 * table["q2"] + np.pi) % (2 * np.pi) - np.pi
    settings = {"transmission": {"position": [[1, 0, 0], [0, 1 / 6, 0], [0, 0, 1]]}}
    run = load_recording(folder_with(tmp_path, table, settings)).runs[0]
    difference = run.position[:, 1] - frame()["q2"]
    assert_allclose(difference, difference[0], atol=1e-9)
    assert kinds(run) == [("wrapped_encoder", "repaired")]


def test_a_channel_that_counts_whole_turns_is_left_alone(tmp_path: Path) -> None:
    table = frame()
    ticks = np.round(table["q2"] * 4096 / (2 * np.pi))
    table["q2"] = 2 * np.pi * ticks
    settings = {"transmission": {"position": [[1, 0, 0], [0, 1 / 4096, 0], [0, 0, 1]]}}
    run = load_recording(folder_with(tmp_path, table, settings)).runs[0]
    assert_allclose(run.position[:, 1], 2 * np.pi * ticks / 4096, atol=1e-12)
    assert kinds(run) == []


def test_a_jump_that_is_no_whole_turn_is_left_alone(tmp_path: Path) -> None:
    table = frame()
    table.loc[800:, "q2"] += 5.0
    (run,) = loaded(tmp_path, table)
    assert_array_equal(run.position, table[POSITION])


def test_missing_cells_of_an_optional_signal_are_bridged_and_said_so(tmp_path: Path) -> None:
    table = frame()
    table["temp"] = np.linspace(20, 30, len(table))
    table.loc[table.index % 50 != 0, "temp"] = np.nan
    change = {"columns": {**SETTINGS["columns"], "temperature": ["temp"]}, "runs": SETTINGS["runs"][:1]}
    (run,) = load_recording(folder_with(tmp_path, table, change)).runs
    assert run.temperature is not None
    assert_allclose(run.temperature[:1500, 0], np.linspace(20, 30, len(table))[:1500])
    assert ("bad_value", "repaired") in kinds(run)


def test_runs_of_different_rate_are_each_kept_at_their_own(tmp_path: Path) -> None:
    recording = load_recording(folder_with(tmp_path, frame().iloc[::2]))
    assert [round(run.rate_hz) for run in recording.runs] == [100, 200]
    assert [finding.kind for finding in recording.findings] == ["different_rates"]


def test_the_time_column_decides_against_the_nominal_rate(tmp_path: Path) -> None:
    run = load_recording(folder_with(tmp_path, frame(), {"sample_rate_hz": 500.0})).runs[0]
    assert run.rate_hz == pytest.approx(RATE_HZ)
    assert kinds(run) == [("rate", "warning")]


@pytest.mark.parametrize(("unit", "factor"), [("ms", 1e3), ("us", 1e6)])
def test_stamps_in_another_unit_than_the_rate_tells_are_refused_with_their_unit(
    tmp_path: Path, unit: str, factor: float
) -> None:
    table = frame()
    table["t"] *= factor
    with pytest.raises(InputError, match=f"its stamps are in {unit}"):
        load_recording(folder_with(tmp_path, table, {"sample_rate_hz": RATE_HZ}))


def test_a_clock_that_runs_faster_than_any_drive_is_refused(tmp_path: Path) -> None:
    table = frame()
    table["t"] *= 1e-9
    assert "Hz, should be 1e+06 at most: another unit?" in refusal(load_recording, folder_with(tmp_path, table))


def test_a_clock_that_no_drive_has_is_suspected_without_a_rate(tmp_path: Path) -> None:
    table = frame()
    table["t"] *= 1e3
    run = load_recording(folder_with(tmp_path, table)).runs[0]
    assert ("rate", "warning") in kinds(run)
