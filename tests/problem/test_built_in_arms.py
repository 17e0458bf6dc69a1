"""The built-in arms against their sources, and the arithmetic of inertias that brought them into their frames."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from shipped_schemas import check_against_schema

from armlab.common.arrays import Array
from armlab.common.settings import read_yaml
from problem.arm import Link, link_poses
from problem.pseudo_inertia import (
    link_from_centre_of_mass,
    link_from_pseudo_inertia,
    pseudo_inertia_of,
    transform_pseudo_inertia,
)
from problem.robot_file import BUILT_IN_FOLDER, built_in_arms, load_arm
from problem.transforms import inverse, translation

BY_HAND = ("irb120-arm", "irb120-arm-eq49", "irb120")

Row = tuple[float, tuple[float, float, float], tuple[float, float, float]]
# Eq. 49-53, in kg, kg mm and kg mm2, with the scattered digits of eq. 52 and 53 put back in place.
EQ49 = [
    (5.029912009, (4.3956, -15.8576, 10.1804), (20975.4835, 13651.6206, 19154.2091)),
    (4.530794148, (-44.1094, 93.9465, 183.7506), (103901.5055, 79173.3916, 30809.7396)),
    (3.056783430, (0.37299, 0.001086, 100.6463), (9855.9631, 9759.0, 7360.3570)),
]
# Table 4's ideal values of links 2 and 3, in the same units.
TABLE4 = [EQ49[0], (4.0, (350.0, 0.0, 0.0), (103901, 79173, 30809)), (3.0, (60.0, 0.0, 0.0), (9855, 9759, 7360))]
# ROS-Industrial abb_experimental, irb120_3_58_macro.xacro: mass, centre of mass, Ixx Ixy Ixz Iyy Iyz Izz about it.
URDF = [
    (1.328, (0.2247, 0.00015, 0.00041), (0.00284661, -2.12765e-05, -1.6435e-05, 0.00401346, 1.31336e-05, 0.0052535)),
    (
        0.546,
        (-0.00109, 3.68e-05, 6.22e-05),
        (0.000404891, 1.61943e-06, 8.46805e-07, 0.000892825, -1.51792e-08, 0.000815468),
    ),
    (0.137, (-0.00706, -0.00017, -1.32e-06), (0.001, 0.0, 0.0, 0.001, 0.0, 0.001)),
]
URDF_ORIGINS = [(0.0, 0.0, 0.63), (0.302, 0.0, 0.63), (0.374, 0.0, 0.63)]  # of links 4-6, axes as the base's, at zero


def about_the_frame(mass: float, moment: tuple[float, ...], diagonal: tuple[float, ...]) -> Link:
    """Eq. 17 by hand: inertia about the centre of mass, moved to the link's frame."""
    x, y, z = (component * 1e-3 / mass for component in moment)
    xx, yy, zz = (entry * 1e-6 for entry in diagonal)
    inertia = (
        xx + mass * (y * y + z * z),
        yy + mass * (x * x + z * z),
        zz + mass * (x * x + y * y),
        -mass * x * y,
        -mass * x * z,
        -mass * y * z,
    )
    return Link(mass, (x * mass, y * mass, z * mass), inertia)


def links(name: str) -> tuple[Link, ...]:
    found = load_arm(name).links
    assert found is not None
    return found


@pytest.mark.parametrize(("name", "source"), [("irb120-arm", TABLE4), ("irb120-arm-eq49", EQ49), ("irb120", TABLE4)])
def test_links_1_to_3_carry_the_papers_values_moved_to_the_frame_by_eq_17(name: str, source: list[Row]) -> None:
    for link, row in zip(links(name), source, strict=False):
        assert_allclose(link.parameters, about_the_frame(*row).parameters, rtol=1e-11, atol=1e-15)


