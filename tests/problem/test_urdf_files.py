"""URDF files: what is read, and each kind of mistake in one clear line."""

from pathlib import Path

import numpy as np
import pytest
from refusals import refusal

from problem.arm import Limits
from problem.robot_file import load_arm


def joint(name: str, kind: str, parent: str, child: str, inside: str = "") -> str:
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>'


def urdf(*joints: str, links: str = "abcd") -> str:
    return "<robot name='r'>" + "".join(f'<link name="{link}"/>' for link in links) + "".join(joints) + "</robot>"


CHAIN = joint("j1", "revolute", "a", "b")
BOMB = '<!DOCTYPE r [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]><robot name="&b;"/>'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            urdf(CHAIN, joint("j2", "revolute", "b", "c", '<mimic joint="j1"/>'), links="abc"),
            "joints follow others, but no link has an inertia",
        ),
        (
            urdf(CHAIN, joint("j2", "revolute", "a", "c"), joint("j3", "revolute", "c", "b"), links="abc"),
            "joint 'j3': link 'b' hangs on two joints; closed chains",
        ),
        (
            urdf(CHAIN, joint("j2", "revolute", "c", "d"), joint("j3", "revolute", "d", "c")),
            "joint 'j2': not reached from link 'a'; closed chains are not supported",
        ),
        (
            urdf(joint("j1", "revolute", "a", "b"), joint("j2", "revolute", "b", "a"), links="ab"),
            "one tree with one root; roots found: []",
        ),
        (urdf(CHAIN, joint("j2", "revolute", "a", "c"), links="abc"), "joint 'j2': a second branch of moving joints"),
        (
            urdf(CHAIN, joint("j2", "revolute", "b", "c"), joint("j3", "prismatic", "b", "d")),
            "joint 'j3': a second branch of moving joints",
        ),
        (
            urdf(joint("j1", "floating", "a", "b"), links="ab"),
            "joint 'j1': type 'floating' is not supported: revolute, continuous, prismatic or fixed",
        ),
        (urdf(joint("j1", "fixed", "a", "b"), links="ab"), "has no moving joint"),
        (urdf(CHAIN, links="abc"), "one tree with one root; roots found: ['a', 'c']"),
        (urdf(joint("j1", "revolute", "a", "z"), links="a"), "joint 'j1': link 'z' does not exist"),
        (
            urdf(joint("j1", "revolute", "a", "b", '<axis xyz="0 0 0"/>'), links="ab"),
            "joint 'j1': axis xyz should not be zero",
        ),
        (
            urdf(joint("j1", "revolute", "a", "b", '<axis xyz="0 1"/>'), links="ab"),
            "joint 'j1': axis xyz='0 1' should hold 3 finite number(s)",
        ),
        (
            urdf(joint("j1", "revolute", "a", "b", '<origin xyz="0 nan 0"/>'), links="ab"),
            "joint 'j1': origin xyz='0 nan 0' should hold 3 finite",
        ),
        (
            urdf(joint("j1", "revolute", "a", "b", '<limit lower="2" upper="1"/>'), links="ab"),
            "joint 'j1': limit lower=2.0 should be below upper=1.0",
        ),
        (
            urdf(joint("j1", "revolute", "a", "b", '<limit velocity="-1"/>'), links="ab"),
            "joint 'j1': limit velocity=-1.0 should not be negative",
        ),
        (
            urdf(CHAIN, links="a").replace(
                "</robot>", '<link name="b"><inertial><mas value="1"/></inertial></link></robot>'
            ),
            "link 'b': inertial/inertia ixx='' should hold 1 finite number(s)",
        ),
        ("<robot", "is not valid XML"),
        ("<sdf/>", "the outermost element should be <robot>, not <sdf>"),
        (BOMB, "too large, or with XML entities"),
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_each_mistake_in_a_urdf_is_told_in_one_line(tmp_path: Path, text: str, message: str, encoding: str) -> None:
    path = tmp_path / "robot.urdf"
    path.write_bytes(text.encode(encoding))
    assert message in refusal(load_arm, str(path))


def test_urdf_limits_are_read_and_a_continuous_joint_has_no_range(tmp_path: Path) -> None:
    limit = '<limit lower="-1" upper="2" velocity="3" effort="4"/>'
    text = urdf(joint("j1", "revolute", "a", "b", limit), joint("j2", "continuous", "b", "c", limit), links="abc")
    (tmp_path / "two.urdf").write_text(text)
    first, second = (joint.limits for joint in load_arm("two.urdf", beside=tmp_path).joints)
    assert (first.position, first.velocity, first.acceleration, first.torque) == ((-1.0, 2.0), 3.0, np.inf, 4.0)
    assert second.position == (-np.inf, np.inf)


def test_limits_of_a_urdf_that_are_left_out_or_zero_are_none(tmp_path: Path) -> None:
    limits = ["", '<limit lower="0" upper="0" velocity="0" effort="0"/>', '<limit effort="0"/>']
    joints = [joint(f"j{n}", "revolute", "abcd"[n], "abcd"[n + 1], limit) for n, limit in enumerate(limits)]
    (tmp_path / "free.urdf").write_text(urdf(*joints))
    assert all(joint.limits == Limits() for joint in load_arm("free.urdf", beside=tmp_path).joints)


def test_a_urdf_without_masses_is_an_arm_without_links(tmp_path: Path) -> None:
    (tmp_path / "bare.urdf").write_text(urdf(CHAIN, links="ab"))
    assert load_arm("bare.urdf", beside=tmp_path).links is None
