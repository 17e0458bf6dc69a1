"""Joints that follow others inside the chain: q_all = C q + b and tau = C' tau_all, beside two engines."""

from pathlib import Path

import numpy as np
import pytest
from refusals import refusal
from robot_file_table import FILES

from problem.arm import Arm, link_poses
from problem.drive_torque import drive_torque
from problem.excitation import ExcitationProblem
from problem.locked_joints import lock_joints
from problem.motion import Motion
from problem.regressor import (
    coupled_links_torque,
    extended_gram_matrix,
    inertia_column,
    observation_matrix,
    rigid_body_torque,
)
from problem.robot_file import load_arm
from problem.simulator_check import random_states

TELESCOPE = """<robot name="t"><link name="base"/>
<link name="s1"><inertial><mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<link name="s2"><inertial><mass value="3"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="first" type="prismatic"><parent link="base"/><child link="s1"/><axis xyz="0 0 1"/>
<dynamics damping="5" friction="7"/></joint>
<joint name="second" type="prismatic"><parent link="s1"/><child link="s2"/><axis xyz="0 0 1"/>
<mimic joint="{leader}" multiplier="-2" offset="0.1"/><dynamics damping="1" friction="2"/></joint></robot>"""
CHAIN = """<mujoco><worldbody><body name="x"><joint name="a" axis="0 1 0"/>{inertial}
<body name="y" pos=".3 0 0"><joint name="b" axis="0 1 0"/>{inertial}
<body name="z" pos=".3 0 0"><joint name="c" axis="0 1 0"/>{inertial}</body></body></body></worldbody>
<tendon><fixed name="t"><joint joint="a" coef="1"/></fixed></tendon><equality>{equality}</equality></mujoco>"""
INERTIAL = '<inertial mass="1" pos=".1 0 0" diaginertia=".01 .02 .02"/>'


@pytest.fixture(params=["coupled_wrist.xml", "telescope_that_mimics.urdf"])
def arm(request: pytest.FixtureRequest) -> Arm:
    return load_arm(str(FILES / request.param))


def test_a_telescope_needs_the_force_that_a_person_computes(tmp_path: Path) -> None:
    (tmp_path / "t.urdf").write_text(TELESCOPE.format(leader="first"))
    arm = load_arm(str(tmp_path / "t.urdf"))
    q, qd, qdd = 0.3, -0.5, 2.0
    # the second stage is at q + (0.1 - 2 q): it moves by -qd, its joint by -2 qd
    force = (2 + 3) * qdd + (2 - 3) * 9.81 + (5 + 4 * 1) * qd + (7 + 2 * 2) * np.sign(qd)
    motion = Motion(*(np.array([[value]]) for value in (q, qd, qdd)))
    assert [joint.name for joint in arm.joints] == ["first"]
    assert drive_torque(arm, motion)[0, 0] == pytest.approx(force)
    assert link_poses(arm.chain, arm.coupling[0] @ [q] + arm.coupling[1])[1][2, 3] == pytest.approx(0.1 - q)


def test_columns_sums_and_inertia_belong_to_the_same_torque(arm: Arm) -> None:
    motion = random_states(arm, np.random.default_rng(0))
    columns, joints = np.arange(0, 10 * len(arm), 3), len(arm)
    matrix = observation_matrix(arm, motion)
    torque = rigid_body_torque(arm, motion)
    np.testing.assert_allclose(
        (matrix @ arm.parameters).reshape(-1, joints) + coupled_links_torque(arm, motion), torque, atol=1e-9
    )
    own = motion.velocity[:, :, None]
    whole = np.hstack([matrix[:, columns], (own * np.eye(joints)).reshape(-1, joints)])
    np.testing.assert_allclose(extended_gram_matrix(arm, motion, columns, own), whole.T @ whole, rtol=1e-9, atol=1e-9)
    pushed = Motion(motion.position, motion.velocity, motion.acceleration + np.eye(joints)[1])
    column = inertia_column(arm, motion.position, 1)
    np.testing.assert_allclose(rigid_body_torque(arm, pushed) - torque, column, atol=1e-8)


def test_a_link_loads_no_joint_behind_it(arm: Arm) -> None:
    motion = random_states(arm, np.random.default_rng(1))
    blocks = observation_matrix(arm, motion).reshape(motion.samples, len(arm), len(arm), 10)
    for link in range(len(arm)):
        assert not np.any(blocks[:, link + 1 :, link])


def test_mimic_joints_are_those_of_pinocchio() -> None:
    pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed")
    path = FILES / "telescope_that_mimics.urdf"
    arm, model = load_arm(str(path)), pin.buildModelFromUrdf(str(path), mimic=True)
    data, motion = model.createData(), random_states(arm, np.random.default_rng(2))
    assert [name for name in model.names if name in {joint.name for joint in arm.joints}] == [
        "lift",
        "shoulder",
        "wrist",
    ]
    torque = rigid_body_torque(arm, motion)
    for row, (q, qd, qdd) in enumerate(zip(motion.position, motion.velocity, motion.acceleration, strict=True)):
        turning = np.array([q[0], q[1], np.cos(q[2]), np.sin(q[2])])  # a continuous joint
        np.testing.assert_allclose(torque[row], pin.rnea(model, data, turning, qd, qdd), atol=1e-9)


