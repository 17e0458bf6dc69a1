"""The simulation that a recording of motion only is compared with: a MuJoCo model and the numbers of its servos."""

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.diagnosis.motion.mjcf_drives import servo_spec
from armlab.diagnosis.motion.servo import INFINITE_LIMIT, KEYS, NEUTRAL, UNSTATED, Servos, place
from armlab.diagnosis.motion.servo_plugin import find_actuator
from armlab.identification.export import SimulatorModel, mjcf_document
from armlab.identification.structure import Structure
from armlab.identification.torque_model import TorqueModel
from armlab.recordings.motion import MotionRecording
from armlab.recordings.recording_file import FILE_NAME, ControllerEntry
from problem.arm import Arm, Link
from problem.bodies import with_extent
from problem.mjcf import arm_of, compile_mjcf, import_mujoco
from problem.mjcf_servos import actuators_of, reason_no_servo, refuse_other_drives

UNSUPPORTED = {
    "velocity_filter_hz": "a filtered velocity",
    "kt": "a motor constant (give torque_limit and kp in N m)",
    "resistance": "a winding resistance (give torque_limit and kp in N m)",
}


@dataclass(frozen=True, eq=False)
class ServoSimulation:
    """The simulation.

    path: of the robot's file; document: its MJCF where the file is another format. nominal: of the recorded joints, NaN
    where unknown. joints: places of the recorded joints in the arm. as_given: the MJCF alone is the simulation.
    read_delay: of the position of each recorded joint after its stamp, (joints,), s. rate_hz: how often the command is
    taken over. supply: nominal supply voltage, V, of drives that command a voltage;
    None for others. payload: mass that is added at the tool, kg. delay: what is added to that of each command, s; it is
    in `nominal`. replaced: joints whose actuator in the file is no servo, and whose drive the recording states.
    """

    arm: Arm
    path: Path
    document: str | None
    joints: tuple[int, ...]
    nominal: Servos
    as_given: bool
    read_delay: Array
    rate_hz: float | None = None
    supply: float | None = None
    payload: float = 0.0
    delay: float = 0.0
    replaced: frozenset[str] = frozenset()

    def number_of(self, row: int) -> int:
        """The robot's number, from 1, of the joint that a column of the recording, from 0, belongs to."""
        return self.joints[row] + 1

    @property
    def last_link(self) -> int:
        """The link that carries the tool, from 1."""
        return len(self.arm)

    def spec(self) -> Any:
        """The simulation as mujoco.MjSpec, with a position actuator at each joint; their gain is 1 where none was."""
        mujoco = import_mujoco()
        if self.document is not None:
            spec = mujoco.MjSpec.from_string(self.document)
        else:
            spec = servo_spec(self.path, self.replaced)
        driven = {actuator.target for actuator in spec.actuators}
        for joint in self.arm.joints:
            if joint.name not in driven:
                kind = mujoco.mjtTrn.mjTRN_JOINT
                spec.add_actuator(name=f"servo-{joint.name}", target=joint.name, trntype=kind).set_to_position(kp=1.0)
        if self.payload:
            _add_payload(spec, self.payload)
        return spec

    def is_physical(self) -> bool:
        """Whether MuJoCo takes the inertias: a payload that is less than nothing may leave impossible ones."""
        try:
            self.model()
        except ValueError:
            return False
        return True

    def with_payload(self, mass: float) -> "ServoSimulation":
        """The simulation with a point mass at the tool, kg: less than nothing where the simulation has too much."""
        with_mass = replace(self, payload=self.payload + mass)
        seen = [arm_of(each.spec().compile(), self.path) for each in (self, replace(self, payload=self.payload + 1.0))]
        unit = seen[1].parameters - seen[0].parameters
        moved = (self.arm.parameters + mass * unit).reshape(-1, 10)
        links = tuple(Link(float(row[0]), tuple(row[1:4].tolist()), tuple(row[4:].tolist())) for row in moved)
        return replace(with_mass, arm=replace(self.arm, links=links))

    def with_delay(self, seconds: float) -> "ServoSimulation":
        """The simulation whose commands all come later, s."""
        values = self.nominal.values.copy()
        values[:, place("delay")] += seconds
        return replace(self, nominal=Servos(values), delay=self.delay + seconds)

    def model(self) -> Any:
        """The same, compiled: mujoco.MjModel."""
        return self.spec().compile()


