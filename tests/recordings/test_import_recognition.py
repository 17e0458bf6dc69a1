"""What drivers write is recognised: names, units, joints, stamps that count from 1970."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from recording_folders import POSITION, TORQUE, folder_with, frame
from refusals import refusal

from armlab.recordings.imports.families import describe_unused, list_columns
from armlab.recordings.imports.files import import_files
from armlab.recordings.imports.plan import plan_import
from armlab.recordings.imports.text import read_odd_csv
from armlab.recordings.load import load_recording

NOTHING = {
    **dict.fromkeys(("time", "position", "torque", "gains", "separator", "decimal", "topic")),
    "robot": "irb120-arm",
    "units": (),
    "validate": (),
}
JOINT_NAMES = ("base_joint", "shoulder_joint", "elbow_joint")
EPOCH_S = 1763680000


def write_log(path: Path, names: tuple[str, ...], seconds: np.ndarray | None = None) -> Path:
    """The run with other column names, position in rad, torque in N m."""
    table = frame()
    if seconds is not None:
        table["t"] = seconds
    pd.DataFrame(table.to_numpy(), columns=list(names)).to_csv(path, index=False)
    return path


def write_robot(folder: Path) -> str:
    """The arm of the recordings with names of joints."""
    from problem.robot_file import BUILT_IN_FOLDER

    text = (BUILT_IN_FOLDER / "irb120-arm.yaml").read_text()
    for number, name in enumerate(JOINT_NAMES, 1):
        text = text.replace(f"name: joint{number}", f"name: {name}")
    path = folder / "arm.yaml"
    path.write_text(text)
    return str(path)


def bracketed(stem: str) -> tuple[str, ...]:
    return tuple(f"{stem}[{joint}]" for joint in range(3))


@pytest.mark.parametrize(
    ("names", "change", "columns", "units"),
    [
        (
            ("timestamp_ns", *(f"actual_q_{n}" for n in range(3)), *bracketed("x")),
            {"torque": "x*", "units": ("torque=Nm",)},
            {"time": "a usual name", "position": "named as in UR's RTDE", "torque": "given with --torque"},
            {"time": "from _ns", "position": "as in UR's RTDE", "torque": "given with --unit"},
        ),
        (
            ("t", *(f"position_{n}" for n in JOINT_NAMES), *(f"effort_{n} [N.m]" for n in JOINT_NAMES)),
            {},
            {
                "time": "a usual name",
                "position": "named as in ROS joint states, joints matched by name",
                "torque": "named as in ROS joint states, joints matched by name",
            },
            {
                "time": "by its steps, 200 Hz",
                "position": "as in ROS joint states",
                "torque": "from the header",
            },
        ),
    ],
)
def test_what_was_recognised_has_a_reason_each(
    tmp_path: Path, names: tuple[str, ...], change: dict, columns: dict[str, str], units: dict[str, str]
) -> None:
    stamps = frame()["t"].to_numpy() * (1e9 if names[0].endswith("_ns") else 1.0)
    path = write_log(tmp_path / "log.csv", names, stamps)
    imported = import_files([path], tmp_path / "new", {**NOTHING, "robot": write_robot(tmp_path), **change})
    assert imported.document["reasons"] == {"columns": columns, "units": units}
    shown = f"({columns['time']}; unit {units['time']})"
    assert f"time: {names[0]} [{imported.plan.units['time']}] {shown}" in imported.lines
    assert sum(line.startswith("position") for line in imported.lines) == 1


def test_columns_that_count_up_are_listed_by_the_first_and_the_last() -> None:
    assert list_columns([f"q{n}_rad" for n in range(1, 7)]) == "q1_rad ... q6_rad"
    assert list_columns(["q1", "q2", "q4", "q5"]) == "q1, q2, q4, q5"
    assert list_columns(["elbow", "wrist_1", "wrist_2", "wrist_3"]) == "elbow, wrist_1, wrist_2, wrist_3"
    assert list_columns(["q1", "q2", "q3"]) == "q1, q2, q3"


def write_torques(path: Path, **others: float) -> Path:
    """The run with a velocity, a counter, and further torques that are so many times the measured one."""
    table = frame()
    factors = {f"{name}{n}": factor * table[f"tau{n}"] for name, factor in others.items() for n in (1, 2, 3)}
    speeds = {f"qd{n}": 0.1 * n * table["t"] for n in (1, 2, 3)}
    table.assign(**speeds, **factors, rows=np.arange(len(table))).to_csv(path, index=False)
    return path


ALL_UNITS = ("position=rad", "torque=N.m")


def test_columns_that_no_signal_takes_are_listed_with_the_option_for_a_velocity(tmp_path: Path) -> None:
    log = write_torques(tmp_path / "log.csv", tauCmd=0.9)
    imported = import_files([log], tmp_path / "new", {**NOTHING, "units": ALL_UNITS})
    (line,) = (line for line in imported.lines if line.startswith("not used: "))
    assert line == (
        "not used: qd1, qd2, qd3, tauCmd1, tauCmd2, tauCmd3, rows; --velocity 'qd*' compares a velocity with positions"
    )
    assert imported.document["unused_columns"][-1] == "rows"


@pytest.mark.parametrize(("others", "count"), [({"tauSm": 1.2}, 2), ({"tauCur": 2.0, "tauSm": 1.2, "tauDes": 1.0}, 3)])
def test_several_torques_are_a_question_and_those_of_a_controller_are_none(
    tmp_path: Path, others: dict[str, float], count: int
) -> None:
    options = {**NOTHING, "units": ALL_UNITS, "out": tmp_path / "new"}
    (question,) = plan_import([write_torques(tmp_path / "log.csv", **others)], options).questions
    assert f"the file holds {count} torques of each joint (tau1, tau2, tau3; " in question.missing
    best = "tauCur" if "tauCur" in others else "tau"
    assert question.proposal == f"{best}1,{best}2,{best}3"
    assert not plan_import([tmp_path / "log.csv"], question.with_answer(options, "tauSm*")).questions


def test_torques_that_never_change_or_that_a_driver_names_are_not_asked_about(tmp_path: Path) -> None:
    options = {**NOTHING, "units": ALL_UNITS, "out": tmp_path / "new"}
    assert not plan_import([write_torques(tmp_path / "zero.csv", tauSm=0.0)], options).questions
    franka = ("t", *bracketed("q"), *bracketed("tau_J"))
    log = pd.read_csv(write_log(tmp_path / "log.csv", franka))
    log.assign(**dict.fromkeys(bracketed("tau_other"), log["tau_J[0]"])).to_csv(tmp_path / "log.csv")
    assert not plan_import([tmp_path / "log.csv"], options).questions


@pytest.mark.parametrize(
    ("names", "gains"),
    [
        (("timestamp", *(f"actual_q_{n}" for n in range(3)), *(f"actual_current_{n}" for n in range(3))), "1,1,1"),
        (("t", *bracketed("q"), *bracketed("tau_J")), None),
        (("time_s", *(f"q{n}_rad" for n in range(1, 4)), *(f"tau{n}_Nm" for n in range(1, 4))), None),
        (("time", *bracketed("measured_joint_position"), *bracketed("measured_torque")), None),
        (("__time", *(f"/arm/position_{n}" for n in range(3)), *(f"/arm/effort_{n}" for n in range(3))), None),
    ],
)
def test_columns_and_units_of_drivers_need_no_flags(tmp_path: Path, names: tuple[str, ...], gains: str | None) -> None:
    path = write_log(tmp_path / "log.csv", names)
    import_files([path], tmp_path / "new", {**NOTHING, "gains": gains})
    run = load_recording(tmp_path / "new").runs[0]
    assert_allclose(run.position, frame()[POSITION])
    assert_allclose(run.torque, frame()[TORQUE])


def test_the_axes_of_a_kuka_controller_count_in_degrees(tmp_path: Path) -> None:
    names = ("t", *(f"AIPos.A{n}" for n in range(1, 4)), *(f"GearTorque.A{n}" for n in range(1, 4)))
    import_files([write_log(tmp_path / "log.csv", names)], tmp_path / "new", NOTHING)
    run = load_recording(tmp_path / "new").runs[0]
    assert_allclose(run.position, np.radians(frame()[POSITION]))
    assert_allclose(run.torque, frame()[TORQUE])


@pytest.mark.parametrize(("name", "factor"), [("timestamp_ns", 1e9), ("timestamp", 1.0), ("time", 1e3)])
def test_stamps_that_count_from_1970_are_taken_from_the_first_one_and_said(
    tmp_path: Path, name: str, factor: float
) -> None:
    stamps = (EPOCH_S + frame()["t"].to_numpy()) * factor
    path = write_log(tmp_path / "log.csv", (name, *(f"q{n}_rad" for n in range(3)), *bracketed("tau_J")), stamps)
    import_files([path], tmp_path / "new", NOTHING)
    run = load_recording(tmp_path / "new").runs[0]
    assert_allclose(run.time, frame()["t"], atol=1e-5)
    assert "2025-11-20 23:06:40 UTC" in next(each.text for each in run.findings if each.kind == "epoch_stamps")


def test_a_single_stamp_of_zero_among_epoch_stamps_is_a_bad_row(tmp_path: Path) -> None:
    table = frame()
    table["t"] += EPOCH_S
    table.loc[5, "t"] = 0.0
    run = load_recording(folder_with(tmp_path / "arm", table)).runs[0]
    assert run.samples == len(table) - 1


def test_joints_in_columns_are_matched_with_the_robot_whatever_their_order(tmp_path: Path) -> None:
    table = frame().to_numpy()
    order = [2, 0, 1]
    names = [f"{kind}_{JOINT_NAMES[joint]}" for kind in ("position", "effort") for joint in order]
    shuffled = np.column_stack([table[:, 0], table[:, 1:4][:, order], table[:, 4:][:, order]])
    pd.DataFrame(shuffled, columns=["t", *names]).to_csv(tmp_path / "log.csv", index=False)
    options = {**NOTHING, "robot": write_robot(tmp_path)}
    for folder, change in (("a", {}), ("b", {"position": "position_*", "torque": "effort_*"})):
        import_files([tmp_path / "log.csv"], tmp_path / folder, {**options, **change})
        run = load_recording(tmp_path / folder).runs[0]
        assert_allclose(run.position, frame()[POSITION])
        assert_allclose(run.torque, frame()[TORQUE])
    listed = {**options, "position": ",".join(names[:3])}
    assert "the robot's order is base_joint" in refusal(import_files, [tmp_path / "log.csv"], tmp_path / "c", listed)


def test_joints_between_topic_and_signal_are_matched_with_the_robot(tmp_path: Path) -> None:
    table, order = frame().to_numpy(), [2, 0, 1]
    names = [f"/joint_states/{JOINT_NAMES[joint]}/{kind}" for kind in ("position", "effort") for joint in order]
    shuffled = np.column_stack([table[:, 0], table[:, 1:4][:, order], table[:, 4:][:, order]])
    pd.DataFrame(shuffled, columns=["__time", *names]).to_csv(tmp_path / "log.csv", index=False)
    import_files([tmp_path / "log.csv"], tmp_path / "new", {**NOTHING, "robot": write_robot(tmp_path)})
    run = load_recording(tmp_path / "new").runs[0]
    assert_allclose(run.position, frame()[POSITION])
    assert_allclose(run.torque, frame()[TORQUE])


def test_joints_that_the_robot_does_not_have_are_never_taken_in_the_order_of_the_file(tmp_path: Path) -> None:
    names = tuple(f"{kind}_{joint}" for kind in ("position", "effort") for joint in JOINT_NAMES)
    path = write_log(tmp_path / "log.csv", ("t", *names))
    assert "name other joints than the robot" in refusal(import_files, [path], tmp_path / "new", NOTHING)


def test_a_pattern_of_too_many_columns_is_an_error(tmp_path: Path) -> None:
    path = write_log(tmp_path / "log.csv", ("t", *bracketed("tau_J"), *bracketed("tau_J_d")))
    options = {**NOTHING, "torque": "tau_J*", "position": "tau_J[?]"}
    message = refusal(import_files, [path], tmp_path / "new", options)
    assert "--torque tau_J* names 6 columns (tau_J[0], tau_J[1], " in message
    assert read_odd_csv(path).table.names[1] == "tau_J[0]"


def test_a_velocity_is_proposed_by_what_its_columns_begin_and_end_with() -> None:
    names = [f"/joint_states/joint_{number}/velocity" for number in (1, 2, 3)]
    assert "--velocity '/joint_states/joint_*/velocity'" in describe_unused(names, ("joint_1", "joint_2", "joint_3"))


def test_everything_that_is_missing_is_asked_for_at_once(tmp_path: Path) -> None:
    path = write_log(tmp_path / "log.csv", ("clock", "x1", "x2", "x3", "current_0_mA", "current_1_mA", "current_2_mA"))
    message = refusal(import_files, [path], tmp_path / "new", NOTHING)
    assert all(text in message for text in ("give --time", "give --position", "give --gains"))
    assert "give --robot" in refusal(import_files, [path], tmp_path / "new", {**NOTHING, "robot": None})


def test_a_folder_that_a_check_would_refuse_for_its_gains_is_not_written(tmp_path: Path) -> None:
    names = ("timestamp", *(f"actual_q_{n}" for n in range(3)), *(f"actual_current_{n}" for n in range(3)))
    path = write_log(tmp_path / "log.csv", names)
    assert "give --gains" in refusal(import_files, [path], tmp_path / "new", NOTHING)
    short = {**NOTHING, "gains": "1,2"}
    assert "2 numbers for 3 columns" in refusal(import_files, [path], tmp_path / "new", short)
    assert not (tmp_path / "new").exists()


def test_two_files_of_one_name_are_two_runs_and_one_file_twice_is_refused(tmp_path: Path) -> None:
    names = ("timestamp", *(f"q_{n}_rad" for n in range(3)), *bracketed("tau_J"))
    paths = []
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        paths.append(write_log(tmp_path / folder / "run.csv", names))
    import_files(paths, tmp_path / "new", {**NOTHING, "validate": (paths[1],)})
    assert [run.file for run in load_recording(tmp_path / "new").runs] == ["a-run-1.csv", "b-run-2.csv"]
    assert "given twice" in refusal(import_files, [paths[0], paths[0]], tmp_path / "again", NOTHING)
