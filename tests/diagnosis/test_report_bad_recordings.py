"""Recordings that go wrong: one clear line and nothing written, or a verdict that says why it is none."""

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from click.testing import CliRunner
from small_recordings import POSITION, TORQUE, frame, recording_in

from armlab.cli.main import main
from armlab.recordings.load import load_recording

Make = Callable[[Path], Path]


def two_runs() -> tuple[pd.DataFrame, pd.DataFrame]:
    """Runs of six seconds, which are enough for a verdict."""
    return frame(0, 6), frame(1, 6)


def changed(change: Callable[[pd.DataFrame], pd.DataFrame], **settings: object) -> Make:
    """A recording of two runs, both changed in the same way."""
    return lambda folder: recording_in(folder, *map(change, two_runs()), **settings)


def scaled(factor: float) -> Make:
    return changed(lambda run: run.assign(**{name: factor * run[name] for name in TORQUE}))


def resting(*names: str) -> Make:
    return changed(lambda run: run.assign(**{name: run[name].iloc[0] for name in names}))


def spoiled(run: pd.DataFrame, share: float, value: float) -> pd.DataFrame:
    rows = np.random.default_rng(0).choice(len(run), int(share * len(run)), replace=False)
    out = run.copy()
    out.loc[rows, "tau2"] = value
    return out


def another_arm(folder: Path) -> Path:
    """The robot file has the links of an arm ten times as large and hung from the ceiling."""
    made = recording_in(folder, *two_runs(), robot="robot.yaml")
    content = yaml.safe_load((Path(__file__).parents[2] / "problem" / "robots" / "irb120-arm.yaml").read_text())
    content |= {"name": "another", "gravity": [0.0, 9.81, 0.0]}
    for joint in content["joints"]:
        joint["a"] = 0.9 - joint["a"]
        joint["alpha"] = 1.0 - joint["alpha"]
    (made / "robot.yaml").write_text(yaml.safe_dump(content))
    return made


def with_text(change: Callable[[str], str], file: str = "run-0.csv") -> Make:
    """A recording of which a file is changed as text: the first run, or another one."""

    def make(folder: Path) -> Path:
        made = recording_in(folder, *two_runs())
        path = made / file
        path.write_text(change(path.read_text()))
        return made

    return make


REFUSED = {
    "no folder": (lambda folder: folder, "no recording.yaml"),
    "no run file": (lambda folder: _without(recording_in(folder, *two_runs()), "run-0.csv"), "run-0.csv"),
    "a column is missing": (changed(lambda run: run.drop(columns="tau2")), "no column 'tau2'"),
    "most torques are no numbers": (changed(lambda run: spoiled(run, 0.5, np.nan)), "too many to repair"),
    "most torques are absurd": (changed(lambda run: spoiled(run, 0.5, 1e251)), "too many to repair"),
    "robot of another number of joints": (changed(lambda run: run, robot="kuka-kr300"), "joints"),
    "unknown unit": (changed(lambda run: run, units={"time": "s", "position": "rad", "torque": "lbf"}), "lbf"),
    "an empty run": (with_text(lambda text: text.splitlines()[0] + "\n"), "holds no rows"),
    "no run to identify from": (
        with_text(lambda text: text.replace("identify", "validate"), "recording.yaml"),
        "give one of its runs the role identify",
    ),
    "no simulation to compare with": (
        changed(lambda run: run, simulation="model.yaml"),
        "no file",
    ),
}
INCONCLUSIVE = {
    "too short": (lambda folder: recording_in(folder, frame(0, 0.8), frame(1, 0.8)), "too short"),
    "no motion": (resting(*POSITION), "No joint moves"),
    "torque channels that are dead": (resting("tau1", "tau2", "tau3"), "never change"),
    "robot of another arm": (another_arm, "another"),
}
AS_READ = {
    "torque in N mm": (scaled(1000.0), "another unit", "unit_error"),
    "torque of the wrong sign": (scaled(-1.0), "opposite sign", "torque_sign"),
}
USED = {
    "a joint that never moves": resting("q1"),
    "a few bad cells": changed(lambda run: spoiled(run, 0.01, np.nan)),
    "a broken last row": with_text(lambda text: text[: text.rstrip("\n").rindex(",") - 3]),
    "a row twice": with_text(lambda text: "".join(_twice(text.splitlines(keepends=True)))),
    "no run that validates": lambda folder: recording_in(folder, *two_runs(), validate=False),
}


def _without(folder: Path, name: str) -> Path:
    (folder / name).unlink()
    return folder


def _twice(lines: list[str]) -> list[str]:
    return [*lines[:300], lines[299], *lines[300:]]


def run(recording: Path, out: Path, *options: str) -> tuple[int, str, str]:
    result = CliRunner().invoke(main, ["diagnose", str(recording), "--out", str(out), *options])
    return result.exit_code, result.stdout, result.stderr