def read_servo_simulation(recording: MotionRecording) -> ServoSimulation:
    """The simulation of a recording: its MJCF, or its robot file, with the controller of `recording.yaml`.

    Raises InputError for a robot without inertias, and for a controller that the replay does not have.
    """
    controller = recording.controller
    where = str(recording.folder / FILE_NAME)
    if controller is not None:
        _check_supported(controller, where)
    if recording.arm.links is None:
        raise InputError(f"robot of {where} has no links: without inertias a motion says nothing of its drives")
    path = recording.folder / recording.robot
    from_mjcf, replaced = path.suffix == ".xml", frozenset[str]()
    if from_mjcf:
        replaced = _stated_drives(recording)
        nominal = _servos_of_mjcf(recording, path, replaced)
    else:
        nominal = np.tile(NEUTRAL, (len(recording.joints), 1))
        nominal[:, place("armature")] = _rotors(recording)
        for row, joint in enumerate(recording.joints if recording.arm.joint_laws else ()):
            law = recording.arm.joint_laws[joint]
            nominal[row, place("damping")], nominal[row, place("friction")] = law.damping, law.friction
    if controller is not None:
        nominal = _with_controller(nominal, controller)
        _check_limits(nominal, where)
    else:
        nominal[np.isnan(nominal[:, [place("kp")]]) & np.array(UNSTATED)] = np.nan
    return ServoSimulation(
        arm=recording.arm,
        path=path,
        document=None if from_mjcf else _mjcf_of_arm(recording),
        joints=recording.joints,
        nominal=Servos(nominal),
        as_given=from_mjcf and controller is None,
        read_delay=_read_delays(controller, len(recording.joints)),
        rate_hz=controller.rate_hz if controller is not None else None,
        supply=controller.supply if controller is not None else None,
        replaced=replaced,
    )


def _add_payload(spec: Any, mass: float) -> None:
    """Adds a point mass at the last site of the model or, without sites, at the frame of its last body."""
    mujoco = import_mujoco()
    model = spec.compile()
    tool = spec.sites[-1] if spec.sites else None
    body, point = (spec.bodies[-1], np.zeros(3)) if tool is None else (tool.parent, np.array(tool.pos))
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, model.body_iquat[body.id])
    own, axes, centre = model.body_mass[body.id], turn.reshape(3, 3), model.body_ipos[body.id]
    whole = own + mass
    middle = (own * centre + mass * point) / whole
    inertia = axes @ np.diag(model.body_inertia[body.id]) @ axes.T
    for each, place_of in ((own, centre), (mass, point)):
        arm = place_of - middle
        inertia = inertia + each * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    body.mass, body.ipos, body.iquat, body.explicitinertial = whole, middle, [1.0, 0.0, 0.0, 0.0], True
    body.inertia, body.fullinertia = np.zeros(3), inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]


def _check_supported(controller: ControllerEntry, where: str) -> None:
    for key, words in UNSUPPORTED.items():
        if getattr(controller, key) is not None:
            raise InputError(f"controller.{key} in {where}: the replay has no law with {words}")
    if controller.reference_velocity != "zero" or controller.feedforward != "none":
        raise InputError(f"controller in {where}: the replay has no reference velocity and no feedforward")
    gains = zip(controller.ki_speed or (), controller.kp, strict=False)
    if any(part is not None and whole is not None and part >= whole for part, whole in gains):
        raise InputError(f"controller.ki_speed in {where} should be less than kp, of which it is a part")


def _check_limits(nominal: Array, where: str) -> None:
    falls = (nominal[:, place("limit_slope")] > 0) & (nominal[:, place("limit")] >= INFINITE_LIMIT)
    if falls.any():
        joint = int(np.argmax(falls)) + 1
        raise InputError(
            f"controller.limit_slope in {where}: joint {joint} has no torque_limit that could fall with speed"
        )


