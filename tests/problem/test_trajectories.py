"""Excitation trajectories: derivatives, rest, periods, and the paper's path in space."""

import numpy as np
import pytest

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from problem.arm import Arm, body_points, link_poses
from problem.inverse_kinematics import planar_arm
from problem.motion import Motion
from problem.robot_file import load_arm
from problem.trajectories import CartesianFourier, JointFourier, Trajectory, sample_instants, series

ARM = load_arm("irb120-arm")
TOOL = np.array([0.0, 0.0, 0.374])
DURATION = 10.0
# radius 0.3 m about the shoulder, well within reach: a1 a2 a3 b1 b2 b3 c
POINTS = np.array([[0.1, 0.15, 0.05, 0.05, -0.04, 0.03, 0.02], [0.2, 0.1, 0.0, -0.03, 0.02, 0.05, -0.04]])


def joint_fourier(rest: bool = False, duration: float = DURATION) -> JointFourier:
    return JointFourier(duration, 4, np.array([0.1, -0.2]), np.array([1.0, 0.5]), np.array([0.6, 0.9]), rest)


def cartesian(rest: bool = True, elbow_up: bool = True, one_c: bool = True) -> CartesianFourier:
    arm = planar_arm(ARM, TOOL)
    return CartesianFourier(arm, DURATION, 3, (0.0, 0.0, 0.29), 0.2, 0.5, one_c, rest, elbow_up)


def motion_at(trajectory: Trajectory, points: Array, times: Array) -> Motion:
    return trajectory.motions(points, times).motion


def random_points(trajectory: Trajectory, count: int = 3) -> Array:
    return np.random.default_rng(0).uniform(trajectory.lower, trajectory.upper, (count, len(trajectory.lower)))


CASES: dict[str, tuple[Trajectory, Array]] = {
    "joint": (joint_fourier(), random_points(joint_fourier())),
    "joint, rest": (joint_fourier(rest=True), random_points(joint_fourier(rest=True))),
    "Cartesian": (cartesian(), POINTS),
    "Cartesian, elbow down": (cartesian(elbow_up=False), POINTS),
    "Cartesian, literal": (cartesian(rest=False), POINTS),
    "Cartesian, a c for each harmonic": (cartesian(one_c=False), np.column_stack([POINTS, POINTS[:, 3:5]])),
}


