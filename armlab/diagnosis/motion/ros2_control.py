"""The servos of a diagnosis for ROS 2: a URDF with `ros2_control` tags, and the parameters of its controllers.

`pid_controller/PidController` (ros2_controllers 4.22.0, `pid_controller.cpp`) with the interfaces position and velocity
and the command interface effort computes at each cycle

    effort = p (reference - position) + d (reference_dot - velocity) + i-term,  d/dt i-term = i (reference - position)

with the i-term within i_clamp_min and i_clamp_max where `antiwindup` is set. So p is kp, i is ki, and d is kd as long
as reference_dot is zero. The hardware (in simulation gz_ros2_control, whose position interface is a velocity
proportional to the error, and so no servo) limits the effort to `min` and `max` of its command interface. Damping and
friction stand in `dynamics` of the URDF: N m s/rad and N m (N s/m, N).
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
import yaml

from armlab.common.arrays import Array
from armlab.diagnosis.motion.export import lines_without_field
from armlab.diagnosis.motion.servo import INFINITE_LIMIT, Key, Servos
from armlab.diagnosis.motion.servo_simulation import ServoSimulation
from armlab.identification.export import build_simulator_model, unstated_limits, urdf_document
from armlab.identification.structure import Structure
from armlab.identification.torque_model import TorqueModel

HARDWARE = "gz_ros2_control/GazeboSimSystem"
CONTROLLER = "servo_controller"
URDF_FIELDS: dict[str, Key] = {"damping": "damping", "frictionloss": "friction"}


def ros_urdf_text(simulation: ServoSimulation, servos: Servos) -> str:
    """`robot.urdf`: the arm with damping, friction and effort limits found, and its `ros2_control` tags.

    Raises InputError for an arm whose links no URDF takes.
    """
    arm = simulation.arm
    limits = dict(zip(simulation.joints, servos.get("limit").tolist(), strict=True))
    joints = tuple(
        replace(joint, limits=replace(joint.limits, torque=limits[number]))
        if limits.get(number, INFINITE_LIMIT) < INFINITE_LIMIT
        else joint
        for number, joint in enumerate(arm.joints)
    )
    arm = replace(arm, joints=joints)
    structure = Structure(arm)
    rigid = TorqueModel(arm.name, structure, structure.base.values(arm.parameters), inertial=arm.parameters)
    fields = {name: _over_arm(simulation, servos.get(key)) for name, key in URDF_FIELDS.items()}
    root = ElementTree.fromstring(urdf_document(replace(build_simulator_model(rigid), fields=fields)))
    lacking_lines = [*_lines_without_field(simulation, servos), *unstated_limits(arm)]
    lacking = "".join(f"\n  - {line.replace('--', '-')}" for line in lacking_lines)
    root.insert(0, ElementTree.Comment(f" Written by armlab. What URDF and ros2_control do not hold:{lacking}\n"))
    control = ElementTree.SubElement(root, "ros2_control", name="servos", type="system")
    hardware = ElementTree.SubElement(control, "hardware")
    ElementTree.SubElement(hardware, "plugin").text = HARDWARE
    for number in simulation.joints:
        _add_interfaces(control, arm.joints[number].name, limits[number])
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _add_interfaces(control: ElementTree.Element, name: str, limit: float) -> None:
    joint = ElementTree.SubElement(control, "joint", name=name)
    command = ElementTree.SubElement(joint, "command_interface", name="effort")
    if limit < INFINITE_LIMIT:
        for end, value in (("min", -limit), ("max", limit)):
            ElementTree.SubElement(command, "param", name=end).text = f"{value:.6g}"
    for state in ("position", "velocity", "effort"):
        ElementTree.SubElement(joint, "state_interface", name=state)


def controllers_text(simulation: ServoSimulation, servos: Servos, step_s: float) -> str:
    """`controllers.yaml`: a PID controller with the gains found. step_s: a cycle of the controller, s."""
    names = [simulation.arm.joints[number].name for number in simulation.joints]
    gains = {name: _gains(servos.of_joint(row)) for row, name in enumerate(names)}
    manager = {
        "update_rate": round(1 / step_s),
        "joint_state_broadcaster": {"type": "joint_state_broadcaster/JointStateBroadcaster"},
        CONTROLLER: {"type": "pid_controller/PidController"},
    }
    servo = {
        "dof_names": names,
        "command_interface": "effort",
        "reference_and_state_interfaces": ["position", "velocity"],
        "gains": gains,
    }
    content = {name: {"ros__parameters": part} for name, part in (("controller_manager", manager), (CONTROLLER, servo))}
    head = (
        "# Controllers for robot.urdf, written by armlab; names as in ros2_controllers 4.22.0.\n"
        "# p: N m/rad, d: N m s/rad (N/m, N s/m for sliding joints); update_rate: Hz.\n"
        "# References (control_msgs/MultiDOFCommand): values are the commanded positions, values_dot zeros; without\n"
        "# values_dot, d would act on the derivative of the command, too.\n"
    )
    return head + yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=110)


def _gains(servo: Mapping[str, float | None]) -> dict[str, float | bool]:
    """Parameters of one PID: a limit of its integral where the servo has one."""
    names = {"p": "kp", "i": "ki", "d": "kd"}
    gains: dict[str, float | bool] = {name: float(f"{servo[key] or 0.0:.6g}") for name, key in names.items()}
    most = servo["integral_limit"]
    if not servo["ki"] or most is None:
        return gains
    clamp = float(f"{most:.6g}")
    return gains | {"antiwindup": True, "i_clamp_max": clamp, "i_clamp_min": -clamp}


def _lines_without_field(simulation: ServoSimulation, servos: Servos) -> Iterator[str]:
    """What neither the URDF nor the controller's parameters hold."""
    for row, number in enumerate(simulation.joints):
        name = simulation.arm.joints[number].name
        rotor, delay = float(servos.get("armature")[row]), float(servos.get("delay")[row])
        if rotor:
            yield f"{name}: rotor inertia of {rotor:.4g} kg m2 on the joint side (armature)"
        if delay > 0:
            yield f"{name}: the command arrives {1e3 * delay:.3g} ms late: send it that much later"
    yield "friction at rest: Gazebo's joint friction depends on its physics engine, and may creep"
    yield from lines_without_field(simulation, servos, ("integral gain",))


def _over_arm(simulation: ServoSimulation, values: Array) -> Array:
    """Numbers of the recorded joints as numbers of all joints of the arm, zero elsewhere."""
    whole = np.zeros(len(simulation.arm))
    whole[list(simulation.joints)] = values
    return whole
