"""Distances of arms from themselves, floors and boxes: cases that a person can check, and bounds on random poses."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from problem.arm import Arm, Joint, body_points
from problem.collision import ArmShape, Surroundings, arm_shape
from problem.robot_file import load_arm
from problem.transforms import rotation_x, translation

RADIUS = 0.05
LEVEL = rotation_x(-np.pi / 2)  # the axis of a joint that lifts a link along x


def lifting_arm() -> Arm:
    """Three links of half a metre in a vertical plane, from a shoulder 1 m above the base."""
    shoulder = Joint("shoulder", "revolute", translation(0, 0, 1) @ LEVEL, translation(0.5, 0, 0))
    others = (Joint(name, "revolute", np.eye(4), translation(0.5, 0, 0)) for name in ("elbow", "wrist"))
    return Arm("lifting", (shoulder, *others))


def shape_of(arm: Arm, robot: str = "none", **around: Any) -> ArmShape:
    limits = tuple(joint.limits for joint in arm.joints)
    return arm_shape(arm, robot, Surroundings(**around), limits, RADIUS)


def distance(shape: ArmShape, first: str, second: str, pose: list[float]) -> float:
    names = [pair.names for pair in shape.pairs]
    return float(shape.distances(np.array([pose]))[0, names.index((first, second))])


def link(name: str) -> str:
    return f"the link of {name}"


def test_links_of_a_level_arm_are_as_far_above_the_floor_as_its_shoulder_less_the_radius() -> None:
    shape = shape_of(lifting_arm(), floor=0.25)
    assert distance(shape, "the floor", link("wrist"), [0, 0, 0]) == pytest.approx(1 - 0.25 - RADIUS)


def test_a_hanging_arm_is_deep_in_the_floor() -> None:
    shape = shape_of(lifting_arm(), floor=0.0)
    assert distance(shape, "the floor", link("wrist"), [np.pi / 2, 0, 0]) == pytest.approx(-0.5 - RADIUS)


def test_the_distance_from_a_box_is_that_of_its_nearest_face() -> None:
    shape = shape_of(lifting_arm(), boxes=(((1.0, -0.1, 0.0), (1.4, 0.1, 0.8)),))
    assert distance(shape, "box 1", link("wrist"), [0, 0, 0]) == pytest.approx(0.2 - RADIUS)
    assert distance(shape, "box 1", link("wrist"), [np.pi / 4, 0, 0]) < 0


def test_a_folded_arm_runs_into_itself() -> None:
    shape = shape_of(lifting_arm())
    assert distance(shape, link("shoulder"), link("wrist"), [0, 0, 0]) == pytest.approx(0.5 - 2 * RADIUS)
    assert distance(shape, link("shoulder"), link("wrist"), [0, 2.6, 2.6]) < 0


def test_neighbouring_links_are_no_pair() -> None:
    names = {pair.names for pair in shape_of(lifting_arm()).pairs}
    assert names == {("the base", link("elbow")), ("the base", link("wrist")), (link("shoulder"), link("wrist"))}


def test_the_first_link_of_a_turning_base_is_not_held_against_the_floor_that_it_stands_on() -> None:
    arm = load_arm("irb120")
    shape = arm_shape(arm, "irb120", Surroundings(floor=0.0), tuple(joint.limits for joint in arm.joints))
    against_floor = [pair.names[1] for pair in shape.pairs if pair.kind == "the floor"]
    assert against_floor == [link(joint.name) for joint in arm.joints[1:]]


@pytest.mark.parametrize("robot", ["irb120", "lbr-iiwa-14", "kuka-kr300"])
def test_the_frames_of_the_capsules_are_those_of_the_arm(robot: str) -> None:
    arm = load_arm(robot)
    pose = np.random.default_rng(1).uniform(-1, 1, len(arm))
    shape = arm_shape(arm, robot, Surroundings(floor=-5.0), tuple(joint.limits for joint in arm.joints))
    shape.distances(pose[None])
    frames = [np.eye(4)]
    for joint, place in zip(arm.joints, pose, strict=True):
        frames.append(frames[-1] @ joint.pose(float(place)))
    anchors = [(frame @ joint.before)[:3, 3] for frame, joint in zip(frames, arm.joints, strict=False)]
    np.testing.assert_allclose(shape.data.xanchor, anchors, atol=1e-9)
    np.testing.assert_allclose([frame[:3, 3] for frame in frames[1:]], body_points(arm, pose, np.zeros(3))[:-1])


@pytest.mark.parametrize("robot", ["irb120", "lbr-iiwa-14"])
def test_no_distance_changes_by_more_than_the_reach_of_its_joints(robot: str) -> None:
    arm, rng = load_arm(robot), np.random.default_rng(2)
    around = Surroundings(0.0, (((0.3, -0.2, 0.0), (0.5, 0.2, 0.4)),))
    shape = arm_shape(arm, robot, around, tuple(joint.limits for joint in arm.joints))
    first = rng.uniform(-1.5, 1.5, (150, len(arm)))
    second = first + rng.uniform(-0.3, 0.3, first.shape)
    change = np.abs(shape.distances(first) - shape.distances(second))
    assert np.all(change <= np.abs(second - first) @ shape.reach.T + 1e-9)


def test_what_is_given_for_parts_far_apart_is_a_lower_bound() -> None:
    shape, poses = shape_of(lifting_arm(), floor=-0.2), np.random.default_rng(3).uniform(-2, 2, (100, 3))
    exact, bounds = shape.distances(poses), shape.distances(poses, close=0.05)
    assert np.all(bounds <= exact + 1e-9)
    assert np.any(bounds < exact - 0.01)
    assert np.array_equal(bounds[exact < 0.0], exact[exact < 0.0])


MJCF = """<mujoco><worldbody>
<geom name="column" type="box" size=".05 .05 .5" pos="0 0 .5"/>
<body name="upper" pos="0 0 1"><joint name="a" axis="0 1 0" range="-180 180"/>
<geom type="capsule" size=".05" fromto="0.1 0 0 .5 0 0" mass="1"/>
<geom type="sphere" size=".4" contype="0" conaffinity="0" mass="1"/>
<body name="fore" pos=".5 0 0"><joint name="b" axis="0 1 0" range="-180 180"/>
<geom type="box" size=".25 .02 .03" pos=".25 0 0" mass="1"/></body></body></worldbody></mujoco>"""


def test_geometry_of_an_mjcf_is_what_collides_and_nothing_that_is_only_seen(tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    path.write_text(MJCF)
    shape = shape_of(load_arm(str(path)), str(path), floor=0.0)
    assert shape.words == "the collision geometry of arm.xml, meshes as their convex hulls"
    assert distance(shape, "the floor", "fore", [0, 0]) == pytest.approx(0.97)
    assert distance(shape, "the base", "fore", [0, 0]) == pytest.approx(0.45)
    assert distance(shape, "the base", "fore", [np.pi / 2, np.pi / 2]) < 0


def test_a_joint_with_a_reference_position_stands_where_the_file_counts_it(tmp_path: Path) -> None:
    joint = '<joint name="a"'
    assert joint in MJCF
    path = tmp_path / "arm.xml"
    path.write_text(MJCF.replace(joint, f'{joint} ref="-90"'))
    shape = shape_of(load_arm(str(path)), str(path), floor=0.0)
    assert distance(shape, "the floor", "fore", [-np.pi / 2, 0]) == pytest.approx(0.97)


URDF = """<robot name="two"><link name="base"/><link name="upper">{geometry}</link><link name="fore">{geometry}</link>
<joint name="a" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 1"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" velocity="1" effort="9"/></joint>
<joint name="b" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz=".5 0 0"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" velocity="1" effort="9"/></joint></robot>"""
BAR = '<collision><origin xyz=".25 0 0"/><geometry><box size=".5 .04 .06"/></geometry></collision>'
MESH = '<collision><geometry><mesh filename="package://two/meshes/bar.stl"/></geometry></collision>'


def test_geometry_of_a_urdf_counts_even_without_inertias(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(URDF.format(geometry=BAR))
    shape = shape_of(load_arm(str(path)), str(path), floor=0.0)
    assert distance(shape, "the floor", "fore", [0, 0]) == pytest.approx(0.97)


def test_where_meshes_are_not_at_hand_capsules_stand_for_the_arm_and_it_is_said(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(URDF.format(geometry=MESH))
    shape = shape_of(load_arm(str(path)), str(path), floor=0.0)
    assert shape.words.startswith("capsules of 0.05 m radius from joint to joint (MuJoCo cannot read the geometry")
    assert "bar.stl" in shape.words
    assert "\n" not in shape.words