@pytest.mark.parametrize(("trajectory", "points"), CASES.values(), ids=CASES.keys())
def test_speeds_and_accelerations_are_the_derivatives(trajectory: Trajectory, points: Array) -> None:
    times, step = np.linspace(0.5, 9.5, 61), 2e-3
    weights = np.array([-1, 9, -45, 0, 45, -9, 1]) / 60  # sixth order
    around = [motion_at(trajectory, points, times + k * step) for k in range(-3, 4)]
    here = around[3]
    # Speeds come from unwrapped positions: a whole series keeps its turn only from its own start.
    slope = sum(w * _unturned(m.position, here.position) for w, m in zip(weights, around, strict=True)) / step
    bend = sum(w * m.velocity for w, m in zip(weights, around, strict=True)) / step
    np.testing.assert_allclose(here.velocity, slope, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(here.acceleration, bend, rtol=1e-8, atol=1e-9)


def _unturned(angle: Array, near: Array) -> Array:
    return angle - 2 * np.pi * np.round((angle - near) / (2 * np.pi))


@pytest.mark.parametrize(
    "name", ["joint, rest", "Cartesian", "Cartesian, elbow down", "Cartesian, a c for each harmonic"]
)
def test_rest_variants_are_at_rest_at_both_ends(name: str) -> None:
    trajectory, points = CASES[name]
    ends = motion_at(trajectory, points, np.array([0.0, DURATION]))
    assert np.abs(ends.velocity).max() < 1e-12
    assert np.abs(ends.acceleration).max() < 1e-12


@pytest.mark.parametrize("name", ["joint", "Cartesian, literal"])
def test_the_other_variants_start_in_motion(name: str) -> None:
    trajectory, points = CASES[name]
    assert np.abs(motion_at(trajectory, points, np.array([0.0])).velocity).max() > 0.01


@pytest.mark.parametrize("rest", [False, True])
def test_a_joint_series_repeats_after_its_duration(rest: bool) -> None:
    trajectory, times = joint_fourier(rest), np.linspace(0, DURATION, 17)
    points = random_points(trajectory)
    one, next_one = (motion_at(trajectory, points, times + shift) for shift in (0.0, DURATION))
    for name in ("position", "velocity", "acceleration"):
        np.testing.assert_allclose(getattr(next_one, name), getattr(one, name), atol=1e-12)


def test_a_joint_series_is_swevers_sum() -> None:
    point = np.array([[0.3, 0.0, 0.0, 0.2, 0.0, 0.5, 0.0, 0.0, 1.0, *np.zeros(9)]])  # a1 a4, b2, q0 of joint 1
    t, w = np.array([0.0, 1.3, 7.7]), 2 * np.pi / DURATION
    motion = motion_at(joint_fourier(), point, t)
    expected = 1.0 + 0.3 * np.sin(w * t) / w + 0.2 * np.sin(4 * w * t) / (4 * w) - 0.5 * np.cos(2 * w * t) / (2 * w)
    np.testing.assert_allclose(motion.position[0, :, 0], expected, rtol=1e-13)
    assert np.all(motion.position[0, :, 1] == 0)


@pytest.mark.parametrize(("joints", "samples"), [(1, 1), (3, 10), (16, 8), (37, 5)])
def test_a_series_is_the_sum_of_its_terms_for_any_number_of_joints_and_samples(joints: int, samples: int) -> None:
    rng = np.random.default_rng(0)
    basis, coefficients = rng.normal(size=(3, samples, 7)), rng.normal(size=(4, joints, 7))
    expected = np.einsum("osk,pjk->opsj", basis, coefficients)
    np.testing.assert_allclose(series(basis, coefficients), expected, rtol=0, atol=1e-14)


def test_the_box_and_the_names_of_a_joint_series_go_joint_by_joint() -> None:
    trajectory = JointFourier(1.0, 1, np.array([0.1, 0.2]), np.array([1.0, 2.0]), np.array([3.0, 4.0]))
    assert trajectory.names == ("a1_1", "b1_1", "q0_1", "a1_2", "b1_2", "q0_2")
    np.testing.assert_allclose(trajectory.lower, [-3, -3, -0.9, -4, -4, -1.8])
    np.testing.assert_allclose(trajectory.upper, [3, 3, 1.1, 4, 4, 2.2])


@pytest.mark.parametrize("trajectory", [joint_fourier(), joint_fourier(rest=True), cartesian(), cartesian(one_c=False)])
def test_every_number_has_a_name_and_bounds(trajectory: Trajectory) -> None:
    assert len(set(trajectory.names)) == len(trajectory.lower) == len(trajectory.upper)


@pytest.mark.parametrize("elbow_up", [True, False])
@pytest.mark.parametrize("rest", [True, False])
def test_the_tool_is_on_the_path(rest: bool, elbow_up: bool) -> None:
    trajectory, times = cartesian(rest, elbow_up), sample_instants(DURATION, 101)
    path = np.stack(trajectory.path(POINTS, times).position, axis=-1)
    excitation = trajectory.motions(POINTS, times)
    tool = body_points(ARM, excitation.motion.position, TOOL)[..., -1, :]
    assert np.all(excitation.overreach == 0)
    np.testing.assert_allclose(tool, path, atol=1e-12)


def test_elbow_up_is_above_elbow_down() -> None:
    times = sample_instants(DURATION, 21)
    up, down = (
        body_points(ARM, motion_at(cartesian(elbow_up=side), POINTS, times).position, TOOL)[..., 1, 2]
        for side in (True, False)
    )
    assert np.all(up > down)


def test_joint_1_turns_once_round_without_a_jump_and_the_others_stay_within_half_a_turn() -> None:
    position = motion_at(cartesian(), POINTS, sample_instants(DURATION, 401)).position
    assert np.abs(np.diff(position[..., 0], axis=1)).max() < 0.2
    np.testing.assert_allclose(position[:, -1, 0] - position[:, 0, 0], 2 * np.pi)
    assert np.all(np.abs(position[:, 0, 0]) <= np.pi)
    assert np.all(np.abs(position[..., 1:]) <= np.pi)


def test_the_literal_path_is_eq_45_to_47() -> None:
    times = sample_instants(DURATION, 41)
    x, y, z = cartesian(rest=False).path(POINTS, times).position
    w = 2 * np.pi / DURATION
    for index, (a1, a2, a3, b1, b2, b3, c) in enumerate(POINTS):
        for sample, t in enumerate(times):
            s = t / DURATION
            phase = 2 * np.pi * (10 * s**3 - 15 * s**4 + 6 * s**5)
            qx, qy, qz = 0.0, 0.0, 0.29
            for k, a, b in ((1, a1, b1), (2, a2, b2), (3, a3, b3)):
                fourier = b / (w * k) * np.sin(w * k * t) - c / (w * k) * np.cos(w * k * t)
                qx, qy, qz = qx + np.cos(phase) * a + fourier, qy + np.sin(phase) * a + fourier, qz + fourier
            np.testing.assert_allclose([x[index, sample], y[index, sample], z[index, sample]], [qx, qy, qz], atol=1e-13)


def test_the_path_at_rest_begins_and_ends_at_the_same_place_on_the_circle() -> None:
    x, y, z = cartesian().path(POINTS, np.array([0.0, DURATION])).position
    radius = POINTS[:, :3].sum(axis=1)
    np.testing.assert_allclose(x, np.column_stack([radius, radius]), atol=1e-14)
    np.testing.assert_allclose(y, 0, atol=1e-14)
    np.testing.assert_allclose(z, 0.29, atol=1e-14)


def test_overreach_is_the_distance_to_what_the_arm_can_reach() -> None:
    # a circle of 0.9 m about the shoulder; upper arm 0.27 m, elbow to tool sqrt(0.07^2 + 0.374^2) m
    far, near = np.array([[0.9, 0, 0, 0, 0, 0, 0.0]]), np.array([[0.05, 0, 0, 0, 0, 0, 0.0]])
    fore = np.hypot(0.07, 0.374)
    trajectory, times = cartesian(), sample_instants(DURATION, 11)
    assert trajectory.motions(far, times).overreach == pytest.approx([0.9 - 0.27 - fore])
    assert trajectory.motions(near, times).overreach == pytest.approx([fore - 0.27 - 0.05])
    assert np.all(np.isfinite(trajectory.motions(far, times).motion.acceleration))


def test_forward_kinematics_of_a_motion_agrees_with_the_poses_of_its_states() -> None:
    arm, positions = load_arm("irb120"), np.random.default_rng(0).uniform(-3, 3, (2, 4, 6))
    points = body_points(arm, positions, np.array([0.1, 0.2, 0.3]))
    for index in np.ndindex(2, 4):
        poses = link_poses(arm, positions[index])
        expected = [*(pose[:3, 3] for pose in poses), (poses[-1] @ [0.1, 0.2, 0.3, 1.0])[:3]]
        np.testing.assert_allclose(points[index], expected, atol=1e-14)


def test_the_irb120_stands_as_its_data_sheet_draws_it() -> None:
    points = body_points(load_arm("irb120"), np.zeros((1, 6)), np.zeros(3))[0]
    np.testing.assert_allclose(points[1], [0, 0, 0.56], atol=1e-12)  # elbow, upper arm upright
    np.testing.assert_allclose(points[-1], [0.374, 0, 0.63], atol=1e-12)  # flange, forearm level


def joined(arm: Arm, joints: tuple[int, ...]) -> Arm:
    return Arm("odd", tuple(arm.joints[joint] for joint in joints))


@pytest.mark.parametrize(
    ("arm", "tool", "told"),
    [
        (load_arm("irb120"), TOOL, "needs an arm of three revolute joints; 'irb120' is another"),
        (ARM.first(2), TOOL, "needs an arm of three revolute joints"),
        (joined(ARM, (1, 0, 2)), TOOL, "axes 2 and 3 parallel and level"),
        (ARM, np.array([0.0, 0.1, 0.0]), "the tool in the plane of the arm"),
    ],
)
def test_an_arm_that_is_not_anthropomorphic_is_refused_in_one_line(arm: Arm, tool: Array, told: str) -> None:
    with pytest.raises(InputError, match=told) as refusal:
        planar_arm(arm, tool)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("trajectory", [joint_fourier(), cartesian()])
def test_points_of_a_wrong_length_are_refused(trajectory: Trajectory) -> None:
    with pytest.raises(ValueError, match=r"reshape|broadcast"):
        trajectory.motions(np.zeros((2, 6)), sample_instants(DURATION, 5))
