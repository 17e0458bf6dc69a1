"""Limits: each broken alone is seen, by the amount it should be; within all of them the violation is zero."""

from dataclasses import replace

import numpy as np
import pytest

from problem.arm import Arm, Joint, Limits, Link
from problem.drive_torque import drive_torque
from problem.limits import Constraints, Workspace, peaks
from problem.motion import Motion
from problem.trajectories import Excitation
from problem.transforms import translation

FREE = Limits()
ANYWHERE = Workspace()
LIMITS = Limits(position=(-1.0, 3.0), velocity=2.0, acceleration=5.0, torque=10.0)
# A level turntable with a point mass of 2 kg half a metre from its axis: tau = 0.5 qdd, no gravity in it.
LINK = Link(2.0, (1.0, 0.0, 0.0), (0.0, 0.5, 0.5, 0.0, 0.0, 0.0))
ARM = Arm("turntable", (Joint("j", "revolute", np.eye(4), translation(0.0, 0.0, 0.25)),), (LINK,))


def excitation(q: float = 0.0, qd: float = 0.0, qdd: float = 0.0, overreach: float = 0.0) -> Excitation:
    """Two samples of one joint: at rest at zero, then in the given state."""
    position, velocity, acceleration = (np.array([[[0.0], [value]]]) for value in (q, qd, qdd))
    return Excitation(Motion(position, velocity, acceleration), np.array([overreach]))


def violation(state: Excitation, limits: Limits = LIMITS, workspace: Workspace = ANYWHERE, arm: Arm = ARM) -> float:
    return float(Constraints(arm, (limits,), workspace).violation(state)[0])


@pytest.mark.parametrize("state", [excitation(), excitation(3.0, 2.0, 5.0), excitation(-1.0, -2.0, -5.0)])
def test_within_all_limits_the_violation_is_zero(state: Excitation) -> None:
    assert violation(state) == 0.0


@pytest.mark.parametrize(
    ("state", "excess"),
    [
        (excitation(q=4.0), 0.5),  # 1 rad over, of half the range: 2 rad
        (excitation(q=-2.0), 0.5),
        (excitation(qd=3.0), 0.5),
        (excitation(qd=-3.0), 0.5),
        (excitation(qdd=10.0), 1.0),
        (excitation(qdd=-10.0), 1.0),
    ],
)
def test_each_limit_of_motion_broken_alone_counts_relative_to_itself(state: Excitation, excess: float) -> None:
    assert violation(state) == pytest.approx(np.log1p(excess))


def test_a_torque_limit_broken_alone_is_seen() -> None:
    limits = Limits(torque=10.0)
    assert violation(excitation(qdd=20.0), limits) == 0.0
    assert violation(excitation(qdd=-30.0), limits) == pytest.approx(np.log1p(0.5))


def test_the_drives_also_turn_their_rotors() -> None:
    geared = replace(ARM, rotor_inertia=(0.25,))
    assert violation(excitation(qdd=20.0), Limits(torque=10.0), arm=geared) == pytest.approx(np.log1p(0.5))
    assert drive_torque(geared, excitation(qdd=20.0).motion)[0, 1, 0] == pytest.approx(15.0)


def test_two_broken_limits_add_up() -> None:
    assert violation(excitation(q=4.0, qd=3.0)) == pytest.approx(2 * np.log1p(0.5))


def test_a_joint_with_a_single_sided_range_is_limited_on_that_side() -> None:
    limits = Limits(position=(-np.inf, 1.0))
    assert violation(excitation(q=-1e6), limits) == 0.0
    assert violation(excitation(q=2.0), limits) == pytest.approx(np.log1p(1.0))


TOOL = (0.5, 0.0, 0.0)  # the tool turns on a circle of 0.5 m at a height of 0.25 m


@pytest.mark.parametrize(
    ("workspace", "excess"),
    [
        (Workspace(reach=0.6, tool=TOOL), 0.0),
        (Workspace(reach=0.5, tool=TOOL), np.hypot(0.5, 0.25) - 0.5),
        (Workspace(floor=0.2, tool=TOOL), 0.0),
        (Workspace(floor=0.3, tool=TOOL), 0.05),
        (Workspace(keep_out=((0.4, -0.1, 0.0), (0.9, 0.1, 1.0)), tool=TOOL), 0.1),
        (Workspace(keep_out=((0.9, 0.1, 1.0), (0.4, -0.1, 0.0)), tool=TOOL), 0.1),  # any opposite corners
        (Workspace(keep_out=((0.6, -0.1, 0.0), (0.9, 0.1, 1.0)), tool=TOOL), 0.0),
        (Workspace(keep_out=((-0.02, -0.1, 0.0), (0.1, 0.1, 1.0)), tool=TOOL), 0.02),  # a joint's frame inside
    ],
)
def test_each_limit_of_the_workspace_counts_in_metres(workspace: Workspace, excess: float) -> None:
    assert violation(excitation(), FREE, workspace) == pytest.approx(np.log1p(excess))


def test_the_worst_place_of_the_whole_motion_counts() -> None:
    behind = Workspace(keep_out=((-0.9, -0.1, 0.0), (-0.4, 0.1, 1.0)), tool=TOOL)
    assert violation(excitation(q=1.0), FREE, behind) == 0.0
    assert violation(excitation(q=np.pi), FREE, behind) == pytest.approx(np.log1p(0.1))


def test_out_of_reach_costs_more_than_any_limit_and_the_more_the_farther() -> None:
    near, far = (violation(excitation(overreach=metres)) for metres in (1e-6, 0.5))
    assert violation(excitation(q=1e9, qd=1e9, qdd=1e9)) < near < far


def test_a_motion_that_is_not_finite_breaks_limits_infinitely() -> None:
    for bad in (np.nan, np.inf):
        assert violation(excitation(q=bad)) == np.inf


def test_peaks_are_numpys() -> None:
    rng = np.random.default_rng(0)
    motion = Motion(*rng.normal(size=(3, 4, 9, 2)))
    q, qd, qdd = motion.position, motion.velocity, motion.acceleration
    expected = [q.min(axis=1), q.max(axis=1), np.abs(qd).max(axis=1), np.abs(qdd).max(axis=1)]
    assert np.array_equal(peaks(motion), np.stack(expected, axis=1))