def _rotors(recording: MotionRecording) -> Array:
    rotors = recording.arm.rotor_inertia or (0.0,) * len(recording.arm)
    return np.array([rotors[joint] for joint in recording.joints])


def _stated_drives(recording: MotionRecording) -> frozenset[str]:
    """Names of the joints whose drive the recording states: whatever actuators the file has there, they are not."""
    stated = recording.joints if recording.controller is not None else ()
    return frozenset(recording.arm.joints[joint].name for joint in stated)


def _servos_of_mjcf(recording: MotionRecording, path: Path, replaced: frozenset[str]) -> Array:
    """Parameters (joints, parameters) of the recorded joints and their position actuators.

    replaced: joints whose drive the recording states.
    """
    given = compile_mjcf(path)
    if not replaced:
        refuse_other_drives(given, recording.joints, path)
    model = servo_spec(path, replaced).compile()
    values = np.tile(NEUTRAL, (len(recording.joints), 1))
    for row, joint in enumerate(recording.joints):
        values[row, place("damping")] = model.dof_damping[joint]
        values[row, place("armature")] = model.dof_armature[joint]
        values[row, place("friction")] = model.dof_frictionloss[joint]
        actuator, own = find_actuator(model, joint), actuators_of(given, joint)
        if actuator is None or reason_no_servo(given, own[0]) is not None:
            continue
        gain, bias = model.actuator_gainprm[actuator], model.actuator_biasprm[actuator]
        values[row, place("kp")], values[row, place("kd")] = gain[0], -bias[2]
        values[row, place("delay")] = model.actuator_delay[actuator]
        if model.actuator_forcelimited[actuator]:
            values[row, place("limit")] = min(model.actuator_forcerange[actuator, 1], INFINITE_LIMIT)
    return values


def actuator_of(model: Any, joint: int) -> int:
    """The actuator of a joint, from 0."""
    found = find_actuator(model, joint)
    if found is None:
        raise InputError(f"joint '{model.joint(joint).name}' has no actuator")
    return found


def _with_controller(nominal: Array, controller: ControllerEntry) -> Array:
    """The numbers of `recording.yaml` in place of those of the robot's file, where it gives any."""
    values, joints = nominal.copy(), len(nominal)
    given = {"kp": controller.kp, "kd": controller.kd, "limit": controller.torque_limit, "offset": controller.offset}
    given |= {"ki": controller.ki, "ki_speed": controller.ki_speed, "integral_limit": controller.integral_limit}
    given |= {"dead_band": controller.dead_band, "limit_slope": controller.limit_slope}
    for key, numbers in given.items():
        for row, value in enumerate(numbers or ()):
            if value is not None:
                values[row, KEYS.index(key)] = value
    values[:, place("delay")] = np.broadcast_to(np.asarray(controller.delay), (joints,))
    return values


def _read_delays(controller: ControllerEntry | None, joints: int) -> Array:
    if controller is None or controller.read_delay is None:
        return np.zeros(joints)
    return np.asarray(controller.read_delay, dtype=float)


def _mjcf_of_arm(recording: MotionRecording) -> str:
    """The arm of a robot file or URDF as MJCF, with a position actuator of gain 1 at each joint.

    Points, rods and frames without mass get as little extent as MuJoCo takes, and what no body is, the nearest one.
    """
    arm = recording.arm
    structure, inertial = Structure(arm), with_extent(arm.parameters)
    rigid = TorqueModel(recording.robot, structure, structure.base.values(inertial), inertial=inertial)
    root = ElementTree.fromstring(mjcf_document(SimulatorModel(rigid, {}, ())))
    actuators = ElementTree.SubElement(root, "actuator")
    for joint in arm.joints:
        ElementTree.SubElement(actuators, "position", name=joint.name, joint=joint.name, kp="1")
    return ElementTree.tostring(root, encoding="unicode")
