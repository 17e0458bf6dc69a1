"""Comparisons of recordings of motion only: the number that changed and no other, intervals, several recordings."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from servo_arms import arm_text, commands, simulate, write_recording

from armlab.cli.main import main
from armlab.diagnosis.motion.choose import ChosenServo
from armlab.diagnosis.motion.compare import FittedLevels, ServoChange, common_start, compare_motion, fit_shared
from armlab.diagnosis.motion.estimate import ServoFit, from_coordinates, to_coordinates
from armlab.diagnosis.motion.motion_tuning import DEFAULT
from armlab.diagnosis.motion.servo import HIGHEST, LOWEST, NEUTRAL, PARAMETERS, place
from armlab.diagnosis.motion.servo_simulation import read_servo_simulation
from armlab.diagnosis.motion.windows import make_windows
from armlab.recordings.motion import load_motion_recording
from armlab.report.motion.compare_write import comparison_page, make_motion_comparison

TRUTH = {"kp": 8.0, "kv": 0.0, "damping": 0.5, "frictionloss": 0.1}


def test_a_comparison_names_the_gain_that_was_raised_and_nothing_else(tmp_path: Path) -> None:
    old = write_recording(tmp_path / "old", TRUTH, seconds=6.0)
    new = write_recording(tmp_path / "new", {**TRUTH, "kp": 16.0}, seconds=6.0)
    comparison = compare_motion(load_motion_recording(old), load_motion_recording(new))
    assert {(each.parameter.key, each.joint) for each in comparison.changed} == {("kp", 1), ("kp", 2)}
    for each in comparison.changed:
        assert each.ratio is not None
        assert each.ratio[0] == pytest.approx(2.0, rel=0.06)
    file = make_motion_comparison(comparison)
    assert file.status == "changed"
    assert "a factor of" in file.summary
    assert "controller gain" in comparison_page(comparison, "armlab diagnose --compare")


def test_an_interval_of_a_change_is_as_wide_as_the_scatter_between_runs(tmp_path: Path) -> None:
    gains = {"old": (7.0, 8.0, 9.0), "new": (14.0, 16.0, 18.0)}
    for name, each in gains.items():
        folder = write_recording(tmp_path / name, {**TRUTH, "kp": each[0]}, seconds=4.0)
        for seed, gain in enumerate(each, start=1):
            command = commands(seed, 4.0)
            truth = {**TRUTH, "kp": gain}
            columns = simulate(arm_text(**truth), command)
            table = pd.read_csv(folder / f"run-{seed}.csv").assign(q1=columns[:, 0], q2=columns[:, 1])
            table.to_csv(folder / f"run-{seed}.csv", index=False)
    comparison = compare_motion(*(load_motion_recording(tmp_path / name) for name in gains))
    for joint in (1, 2):
        (change,) = (each for each in comparison.changes if (each.parameter.key, each.joint) == ("kp", joint))
        assert change.ratio is not None
        assert change.ratio[1] < 2.0 < change.ratio[2]
        assert change.ratio[2] / change.ratio[1] > 1.3  # a gain of 12 % scatter in each of three runs


def test_a_gain_that_was_raised_at_the_third_of_three_recordings_is_a_step_there(tmp_path: Path) -> None:
    truths = {"first": TRUTH, "second": TRUTH, "third": {**TRUTH, "kp": 16.0}}
    folders = [str(write_recording(tmp_path / name, truth, seconds=6.0)) for name, truth in truths.items()]
    days = ["--dates", "2026-01-31,2026-02-28,2026-03-31"]
    result = CliRunner().invoke(main, ["diagnose", "--compare", *folders, *days, "--out", str(tmp_path / "out")])
    assert result.exit_code == 0
    file = json.loads((tmp_path / "out" / "comparison.json").read_text(encoding="utf-8"))
    assert {(each["effect"], each["joint"]) for each in file["findings"]} == {
        ("controller_gain_error", 1),
        ("controller_gain_error", 2),
    }
    assert file["dates"] == days[1].split(",")
    for each in file["trends"]:
        assert (each["kind"], each["change_point"]) == ("step", 2)
        assert each["values"] == pytest.approx([8.0, 8.0, 16.0], rel=0.06)
    assert "changes once, at third" in result.output
    page = (tmp_path / "out" / "comparison.html").read_text(encoding="utf-8")
    assert "third: 2026-03-31" in page


def test_recordings_and_dates_are_as_many(tmp_path: Path) -> None:
    folder = str(write_recording(tmp_path / "one", {}, seconds=4.0))
    command = ["diagnose", "--compare", folder, folder, "--dates", "2026-01-31", "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(main, command)
    assert result.exit_code == 2
    assert "1 dates for 2 recordings" in result.output


def levels_of_kp(values: list[float], error: float, run_error: float) -> FittedLevels:
    """Independent levels: errors of their logarithms by windows, and by two degrees of freedom of the runs of each."""
    count = len(values)
    by_runs = np.array([np.diag(row) for row in run_error**2 * np.eye(count)])
    coordinates, by_windows = np.log(values), error**2 * np.eye(count)
    return FittedLevels(place("kp"), coordinates, by_windows, 100.0, by_runs, np.full(count, 2.0))


def test_a_factor_between_any_two_recordings_has_the_wider_interval_of_windows_and_runs() -> None:
    """Two levels of standard error 0.03: 0.0424 in all, t of 4 degrees of freedom (Welch) 2.776, of 100 1.984."""
    for by_runs, half in ((0.0, 1.984 * 0.0424), (0.03, 2.776 * 0.0424)):
        factor = levels_of_kp([2.0, 4.0, 16.0], 0.03, by_runs).between(0, 1).factor
        assert factor == pytest.approx([2.0, 2.0 * np.exp(-half), 2.0 * np.exp(half)], rel=1e-3)


def test_a_number_that_differs_between_any_two_recordings_differs() -> None:
    """It goes up and comes back: first and last are the same."""
    levels = levels_of_kp([2.0, 4.0, 2.0], 0.03, 0.0)
    assert levels.between(0, 2).chance == 1.0
    assert levels.chance_of_same() < 1e-20


def test_a_number_of_which_no_possible_change_would_be_seen_is_not_told() -> None:
    levels = levels_of_kp([2.0, 4.0], 0.03, 0.0)
    told, untold = (ServoChange(PARAMETERS[levels.number], 1, levels, 1.0, False, each) for each in (0.5, 7e21))
    assert told.is_told
    assert not untold.is_told


def test_a_drive_with_damping_lends_the_joints_own_to_the_others() -> None:
    kd, damping = place("kd"), place("damping")

    def servo(at: tuple[float, float], own: tuple[bool, bool]) -> ChosenServo:
        values, free = NEUTRAL.copy(), np.zeros(len(NEUTRAL), dtype=bool)
        values[[kd, damping]], free[[kd, damping]] = at, own
        fit = ServoFit(values, free, lambda: np.eye(1), 0.0, 0.0, 1, np.zeros(1))
        return ChosenServo(NEUTRAL, fit, free, {}, np.zeros(0, dtype=np.intp), 0.0)

    starts, free = common_start([servo((0.0, 0.5), (False, True)), servo((0.3, 0.2), (True, False))])
    np.testing.assert_allclose(starts[:, [kd, damping]], [(0.3, 0.2), (0.3, 0.2)])
    assert free[[kd, damping]].tolist() == [True, False]


def test_a_shared_fit_stays_within_the_bounds_of_its_numbers(tmp_path: Path) -> None:
    """Without friction in the joint, noise would have it push."""
    recording = load_motion_recording(write_recording(tmp_path / "one", TRUTH, seconds=4.0))
    windows = make_windows(recording.with_role("identify"), read_servo_simulation(recording))[0]
    values, free = NEUTRAL.copy(), np.zeros(len(NEUTRAL), dtype=bool)
    values[place("kp")] = TRUTH["kp"]
    free[[place("kp"), place("static_excess")]] = True
    start = to_coordinates(np.stack([values, values]))
    fitted = fit_shared([windows, windows], start, free, tuple(np.flatnonzero(free).tolist()), DEFAULT)
    assert np.all(from_coordinates(fitted.levels) >= LOWEST)
    assert np.all(from_coordinates(fitted.levels) <= HIGHEST)
