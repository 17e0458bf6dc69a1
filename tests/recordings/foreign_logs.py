"""Logs of simulated arms of known truth, written as the drivers' own documentation says, not as the importer reads.

| log | layout after |
|---|---|
| motor currents | RealMan API, rm_joint_status_t: joint_current in mA, joint_position in deg, joint_speed in rpm |
| ROS 2 bag | sensor_msgs/JointState: a driver lists joints in an order of its own, and a gripper among them |
| LeRobot | dataset v3.0 of an SO-101: float32 vectors in degrees, gripper in percent, 30 frames a second |
| UR RTDE | RTDE client library, rtde/csv_writer.py: blanks between cells, VECTOR6D as NAME_0 ... NAME_5, current in A |
"""

import csv
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import mujoco
import numpy as np
import pandas as pd

from armlab.effects.contract import Scene, Value
from armlab.effects.example import random_motion
from armlab.effects.library import family_named
from armlab.effects.model import FittedEffect, torque_of_model
from problem.arm import Arm
from problem.motion import Motion
from problem.regressor import rigid_body_torque
from problem.robot_file import BUILT_IN_FOLDER, load_arm

SECONDS, RATE_HZ = 20.0, 125.0
ENCODER_STEP = 2e-5  # rad
START_NS = 1_767_225_600 * 10**9
Hidden = Sequence[tuple[str, int, dict[str, Value]]]  # effect, its joint, its numbers, the telling one first


@dataclass(frozen=True)
class ForeignLog:
    """Files of a log, the robot file of its user, what only the user knows (by the option), and what is hidden."""

    files: tuple[Path, ...]
    robot: Path
    known: Mapping[str, str]
    hidden: Hidden


@dataclass(frozen=True, eq=False)
class SimulatedRun:
    """time (samples,), s; motion and torque (samples, joints)."""

    time: np.ndarray
    motion: Motion
    torque: np.ndarray


