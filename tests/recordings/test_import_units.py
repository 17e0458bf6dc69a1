"""Units that cannot be right are refused at import; recordings of real arms are not."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from public_copies import needs_copies
from recording_folders import POSITION, TORQUE, frame
from refusals import refusal
from terminal_sessions import TerminalSession

from armlab.recordings.imports.files import import_files
from armlab.recordings.imports.plan import ImportPlan, plan_import
from armlab.recordings.load import load_recording
from armlab.recordings.possible import can_have_position, can_have_speed, can_have_step, can_have_torque, is_creeping
from armlab.recordings.public import PUBLIC_RECORDINGS, fetch_recording
from problem.arm import Joint, Limits
from problem.motion import Motion
from problem.regressor import rigid_body_torque
from problem.robot_file import BUILT_IN_FOLDER, load_arm

OPTIONS: dict[str, Any] = {
    **dict.fromkeys(("gains", "separator", "decimal", "topic")),
    "robot": "irb120-arm",
    "time": "t",
    "position": "q1,q2,q3",
    "torque": "tau1,tau2,tau3",
    "units": ("time=s", "position=rad", "torque=N.m"),
    "validate": (),
}
HALF_TURN_LIMITS = Limits((-2.9, 2.9), 2.6, np.inf, 80.0)


def changed_arm(folder: Path, keys: dict[str, Any]) -> str:
    """The three-joint arm with other keys of its joints."""
    arm = yaml.safe_load((BUILT_IN_FOLDER / "irb120-arm.yaml").read_text())
    arm["joints"] = [{**joint, **keys} for joint in arm["joints"]]
    path = folder / "arm.yaml"
    path.write_text(yaml.safe_dump(arm))
    return str(path)


def write_log(path: Path, factors: dict[str, float]) -> Path:
    """A run whose numbers are in other units than rad, s and N m. factors: by the first letter of the columns."""
    table = frame()
    for name in table:
        table[name] *= factors.get(name.rstrip("123"), 1.0)
    table.to_csv(path, index=False)
    return path


@pytest.mark.parametrize(
    ("factors", "units", "message"),
    [
        ({"q": 180 / np.pi}, (), "its limits are -2.88 and 2.88 rad: --unit position=deg, or angles of the motors"),
        ({"q": 180 / np.pi, "t": 1e3}, ("time=ms",), "--unit position=deg, or"),
        ({"q": 180 / np.pi}, ("position=rev",), "as rev that is 51.2 turns"),
        ({"t": 1e3}, (), "the rows are 5 s apart with time in s, and joint"),
        ({"t": 1e3}, (), "--unit time=ms?"),
        ({"t": 1e6}, (), "--unit time=us?"),
        ({"t": 1e9}, (), "--unit time=ns?"),
        ({"t": 1e9}, ("time=ms",), "--unit time=ns?"),
        ({}, ("time=ms",), "--unit time=s?"),
        ({}, ("time=us",), "--unit time=s?"),
        ({}, ("time=ns",), "--unit time=s?"),
        ({"t": 1e3}, ("time=us",), "--unit time=ms?"),
        ({"tau": 1e3}, (), "its limit is 60: --unit torque=mN.m?"),
        ({"q": 180 / np.pi, "t": 1e3, "tau": 1e3}, (), "which need --gear-ratio?; torque of joint"),
    ],
)
def test_numbers_that_cannot_be_in_their_unit_are_refused_with_the_right_one(
    tmp_path: Path, factors: dict[str, float], units: Sequence[str], message: str
) -> None:
    path = write_log(tmp_path / "log.csv", factors)
    options = {**OPTIONS, "robot": changed_arm(tmp_path, {"torque_limit": 60.0}), "units": (*OPTIONS["units"], *units)}
    assert message in refusal(import_files, [path], tmp_path / "new", options)
    assert not (tmp_path / "new").exists()


def test_milliamperes_that_were_called_amperes_are_refused(tmp_path: Path) -> None:
    path = write_log(tmp_path / "log.csv", {"tau": 250.0})
    options = {**OPTIONS, "units": ("time=s", "position=rad", "torque=A"), "gains": "4,4,4"}
    message = refusal(import_files, [path], tmp_path / "new", options)
    assert "as A with a gain of 4 that is " in message
    assert message.endswith("--unit torque=mA?")
    import_files([path], tmp_path / "new", {**options, "units": ("time=s", "position=rad", "torque=mA")})
    np.testing.assert_allclose(load_recording(tmp_path / "new").runs[0].torque, frame()[TORQUE])


def test_a_unit_that_names_tell_is_judged_like_one_that_is_given(tmp_path: Path) -> None:
    table = frame()
    table[POSITION] *= 180 / np.pi
    names = ["time_s", *(f"actual_q_{joint}" for joint in range(3)), *(f"effort_{joint}" for joint in range(3))]
    table.set_axis(names, axis=1).to_csv(tmp_path / "log.csv", index=False)
    options = {**OPTIONS, "units": (), "time": None, "position": None, "torque": None}
    message = refusal(import_files, [tmp_path / "log.csv"], tmp_path / "new", options)
    assert message.startswith("position of joint joint1 reaches ")
    import_files([tmp_path / "log.csv"], tmp_path / "new", {**options, "units": ("position=deg",)})


def test_a_command_in_another_unit_than_the_position_is_refused(tmp_path: Path) -> None:
    table = frame().set_axis(["t", *POSITION, "goal1", "goal2", "goal3"], axis=1)
    table[["goal1", "goal2", "goal3"]] = table[POSITION] * 180 / np.pi
    table.to_csv(tmp_path / "log.csv", index=False)
    options = {**OPTIONS, "torque": None, "reference_position": "goal?"}
    options["units"] = ("time=s", "position=rad", "reference_position=rad")
    message = refusal(import_files, [tmp_path / "log.csv"], tmp_path / "new", options)
    assert message.startswith("reference position of joint joint1 reaches ")
    assert message.endswith("--unit reference_position=deg?")


def test_the_file_with_a_wrong_unit_is_named_among_several(tmp_path: Path) -> None:
    paths = [write_log(tmp_path / "a.csv", {}), write_log(tmp_path / "b.csv", {"q": 180 / np.pi})]
    assert refusal(import_files, paths, tmp_path / "new", OPTIONS).startswith(f"{paths[1]}: position of joint joint")


def test_counts_of_an_encoder_have_no_unit_that_fits(tmp_path: Path) -> None:
    path = write_log(tmp_path / "log.csv", {"q": 1e5})
    assert "no unit makes that possible" in refusal(import_files, [path], tmp_path / "new", OPTIONS)


def test_the_form_asks_again_for_a_unit_that_cannot_be_right(tmp_path: Path) -> None:
    write_log(tmp_path / "log.csv", {"q": 180 / np.pi})
    words = "recording import log.csv --robot irb120-arm --out new --unit position=rad --unit torque=N.m"
    session = TerminalSession(words.split(), tmp_path)
    assert "as rad that is " in session.wait_for(r"unit of position.*\[deg\]: $")
    session.answer("rev")
    assert "as rev that is " in session.wait_for(r"unit of position.*\[deg\]: $")
    session.answer("")
    assert session.finish() == 0
    assert "--unit position=deg" in session.text.split("the same without questions: ")[1]
    assert "position=rad" not in session.text.split("the same without questions: ")[1]


def plan_of(folder: Path, table: pd.DataFrame, robot: str, units: Sequence[str]) -> ImportPlan:
    table.to_parquet(folder / "log.parquet")
    joints = [name for name in table if name.startswith("q")]
    position, torque = ",".join(joints), ",".join(name.replace("q", "tau") for name in joints)
    options = {**OPTIONS, "robot": robot, "position": position, "torque": torque, "units": tuple(units)}
    return plan_import([folder / "log.parquet"], {**options, "out": folder / "new"})


@pytest.mark.parametrize("name", [pytest.param(name, marks=needs_copies(name)) for name in PUBLIC_RECORDINGS])
def test_no_recording_of_a_real_arm_is_refused(tmp_path: Path, name: str) -> None:
    recording = load_recording(fetch_recording(name, tmp_path / name))
    turning = recording.arm.joints[0].kind == "revolute"
    units = ("time=s", f"position={'rad' if turning else 'm'}", f"torque={'N.m' if turning else 'N'}")
    for run in recording.runs:
        columns = [f"{signal}{joint}" for signal in ("q", "tau") for joint in range(run.joints)]
        table = pd.DataFrame(np.column_stack([run.time, run.position, run.torque]), columns=["t", *columns])
        plan = plan_of(tmp_path, table, recording.robot, units)
        assert plan.questions == ()
        assert plan.doubts == ()


def spun(turns: float, seconds: float, wrapped: bool = False) -> pd.DataFrame:
    """The run with a last joint that turns on and on, as a counter of turns or an encoder of one turn shows it."""
    table = frame(seconds=seconds)
    angle = 2 * np.pi * turns * np.linspace(0, 1, len(table))
    table["q3"] = (angle + np.pi) % (2 * np.pi) - np.pi if wrapped else angle
    return table


@pytest.mark.parametrize(
    "damage",
    [
        lambda table: table.assign(q1=table["q1"] + 2 * np.pi),  # another zero
        lambda table: table.assign(q1=table["q1"].where(table.index != 7, 65535.0)),  # an outlier
        lambda table: table.assign(t=np.where(table.index == 7, 0.0, table["t"] + 1.7e9)),  # a stamp of zero
        lambda table: table.assign(t=np.repeat(table["t"][::10], 10).to_numpy()[: len(table)]),  # stamps in bursts
        lambda table: table.assign(t=table["t"] + np.where(table.index > 700, 1e4, 0.0)),  # a long pause
        lambda table: pd.concat([table, table]),  # a clock that starts anew
        lambda table: table.iloc[::400],  # poses far apart
        lambda table: table.assign(t=table["t"] * 1e3)[::200].head(7),  # poses with pauses
        lambda table: table.assign(**{name: table[name][0] for name in POSITION}, t=table["t"] * 200),  # at rest
        lambda table: table.head(1),
    ],
)
def test_what_is_only_unusual_is_not_refused(tmp_path: Path, damage: Any) -> None:
    assert plan_of(tmp_path, damage(frame()).reset_index(drop=True), "irb120-arm", OPTIONS["units"]).questions == ()


def test_a_wrist_that_turns_on_is_not_refused(tmp_path: Path) -> None:
    robot = changed_arm(tmp_path, {"position_limits": [-6.2832, 6.2832]})
    for wrapped in (False, True):
        table = spun(turns=60, seconds=120, wrapped=wrapped)
        assert plan_of(tmp_path, table, robot, OPTIONS["units"]).questions == ()


@pytest.mark.parametrize(
    ("limits", "position", "speed", "possible"),
    [
        (HALF_TURN_LIMITS, 2.9 + 4 * np.pi, 1.0, True),
        (HALF_TURN_LIMITS, 2.9 + 4 * np.pi + 0.1, 1.0, False),
        (Limits((-6.3, 6.3), 3.0), 600.0, 3.0, True),
        (Limits((-6.3, 6.3), 3.0), 600.0, 16.0, False),
        (Limits(), 1e6, 50.0, True),
    ],
)
def test_a_joint_with_stops_goes_two_turns_beyond_at_most(
    limits: Limits, position: float, speed: float, possible: bool
) -> None:
    joint = Joint("elbow", "revolute", np.eye(4), np.eye(4), limits)
    assert can_have_position(joint, 0.0, position, speed) == possible
    assert can_have_position(joint, -position, 0.0, speed) == possible


@pytest.mark.parametrize("limits", [HALF_TURN_LIMITS, Limits()])
def test_a_joint_is_never_faster_than_100_rad_per_s(limits: Limits) -> None:
    joint = Joint("elbow", "revolute", np.eye(4), np.eye(4), limits)
    assert can_have_speed(joint, 99.0)
    assert not can_have_speed(joint, 101.0)


@pytest.mark.parametrize(
    ("limits", "bound", "drive"),
    [
        (HALF_TURN_LIMITS, 8000.0, 0.0),
        (HALF_TURN_LIMITS, 800.0, 300.0),
        (Limits(torque=1.0), 1000.0, 0.0),
        (Limits(), 1e5, 0.0),
        (Limits(), 1e4, 300.0),
    ],
)
def test_a_torque_is_judged_more_strictly_where_the_current_is_great(
    limits: Limits, bound: float, drive: float
) -> None:
    joint = Joint("elbow", "revolute", np.eye(4), np.eye(4), limits)
    assert can_have_torque(joint, 0.99 * bound, drive, "A")
    assert not can_have_torque(joint, 1.01 * bound, drive, "A")


@pytest.mark.parametrize(("reach", "step", "creeps"), [(1.0, 2.0, True), (1.0, 0.5, False), (0.05, 2.0, False)])
def test_a_motion_creeps_where_rows_are_rare_and_no_joint_is_fast(reach: float, step: float, creeps: bool) -> None:
    assert is_creeping(reach * np.linspace(0, 1, 101)[:, None], step) == creeps


@pytest.mark.parametrize(("step", "possible"), [(900.0, True), (1100.0, False), (2e-6, True), (1e-7, False)])
def test_rows_are_a_microsecond_to_a_thousand_seconds_apart(step: float, possible: bool) -> None:
    assert can_have_step(step) == possible


def carrying_table(seconds: float = 8.0, **factors: float) -> pd.DataFrame:
    """A run whose torque is about what the links of the three-joint arm need. factors: by the letters of columns."""
    table = frame(seconds=seconds)
    arm = load_arm("irb120-arm")
    position = table[POSITION].to_numpy()
    table[TORQUE] = rigid_body_torque(arm, Motion(position, 0 * position, 0 * position)) + 0.3
    for name in table:
        table[name] *= factors.get(name.rstrip("123"), 1.0)
    return table


@pytest.mark.parametrize(
    ("factors", "units", "gains", "doubt"),
    [
        ({}, ("time=s", "position=deg", "torque=N.m"), None, "--unit position=rad?"),
        ({}, ("time=s", "position=rad", "torque=mN.m"), None, "another unit (--unit torque=N.m)"),
        ({"tau": 1 / 100}, ("time=s", "position=rad", "torque=N.m"), None, "torque of the motors (--gear-ratio with"),
        ({"tau": 1 / 4}, ("time=s", "position=rad", "torque=mA"), "4,4,4", "--unit torque=A"),
        ({"tau": 1 / 4000}, ("time=s", "position=rad", "torque=mA"), "4,4,4", "--unit torque=A?"),
        ({"tau": 500}, ("time=s", "position=rad", "torque=N.m"), None, "another unit (--unit torque=mN.m)"),
    ],
)
def test_numbers_too_small_for_their_unit_are_doubtful_and_the_import_says_which_unit_fits(
    tmp_path: Path, factors: dict[str, float], units: tuple[str, ...], gains: str | None, doubt: str
) -> None:
    path = tmp_path / "log.csv"
    carrying_table(**factors).to_csv(path, index=False)
    imported = import_files([path], tmp_path / "new", {**OPTIONS, "units": units, "gains": gains})
    assert any(doubt in text for text in imported.plan.doubts), imported.plan.doubts
    assert any(line.startswith("doubtful: ") for line in imported.lines)
    assert imported.document["doubts"] == imported.plan.doubts


def test_numbers_in_their_right_unit_are_not_doubtful(tmp_path: Path) -> None:
    for units, factors in (
        (OPTIONS["units"], {}),
        (("time=s", "position=deg", "torque=mN.m"), {"q": 180 / np.pi, "tau": 1e3}),
    ):
        plan = plan_of(tmp_path, carrying_table(**factors), "irb120-arm", units)
        assert (plan.questions, plan.doubts) == ((), ())


@pytest.mark.filterwarnings("error")
def test_torque_far_too_small_is_doubtful_where_some_joints_have_none(tmp_path: Path) -> None:
    table = carrying_table(tau=1e-4)
    table[["tau2", "tau3"]] = 0.0
    (doubt,) = plan_of(tmp_path, table, "irb120-arm", OPTIONS["units"]).doubts
    assert "against gravity" in doubt


def test_a_joint_that_gravity_does_not_load_is_not_doubted(tmp_path: Path) -> None:
    urdf = (
        '<robot name="turntable"><link name="base"/><link name="plate"><inertial><origin xyz="1e-7 0 0"/>'
        '<mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<joint name="turn" type="revolute"><parent link="base"/><child link="plate"/>'
        '<axis xyz="1e-6 0 1"/><limit lower="-10" upper="10" effort="150" velocity="20"/></joint></robot>'
    )
    (tmp_path / "table.urdf").write_text(urdf)
    log = carrying_table()[["t", "q1", "tau1"]]
    assert plan_of(tmp_path, log, str(tmp_path / "table.urdf"), OPTIONS["units"]).doubts == ()


def test_torque_is_judged_by_the_limits_where_the_links_are_unknown(tmp_path: Path) -> None:
    robot = changed_arm(tmp_path, {"torque_limit": 60.0})
    text = yaml.safe_load(Path(robot).read_text())
    text.pop("links", None)
    Path(robot).write_text(yaml.safe_dump(text))
    plan = plan_of(tmp_path, carrying_table(tau=1e-5), robot, OPTIONS["units"])
    assert ["its limit is 60" in text for text in plan.doubts] == [True]


@pytest.mark.parametrize(
    ("factors", "change", "right"),
    [
        ({"v": 180 / np.pi}, (), "--unit velocity=deg/s?"),
        ({"v": 30 / np.pi}, (), "--unit velocity=rpm?"),
        ({}, ("position=deg",), "--unit position=rad?"),
    ],
)
def test_a_velocity_that_is_no_slope_of_its_position_is_refused_with_the_unit_that_makes_it_one(
    tmp_path: Path, factors: dict[str, float], change: tuple[str, ...], right: str
) -> None:
    table = frame()
    for name in POSITION:
        table[name.replace("q", "v")] = np.gradient(table[name], table["t"]) * factors.get("v", 1.0)
    table.to_csv(tmp_path / "log.csv", index=False)
    options = {**OPTIONS, "velocity": "v1,v2,v3", "units": (*OPTIONS["units"], "velocity=rad/s", *change)}
    message = refusal(import_files, [tmp_path / "log.csv"], tmp_path / "new", options)
    assert " times the slope of its position in " in message
    assert message.endswith(right)


MOTION_ONLY: dict[str, Any] = {
    "torque": None,
    "reference_position": "q1,q2,q3",
    "units": ("time=s", "position=rad", "reference_position=rad"),
}
RATIOS = np.array([100.0, -80.0, 50.0])


def motor_table() -> pd.DataFrame:
    """The run as the motors show it."""
    table = frame()
    table[POSITION] *= RATIOS
    table[TORQUE] /= RATIOS
    return table


def test_signals_of_motors_become_those_of_joints_by_their_gear_ratios(tmp_path: Path) -> None:
    motor_table().to_csv(tmp_path / "log.csv", index=False)
    options = {**OPTIONS, "gear_ratio": "100,-80,50"}
    imported = import_files([tmp_path / "log.csv"], tmp_path / "new", options)
    run = load_recording(tmp_path / "new").runs[0]
    np.testing.assert_allclose(run.position, frame()[POSITION])
    np.testing.assert_allclose(run.torque, frame()[TORQUE])
    assert "gear ratio: positions divided and torques multiplied by 100, -80, 50" in imported.lines


@pytest.mark.parametrize("side", ["position", "torque"])
def test_one_side_of_a_gear_may_be_measured_at_the_joints(tmp_path: Path, side: str) -> None:
    table = motor_table()
    measured_at_joints = TORQUE if side == "position" else POSITION
    table[measured_at_joints] = frame()[measured_at_joints]
    table.to_csv(tmp_path / "log.csv", index=False)
    options = {**OPTIONS, "gear_ratio": "100,-80,50", "motor_side": side}
    import_files([tmp_path / "log.csv"], tmp_path / "new", options)
    run = load_recording(tmp_path / "new").runs[0]
    np.testing.assert_allclose(run.position, frame()[POSITION])
    np.testing.assert_allclose(run.torque, frame()[TORQUE])


def test_angles_of_motors_are_refused_with_the_option_that_they_need(tmp_path: Path) -> None:
    motor_table().to_csv(tmp_path / "log.csv", index=False)
    message = refusal(import_files, [tmp_path / "log.csv"], tmp_path / "new", OPTIONS)
    assert "angles of the motors, which need --gear-ratio?" in message


def test_a_gear_ratio_of_signals_of_the_joints_is_doubtful(tmp_path: Path) -> None:
    options = {**OPTIONS, "gear_ratio": "100,100,100", "motor_side": "position", "out": str(tmp_path / "new")}
    carrying_table().to_csv(tmp_path / "log.csv", index=False)
    (doubt,) = plan_import([tmp_path / "log.csv"], options).doubts
    assert "leave --gear-ratio out" in doubt


def test_a_motor_turns_where_its_joint_slides(tmp_path: Path) -> None:
    arm = yaml.safe_load((BUILT_IN_FOLDER / "emps.yaml").read_text())
    (tmp_path / "arm.yaml").write_text(yaml.safe_dump(arm))
    table = frame()[["t", "q1", "tau1"]]
    table["q1"] *= 300.0
    table.to_csv(tmp_path / "log.csv", index=False)
    options = {**OPTIONS, "robot": str(tmp_path / "arm.yaml"), "position": "q1", "torque": "tau1"}
    import_files([tmp_path / "log.csv"], tmp_path / "new", {**options, "gear_ratio": "300"})
    np.testing.assert_allclose(load_recording(tmp_path / "new").runs[0].position[:, 0], frame()["q1"])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"gear_ratio": "100,50"}, "--gear-ratio holds 2 numbers for 3 columns of position"),
        ({"gear_ratio": "100,0,50"}, "not zero"),
        ({"gear_ratio": "a,b,c"}, "one number a joint"),
        ({"motor_side": "torque"}, "needs the gears: give --gear-ratio"),
        ({"gear_ratio": "9,9,9", "motor_side": "torque", **MOTION_ONLY}, "--motor-side torque needs columns of torque"),
    ],
)
def test_a_wrong_gear_ratio_is_refused(tmp_path: Path, options: dict[str, Any], message: str) -> None:
    path = write_log(tmp_path / "log.csv", {})
    assert message in refusal(import_files, [path], tmp_path / "new", {**OPTIONS, **options})
