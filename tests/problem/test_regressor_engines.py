"""The observation matrix against two independent engines, and one arm written in three ways."""

from pathlib import Path

import numpy as np
import pytest
from engines import mujoco_torque, pinocchio_model, pinocchio_regressor
from random_arms import random_arm, random_motion

from armlab.common.arrays import Array
from problem.arm import Arm
from problem.motion import Motion
from problem.regressor import inertia_column, observation_matrix, rigid_body_torque
from problem.robot_file import RobotFile, load_arm
from problem.urdf import read_urdf

STATES = 1000
ARMS = {
    "3 joints": load_arm("irb120-arm"),
    "6 joints": load_arm("irb120"),
    "7 joints, one prismatic": random_arm("RRPRRRR", seed=7),
}
every_arm = pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS.keys())


def each_row_close(ours: Array, theirs: Array) -> bool:
    """Whether every row agrees to 1e-10 of its own largest entry."""
    error = np.abs(ours - theirs).max(axis=-1)
    return bool(np.all(error <= 1e-10 * np.abs(theirs).max(axis=-1)))


@every_arm
def test_observation_matrix_is_pinocchios_regressor_to_1e_10_in_1000_random_states(arm: Arm) -> None:
    motion = random_motion(len(arm), STATES)
    assert each_row_close(observation_matrix(arm, motion), pinocchio_regressor(arm, motion))


@every_arm
def test_torque_is_mujocos_inverse_dynamics_to_1e_10_in_1000_random_states(arm: Arm) -> None:
    motion = random_motion(len(arm), STATES, seed=1)
    assert each_row_close(rigid_body_torque(arm, motion), mujoco_torque(arm, motion))


@pytest.mark.parametrize("kinds", ["R", "P", "PP", "PRP", "RRRRRRRRRRRRRRRR"])
def test_other_chains_agree_with_pinocchio_too(kinds: str) -> None:
    arm, motion = random_arm(kinds, seed=2), random_motion(len(kinds), 11)
    assert each_row_close(observation_matrix(arm, motion), pinocchio_regressor(arm, motion))


def test_gravity_may_point_anywhere() -> None:
    upright = random_arm("RRR")
    motion = Motion(np.full((1, 3), 0.3), np.zeros((1, 3)), np.zeros((1, 3)))
    slanted = Arm("slanted", upright.joints, upright.links, gravity=(9.81, 0.0, 0.0))
    assert not np.allclose(rigid_body_torque(slanted, motion), rigid_body_torque(upright, motion))
    assert each_row_close(observation_matrix(slanted, motion), pinocchio_regressor(slanted, motion))


# One arm with axes z, then y, then y: as distal (standard) D-H, as proximal (modified) D-H, and as a URDF.
STANDARD = [(0.1, 0.3, -np.pi / 2), (0.4, 0.0, 0.0), (0.2, 0.0, 0.0)]  # a, d, alpha
MODIFIED = [(0.0, 0.3, 0.0), (0.1, 0.0, -np.pi / 2), (0.4, 0.0, 0.0)]
URDF = """<robot name="three">
<link name="base"/><link name="l1"/><link name="l2"/><link name="l3"/>
<joint name="j1" type="revolute"><parent link="base"/><child link="l1"/>
  <origin xyz="0 0 0.3"/><axis xyz="0 0 1"/></joint>
<joint name="j2" type="revolute"><parent link="l1"/><child link="l2"/>
  <origin xyz="0.1 0 0"/><axis xyz="0 2 0"/></joint>
<joint name="j3" type="revolute"><parent link="l2"/><child link="l3"/>
  <origin xyz="0.4 0 0"/><axis xyz="0 1 0"/></joint>
</robot>"""


def dh_arm(convention: str, rows: list[tuple[float, float, float]]) -> Arm:
    joints = tuple({"name": "j", "type": "revolute", "a": a, "d": d, "alpha": alpha} for a, d, alpha in rows)
    return RobotFile.model_validate({"name": convention, "dh_convention": convention, "joints": joints}).build()


def test_standard_dh_modified_dh_and_urdf_write_the_same_arm(tmp_path: Path) -> None:
    path = tmp_path / "three.urdf"
    path.write_text(URDF)
    motion = random_motion(3, 50)
    standard = observation_matrix(dh_arm("standard", STANDARD), motion)
    modified = observation_matrix(dh_arm("modified", MODIFIED), motion)
    urdf = observation_matrix(read_urdf(path), motion)
    # The frames of the links differ, so the parameters do, but what the torques can be does not.
    for other in (modified, urdf):
        combination = np.linalg.lstsq(standard, other, rcond=None)[0]
        np.testing.assert_allclose(standard @ combination, other, atol=1e-10 * np.abs(other).max())
    # Behind joint 3 the standard frame is shifted by a = 0.2: a point mass there has the same torques in all.
    at_tip, seen_from_joint = np.zeros(30), np.zeros(30)
    at_tip[20] = 1.0
    seen_from_joint[[20, 21, 25, 26]] = 1.0, 0.2, 0.04, 0.04
    np.testing.assert_allclose(standard @ at_tip, modified @ seen_from_joint, rtol=0, atol=1e-12)
    np.testing.assert_allclose(standard @ at_tip, urdf @ seen_from_joint, rtol=0, atol=1e-12)


