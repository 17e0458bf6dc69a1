"""A base that gives way against the whole nonlinear arm on it: Pinocchio's dynamics in scipy's integrator."""

from dataclasses import replace

import numpy as np
import pytest
from effect_scenes import scene_of, torque_of, waves
from engines import pinocchio_model
from random_arms import random_arm
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

from armlab.common.arrays import Array
from armlab.effects.contract import Scene
from armlab.effects.soft_base import FLEXIBLE_BASE, FlexibleBase
from problem.arm import Arm, Joint, Link
from problem.transforms import inverse, turn_z_to

HERTZ, DAMPING, DIRECTION = 9.0, 0.08, 0.7
NOTHING = Link(1e-9, (0.0, 0.0, 0.0), (0.0,) * 6)


def upright(kinds: str = "RRR") -> Arm:
    return replace(random_arm(kinds, seed=3), gravity=(0.0, 0.0, -9.81))


def base_of(arm: Arm) -> FlexibleBase:
    return FlexibleBase.at(arm, 0, shape=(HERTZ, DAMPING, DIRECTION))


def torque_on_spring(where: Scene, stiffness: float) -> Array:
    """What the motors give beyond the rigid torque, (samples, joints): no derivative of a model, no small angles."""
    pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed")
    arm, time = where.arm, where.time
    turn = turn_z_to(np.array((np.cos(DIRECTION), np.sin(DIRECTION), 0.0)))
    assert arm.links is not None
    standing = replace(
        arm, joints=(Joint("base", "revolute", turn, inverse(turn)), *arm.joints), links=(NOTHING, *arm.links)
    )
    model = pinocchio_model(standing)
    data, path = model.createData(), make_interp_spline(time, where.motion.position, k=5)
    speeds, pushes = path.derivative(1), path.derivative(2)
    damping = 2 * DAMPING / (2 * np.pi * HERTZ) * stiffness

    def torques(now: float, *base: float) -> Array:
        """At an angle, a speed and an acceleration of the base."""
        state = zip(base, (path(now), speeds(now), pushes(now)), strict=True)
        return np.array(pin.rnea(model, data, *(np.append(own, each) for own, each in state)))

    def push_at(now: float, angle: float, speed: float) -> float:
        still = torques(now, angle, speed, 0.0)[0]
        inertia = torques(now, angle, speed, 1.0)[0] - still
        return float((-still - stiffness * angle - damping * speed) / inertia)

    begin = -torques(time[0], 0.0, 0.0, 0.0)[0] / stiffness
    found = solve_ivp(
        lambda now, state: [state[1], push_at(now, *state)],
        (time[0], time[-1]),
        [begin, 0.0],
        t_eval=time,
        max_step=2e-3,
        rtol=1e-7,
        atol=1e-10,
    )
    pairs = zip(time, found.y.T, strict=True)
    return np.array(
        [(torques(now, *state, push_at(now, *state)) - torques(now, 0.0, 0.0, 0.0))[1:] for now, state in pairs]
    )


def test_the_torque_of_a_base_is_that_of_the_whole_arm_on_a_spring() -> None:
    time, motion = waves(3, 2, 2.0)
    where = scene_of(upright(), motion, time)
    base = base_of(where.arm)
    stiffness = base.base_of(where).stiffness(HERTZ)
    ours, theirs = torque_of(base, np.array([1 / stiffness]), where), torque_on_spring(where, stiffness)
    for own, truth in zip(ours[50:-50].T, theirs[50:-50].T, strict=True):
        assert np.std(own - truth) < 0.03 * np.std(truth)


def test_a_direction_and_its_opposite_are_one_axis() -> None:
    time, motion = waves(3, 2, 1.0)
    where = scene_of(upright(), motion, time)
    one = base_of(where.arm)
    other = one.with_shape((HERTZ, DAMPING, DIRECTION + np.pi))
    np.testing.assert_allclose(other.columns(where), one.columns(where), rtol=1e-6, atol=1e-6)
    assert other.parameters(np.array([1e-4])) == pytest.approx(one.parameters(np.array([1e-4])))


def test_a_base_is_restored_from_its_parameters() -> None:
    arm = upright()
    base = base_of(arm)
    again, coefficients = FLEXIBLE_BASE.from_parameters(arm, (), base.parameters(np.array([2e-4])))
    assert again.shape == pytest.approx(base.shape)
    np.testing.assert_allclose(coefficients, [2e-4])
    assert base.equation(np.array([2e-4])) == "base turns by 0.0002 rad/(N.m) M about (0.7648, 0.6442, 0)"
    assert base.objection(np.array([-2e-4])) == "compliance -0.0002 rad/(N.m) should be positive"


def test_an_arm_with_no_room_for_one_more_joint_has_no_such_base() -> None:
    assert FLEXIBLE_BASE.candidates(upright("R" * 16), []) == []
    assert len(FLEXIBLE_BASE.candidates(upright("R" * 15), [])) == 1
