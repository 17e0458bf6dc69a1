"""The form of an import in a terminal: what is open is asked, and nothing else; a wrong answer is asked again."""

import json
import shlex
import shutil
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from click.testing import CliRunner
from foreign_logs import SO101_JOINTS, lerobot_log
from numpy.testing import assert_allclose
from recording_folders import POSITION, TORQUE, frame
from terminal_sessions import TerminalSession

from armlab.cli.main import main
from armlab.recordings.imports.plan import plan_import
from armlab.recordings.imports.proposals import follow_order, match_joints, propose_unit
from armlab.recordings.load import load_recording
from problem.robot_file import BUILT_IN_FOLDER

NOTHING = {
    **dict.fromkeys(("robot", "out", "time", "position", "torque", "gains", "separator", "decimal", "topic", "joints")),
    "units": (),
    "validate": (),
}
CURRENT_PER_TORQUE = 250.0  # mA per N m


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A log in milliamperes with names that nobody knows, and the robot file beside it."""
    table = frame()
    table[TORQUE] *= CURRENT_PER_TORQUE
    names = ["clock", "a", "b", "c", "motor_current_1", "motor_current_2", "motor_current_3"]
    pd.DataFrame(table.to_numpy(), columns=names).to_csv(tmp_path / "log.csv", index=False)
    shutil.copy(BUILT_IN_FOLDER / "irb120-arm.yaml", tmp_path / "arm.yaml")
    return tmp_path


def check_log(recording: Path) -> None:
    run = load_recording(recording).runs[0]
    assert_allclose(run.position, frame()[POSITION])
    assert_allclose(run.torque, frame()[TORQUE])


def test_the_form_asks_all_that_is_open_and_a_wrong_answer_again(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    session = TerminalSession(["recording", "import", "log.csv"], folder)
    assert "motor_current_1, motor_current_2, motor_current_3 [unit?]" in session.wait_for("Still open")
    session.wait_for(r"\[arm.yaml\]: $")
    session.answer("arm.yml")
    assert "Error: " in session.wait_for(r"robot: a file")
    session.wait_for(r"\[arm.yaml\]: $")
    session.answer("")
    session.wait_for(r"column of time \[clock\]: $")
    session.answer("")
    session.wait_for(r"columns of position, joint by joint \(joint1, joint2, joint3\): $")
    session.answer("a,b")
    assert "names 2 columns (a, b); the robot has 3 joints" in session.wait_for(r"columns of position.*: $")
    session.answer("a,b,c")
    session.wait_for(r"unit of position.*\[rad\]: $")
    session.answer("")
    session.wait_for(r"unit of torque.*\[mA\]: $")
    session.answer("")
    session.wait_for(r"gains of .*: $")
    session.answer("4,4")
    assert "holds 2 numbers for 3 columns" in session.wait_for(r"gains of .*: $")
    session.answer("4,4,4")
    session.wait_for(r"new folder for the recording \[log-recording\]: $")
    session.answer("")
    assert session.finish() == 0
    check_log(folder / "log-recording")
    command = session.text.split("the same without questions: armlab ")[1].split("\n")[0]
    monkeypatch.chdir(folder)
    again = CliRunner().invoke(main, shlex.split(command.replace("log-recording", "again")))
    assert again.exit_code == 0, again.output
    check_log(folder / "again")


def test_options_that_are_given_are_not_asked(folder: Path) -> None:
    words = "recording import log.csv --robot arm.yaml --out new --time clock --position a,b,c --unit position=rad"
    session = TerminalSession([*words.split(), "--gains", "4,4,4"], folder)
    assert "[arm.yaml]" not in session.wait_for(r"unit of torque.*\[mA\]: $")
    session.answer("")
    assert session.finish() == 0
    assert session.text.count("]: ") == 1
    check_log(folder / "new")


def test_an_interrupt_writes_nothing(folder: Path) -> None:
    before = sorted(folder.iterdir())
    session = TerminalSession(["recording", "import", "log.csv"], folder)
    session.wait_for(r"\[arm.yaml\]: $")
    session.answer("")
    session.wait_for(r"column of time.*: $")
    session.interrupt()
    assert session.finish() == 130
    assert "stopped: nothing is written" in session.text
    assert sorted(folder.iterdir()) == before


@pytest.mark.parametrize("silent", ["--quiet", "--json"])
def test_a_silent_command_does_not_ask(folder: Path, silent: str) -> None:
    session = TerminalSession(["recording", "import", "log.csv", silent], folder)
    assert session.finish() == 2
    assert all(flag in session.text for flag in ("--robot", "--time", "--position", "--unit torque=UNIT", "--out"))


def test_without_a_terminal_one_message_names_all_that_is_open(folder: Path) -> None:
    result = CliRunner().invoke(main, ["recording", "import", str(folder / "log.csv")])
    assert result.exit_code == 2
    assert all(flag in result.output for flag in ("--robot", "--time", "--position", "--unit torque=UNIT", "--out"))
    assert not (folder / "log-recording").exists()


def test_a_log_of_commands_is_told_by_an_answer(tmp_path: Path) -> None:
    table = frame().set_axis(["t", "q1", "q2", "q3", "goal1", "goal2", "goal3"], axis=1)
    table.to_csv(tmp_path / "log.csv", index=False)
    plan = plan_import([tmp_path / "log.csv"], {**NOTHING, "robot": "irb120-arm", "units": ("position=rad",)})
    torque = plan.questions[0]
    assert (torque.option, torque.proposal) == ("torque", None)
    asked = plan_import([tmp_path / "log.csv"], torque.with_answer(plan.options, "none")).questions[0]
    assert (asked.option, asked.proposal) == ("reference_position", "goal1,goal2,goal3")


def test_columns_of_joints_with_other_names_are_a_question_with_the_order_by_words(tmp_path: Path) -> None:
    joints = ["elbow", "base", "shoulder"]
    names = ["t", *(f"{kind}_arm_{joint}" for kind in ("position", "effort") for joint in joints)]
    frame().set_axis(names, axis=1).to_csv(tmp_path / "log.csv", index=False)
    text = (BUILT_IN_FOLDER / "irb120-arm.yaml").read_text()
    for number, name in enumerate(("base_joint", "shoulder_joint", "elbow_joint"), 1):
        text = text.replace(f"name: joint{number}", f"name: {name}")
    (tmp_path / "arm.yaml").write_text(text)
    plan = plan_import([tmp_path / "log.csv"], {**NOTHING, "robot": str(tmp_path / "arm.yaml")})
    assert [(question.option, question.proposal) for question in plan.questions[:2]] == [
        ("position", "position_arm_base,position_arm_shoulder,position_arm_elbow"),
        ("torque", "effort_arm_base,effort_arm_shoulder,effort_arm_elbow"),
    ]


@pytest.mark.parametrize(
    ("names", "answers"),
    [
        ([f"main_{joint}" for joint in SO101_JOINTS], ["units"]),
        ([[f"{joint}.pos" for joint in SO101_JOINTS]], ["units"]),
        ([f"left_{joint}.pos" for joint in SO101_JOINTS], ["position", "reference_position", "units"]),
    ],
)
def test_the_joints_of_a_lerobot_dataset_are_found_by_its_names(
    tmp_path: Path, names: list[Any], answers: list[str]
) -> None:
    log = lerobot_log(tmp_path)
    info = log.files[0] / "meta" / "info.json"
    content = json.loads(info.read_text())
    for vector in ("action", "observation.state"):
        content["features"][vector]["names"] = names
    info.write_text(json.dumps(content))
    plan = plan_import(log.files, {**NOTHING, "robot": str(log.robot), "out": str(tmp_path / "new")})
    asked = []
    while plan.questions:
        question = plan.questions[0]
        assert question.proposal is not None
        asked.append(question.option)
        plan = plan_import(log.files, question.with_answer(plan.options, question.proposal))
    assert asked == answers
    assert all("shoulder_pan" in columns[0] for signal, columns in plan.columns.items() if signal != "time")
    assert plan.units["reference_position"] == "deg"


def test_the_robot_beside_a_log_is_proposed_where_just_one_fits(tmp_path: Path) -> None:
    log = lerobot_log(tmp_path)
    shutil.copy(BUILT_IN_FOLDER / "irb120-arm.yaml", tmp_path / "other.yaml")
    assert plan_import(log.files, NOTHING).questions[0].proposal == str(log.robot)
    shutil.copy(log.robot, tmp_path / "again.xml")
    assert plan_import(log.files, NOTHING).questions[0].proposal is None


def test_an_order_is_proposed_only_where_the_names_tell_it() -> None:
    assert match_joints(["main_wrist", "main_elbow"], ["elbow_joint", "wrist_joint"]) == ("main_elbow", "main_wrist")
    assert match_joints(["left", "right"], ["elbow", "wrist"]) == ()
    assert match_joints(["wrist_1", "wrist_2"], ["wrist", "elbow"]) == ()
    assert follow_order(["effort_x", "effort_y"], ["position_y", "position_x"]) == ("effort_y", "effort_x")
    assert follow_order(["effort_x", "effort_z"], ["position_y", "position_x"]) == ()


def test_units_are_proposed_by_the_size_of_the_values() -> None:
    values = frame()[POSITION].to_numpy()
    assert propose_unit("position", POSITION, values, sliding=False) == "rad"
    assert propose_unit("position", POSITION, 57.3 * values, sliding=False) == "deg"
    assert propose_unit("position", POSITION, values, sliding=True) == "m"
    assert propose_unit("torque", ["current_1"], values, sliding=False) == "A"


def test_the_table_has_one_row_a_signal_in_80_columns(tmp_path: Path) -> None:
    names = ["timestamp_ns", *(f"q{n}_rad" for n in (1, 2, 3)), *(f"tau{n}_Nm" for n in (1, 2, 3))]
    table = frame()
    table["t"] *= 1e9
    (tmp_path / "a folder with a long name").mkdir()
    log = tmp_path / "a folder with a long name" / "log.csv"
    table.set_axis(names, axis=1).to_csv(log, index=False)
    session = TerminalSession(["recording", "import", str(log)], tmp_path)
    shown = session.wait_for("Still open")
    session.interrupt()
    for signal, text in (
        ("time", "timestamp_ns [ns] (a usual name; unit from _ns)"),
        ("position", "q1_rad, q2_rad, q3_rad [rad] (usual names; unit from _rad)"),
        ("torque", "tau1_Nm, tau2_Nm, tau3_Nm [N.m] (usual names; unit from _Nm)"),
    ):
        assert len([line for line in shown.splitlines() if line.strip().startswith(signal)]) == 1
        assert text in shown