def simulate_run(arm: Arm, hidden: Hidden, seed: int, noise: float) -> SimulatedRun:
    """A run of an arm with hidden effects: positions with the steps of an encoder, torques with noise (N m)."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
    motion = random_motion(arm, time, rng)
    effects = [FittedEffect(*family_named(name).from_parameters(arm, (joint,), each)) for name, joint, each in hidden]
    torque = torque_of_model(effects, Scene("run", time, motion, arm, arm.parameters, rigid_body_torque(arm, motion)))
    position = np.round(motion.position / ENCODER_STEP) * ENCODER_STEP
    measured = torque + rng.normal(0.0, noise, torque.shape)
    return SimulatedRun(time, Motion(position, motion.velocity, motion.acceleration), measured)


PAYLOAD: dict[str, Value] = {
    "mass": 1.5,
    "centre": (0.05, 0.0, 0.08),
    "inertia": (0.0136, 0.01735, 0.00775, 0.0, -0.006, 0.0),
}

HAND: dict[str, Value] = {
    "mass": 2.0,
    "centre": (0.0, 0.02, 0.06),
    "inertia": (0.0158, 0.0122, 0.0058, 0.0, 0.0, -0.0024),
}


def motor_current_log(folder: Path) -> ForeignLog:
    """Two CSV files with currents in mA and stamps of `time.time_ns()`."""
    hidden: Hidden = (("coulomb_friction", 2, {"level": 3.1}), ("payload", 3, PAYLOAD))
    gains = (9.1, 9.1, 5.4)  # N m per A
    arm = load_arm("irb120-arm")
    robot = folder / "arm.yaml"
    robot.write_text((BUILT_IN_FOLDER / "irb120-arm.yaml").read_text())
    fields = ("joint_position", "joint_speed", "joint_current", "joint_temperature", "joint_voltage")
    header = ["timestamp_ns", *(f"{name}_{joint}" for name in fields for joint in (1, 2, 3))]
    files = []
    for seed in (1, 2):
        run = simulate_run(arm, hidden, seed, noise=0.05)
        path = folder / f"log-{seed}.csv"
        with path.open("w", newline="") as stream:
            writer = csv.writer(stream)
            writer.writerow(header)
            for time, angle, speed, torque in zip(
                run.time, run.motion.position, run.motion.velocity, run.torque, strict=True
            ):
                cells = [*np.round(np.degrees(angle), 3), *np.round(speed * 30 / np.pi, 2)]
                cells += [*np.round(1000 * torque / gains, 3), 31.2, 31.4, 30.9, 24.0, 24.0, 24.0]
                writer.writerow([START_NS + seed * 60 * 10**9 + round(time * 1e9), *cells])
        files.append(path)
    return ForeignLog(tuple(files), robot, {"gains": ",".join(map(str, gains))}, hidden)


def joint_state_log(folder: Path) -> ForeignLog:
    """Two ROS 2 bags of `/joint_states`; the driver sorts the joints by name, the robot from base to tool."""
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    hidden: Hidden = (("viscous_friction", 1, {"coefficient": 1.8}), ("coulomb_friction", 3, {"level": 1.2}))
    joints = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint"]
    listed = sorted([*joints, "finger_joint"])
    text = (BUILT_IN_FOLDER / "irb120-arm.yaml").read_text()
    for number, name in enumerate(joints, 1):
        text = text.replace(f"name: joint{number}", f"name: {name}")
    robot = folder / "arm.yaml"
    robot.write_text(text)
    store = get_typestore(Stores.ROS2_HUMBLE)
    kind = "sensor_msgs/msg/JointState"
    bags = []
    for seed in (3, 4):
        run = simulate_run(load_arm(str(robot)), hidden, seed, noise=0.05)
        states = {
            name: np.stack([run.motion.position[:, place], run.motion.velocity[:, place], run.torque[:, place]], axis=1)
            for place, name in enumerate(joints)
        } | {"finger_joint": np.zeros((len(run.time), 3))}
        bag = folder / f"rosbag2-{seed}"
        with Writer(bag, version=9) as writer:
            link = writer.add_connection("/joint_states", kind, typestore=store)
            for row, time in enumerate(run.time):
                stamp = START_NS + seed * 60 * 10**9 + round(time * 1e9)
                header = store.types["std_msgs/msg/Header"](
                    store.types["builtin_interfaces/msg/Time"](*divmod(stamp, 10**9)), "base_link"
                )
                position, velocity, effort = np.array([states[name][row] for name in listed]).T
                message = store.types[kind](header, listed, position.copy(), velocity.copy(), effort.copy())
                writer.write(link, stamp + 1_200_000, store.serialize_cdr(message, kind))
        bags.append(bag)
    return ForeignLog(tuple(bags), robot, {}, hidden)


SO101_JOINTS = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper")
SO101_LENGTHS = (0.05, 0.11, 0.13, 0.06, 0.04, 0.03)  # m
SO101_MASSES = (0.15, 0.12, 0.1, 0.08, 0.05, 0.02)  # kg
SO101_AXES = ("0 0 1", "0 1 0", "0 1 0", "0 1 0", "1 0 0", "0 0 1")
SO101_EPISODES, SO101_SECONDS, SO101_FPS = 3, 15.0, 30
SO101_COUNT = 2 * np.pi / 4096  # of the STS3215 servo


def so101_text(kp: Mapping[str, float], timestep: float = 1e-3) -> str:
    """An arm with the joints of the SO-101 as MJCF. kp: of joints that differ from 17.8 N m/rad; timestep: s."""
    bodies, ends, drives, place = "", "", "", "0 0 0.06"
    for name, length, mass, axis in zip(SO101_JOINTS, SO101_LENGTHS, SO101_MASSES, SO101_AXES, strict=True):
        inertia = mass * length**2 / 12 + 1e-5
        bodies += f'<body name="{name}_link" pos="{place}"><joint name="{name}" axis="{axis}" range="-2.5 2.5"/>'
        bodies += f'<inertial pos="{length / 2} 0 0" mass="{mass}" diaginertia="1e-5 {inertia:.3g} {inertia:.3g}"/>'
        drives += f'<position name="{name}" joint="{name}" kp="{kp.get(name, 17.8)}"/>'
        ends += "</body>"
        place = f"{length} 0 0"
    return (
        f'<mujoco model="so101"><option timestep="{timestep}" integrator="implicitfast"/>'
        '<compiler angle="radian"/><default>'
        '<joint damping="0.6" frictionloss="0.05" armature="0.028" solimpfriction="0.9999 0.9999 0.001"/>'
        '<position forcerange="-3.35 3.35"/></default>'
        f"<worldbody>{bodies}{ends}</worldbody><actuator>{drives}</actuator></mujoco>"
    )


def lerobot_log(folder: Path) -> ForeignLog:
    """A LeRobot dataset v3.0, episodes of teleoperation; the elbow's servo is softer than its simulation."""
    robot = folder / "so101.xml"
    robot.write_text(so101_text({}))
    hidden: Hidden = (("controller_gain_error", 3, {"kp": 9.0}),)
    episodes, frames = SO101_EPISODES, round(SO101_SECONDS * SO101_FPS)
    table = pd.DataFrame({name: list(vectors) for name, vectors in _so101_vectors().items()})
    frame = np.tile(np.arange(frames), episodes)
    table["timestamp"] = (frame / SO101_FPS).astype(np.float32)
    table["frame_index"], table["episode_index"] = frame, np.repeat(np.arange(episodes), frames)
    table["index"], table["task_index"] = np.arange(len(table)), 0
    dataset = folder / "so101_stack_cubes"
    for part in ("meta", "data/chunk-000"):
        (dataset / part).mkdir(parents=True)
    table.to_parquet(dataset / "data/chunk-000/file-000.parquet")
    pd.DataFrame({"task_index": [0]}, index=["Stack the cubes"]).to_parquet(dataset / "meta/tasks.parquet")
    vector = {"dtype": "float32", "shape": [6], "names": [f"{name}.pos" for name in SO101_JOINTS]}
    scalars = {
        "timestamp": "float32",
        **dict.fromkeys(("frame_index", "episode_index", "index", "task_index"), "int64"),
    }
    info = {
        "codebase_version": "v3.0",
        "robot_type": "so101_follower",
        "total_episodes": episodes,
        "total_frames": len(table),
        "total_tasks": 1,
        "chunks_size": 1000,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": SO101_FPS,
        "splits": {"train": f"0:{episodes}"},
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "video_path": None,
        "features": {"action": vector, "observation.state": vector}
        | {name: {"dtype": kind, "shape": [1], "names": None} for name, kind in scalars.items()},
    }
    (dataset / "meta/info.json").write_text(json.dumps(info, indent=4))
    return ForeignLog((dataset,), robot, {}, hidden)


