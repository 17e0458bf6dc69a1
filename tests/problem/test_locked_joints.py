"""Robot files with grippers and several arms: one arm is taken, with the torques of the whole with locked joints."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from gripper_robots import GRIPPER_MJCF, GRIPPER_URDF
from refusals import refusal

from armlab.cli.main import main
from armlab.common.errors import UndecidedError
from problem.arm import link_poses
from problem.kinematic_tree import Follower, KinematicTree, TreeJoint
from problem.locked_joints import lock_joints, parse_locks
from problem.motion import Motion
from problem.regressor import rigid_body_torque
from problem.robot_file import load_arm


@pytest.fixture
def urdf(tmp_path: Path) -> Path:
    path = tmp_path / "toy.urdf"
    path.write_text(GRIPPER_URDF)
    return path


@pytest.fixture
def mjcf(tmp_path: Path) -> Path:
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    path = tmp_path / "toy.xml"
    path.write_text(GRIPPER_MJCF)
    return path


def some_motion(joints: int) -> Motion:
    generator = np.random.default_rng(0)
    return Motion(*(generator.uniform(-1, 1, (20, joints)) for _ in range(3)))


def test_the_torques_of_a_locked_urdf_are_those_of_pinocchios_reduced_model(urdf: Path, tmp_path: Path) -> None:
    pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed")
    whole = pin.buildModelFromUrdf(str(urdf))
    still = pin.neutral(whole)
    for name, position in {"finger1": 0.03, "finger2": 0.6}.items():
        still[whole.joints[whole.getJointId(name)].idx_q] = position
    reduced = pin.buildReducedModel(whole, [whole.getJointId("finger1"), whole.getJointId("finger2")], still)
    arm, motion = lock_joints(urdf, "hand", {"finger1": 0.03}, tmp_path).arm, some_motion(3)
    theirs = [pin.rnea(reduced, reduced.createData(), *state) for state in zip(*vars(motion).values(), strict=True)]
    np.testing.assert_allclose(rigid_body_torque(arm, motion), theirs, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("angle", [np.pi / 2, -np.pi / 2, 0.3])
def test_a_joint_locked_at_a_quarter_turn_stands_there(tmp_path: Path, angle: float) -> None:
    """Angles about fixed axes are not unique there."""
    path = tmp_path / "toy.urdf"
    path.write_text(GRIPPER_URDF.replace('rpy="0.1 0.2 0.3"', 'rpy="0.1 0 0"').replace('xyz="0 1 1"', 'xyz="0 1 0"'))
    arm = lock_joints(path, "hand", {"joint2": angle}, tmp_path).arm
    whole = lock_joints(path, "hand", {}, tmp_path).arm
    for position in some_motion(2).position:
        one, other = link_poses(arm, position), link_poses(whole, np.array([position[0], angle, position[1]]))
        np.testing.assert_allclose(one[1], other[2], atol=1e-12)


def test_the_torques_of_a_locked_mjcf_are_those_of_mujoco_with_still_fingers(mjcf: Path, tmp_path: Path) -> None:
    import mujoco

    locked, motion = lock_joints(mjcf, "hand", {"finger1": 0.3}, tmp_path), some_motion(2)
    assert locked.positions == pytest.approx({"finger1": 0.3, "finger2": 0.02 + 0.5 * (0.3 - 0.1)})
    model = mujoco.MjModel.from_xml_path(str(mjcf))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data, theirs = mujoco.MjData(model), []
    for position, velocity, acceleration in zip(*vars(motion).values(), strict=True):
        data.qpos[:] = [*position, *locked.positions.values()]
        data.qvel[:], data.qacc[:] = [*velocity, 0, 0], [*acceleration, 0, 0]
        mujoco.mj_inverse(model, data)
        theirs.append(data.qfrc_inverse[:2].copy())
    np.testing.assert_allclose(rigid_body_torque(locked.arm, motion), theirs, rtol=1e-5, atol=1e-5)


def test_what_names_a_locked_joint_goes_and_the_rest_stays(urdf: Path, mjcf: Path, tmp_path: Path) -> None:
    text = lock_joints(urdf, "hand", {}, tmp_path).document
    assert "by hand" in text
    assert "<transmission" not in text
    assert [line.strip() for line in text.splitlines() if "<joint name" in line][-1] == '<joint name="joint1" />'
    text = lock_joints(mjcf, "hand", {}, tmp_path).document
    assert all(
        word in text for word in ('<general name="finger1" joint="joint1"/>', '<actuatorfrc actuator="finger1"/>')
    )
    assert not any(word in text for word in ("split", "close", "equality", "jointpos", "home"))


def test_the_written_file_is_the_arm_and_its_meshes_are_found(urdf: Path, tmp_path: Path) -> None:
    urdf.write_text(GRIPPER_URDF.replace("</robot>", '<x filename="m/a.stl"/><x filename="package://b.stl"/></robot>'))
    new = tmp_path / "elsewhere" / "arm.urdf"
    new.parent.mkdir()
    result = CliRunner().invoke(
        main, ["model", "lock-joints", str(urdf), str(new), "--tip", "hand", "--lock", "finger2=0.2"]
    )
    assert result.exit_code == 0, result.output
    assert "3 moving joints; locked: finger2 at 0.2, finger1 at 0.01" in result.output
    assert all(word in new.read_text() for word in ('"../m/a.stl"', '"package://b.stl"'))
    arm, motion = load_arm(str(new)), some_motion(3)
    expected = lock_joints(urdf, "hand", {"finger1": 0.01}, tmp_path).arm
    np.testing.assert_allclose(rigid_body_torque(arm, motion), rigid_body_torque(expected, motion))
    again = CliRunner().invoke(main, ["model", "lock-joints", str(urdf), str(new), "--tip", "hand"])
    assert again.exit_code == 2
    assert "is there already: choose another name" in again.output


@pytest.mark.parametrize(
    ("tip", "locks", "message"),
    [
        ("han", {}, "no link 'han': did you mean 'hand'?"),
        ("link0", {}, "--tip link0: no moving joint of"),
        ("hand", {"finger": 0.0}, "no moving joint 'finger': did you mean 'finger2'?"),
        ("hand", {"finger2": 2.0}, "--lock finger1=0.1 should lie within the joint's limits, 0 to 0.04"),
        ("hand", {"finger1": 2.0}, "--lock finger1=2 should lie within the joint's limits, 0 to 0.04"),
        (None, {"joint3": 0.0}, "joint 'finger2': a second branch of moving joints"),
    ],
)
def test_a_wrong_tip_or_lock_is_refused(
    urdf: Path, tmp_path: Path, tip: str | None, locks: dict[str, float], message: str
) -> None:
    assert message in refusal(lock_joints, urdf, tip, locks, tmp_path)


def test_positions_are_numbers_given_once() -> None:
    assert parse_locks(("a=0.5", "b=c=-1")) == {"a": 0.5, "b=c": -1.0}
    for texts in (("a",), ("a=x",), ("=1",), ("a=nan",)):
        assert "should be JOINT=VALUE with a number" in refusal(parse_locks, texts)
    assert "names 'a' twice" in refusal(parse_locks, ("a=1", "a=2"))


def chain(names: str, start: str, prefix: str, follows: str | None = None) -> Sequence[TreeJoint]:
    links = [start, *(f"{prefix}{number}" for number in range(1, len(names) + 1))]
    follower = Follower(follows) if follows else None
    joints = zip(names, links[:-1], links[1:], strict=True)
    return [TreeJoint(prefix + name, parent, child, follows=follower) for name, parent, child in joints]


@pytest.mark.parametrize(
    ("joints", "ends"),
    [
        (chain("abcdef", "base", "arm"), {"arm6": 6}),
        ([*chain("abcdefg", "base", "arm"), *chain("a", "arm7", "f"), *chain("a", "arm7", "g", "fa")], {"arm7": 7}),
        ([*chain("abcdef", "base", "arm"), *chain("ab", "arm6", "f", "arma")], {"arm6": 6}),
        (
            [*chain("a", "base", "t"), *chain("abc", "t1", "left"), *chain("ab", "t1", "right")],
            {"left3": 4, "right2": 3},
        ),
        (chain("ab", "base", "f", "fa"), {}),
    ],
    ids=["a chain", "two fingers", "fingers that follow", "a torso with two arms", "followers alone"],
)
def test_an_arm_ends_where_several_branches_move(joints: Sequence[TreeJoint], ends: dict[str, int]) -> None:
    assert KinematicTree("robot", tuple(joints)).ends == ends


def test_a_robot_with_a_gripper_is_refused_with_the_link_where_its_arm_ends(urdf: Path, mjcf: Path) -> None:
    for path, joints in ((urdf, 3), (mjcf, 2)):
        with pytest.raises(UndecidedError) as raised:
            load_arm(str(path))
        assert f"locked: hand ({joints} joints)" in str(raised.value)
        assert raised.value.choices == ("hand",)


def test_an_mjcf_that_is_not_locked_keeps_its_text_and_finds_its_files_from_another_folder(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    own, new = tmp_path / "own", tmp_path / "new"
    (own / "parts" / "shapes").mkdir(parents=True)
    new.mkdir()
    corners = "\n".join(f"v {x} {y} {z}" for x in (0, 1) for y in (0, 1) for z in (0, 1))
    (own / "parts" / "shapes" / "cube.obj").write_text(corners + "\nf 1 2 3\nf 5 6 7\nf 2 4 8\n")
    (own / "parts" / "inner.xml").write_text('<x><geom name="inner" type="mesh" mesh="cube" mass="0.123456789"/></x>')
    (own / "parts" / "outer.xml").write_text('<x><!-- outer --><joint/><include file="parts/inner.xml"/></x>')
    (own / "arm.xml").write_text(
        '<mujoco><compiler assetdir="parts"/><!-- -- ours -- --><compiler meshdir="parts/shapes"/>'
        '<asset><mesh file="cube.obj"/></asset>'
        '<worldbody><body><include file="parts/outer.xml"/></body></worldbody></mujoco>'
    )
    locked = lock_joints(own / "arm.xml", None, {}, new)
    assert all(word in locked.document for word in ("<!-- -- ours -- -->", "<!-- outer -->", "0.123456789"))
    (new / "arm.xml").write_text(locked.text("unused"))
    read = [mujoco.MjModel.from_xml_path(str(folder / "arm.xml")) for folder in (own, new)]
    np.testing.assert_array_equal(read[0].body_inertia, read[1].body_inertia)
    assert read[1].nmesh == 1
