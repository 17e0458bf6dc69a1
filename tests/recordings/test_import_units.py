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
from problem.robot_file import BUILT_IN_FOLDER

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
        ({"q": 180 / np.pi}, (), "its limits are -2.88 and 2.88 rad: --unit position=deg?"),
        ({"q": 180 / np.pi, "t": 1e3}, ("time=ms",), "--unit position=deg?"),
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
        ({"q": 180 / np.pi, "t": 1e3, "tau": 1e3}, (), "--unit position=deg?; torque of joint"),
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
        assert plan_of(tmp_path, table, recording.robot, units).questions == ()


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
        lambda table: table.assign(q2=np.nan),
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
