"""Robot files as makers write them: the torque of the arm is that of the simulator whose format it is."""

from pathlib import Path

import numpy as np
import pytest
from refusals import refusal
from robot_file_table import FILES, compare, robot_files

from armlab.effects.scene import instants
from armlab.identification.nominal import nominal_model
from problem.arm import link_poses
from problem.drive_torque import drive_torque
from problem.locked_joints import lock_joints
from problem.motion import Motion
from problem.robot_file import load_arm
from problem.simulator_check import check_with_mujoco, left_out_of_urdf, random_states

REFUSED = {
    "ball_wrist.xml": "only hinge and slide joints on a fixed base",
    "four_bar.xml": "closed chains are not supported",
    "tendon_spring.xml": "stiffness of tendons is not supported",
    "coupled_by_a_curve.xml": "joint 'middle' follows a curve, only a straight line is supported",
}
CHAIN = """<mujoco><compiler angle="radian"/><worldbody><body name="a"><joint name="j" axis="0 1 0" {joint}/>
<inertial mass="1" pos=".2 0 0" diaginertia=".01 .01 .01"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize("path", robot_files(), ids=lambda path: path.name)
def test_a_robot_file_has_the_torque_of_its_simulator_or_is_refused_by_name(path: Path, tmp_path: Path) -> None:
    row = compare(path, tmp_path)
    if path.name in REFUSED:
        assert REFUSED[path.name] in row.refused
    else:
        assert row.difference is not None, row.refused
        assert row.difference < 1e-9


@pytest.mark.parametrize(
    ("joint", "reason"),
    [
        ('damping="1 0.1"', "damping is no straight line"),
        ('stiffness="1 0 0.3"', "stiffness is no straight line"),
        ('stiffness="5" springyield="2"', "springyield is no straight line"),
    ],
)
def test_laws_of_a_joint_that_are_no_lines_are_refused_by_name(tmp_path: Path, joint: str, reason: str) -> None:
    path = tmp_path / "bent.xml"
    path.write_text(CHAIN.format(joint=joint))
    assert f"joint 'j': {reason}" in refusal(load_arm, str(path))


def test_a_loop_within_a_gripper_that_is_locked_is_none() -> None:
    message = refusal(load_arm, str(FILES / "gripper_with_loop.xml"))
    assert "closed chains are not supported: say with --tip" in message
    assert message.endswith("the joints beside it are locked: gripper (2 joints)")


def test_a_loop_that_no_tip_opens_is_refused_without_one(tmp_path: Path) -> None:
    assert refusal(lock_joints, FILES / "four_bar.xml", "b", {}, tmp_path).endswith("closed chains are not supported")


def test_joints_without_names_are_called_by_their_bodies(tmp_path: Path) -> None:
    path = FILES / "scene_without_names.xml"
    assert "joint 'cube_joint': only hinge and slide" in refusal(load_arm, str(path))
    locked = lock_joints(path, "fore", {}, tmp_path)
    assert locked.positions == {"cube_joint": 0.0}
    assert [joint.name for joint in locked.arm.joints] == ["body2_joint", "elbow"]
    (tmp_path / "arm.xml").write_text(locked.document)
    assert check_with_mujoco(tmp_path / "arm.xml", with_actuators=False).left_out == (
        "forces of the actuators number 1",
    )


def test_what_is_left_out_of_a_file_is_listed_by_name(tmp_path: Path) -> None:
    assert check_with_mujoco(FILES / "under_water.xml", with_actuators=True).left_out == (
        "drag of the medium (density, viscosity)",
    )
    finger = FILES / "finger_that_follows.xml"
    by_tendon = """<tendon><fixed name="t"><joint joint="knuckle" coef="1"/></fixed></tendon>
<actuator><position name="pull" tendon="t"/><position name="servo" joint="knuckle"/></actuator></mujoco>"""
    (tmp_path / "arm.xml").write_text(finger.read_text().replace("</mujoco>", by_tendon))
    assert check_with_mujoco(tmp_path / "arm.xml", with_actuators=True).left_out == ("forces of the actuators pull",)
    gazebo = """<gazebo reference="elbow"><springStiffness>3</springStiffness></gazebo>
<gazebo reference="hand"><gravity>false</gravity></gazebo></robot>"""
    (tmp_path / "arm.urdf").write_text((FILES / "plain_cobot.urdf").read_text().replace("</robot>", gazebo))
    assert left_out_of_urdf(tmp_path / "arm.urdf") == ("the spring of joint 'elbow'", "that link 'hand' has no weight")
    assert left_out_of_urdf(FILES / "transmissions.urdf") == ()


def test_the_pose_of_an_mjcf_is_that_of_the_reference_position(tmp_path: Path) -> None:
    (tmp_path / "plain.xml").write_text(CHAIN.format(joint=""))
    (tmp_path / "moved.xml").write_text(CHAIN.format(joint='ref="0.4" limited="true" range="-1 1"'))
    plain, moved = (load_arm(str(tmp_path / name)) for name in ("plain.xml", "moved.xml"))
    np.testing.assert_allclose(link_poses(moved, np.array([0.4]))[0], link_poses(plain, np.zeros(1))[0], atol=1e-15)
    assert moved.joints[0].limits.position == (-1, 1)


@pytest.mark.parametrize(
    "name", ["ref_and_springref.xml", "gravity_partly_compensated.xml", "friction_alone.urdf", "coupled_wrist.xml"]
)
def test_the_nominal_model_has_the_torque_of_the_arm_with_all_its_laws(name: str) -> None:
    arm = load_arm(str(FILES / name))
    motion, model = random_states(arm, np.random.default_rng(1)), nominal_model(arm, name)
    assert model is not None
    expected = drive_torque(arm, motion)
    np.testing.assert_allclose(model.torque_in(instants(arm, motion)), expected, atol=1e-12 * np.abs(expected).max())


def test_friction_loss_and_springs_of_joints_follow_their_formulas(tmp_path: Path) -> None:
    (tmp_path / "arm.xml").write_text(
        CHAIN.format(joint='frictionloss="0.7" damping="0.2" stiffness="3" springref="1"')
    )
    arm = load_arm(str(tmp_path / "arm.xml"))
    rest = Motion(np.array([[1.0]]), np.zeros((1, 1)), np.zeros((1, 1)))
    bent = Motion(np.array([[1.5]]), np.array([[-2.0]]), np.zeros((1, 1)))
    weight = -9.81 * 0.2 * np.cos([1.0, 1.5])
    assert drive_torque(arm, rest)[0, 0] == pytest.approx(weight[0])
    assert drive_torque(arm, bent)[0, 0] == pytest.approx(weight[1] - 0.7 - 0.4 + 1.5)
