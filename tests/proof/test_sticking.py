"""The second engine of the truth machine: it agrees with MuJoCo where nothing sticks, and sticks where it should."""

import numpy as np
import pytest

from armlab.common.arrays import Array
from armlab.proof.blind.effects.friction import Coulomb, Viscous
from armlab.proof.blind.engine import Parts, Track
from armlab.proof.blind.plan import PLAN, Plan, draw_plan
from armlab.proof.blind.simulate import (
    Controller,
    Reference,
    draw_controller,
    law_torque,
    reference_track,
    rigid_torque,
    servo_torques,
    simulate,
)
from armlab.proof.blind.sizing import oracle_grid, simulate_case, standstills
from armlab.proof.blind.sticking import is_carried, play_sticking
from armlab.proof.tiers.torque import SetSettings


def plan_of(index: int) -> tuple[Plan, Controller, Track]:
    plan = draw_plan(1003, index, "clean", only_nulls=True, development=True)
    controller = draw_controller(plan.stream("controller"), plan.machine.arm)
    return plan, controller, reference_track(plan, 0, plan.runs[0])


def played(plan: Plan, controller: Controller, goal: Track, carried: tuple[Coulomb | Viscous, ...] = ()) -> Track:
    given, wanted = servo_torques(controller, Reference(goal.time, goal.position), np.zeros_like(goal.position))
    gains = controller.position_gain, controller.velocity_gain
    return play_sticking(plan.true_arm, gains, goal.time, given, wanted, carried)


def inner_grid(track: Track) -> Array:
    return np.asarray(np.arange(0.5, track.time[-1] - 0.2, 0.002))


@pytest.mark.parametrize("index", [0, 3, 6])
def test_without_friction_both_engines_move_the_arm_alike(index: int) -> None:
    plan, controller, goal = plan_of(index)
    taken = np.zeros_like(goal.position)
    first = simulate(plan.true_arm, Parts(), controller, Reference(goal.time, goal.position), taken)
    second = played(plan, controller, goal)
    grid = inner_grid(first)
    one, other = first.at(grid), second.at(grid)
    assert np.abs(one.position - other.position).max() < 5e-5
    assert np.abs(one.velocity - other.velocity).max() < 1e-3


@pytest.mark.parametrize("index", [0, 3, 6])
def test_its_torque_is_that_of_the_rigid_arm(index: int) -> None:
    plan, controller, goal = plan_of(index)
    track = played(plan, controller, goal).at(inner_grid(goal))
    assert np.abs(track.load - rigid_torque(plan.true_arm, track.motion)).max() < 1e-4


def test_the_torque_of_the_motors_is_recorded_though_a_joint_sticks() -> None:
    plan, controller, goal = plan_of(0)
    carried = (Coulomb(1, 5.0, np.inf, "sign", {"width": 0.0}), Viscous(1, 2.0, np.inf, "linear", {"phase": 0.0}))
    track = played(plan, controller, goal, carried)
    friction = track.load + law_torque(carried, track, 0) - rigid_torque(plan.true_arm, track.motion)
    moving = np.abs(track.velocity[:, 1]) > 0.01
    law = 5.0 * np.sign(track.velocity[:, 1]) + 2.0 * track.velocity[:, 1]
    assert np.abs(friction[moving, 1] - law[moving]).max() < 1e-3
    assert np.abs(friction[:, 1]).max() < 5.0 + 2.0 * np.abs(track.velocity[:, 1]).max() + 1e-6
    still = np.abs(track.velocity[:, 1]) < 1e-9
    assert still.sum() > 10
    assert np.abs(friction[still, 1]).min() < 4.0  # at rest it takes any value up to its level


def test_the_oracle_knows_where_a_joint_sticks() -> None:
    plan, controller, goal = plan_of(0)
    track = played(plan, controller, goal, (Coulomb(1, 5.0, np.inf, "sign", {"width": 0.0}),))
    grid = oracle_grid(track)
    still = standstills(track, grid)
    assert not still[:, 0].any()
    assert 0 < still[:, 1].mean() < 0.2
    slow = np.abs(track.at(grid).velocity[:, 1])
    assert slow[still[:, 1]].max() < 0.1 < slow[~still[:, 1]].max()


def test_a_third_of_a_set_is_of_the_second_engine_without_parts() -> None:
    plans = [SetSettings(120, 1003, development=True).plan(number) for number in range(120)]
    sticking = [plan for plan in plans if plan.engine == "sticking"]
    assert 0.2 < len(sticking) / len(plans) < 0.47
    assert pytest.approx(1 / 3) == PLAN.sticking_share
    case = simulate_case(next(plan for plan in sticking if plan.kind == "single" and plan.realistic))
    assert not any(effect.has_parts for effect in case.hidden)
    assert all(is_carried(effect) for effect in case.plan.background if effect.effect != "torque_offset")
    assert case.multiples[0] == pytest.approx(case.sized.targets[0], rel=0.2)