@pytest.mark.parametrize("name", REFUSED)
def test_unusable_input_is_refused_in_one_line_and_nothing_is_written(name: str, tmp_path: Path) -> None:
    make, word = REFUSED[name]
    code, _, error = run(make(tmp_path / "recording"), tmp_path / "out")
    assert code == 2
    assert word in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", AS_READ)
def test_what_is_read_wrongly_is_corrected_unless_it_is_taken_as_read(name: str, tmp_path: Path) -> None:
    make, word, effect = AS_READ[name]
    folder = make(tmp_path / "recording")
    assert run(folder, tmp_path / "as-read", "--as-read")[0] == 0
    found = json.loads((tmp_path / "as-read" / "verdict.json").read_text())
    assert (found["status"], found["findings"]) == ("inconclusive", [])
    assert word in found["summary"]
    assert run(folder, tmp_path / "out", "--only-setup")[0] == 0
    found = json.loads((tmp_path / "out" / "verdict.json").read_text())
    assert (found["status"], [each["kind"] for each in found["findings"]]) == ("mismatch", ["setup"])
    assert found["findings"][0]["effect"] == effect
    assert len(found["summary"].split(". ")[0].split()) <= 30
    assert load_recording(tmp_path / "out" / "corrected").runs
    assert "read wrongly" in (tmp_path / "out" / "report.html").read_text()
    refused = CliRunner().invoke(main, ["identify", str(folder), "--out", str(tmp_path / "model")])
    assert refused.exit_code == 2
    assert "--as-read" in refused.stderr
    assert (tmp_path / "model" / "corrected" / "recording.yaml").is_file()


@pytest.mark.parametrize("name", INCONCLUSIVE)
def test_what_allows_no_verdict_is_inconclusive_and_says_why(name: str, tmp_path: Path) -> None:
    make, word = INCONCLUSIVE[name]
    code, text, error = run(make(tmp_path / "recording"), tmp_path / "out")
    assert (code, error) == (0, "")
    found = json.loads((tmp_path / "out" / "verdict.json").read_text())
    assert found["status"] == "inconclusive"
    assert word in found["summary"]
    assert found["findings"] == []
    assert word in " ".join(text.split())
    assert word in (tmp_path / "out" / "report.html").read_text()


@pytest.fixture(scope="module")
def used_once(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], tuple[int, str, Path]]:
    """Exit code, error and folder of the diagnosis of a recording of USED, which is made once for all tests."""

    @cache
    def diagnosed(name: str) -> tuple[int, str, Path]:
        folder = tmp_path_factory.mktemp("used")
        code, _, error = run(USED[name](folder / "recording"), folder / "out")
        return code, error, folder / "out"

    return diagnosed


@pytest.mark.parametrize("name", USED)
def test_what_can_be_repaired_or_worked_around_gives_a_verdict(
    name: str, used_once: Callable[[str], tuple[int, str, Path]]
) -> None:
    code, error, out = used_once(name)
    assert (code, error) == (0, "")
    found = json.loads((out / "verdict.json").read_text())
    assert found["status"] == "mismatch"
    wrong = [each for each in found["findings"] if each["joint"] == 1 and "friction" in each["effect"]]
    assert bool(wrong) == (name != "a joint that never moves")


def test_held_out_blocks_and_repairs_stand_in_the_report(used_once: Callable[[str], tuple[int, str, Path]]) -> None:
    repaired, blocks = (used_once(name)[2] / "report.html" for name in ("a row twice", "no run that validates"))
    assert "rows repeat an earlier one" in repaired.read_text()
    assert "every third block of time was held out, of at most six blocks a run" in blocks.read_text()


def test_the_folder_of_the_simulation_itself_is_not_written_over(tmp_path: Path) -> None:
    made = recording_in(tmp_path / "recording", *two_runs(), simulation="model.yaml")
    (made / "model.yaml").write_text("schema: model/1\n")
    code, _, error = run(made, made)
    assert code == 2
    assert "the simulation of recording" in error
    assert (made / "model.yaml").read_text() == "schema: model/1\n"


def test_an_output_folder_that_is_a_file_is_refused_before_any_work(tmp_path: Path) -> None:
    made = recording_in(tmp_path / "recording", *two_runs())
    (tmp_path / "out").write_text("mine")
    code, _, error = run(made, tmp_path / "out")
    assert code == 2
    assert "is a file: give a folder" in error
    assert (tmp_path / "out").read_text() == "mine"
    assert run(made, tmp_path / "out" / "below")[0] == 2


def test_a_baseline_that_is_not_there_is_refused(tmp_path: Path) -> None:
    made = recording_in(tmp_path / "recording", *two_runs())
    code, _, error = run(made, tmp_path / "out", "--baseline", "simulated")
    assert code == 2
    assert "simulated_torque" in error
