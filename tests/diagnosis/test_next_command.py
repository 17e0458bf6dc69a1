"""`armlab next` from a verdict to the files, and what it says of verdicts that it cannot use."""

import csv
import json
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner, Result
from next_questions import LATE, VISCOUS, robot_file, verdict_file

from armlab.cli.main import main
from armlab.diagnosis.next.question import Name
from armlab.effects import library
from armlab.effects.contract import COULOMB_LEVEL, Effect
from armlab.effects.friction import CoulombFriction
from armlab.effects.term import EveryJoint
from problem.arm import body_points
from problem.robot_file import load_arm

QUICK = ["--evaluations", "60", "--duration", "4", "--harmonics", "4", "--rate", "100"]
ROTOR: dict[str, Any] = {"effect": "rotor_inertia", "joint": 1, "parameters": {"inertia": 0.05}}
LINK = {"effect": "inertial_parameter_error", "joint": 1}


def run(tmp_path: Path, verdict: Path, *options: str) -> Result:
    robot = str(robot_file(tmp_path))
    command = ["next", str(verdict), "--robot", robot, "--out", str(tmp_path / "out"), *QUICK, *options]
    return CliRunner().invoke(main, command)


def complaint(result: Result) -> str:
    assert result.exit_code == 2
    lines = result.stderr.strip().splitlines()
    assert len(lines) == 1
    return lines[0]


@pytest.fixture(scope="module")
def designed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    folder = tmp_path_factory.mktemp("next")
    result = run(folder, verdict_file(folder, {**VISCOUS, "rivals": [LATE]}))
    assert result.exit_code == 0, result.output
    return folder / "out", result.output


def test_it_writes_the_motion_in_all_forms_with_card_and_picture(designed: tuple[Path, str]) -> None:
    names = {path.name for path in designed[0].iterdir()}
    assert names == {"next.json", "next.csv", "next.ros2.yaml", "next.mod", "next.png"}
    assert (designed[0] / "next.png").read_bytes().startswith(b"\x89PNG")


def test_the_written_motion_keeps_the_limits_from_rest_to_rest(designed: tuple[Path, str]) -> None:
    with (designed[0] / "next.csv").open() as file:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    for joint in (1, 2, 3):
        assert max(abs(row[f"qd{joint}"]) for row in rows) <= 2.0
        assert max(abs(row[f"qdd{joint}"]) for row in rows) <= 10.0
        assert rows[0][f"qd{joint}"] == pytest.approx(0, abs=1e-9)
        assert rows[-1][f"qdd{joint}"] == pytest.approx(0, abs=1e-9)


def test_all_forms_hold_the_same_motion(designed: tuple[Path, str]) -> None:
    with (designed[0] / "next.csv").open() as file:
        table = np.array([[float(row[f"q{joint}"]) for joint in (1, 2, 3)] for row in csv.DictReader(file)])
    message = yaml.safe_load((designed[0] / "next.ros2.yaml").read_text())
    assert np.array([point["positions"] for point in message["points"]]) == pytest.approx(table)


def test_the_card_tells_standard_errors_before_and_after_and_the_probability(designed: tuple[Path, str]) -> None:
    card = json.loads((designed[0] / "next.json").read_text())
    assert card["schema"] == "next/1"
    question = card["questions"][0]
    errors = question["pairs"][0]["standard_errors"]
    assert errors["designed"] > errors["before"]
    assert sum(question["decides"].values()) == pytest.approx(1)
    assert "one such run decides between viscous friction at joint 2 or time delay" in designed[1]


def lowest_frame(folder: Path) -> float:
    """Height of the lowest origin of a link's frame in the written motion, m."""
    with (folder / "next.csv").open() as file:
        poses = np.array([[float(row[f"q{joint}"]) for joint in (1, 2, 3)] for row in csv.DictReader(file)])
    return float(body_points(load_arm("irb120-arm"), poses, np.zeros(3))[..., 2].min())