@pytest.mark.parametrize("axis", [(0, 0, -1), (1e-6, 0, -1), (3e-4, -2e-4, -1), (-1, 0, 0), (0.2, -0.9, 0.1)])
def test_any_axis_of_a_urdf_joint_is_taken_exactly(tmp_path: Path, axis: tuple[float, float, float]) -> None:
    pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed")
    inertial = (
        '<inertial><origin xyz="0.1 0.2 0.3" rpy="0.4 0.5 0.6"/><mass value="2"/>'
        '<inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0.001" ixz="0.002" iyz="0.003"/></inertial>'
    )
    text = (
        f'<robot name="one"><link name="base"/><link name="l">{inertial}</link><joint name="j" type="revolute">'
        f'<parent link="base"/><child link="l"/><origin rpy="0.3 0.2 0.1"/>'
        f'<axis xyz="{axis[0]} {axis[1]} {axis[2]}"/>'
        '<limit lower="-4" upper="4" velocity="1" effort="1"/></joint></robot>'
    )
    (tmp_path / "one.urdf").write_text(text)
    arm, motion = read_urdf(tmp_path / "one.urdf"), random_motion(1, 20)
    model = pin.buildModelFromXML(text)
    assert each_row_close(rigid_body_torque(arm, motion), rnea(model, motion))


WELDED = """<robot name="welded">
<link name="base"><inertial><mass value="9"/>
  <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="pedestal"/>
<link name="l1"><inertial><origin xyz="0.1 -0.2 0.3" rpy="0.4 -0.5 0.6"/><mass value="3"/>
  <inertia ixx="0.03" ixy="0.002" ixz="-0.001" iyy="0.04" iyz="0.003" izz="0.05"/></inertial></link>
<link name="sensor"><inertial><origin xyz="0 0.05 0" rpy="1 0 0"/><mass value="0.5"/>
  <inertia ixx="0.003" iyy="0.001" izz="0.003" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="l2"><inertial><origin xyz="0 0 0.1"/><mass value="1.5"/>
  <inertia ixx="0.02" iyy="0.01" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="flange"/>
<link name="gripper"><inertial><origin xyz="0.02 0 0.04" rpy="0 0 0.3"/><mass value="0.8"/>
  <inertia ixx="0.004" ixy="0.0003" ixz="0" iyz="0" iyy="0.005" izz="0.006"/></inertial></link>
<joint name="foot" type="fixed"><parent link="base"/><child link="pedestal"/>
  <origin xyz="0 0 1" rpy="0 0.3 0"/></joint>
<joint name="j1" type="revolute"><parent link="pedestal"/><child link="l1"/>
  <origin xyz="0.1 0 0" rpy="0.1 0.2 0.3"/>
  <axis xyz="0.6 0 0.8"/><limit lower="-3" upper="3" velocity="2" effort="10"/></joint>
<joint name="mount" type="fixed"><parent link="l1"/><child link="sensor"/>
  <origin xyz="0 0.2 0" rpy="0.5 0.5 0"/></joint>
<joint name="j2" type="prismatic"><parent link="sensor"/><child link="l2"/><origin xyz="0 0 0.4" rpy="1.2 0 0"/>
  <axis xyz="0 -1 0"/><limit lower="0" upper="0.5" velocity="1" effort="20"/></joint>
<joint name="weld1" type="fixed"><parent link="l2"/><child link="flange"/><origin xyz="0 0 0.2" rpy="0 1 0"/></joint>
<joint name="weld2" type="fixed"><parent link="flange"/><child link="gripper"/>
  <origin xyz="0.1 0 0" rpy="0 0 2"/></joint>
</robot>"""


def test_fixed_joints_are_welded_and_inertial_frames_turned_as_in_pinocchios_reader(tmp_path: Path) -> None:
    pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed")
    (tmp_path / "welded.urdf").write_text(WELDED)
    arm, motion = read_urdf(tmp_path / "welded.urdf"), random_motion(2, 200)
    assert each_row_close(rigid_body_torque(arm, motion), rnea(pin.buildModelFromXML(WELDED), motion))


def test_our_pinocchio_model_carries_the_links(tmp_path: Path) -> None:
    arm, motion = random_arm("RPR"), random_motion(3, 20)
    assert each_row_close(rnea(pinocchio_model(arm), motion), rigid_body_torque(arm, motion))


def rnea(model: object, motion: Motion) -> Array:
    pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed")
    data = model.createData()
    states = zip(motion.position, motion.velocity, motion.acceleration, strict=True)
    return np.array([pin.rnea(model, data, *state).copy() for state in states])


@pytest.mark.parametrize("kinds", ["RRR", "PRRRRR"])
def test_columns_of_the_inertia_matrix_are_those_of_an_independent_engine(kinds: str) -> None:
    pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed")
    arm = random_arm(kinds, seed=5)
    position = np.random.default_rng(5).uniform(-2, 2, (50, len(arm)))
    model = pinocchio_model(arm)
    data = model.createData()
    upper = [np.triu(pin.crba(model, data, state)) for state in position]
    theirs = np.array([each + np.triu(each, 1).T for each in upper])
    ours = np.stack([inertia_column(arm, position, joint) for joint in range(len(arm))], axis=-1)
    np.testing.assert_allclose(ours, theirs, atol=1e-10 * np.abs(theirs).max())
