"""Bags of controllers become recordings of motion only: commands beside positions, joint by joint, by their stamps."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from refusals import refusal
from servo_arms import arm_text

from armlab.cli.main import main
from armlab.recordings.imports.files import import_files
from armlab.recordings.imports.plan import plan_import
from armlab.recordings.imports.ros_messages import DEFINITIONS, SINGLE_STATE, TRAJECTORY_STATE
from armlab.recordings.motion import load_motion_recording
from armlab.recordings.recording import MotionRun

pytest.importorskip("rosbags")
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

STORE = get_typestore(Stores.ROS2_HUMBLE)
for kind, text in DEFINITIONS.items():
    STORE.register(get_types_from_msg(text, kind))
TYPES = STORE.types
JOINTS = ["shoulder", "elbow"]
START = 1_700_000_000 * 10**9  # ns
ROWS, PERIOD = 200, 20_000_000  # ns
TIMES = START + PERIOD * np.arange(ROWS)
POSITION = np.stack([np.sin(np.arange(ROWS) / 20), np.cos(np.arange(ROWS) / 30)], axis=1)
COMMAND = np.round(POSITION * 1.1 + 0.05, 3)
NOT_GIVEN = ("time", "position", "torque", "reference_position", "gains", "joints", "separator", "decimal", "topic")
OPTIONS: dict[str, Any] = {**dict.fromkeys(NOT_GIVEN), "units": (), "validate": (), "command_topic": None}
Message = tuple[int, str, str, Any]  # time of recording, topic, type, content


def header(stamp: int) -> Any:
    time = TYPES["builtin_interfaces/msg/Time"](*divmod(int(stamp), 10**9))
    return TYPES["std_msgs/msg/Header"](time, "")


def point(positions: Any) -> Any:
    kind, empty = "trajectory_msgs/msg/JointTrajectoryPoint", np.array([])
    return TYPES[kind](np.array(positions), empty, empty, empty, TYPES["builtin_interfaces/msg/Duration"](0, 0))


def joint_state(stamp: int, names: list[str], positions: Any) -> Any:
    return TYPES["sensor_msgs/msg/JointState"](header(stamp), names, np.array(positions), np.array([]), np.array([]))


def trajectory_state(stamp: int, names: list[str], command: Any, position: Any) -> Any:
    none, kind = point([]), "trajectory_msgs/msg/MultiDOFJointTrajectoryPoint"
    several = TYPES[kind]([], [], [], TYPES["builtin_interfaces/msg/Duration"](0, 0))
    points = (point(command), point(position), none, none, none, none)
    return TYPES[TRAJECTORY_STATE](header(stamp), names, *points, [], *[several] * 6)


def single_state(stamp: int, command: float, position: float) -> Any:
    return TYPES[SINGLE_STATE](header(stamp), command, position, *[0.0] * 4, *[0.0] * 4, False)


def write_bag(folder: Path, messages: list[Message]) -> Path:
    """A ROS 2 bag (MCAP) with messages in order of their recording."""
    links: dict[str, Any] = {}
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for time, topic, kind, content in sorted(messages, key=lambda message: message[0]):
            if topic not in links:
                links[topic] = writer.add_connection(topic, kind, typestore=STORE)
            writer.write(links[topic], int(time), STORE.serialize_cdr(content, kind))
    return folder


def late(row: int) -> int:
    """How late a message is recorded, ns: 3 ms, and jitter that the stamps do not have."""
    return 3_000_000 + 400_000 * (row * 7 % 5 - 2)


def states(names: list[str] | None = None) -> list[Message]:
    kind, order = "sensor_msgs/msg/JointState", names or JOINTS
    rows = [[POSITION[row, JOINTS.index(name)] if name in JOINTS else 0.0 for name in order] for row in range(ROWS)]
    return [
        (TIMES[row] + late(row), "/joint_states", kind, joint_state(TIMES[row], order, rows[row]))
        for row in range(ROWS)
    ]


def imported(tmp_path: Path, messages: list[Message], **options: Any) -> tuple[MotionRun, list[str]]:
    (tmp_path / "arm.xml").write_text(arm_text())
    bag = write_bag(tmp_path / "bag", messages)
    chosen = {**OPTIONS, "robot": str(tmp_path / "arm.xml"), **options}
    lines = import_files([bag], tmp_path / "new", chosen).lines
    return load_motion_recording(tmp_path / "new").runs[0], lines


def test_states_of_a_trajectory_controller_arrive_in_the_robots_order_at_their_stamps(tmp_path: Path) -> None:
    names = ["gripper", "elbow", "shoulder"]
    messages: list[Message] = []
    for row in range(ROWS):
        command, position = ([0.5, *values[row, ::-1]] for values in (COMMAND, POSITION))
        content = trajectory_state(TIMES[row], names, command, position)
        messages.append((TIMES[row] + late(row), "/arm_controller/controller_state", TRAJECTORY_STATE, content))
    run, _ = imported(tmp_path, messages)
    np.testing.assert_array_equal(run.position, POSITION)
    np.testing.assert_array_equal(run.reference_position, COMMAND)
    np.testing.assert_allclose(run.time, 0.02 * np.arange(ROWS), atol=1e-9)


def test_states_of_one_joint_a_topic_are_matched_by_the_topics_name(tmp_path: Path) -> None:
    messages: list[Message] = [
        (TIMES[row], f"/robot/{joint}_controller/state", SINGLE_STATE, single_state(TIMES[row], *pair))
        for row in range(ROWS)
        for joint, *pair in zip(JOINTS, COMMAND[row], POSITION[row], strict=True)
    ]
    run, _ = imported(tmp_path, messages)
    np.testing.assert_allclose(run.position, POSITION, atol=1e-12)
    np.testing.assert_array_equal(run.reference_position, COMMAND)


@pytest.mark.parametrize("kind", ["sensor_msgs/msg/JointState", "trajectory_msgs/msg/JointTrajectory"])
def test_commands_of_another_topic_are_held_until_the_next(tmp_path: Path, kind: str) -> None:
    messages = states()
    for row in range(10, ROWS, 5):
        stamp = TIMES[row] - 1_000_000
        content: Any = joint_state(stamp, JOINTS, COMMAND[row])
        if "Trajectory" in kind:
            content = TYPES[kind](header(stamp), JOINTS[::-1], [point(COMMAND[row, ::-1])])
        messages.append((stamp + 9_000_000, "/commands", kind, content))
    run, lines = imported(tmp_path, messages, command_topic="/commands")
    held = COMMAND[np.arange(10, ROWS) // 5 * 5]
    np.testing.assert_array_equal(run.position, POSITION[10:])
    np.testing.assert_array_equal(run.reference_position, held)
    assert "commands are held from one to the next" in lines[0]
    assert "10 of 200 states are left out" in lines[0]


def test_commands_without_stamps_are_put_on_the_clock_of_the_states(tmp_path: Path) -> None:
    kind, layout = "std_msgs/msg/Float64MultiArray", TYPES["std_msgs/msg/MultiArrayLayout"]([], 0)
    messages = states()
    for row in range(ROWS):  # sent 5 ms after the state of its row, recorded at once
        content = TYPES[kind](layout, np.array(COMMAND[row]))
        messages.append((TIMES[row] + 5_000_000 + 3_000_000, "/position_controller/commands", kind, content))
    run, lines = imported(tmp_path, messages, command_topic="/position_controller/commands")
    np.testing.assert_array_equal(run.reference_position, COMMAND[:-1])
    np.testing.assert_array_equal(run.position, POSITION[1:])
    assert "times of recording, less 3 ms" in lines[0]


def several_points(messages: list[Message]) -> list[Message]:
    kind = "trajectory_msgs/msg/JointTrajectory"
    content = TYPES[kind](header(START), JOINTS, [point(COMMAND[0]), point(COMMAND[1])])
    return [*messages, (START, "/goal", kind, content)]


def numbers(messages: list[Message]) -> list[Message]:
    kind, layout = "std_msgs/msg/Float64MultiArray", TYPES["std_msgs/msg/MultiArrayLayout"]([], 0)
    return [*messages, (START, "/goal", kind, TYPES[kind](layout, np.zeros(3)))]


def with_commands_beside(messages: list[Message]) -> list[Message]:
    return [
        (START, "/arm/state", TRAJECTORY_STATE, trajectory_state(START, JOINTS, COMMAND[0], POSITION[0])),
        *(numbers([])),
    ]


def no_reference(messages: list[Message]) -> list[Message]:
    content = trajectory_state(START, JOINTS, [], POSITION[0])
    return [(START, "/arm/state", TRAJECTORY_STATE, content)]


@pytest.mark.parametrize(
    ("change", "options", "reason"),
    [
        (lambda each: each, {"command_topic": "/comands"}, "no commands on topic '/comands'"),
        (with_commands_beside, {"command_topic": "/goal"}, "the states on /arm/state hold the commands"),
        (several_points, {"command_topic": "/goal"}, "sends trajectories of 2 points"),
        (
            numbers,
            {"command_topic": "/goal"},
            "3 numbers a message and names no joints, the robot has 2: give --joints",
        ),
        (no_reference, {}, "/arm/state holds no reference positions: its controller commands no position"),
        (lambda each: [*each, *no_reference(each)], {}, "choose one with --topic"),
        (
            lambda each: [(START, "/wrist_controller/state", SINGLE_STATE, single_state(START, 0.0, 0.0))],
            {},
            "/wrist_controller/state is of one joint, but names none of the robot's (shoulder, elbow)",
        ),
        (
            lambda each: [(START, "/arm/state", TRAJECTORY_STATE, trajectory_state(START, ["elbow"], [0.1], [0.0]))],
            {},
            "bag has no position of joint shoulder, only of elbow: give --joints with those that were recorded",
        ),
    ],
)
def test_what_is_missing_in_a_bag_is_told_in_one_line(
    tmp_path: Path, change: Any, options: dict[str, Any], reason: str
) -> None:
    (tmp_path / "arm.xml").write_text(arm_text())
    bag = write_bag(tmp_path / "bag", change(states()))
    chosen = {**OPTIONS, "robot": str(tmp_path / "arm.xml"), **options}
    assert reason in refusal(import_files, [bag], tmp_path / "new", chosen)
    assert not (tmp_path / "new").exists()


def test_the_command_imports_some_joints_of_a_bag(tmp_path: Path) -> None:
    (tmp_path / "arm.xml").write_text(arm_text())
    rows = range(ROWS)
    messages: list[Message] = [
        (TIMES[row], "/state", TRAJECTORY_STATE, trajectory_state(TIMES[row], ["elbow"], [COMMAND[row, 1]], [0.1]))
        for row in rows
    ]
    bag = write_bag(tmp_path / "bag", messages)
    command = ["recording", "import", str(bag), "--robot", str(tmp_path / "arm.xml"), "--joints", "elbow"]
    result = CliRunner().invoke(main, [*command, "--out", str(tmp_path / "new")])
    assert result.exit_code == 0, result.output
    assert "reference_position: command_elbow [rad]" in result.output
    assert load_motion_recording(tmp_path / "new").joints == (1,)


def test_the_topic_of_a_bag_with_several_is_a_question_with_their_names(tmp_path: Path) -> None:
    (tmp_path / "arm.xml").write_text(arm_text())
    bag = write_bag(tmp_path / "bag", [*states(), *no_reference(states())])
    plan = plan_import([bag], {**OPTIONS, "robot": str(tmp_path / "arm.xml"), "out": tmp_path / "new"})
    (question,) = plan.questions
    assert question.option == "topic"
    assert question.proposal in question.text
    assert "choose one with --topic" in question.missing