def test_a_motion_that_went_through_the_floor_does_not_any_more(tmp_path: Path, designed: tuple[Path, str]) -> None:
    floor = 0.22
    result = run(tmp_path, verdict_file(tmp_path, {**VISCOUS, "rivals": [LATE]}), "--floor", str(floor))
    radius = 0.0378  # of the capsules that stand for this arm
    assert lowest_frame(designed[0]) - radius < floor
    assert lowest_frame(tmp_path / "out") - radius >= floor + 0.02
    assert "checked: the floor at 0.22 m" in result.output
    assert "not checked: a floor" in designed[1]
    safety = json.loads((tmp_path / "out/next.json").read_text())["safety"]
    assert safety["least_distance_m"]["the floor"] >= 0.02
    assert any("payload, tool, cables" in each for each in safety["not_checked"])


def test_a_motion_starts_and_ends_near_the_pose_and_keeps_the_range_that_are_given(tmp_path: Path) -> None:
    (tmp_path / "safety.yaml").write_text("near: [0.1, 0.2, 0.0]\nfloor: 0.0\n")
    options = ["--safety", str(tmp_path / "safety.yaml"), "--range", "-0.5:0.5,-0.3:0.6,-0.4:0.4"]
    result = run(tmp_path, verdict_file(tmp_path, {**VISCOUS, "rivals": [LATE]}), *options)
    assert result.exit_code == 0, result.output
    with (tmp_path / "out/next.csv").open() as file:
        poses = np.array([[float(row[f"q{joint}"]) for joint in (1, 2, 3)] for row in csv.DictReader(file)])
    for end in poses[[0, -1]]:
        assert np.abs(end - [0.1, 0.2, 0.0]).max() <= 0.1
    assert np.all(poses >= [-0.5, -0.3, -0.4])
    assert np.all(poses <= [0.5, 0.6, 0.4])
    assert "checked: positions within the given range" in result.output


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--keep-out", "0.5,0,0,0.3,1,1"], "the lower corner comes first, but x goes from 0.5 to 0.3"),
        (["--keep-out", "0.5,0,0"], "should be six numbers"),
        (["--keep-out", "a,b,c,d,e,f"], "should be finite numbers with commas"),
        (["--near", "0,nan,0"], "should be finite numbers with commas"),
        (["--near", "0,1.9,0", "--floor", "0.2"], "m inside the floor; 0.02 m are to be kept"),
        (["--range", "-1:1"], "range should have 3 entries"),
        (["--range", "-1,1,0"], "one LOW:HIGH a joint"),
        (["--floor", "0.5"], "is too close to the floor in every pose of its range"),
        (["--safety", "missing.yaml"], "missing.yaml"),
    ],
)
def test_safety_options_that_leave_no_room_are_told_in_one_line(tmp_path: Path, options: list[str], told: str) -> None:
    assert told in complaint(run(tmp_path, verdict_file(tmp_path, {**VISCOUS, "rivals": [LATE]}), *options))
    assert not (tmp_path / "out").exists()


def test_the_same_seed_gives_the_same_motion(tmp_path: Path, designed: tuple[Path, str]) -> None:
    run(tmp_path, verdict_file(tmp_path, {**VISCOUS, "rivals": [LATE]}))
    assert (tmp_path / "out/next.csv").read_bytes() == (designed[0] / "next.csv").read_bytes()


def test_where_no_motion_helps_it_says_so_and_what_else_would(tmp_path: Path) -> None:
    result = run(tmp_path, verdict_file(tmp_path, {**ROTOR, "rivals": [LINK]}))
    assert result.exit_code == 0
    assert "no motion separates these two" in result.output
    assert "a data sheet that gives the rotor inertia of joint 1 to 0.0125 kg m2" in result.output
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"next.json"}


def otherwise(tmp_path: Path) -> dict[str, float]:
    pair = json.loads((tmp_path / "out/next.json").read_text())["questions"][0]["pairs"][0]
    assert pair["no_motion_separates"]
    return {each["what"]: each["standard_errors"] for each in pair["otherwise"]}


