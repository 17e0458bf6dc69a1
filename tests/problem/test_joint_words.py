"""Joints in words: by the name that the robot file gives them."""

from dataclasses import replace

import pytest

from problem.arm import Arm
from problem.joint_words import joint_at_start, joint_in_table, joint_in_words, joints_in_words, links_in_words
from problem.presets import load_arm


def arm_with(*names: str) -> Arm:
    """Three joints with these names."""
    arm = load_arm("irb120-arm")
    return replace(arm, joints=tuple(replace(one, name=name) for one, name in zip(arm.joints, names, strict=True)))


NAMED = arm_with("shoulder_pan", "shoulder_lift", "joint_3")


@pytest.mark.parametrize("name", ["joint2", "joint_2", "Joint 2", "joint-02", "2"])
def test_a_name_that_is_no_more_than_the_number_is_written_as_joint_and_number(name: str) -> None:
    assert joint_in_words(arm_with("a", name, "c"), 2) == "joint 2"
    assert joint_at_start(arm_with("a", name, "c"), 2) == "Joint 2"
    assert joint_in_table(arm_with("a", name, "c"), 2) == "2"


@pytest.mark.parametrize("name", ["shoulder_lift", "joint_1", "joint3", "panda_joint2", "J2", "joint", ""])
def test_every_other_name_stands_as_the_robot_file_has_it(name: str) -> None:
    assert joint_in_words(arm_with("a", name, "c"), 2) == joint_at_start(arm_with("a", name, "c"), 2) == name


def test_several_joints_and_links_are_a_list_of_names_or_numbers() -> None:
    bare = load_arm("irb120-arm")
    assert joints_in_words(bare, [1, 3]) == "joints 1 and 3"
    assert joints_in_words(NAMED, [1, 2, 3]) == "all 3 joints"
    assert links_in_words(bare, [3, 2, 1]) == "all 3 links"
    pair = replace(bare, joints=bare.joints[:2], links=None)
    assert joints_in_words(pair, [1, 2]) == "both joints"
    assert links_in_words(pair, [2, 1]) == "both links"
    assert links_in_words(bare, [2]) == "link 2"
    assert links_in_words(bare, [1, 3]) == "links 1 and 3"
    assert joints_in_words(NAMED, [1, 3]) == "shoulder_pan and joint 3"
    assert links_in_words(NAMED, [2]) == "the link of shoulder_lift"
    assert links_in_words(NAMED, [1, 2]) == "the links of shoulder_pan and shoulder_lift"


def test_a_table_has_the_number_that_equations_use_beside_the_name() -> None:
    assert joint_in_table(NAMED, 2) == "2\N{NO-BREAK SPACE}shoulder_lift"