def test_links_4_to_6_carry_the_ros_industrial_values_turned_into_the_dh_frames() -> None:
    poses = link_poses(load_arm("irb120"), np.zeros(6))[3:]
    for link, pose, origin, (mass, centre, entries) in zip(links("irb120")[3:], poses, URDF_ORIGINS, URDF, strict=True):
        xx, xy, xz, yy, yz, zz = entries
        about_mass = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        body = pseudo_inertia_of(link_from_centre_of_mass(mass, np.array(centre), about_mass))
        expected = link_from_pseudo_inertia(transform_pseudo_inertia(body, inverse(pose) @ translation(*origin)))
        assert_allclose(link.parameters, expected.parameters, rtol=1e-9, atol=1e-15)


def test_lengths_and_limits_are_those_of_table_1_and_the_data_sheet() -> None:
    data = read_yaml(BUILT_IN_FOLDER / "irb120.yaml")["joints"]
    assert [(row["a"], row["d"]) for row in data] == [(0, 0.29), (0.27, 0), (0.07, 0), (0, 0.302), (0, 0), (0, 0.072)]
    assert_allclose([row["alpha"] for row in data], np.array([-1, 0, -1, 1, -1, 0]) * np.pi / 2)
    joints = load_arm("irb120").joints
    degrees = np.rad2deg([joint.limits.position for joint in joints])
    assert_allclose(degrees, [(-165, 165), (-110, 110), (-110, 70), (-160, 160), (-120, 120), (-400, 400)], rtol=1e-10)
    assert_allclose(np.rad2deg([joint.limits.velocity for joint in joints]), [250, 250, 250, 320, 320, 420])


def smallest_eigenvalue(link: Link) -> float:
    return float(np.linalg.eigvalsh(pseudo_inertia_of(link))[0])


@pytest.mark.parametrize("name", BY_HAND)
def test_every_link_of_a_built_in_arm_could_exist(name: str) -> None:
    for link in links(name):
        assert smallest_eigenvalue(link) > 0


def test_link_2_of_table_4_could_not_exist_if_its_inertia_were_about_the_frame() -> None:
    assert smallest_eigenvalue(Link(4.0, (0.35, 0.0, 0.0), (0.103901, 0.079173, 0.030809, 0.0, 0.0, 0.0))) < 0


@pytest.mark.parametrize("name", built_in_arms())
def test_every_built_in_arm_loads_and_keeps_the_schema(name: str) -> None:
    data = read_yaml(BUILT_IN_FOLDER / f"{name}.yaml")
    check_against_schema(data, "robot")
    assert load_arm(name).name == name


def test_a_cut_arm_is_the_beginning_of_the_whole_one() -> None:
    arm = load_arm("irb120").first(3)
    assert [joint.name for joint in arm.joints] == ["joint1", "joint2", "joint3"]
    assert_allclose(arm.parameters, load_arm("irb120-arm").parameters)


def test_a_body_moved_there_and_back_is_the_same() -> None:
    link = links("irb120")[3]
    pose = link_poses(load_arm("irb120"), np.full(6, 0.4))[-1]
    there = transform_pseudo_inertia(pseudo_inertia_of(link), pose)
    assert_allclose(
        link_from_pseudo_inertia(transform_pseudo_inertia(there, inverse(pose))).parameters, link.parameters, atol=1e-15
    )


def test_a_pseudo_inertia_is_the_sum_over_point_masses() -> None:
    points, masses = np.array([[1.0, 2.0, 3.0], [-1.0, 0.5, 0.0]]), np.array([2.0, 4.0])
    link = link_from_pseudo_inertia(
        sum(mass * np.outer([*point, 1], [*point, 1]) for mass, point in zip(masses, points, strict=True))
    )
    inertia = sum(
        mass * (point @ point * np.eye(3) - np.outer(point, point)) for mass, point in zip(masses, points, strict=True)
    )
    assert link.mass == 6.0
    assert_allclose(link.first_moment, masses @ points)
    assert_allclose(link.inertia, np.asarray(inertia)[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])


def test_transforms_at_quarter_turns_are_exact() -> None:
    pose: Array = load_arm("irb120").joints[0].after
    assert set(np.unique(pose[:3, :3])) == {-1.0, 0.0, 1.0}