@cache
def _so101_vectors() -> dict[str, np.ndarray]:
    """Commands and positions of all episodes, (frames, 6), degrees and percent."""
    model = mujoco.MjModel.from_xml_string(so101_text({"elbow_flex": 9.0}, timestep=1e-4))  # an arm has no steps
    vectors: dict[str, list[np.ndarray]] = {"action": [], "observation.state": []}
    for episode in range(SO101_EPISODES):
        command = _so101_commands(np.random.default_rng(episode), round(SO101_SECONDS * SO101_FPS))
        for name, values in (("action", command), ("observation.state", _so101_positions(model, command))):
            vectors[name].append(np.column_stack([np.degrees(values[:, :5]), 50 + 40 * values[:, 5]]))
    return {name: np.concatenate(parts).astype(np.float32) for name, parts in vectors.items()}


def _so101_commands(rng: np.random.Generator, frames: int) -> np.ndarray:
    """Commands (frames, 6), rad, of a hand that moves a leader arm: reaches of different speed, and rests."""
    targets = rng.uniform(-0.8, 0.8, (frames // 20 + 2, 6))
    held = np.repeat(targets, 20, axis=0)[: frames + 20]
    smooth = np.stack([np.convolve(column, np.hanning(15) / np.hanning(15).sum(), "same") for column in held.T], axis=1)
    return smooth[10 : frames + 10]


def _so101_positions(model: mujoco.MjModel, command: np.ndarray) -> np.ndarray:
    data = mujoco.MjData(model)
    data.qpos[:] = command[0]
    ends = np.round(np.arange(1, len(command) + 1) / SO101_FPS / model.opt.timestep).astype(int)
    read, step = [], 0
    for wanted, end in zip(command, ends, strict=True):
        read.append(np.round(data.qpos / SO101_COUNT) * SO101_COUNT)
        data.ctrl[:] = wanted
        while step < end:
            mujoco.mj_step(model, data)
            step += 1
    return np.array(read)


UR_LINKS = (  # joint, xyz, rpy, mass, centre, diagonal of the inertia: a UR5e in round numbers
    ("shoulder_pan_joint", "0 0 0.1625", "0 0 0", 3.76, "0 -0.02 0.03", 0.010),
    ("shoulder_lift_joint", "0 0 0", "1.5708 0 0", 8.06, "-0.21 0 0.14", 0.134),
    ("elbow_joint", "-0.425 0 0", "0 0 0", 2.85, "-0.24 0 0.05", 0.031),
    ("wrist_1_joint", "-0.392 0 0.1333", "0 0 0", 1.37, "0 -0.02 0.01", 0.003),
    ("wrist_2_joint", "0 -0.0997 0", "1.5708 0 0", 1.30, "0 0.02 0.01", 0.003),
    ("wrist_3_joint", "0 0.0996 0", "-1.5708 0 0", 0.37, "0 0 -0.02", 0.0003),
)


def ur_text() -> str:
    """An arm with the joints of a UR5e as URDF."""
    parts, parent = ['<robot name="ur5e"><link name="base_link"/>'], "base_link"
    for name, xyz, rpy, mass, centre, inertia in UR_LINKS:
        link = name.replace("_joint", "_link")
        parts.append(
            f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{link}"/>'
            f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="0 0 1"/>'
            '<limit lower="-6.2832" upper="6.2832" velocity="3.1416" effort="150"/></joint>'
            f'<link name="{link}"><inertial><origin xyz="{centre}" rpy="0 0 0"/><mass value="{mass}"/>'
            f'<inertia ixx="{inertia}" iyy="{inertia}" izz="{inertia}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        )
        parent = link
    return "\n".join([*parts, "</robot>"])


def rtde_log(folder: Path) -> ForeignLog:
    """Two files as the RTDE client's record.py writes them, stamps in seconds since the controller's start."""
    hidden: Hidden = (
        ("coulomb_friction", 1, {"level": 8.0}),
        ("viscous_friction", 2, {"coefficient": 12.0}),
        ("payload", 6, HAND),
    )
    gains = (12.9, 12.9, 12.9, 9.4, 9.4, 9.4)  # N m per A
    robot = folder / "ur5e.urdf"
    robot.write_text(ur_text())
    arm = load_arm(str(robot))
    names = ["target_q", "target_qd", "target_current", "target_moment", "actual_q", "actual_qd", "actual_current"]
    files = []
    for seed in (5, 6):
        run = simulate_run(arm, hidden, seed, noise=0.1)
        path = folder / f"robot_data_{seed}.csv"
        with path.open("w", newline="") as stream:
            writer = csv.writer(stream, delimiter=" ")
            writer.writerow(["timestamp", *(f"{name}_{joint}" for name in names for joint in range(6)), "robot_mode"])
            for time, q, qd, torque in zip(run.time, run.motion.position, run.motion.velocity, run.torque, strict=True):
                modelled = np.zeros(6)
                vectors = (q, qd, modelled, modelled, q, qd, torque / gains)
                writer.writerow([1234.5 + seed * 60 + time, *(float(each) for vector in vectors for each in vector), 7])
        files.append(path)
    return ForeignLog(tuple(files), robot, {"gains": ",".join(map(str, gains))}, hidden)


LOGS = {
    "motor currents, CSV in mA": motor_current_log,
    "ROS 2 bag, joints by name": joint_state_log,
    "LeRobot dataset, SO-101": lerobot_log,
    "UR RTDE, CSV in A": rtde_log,
}