def test_equality_constraints_are_those_with_which_mujoco_simulates() -> None:
    """MuJoCo's constrained dynamics, whose constraint gives way a little: its forces do no work on the coupling."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    stiff = 'solref="0.0005 1" solimp="0.999999 0.999999 0.001 0.5 2"'
    text = (FILES / "coupled_wrist.xml").read_text().replace('polycoef="', f'{stiff} polycoef="')
    model = mujoco.MjModel.from_xml_string(text.replace('frictionloss="0.', 'user="0.'))
    arm, data, rng = load_arm(str(FILES / "coupled_wrist.xml")), mujoco.MjData(model), np.random.default_rng(3)
    model.opt.timestep, (matrix, start) = 1e-4, arm.coupling
    for _ in range(10):
        position, velocity, torque = rng.uniform(-1, 1, (3, len(arm)))
        data.qpos, data.qvel = matrix @ position + start, matrix @ velocity
        data.qfrc_applied[list(arm.chain_places)] = 9 * torque
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(matrix.T @ data.qfrc_constraint, 0, atol=1e-9)
        acceleration = np.linalg.lstsq(matrix, data.qacc)[0]
        state = Motion(*(each[None] for each in (position, velocity, acceleration)))
        friction = [law.friction for law in arm.joint_laws] * np.sign(velocity)
        np.testing.assert_allclose(drive_torque(arm, state)[0] - friction, 9 * torque, atol=0.05)


@pytest.mark.parametrize(
    ("equality", "reason"),
    [
        ('<tendon tendon1="t"/>', "only joints may be coupled"),
        ('<joint joint1="b" polycoef="0.3 0 0 0 0"/>', "it holds joint 'b' still"),
        ('<joint joint1="c" joint2="b" polycoef="0 1 2 0 0"/>', "joint 'c' follows a curve"),
        ('<joint joint1="c" joint2="b"/><joint joint1="c" joint2="a"/>', "joint 'c' follows two joints"),
        ('<connect body1="z" body2="x" anchor="0 0 0"/>', "closed chains are not supported"),
    ],
)
def test_couplings_that_are_no_line_to_a_joint_before_are_refused_in_one_line(
    tmp_path: Path, equality: str, reason: str
) -> None:
    (tmp_path / "arm.xml").write_text(CHAIN.format(inertial=INERTIAL, equality=equality))
    assert reason in refusal(load_arm, str(tmp_path / "arm.xml"))


def test_a_mimic_joint_without_its_leader_is_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "t.urdf").write_text(TELESCOPE.format(leader="third"))
    assert "'second' follows 'third', which is no moving joint before it" in refusal(load_arm, str(tmp_path / "t.urdf"))


def test_a_joint_that_follows_a_follower_follows_its_leader(tmp_path: Path) -> None:
    two = '<joint joint1="b" joint2="a" polycoef="0.1 2 0 0 0"/><joint joint1="c" joint2="b" polycoef="0.2 -3 0 0 0"/>'
    (tmp_path / "arm.xml").write_text(CHAIN.format(inertial=INERTIAL, equality=two))
    arm = load_arm(str(tmp_path / "arm.xml"))
    assert [joint.name for joint in arm.joints] == ["a"]
    assert [(each.multiplier, each.offset) for each in arm.coupled] == [
        (2.0, 0.1),
        (-6.0, pytest.approx(0.2 - 3 * 0.1)),
    ]


def test_where_a_constraint_names_the_joint_in_front_first_the_one_behind_follows(tmp_path: Path) -> None:
    line = '<joint joint1="a" joint2="c" polycoef="0.1 -2 0 0 0"/>'
    (tmp_path / "arm.xml").write_text(CHAIN.format(inertial=INERTIAL, equality=line))
    arm = load_arm(str(tmp_path / "arm.xml"))
    assert [joint.name for joint in arm.joints] == ["a", "b"]
    assert (arm.coupled[0].multiplier, arm.coupled[0].offset) == (-0.5, pytest.approx(0.05))


def test_a_switched_off_constraint_leaves_its_joints_free(tmp_path: Path) -> None:
    off = '<joint joint1="b" joint2="a" active="false"/>'
    (tmp_path / "arm.xml").write_text(CHAIN.format(inertial=INERTIAL, equality=off))
    assert len(load_arm(str(tmp_path / "arm.xml"))) == 3


def test_a_locked_leader_locks_what_follows_it(tmp_path: Path) -> None:
    locked = lock_joints(FILES / "telescope_that_mimics.urdf", None, {"lift": 0.2}, tmp_path)
    assert locked.positions == {"lift": 0.2, "second_stage": 0.2}
    assert [joint.name for joint in locked.arm.joints] == ["shoulder", "wrist"]


def test_a_branch_that_moves_with_the_arm_is_refused_by_name_and_can_be_held_still(tmp_path: Path) -> None:
    rod = """<link name="rod"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>
</inertial></link><joint name="rod_joint" type="revolute"><parent link="stage2"/><child link="rod"/>
<axis xyz="0 1 0"/><mimic joint="shoulder"/></joint></robot>"""
    path = tmp_path / "arm.urdf"
    path.write_text((FILES / "telescope_that_mimics.urdf").read_text().replace("</robot>", rod))
    assert "joint 'rod_joint', beside the way to tool, moves with 'shoulder'" in refusal(
        lock_joints, path, "tool", {}, tmp_path
    )
    assert len(lock_joints(path, "tool", {"rod_joint": 0.1}, tmp_path).arm) == 3


def test_excitation_problems_refuse_coupled_joints_by_name(arm: Arm) -> None:
    names = [each.joint.name for each in arm.coupled]
    given: dict[str, object] = dict.fromkeys(
        ("base", "trajectory", "duration", "samples", "constraints", "criterion", "penalty"), None
    )
    message = refusal(ExcitationProblem, "p", arm, **given)
    assert f"joint '{names[0]}' follows" in message
    assert "an excitation problem cannot have" in message
