"""What the messages of a ROS bag say of joints: position, velocity, effort and command by the joint's name.

| message | position | command |
|---|---|---|
| sensor_msgs/JointState | position | position, where its topic is that of the commands |
| control_msgs/JointTrajectoryControllerState | feedback (formerly actual) | reference (formerly desired) |
| control_msgs/JointControllerState, one joint | process_value | set_point |
| trajectory_msgs/JointTrajectory of one point | | positions |
| std_msgs/Float64MultiArray | | data, in the order of the controller's joints |

Definitions: control_msgs 4.8.0 (Humble), for bags that do not bring their own.
"""

from collections.abc import Callable, Sequence
from typing import Any

from armlab.common.errors import InputError

JOINT_STATE = "sensor_msgs/msg/JointState"
TRAJECTORY_STATE = "control_msgs/msg/JointTrajectoryControllerState"
SINGLE_STATE = "control_msgs/msg/JointControllerState"
TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
NUMBERS = "std_msgs/msg/Float64MultiArray"
STATE_TYPES = (JOINT_STATE, TRAJECTORY_STATE, SINGLE_STATE)
COMMAND_TYPES = (JOINT_STATE, TRAJECTORY, NUMBERS)
JOINT_STATE_FIELDS = ("position", "velocity", "effort")

_POINTS = ["reference", "feedback", "error", "output", "desired", "actual"]
DEFINITIONS = {
    TRAJECTORY_STATE: "\n".join(
        [
            "std_msgs/Header header",
            "string[] joint_names",
            *(f"trajectory_msgs/JointTrajectoryPoint {name}" for name in _POINTS),
            "string[] multi_dof_joint_names",
            *(f"trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_{name}" for name in _POINTS),
        ]
    ),
    SINGLE_STATE: "\n".join(
        [
            "std_msgs/Header header",
            *(f"float64 {name}" for name in ("set_point", "process_value", "process_value_dot", "error", "time_step")),
            *(f"float64 {name}" for name in ("command", "p", "i", "d", "i_clamp")),
            "bool antiwindup",
        ]
    ),
}


def parse_state(message: Any, kind: str, topic: str, joints: Sequence[str]) -> dict[str, float]:
    """Columns of a message of STATE_TYPES. joints: of the robot, for a message that names none; else those of topic.

    Raises InputError for a message whose fields do not belong together.
    """
    if kind == JOINT_STATE:
        fields = {field: getattr(message, field) for field in JOINT_STATE_FIELDS}
        return _by_joint(message.name, fields, topic)
    if kind == SINGLE_STATE:
        name = joint_of_topic(topic, joints)
        pairs = {"position": "process_value", "velocity": "process_value_dot", "command": "set_point"}
        return {f"{signal}_{name}": float(getattr(message, field)) for signal, field in pairs.items()}
    state, command = _filled(message, "feedback", "actual"), _filled(message, "reference", "desired")
    if not len(command.positions):
        raise InputError(f"{topic} holds no reference positions: its controller commands no position")
    fields = {"position": state.positions, "velocity": state.velocities, "command": command.positions}
    return _by_joint(message.joint_names, fields, topic)


def parse_command(message: Any, kind: str, topic: str, joints: Sequence[str]) -> dict[str, float]:
    """Columns `command_JOINT` of a message of COMMAND_TYPES. joints: of the controller, for a message that names none.

    Raises InputError for a trajectory of several points, and for numbers that do not fit the joints.
    """
    if kind == JOINT_STATE:
        return _by_joint(message.name, {"command": message.position}, topic)
    if kind == TRAJECTORY:
        if len(message.points) != 1:
            raise InputError(
                f"{topic} sends trajectories of {len(message.points)} points, which the controller interpolates: "
                f"record the topic of its state ({TRAJECTORY_STATE}), and give that as --topic"
            )
        return _by_joint(message.joint_names, {"command": message.points[0].positions}, topic)
    if len(message.data) != len(joints):
        raise InputError(
            f"{topic} holds {len(message.data)} numbers a message and names no joints, the robot has {len(joints)}: "
            "give --joints, in the order of the controller"
        )
    return _by_joint(joints, {"command": message.data}, topic)


def joint_of_topic(topic: str, joints: Sequence[str]) -> str:
    """The joint that a topic like `/elbow_position_controller/state` belongs to, the longest name of several.

    Without joints the topic's own name. Raises InputError where it names none of them.
    """
    if not joints:
        return topic.strip("/").replace("/", "_")
    words = f"_{topic.replace('/', '_')}_"
    found = [joint for joint in joints if f"_{joint}_" in words]
    if not found:
        raise InputError(f"{topic} is of one joint, but names none of the robot's ({', '.join(joints)})")
    return max(found, key=len)


def stamp_of(message: Any) -> int:
    """Stamp of a message's header, ns; 0 where it has none."""
    header = getattr(message, "header", None)
    return 0 if header is None else int(header.stamp.sec) * 10**9 + int(header.stamp.nanosec)


Parser = Callable[[Any, str, str, Sequence[str]], dict[str, float]]


def _filled(message: Any, *names: str) -> Any:
    """The first of some points that holds positions, else the last of those that the message has."""
    points = [getattr(message, name) for name in names if hasattr(message, name)]
    return next((point for point in points if len(point.positions)), points[-1])


def _by_joint(names: Sequence[str], fields: dict[str, Any], topic: str) -> dict[str, float]:
    values = {}
    for field, numbers in fields.items():
        if len(numbers) not in (0, len(names)):
            raise InputError(f"{topic}: a message names {len(names)} joints but holds {len(numbers)} of {field}")
        values.update({f"{field}_{name}": float(value) for name, value in zip(names, numbers, strict=False)})
    return values