def test_a_tilted_base_shows_the_zero_of_joint_one(tmp_path: Path) -> None:
    zero = {"effect": "encoder_offset", "joint": 1, "parameters": {"offset": 0.02}}
    run(tmp_path, verdict_file(tmp_path, {**zero, "rivals": [{"effect": "torque_offset", "joint": 1}]}))
    assert otherwise(tmp_path)["the motion on the level and with the base tilted by 10 degrees"] > 5


def test_a_load_is_told_from_its_link_by_taking_it_off(tmp_path: Path) -> None:
    load = {"effect": "payload", "joint": 3, "parameters": {"mass": 0.3, "centre": [0.0, 0.0, 0.05]}}
    rivals = [{"effect": "inertial_parameter_error", "joint": 3}]
    run(tmp_path, verdict_file(tmp_path, {**load, "rivals": rivals}))
    assert otherwise(tmp_path)["the motion with and without the load on link 3"] > 5


def test_an_effect_of_a_link_is_at_a_link() -> None:
    assert str(Name("payload", 3)) == "payload at link 3"
    assert str(Name("coulomb_friction", 3)) == "Coulomb friction at joint 3"


def test_a_verdict_without_rivals_is_refused(tmp_path: Path) -> None:
    assert "no finding has rivals" in complaint(run(tmp_path, verdict_file(tmp_path, VISCOUS)))


def test_rivals_can_be_named(tmp_path: Path) -> None:
    result = run(tmp_path, verdict_file(tmp_path, VISCOUS), "--rivals", "viscous_friction,nonlinear_viscous_friction")
    assert "viscous friction at joint 2 | nonlinear viscous friction at joint 2" in result.output


class Seal(CoulombFriction):
    """An effect of a user."""

    facts = Effect("sticky_seal", "a seal that sticks", (COULOMB_LEVEL,), title="friction of a seal")


SEAL = EveryJoint(Seal.facts, (Seal,))


def test_an_effect_of_a_plug_in_can_be_a_rival(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    entries = [EntryPoint("seal", f"{__name__}:SEAL", "armlab.effects")]
    monkeypatch.setattr(library, "entry_points", lambda group: entries)
    result = run(tmp_path, verdict_file(tmp_path, VISCOUS), "--rivals", "viscous_friction,sticky_seal")
    assert "viscous friction at joint 2 | friction of a seal at joint 2" in result.output


@pytest.mark.parametrize(
    ("rivals", "told"),
    [
        ("viscous_friction", "two names or more"),
        ("viscous_fricton,time_delay", "did you mean 'viscous_friction'"),
        ("coulomb_friction@9,viscous_friction", "a number from 1 to 3"),
        ("unknown,viscous_friction", "no columns"),
        ("coulomb_friction@1,stribeck_friction@1", "how large is"),
        ("library", "needs --recording"),
    ],
)
def test_names_that_cannot_be_used_are_told_in_one_line(tmp_path: Path, rivals: str, told: str) -> None:
    assert told in complaint(run(tmp_path, verdict_file(tmp_path, VISCOUS), "--rivals", rivals))


def test_a_file_that_is_no_verdict_is_refused(tmp_path: Path) -> None:
    (tmp_path / "verdict.json").write_text('{"schema": "next/1"}')
    assert "is no verdict" in complaint(run(tmp_path, tmp_path / "verdict.json"))


def test_the_verdict_of_a_recording_of_motion_only_is_refused(tmp_path: Path) -> None:
    verdict = verdict_file(tmp_path, {**VISCOUS, "rivals": [LATE]})
    (tmp_path / "model.yaml").write_text(
        "schema: model/1\nrobot: robot.yaml\ncomponents: []\ncontroller: {type: pd, kp: [1], kd: [0]}\n"
    )
    assert "of a recording of motion only" in complaint(run(tmp_path, verdict))


def test_a_robot_without_limits_and_without_a_recording_is_refused(tmp_path: Path) -> None:
    verdict = verdict_file(tmp_path, {**VISCOUS, "rivals": [LATE]})
    result = CliRunner().invoke(main, ["next", str(verdict), "--robot", "irb120-arm", "--out", str(tmp_path / "out")])
    assert "acceleration_limit" in complaint(result)
