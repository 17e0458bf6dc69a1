"""Columns against MuJoCo, where it has the effect: the torque that it needs more once the effect is there."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from effect_scenes import candidate, scene, scene_of, torque_of, waves
from engines import inverse_dynamics, mujoco_model
from random_arms import random_arm

from armlab.common.arrays import Array
from armlab.effects.contract import Scene
from armlab.effects.library import BUILT_IN
from problem.arm import Arm, Link
from problem.pseudo_inertia import link_from_centre_of_mass
from problem.transforms import rotation_x, translation

MUJOCO = 1e-5  # N m: MuJoCo's text and its own arithmetic
KINDS = ("RRR", "RPR")


def more(where: Scene, change: Callable[[Any], None]) -> Array:
    """What MuJoCo's torque gains by a change of its model, (samples, joints)."""
    model = mujoco_model(where.arm)
    before = inverse_dynamics(model, where.motion)
    change(model)
    return inverse_dynamics(model, where.motion) - before


def short(kinds: str, seed: int = 1) -> Scene:
    return scene(kinds, seed, seconds=0.8)


@pytest.mark.parametrize("kinds", KINDS)
def test_viscous_friction_is_damping(kinds: str) -> None:
    where = short(kinds)

    def damp(model: Any) -> None:
        model.dof_damping[1] = 2.3

    ours = torque_of(candidate("viscous_friction", [where], 2), np.array([2.3]), where)
    np.testing.assert_allclose(ours, more(where, damp), atol=MUJOCO)


@pytest.mark.parametrize("kinds", KINDS)
def test_rotor_inertia_is_armature(kinds: str) -> None:
    where = short(kinds)

    def load(model: Any) -> None:
        model.dof_armature[2] = 0.4

    ours = torque_of(candidate("rotor_inertia", [where], 3), np.array([0.4]), where)
    np.testing.assert_allclose(ours, more(where, load), atol=MUJOCO)


def test_coulomb_friction_is_friction_loss_away_from_reversals() -> None:
    where = short("RRR")

    def rub(model: Any) -> None:
        model.dof_frictionloss[0] = 1.7

    theirs = more(where, rub)[:, 0]
    sliding = np.abs(where.motion.velocity[:, 0]) > 0.3
    ours = torque_of(candidate("coulomb_friction", [where], 1), np.array([1.7]), where)[:, 0]
    np.testing.assert_allclose(ours[sliding], theirs[sliding], rtol=0.02)


@pytest.mark.parametrize("effect", ["cable_stiffness", "gravity_compensator"])
def test_linear_spring_is_joint_stiffness_about_its_rest(effect: str) -> None:
    where = short("RRR")

    def pull(model: Any) -> None:
        model.jnt_stiffness[1], model.qpos_spring[1] = 5.0, 0.4

    form = "linear" if effect == "cable_stiffness" else "linear spring"
    spring = candidate(effect, [where], 2, form)
    coefficients = np.array([5.0, -5.0 * 0.4])
    assert spring.parameters(coefficients) == {"stiffness": 5.0, "rest": 0.4}
    np.testing.assert_allclose(torque_of(spring, coefficients, where), more(where, pull), atol=MUJOCO)


def test_base_tilt_is_gravity_in_another_direction() -> None:
    where = short("RRPR")
    tilt = candidate("base_tilt", [where])
    coefficients = np.array([0.03, -0.02])
    gravity = np.array(tilt.parameters(coefficients)["gravity"])
    assert np.linalg.norm(gravity) == pytest.approx(np.linalg.norm(where.arm.gravity))

    def lean(model: Any) -> None:
        model.opt.gravity[:] = gravity

    # the loss of the old direction is of second order, and no part of the columns
    first_order = np.array(where.arm.gravity) + coefficients @ np.array(tilt.across)

    def lean_first_order(model: Any) -> None:
        model.opt.gravity[:] = first_order

    ours = torque_of(tilt, coefficients, where)
    np.testing.assert_allclose(ours, more(where, lean_first_order), atol=MUJOCO)
    np.testing.assert_allclose(ours, more(where, lean), atol=0.01 * np.abs(ours).max())


def test_upright_gravity_tilts_along_x_and_y_of_the_base() -> None:
    arm = random_arm("RR", seed=3)
    upright = Arm(arm.name, arm.joints, arm.links, (0.0, 0.0, -9.81))
    time, motion = waves(2, 1, 1.0)
    tilt = candidate("base_tilt", [scene_of(upright, motion, time)])
    gravity = tilt.parameters(np.array([0.1, 0.2]))["gravity"]
    assert np.allclose(gravity, (0.1, 0.2, -9.81), atol=0.01)


@pytest.mark.parametrize("link", [2, 3])
def test_payload_is_a_heavier_body(link: int) -> None:
    where = short("RRR")
    inertia = np.array([[0.02, 0.001, 0.0], [0.001, 0.03, 0.002], [0.0, 0.002, 0.04]])
    body = link_from_centre_of_mass(1.3, np.array([0.05, -0.02, 0.1]), inertia)
    theirs = _with_body(where, link, body)
    payload = candidate("payload", [where], link, "body")
    coefficients = body.parameters[list(payload.felt)]
    if len(coefficients) == 10:
        named = payload.parameters(coefficients)
        assert named["mass"] == pytest.approx(1.3)
        assert named["centre"] == pytest.approx((0.05, -0.02, 0.1))
    np.testing.assert_allclose(torque_of(payload, coefficients, where), theirs, atol=MUJOCO)


def test_point_payload_is_a_small_heavy_body() -> None:
    where = short("RRR")
    body = link_from_centre_of_mass(0.7, np.array([0.1, 0.2, -0.05]), np.zeros((3, 3)))
    point = candidate("payload", [where], 3, "point").with_shape((0.1, 0.2, -0.05))
    np.testing.assert_allclose(torque_of(point, np.array([0.7]), where), _with_body(where, 3, body), atol=MUJOCO)


def _with_body(where: Scene, link: int, body: Link) -> Array:
    """What MuJoCo's torque gains by a body at a link, (samples, joints)."""
    arm = where.arm
    links = list(arm.links or ())
    ten = links[link - 1].parameters + body.parameters
    links[link - 1] = Link(float(ten[0]), tuple(ten[1:4]), tuple(ten[4:]))
    heavier = Arm(arm.name, arm.joints, tuple(links), arm.gravity)
    return inverse_dynamics(mujoco_model(heavier), where.motion) - inverse_dynamics(mujoco_model(arm), where.motion)


@pytest.mark.parametrize(
    ("form", "joint", "size"), [("a", 1, 5e-4), ("a", 2, -5e-4), ("d", 2, 5e-4), ("y", 1, 5e-4), ("alpha", 2, 5e-4)]
)
def test_geometry_error_is_a_body_at_another_place(form: str, joint: int, size: float) -> None:
    where = short("RRRR")
    arm, number = where.arm, joint - 1
    wrong = arm.joints[number]
    step = {"a": (size, 0, 0), "y": (0, size, 0), "d": (0, 0, size), "alpha": (0, 0, 0)}[form]
    turn = rotation_x(size if form == "alpha" else 0.0)
    # MuJoCo's bodies have their frames at the joints: what is behind moves in them, link and next body alike
    shift = np.array(step) if form != "alpha" else np.zeros(3)

    def move(model: Any) -> None:
        own, following = number + 1, number + 2
        if form == "d":
            model.body_pos[own] += _pose_of(arm, number) @ shift
            return
        after = wrong.after if form == "alpha" else np.eye(4)
        change = after @ turn @ np.linalg.inv(after) @ translation(*shift)
        _carry(model, own, following, change)

    error = candidate("geometry_error", [where], joint, form)
    ours = torque_of(error, np.array([size]), where)
    theirs = more(where, move)
    np.testing.assert_allclose(ours, theirs, atol=2e-3 * np.abs(theirs).max() + MUJOCO)


def _pose_of(arm: Arm, number: int) -> Array:
    """Rotation of a joint's frame before its motion, in the joint frame before it."""
    behind = arm.joints[number - 1].after if number else np.eye(4)
    return (behind @ arm.joints[number].before)[:3, :3]


def _carry(model: Any, own: int, following: int, change: Array) -> None:
    """Moves a body's mass, and the body behind it, by a change in its joint frame."""
    import mujoco

    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(change[:3, :3]).ravel())
    pairs = [(model.body_ipos[own], model.body_iquat[own])]
    pairs.append((model.body_pos[following], model.body_quat[following]))
    for place, turn in pairs:
        place[:] = change[:3, :3] @ place + change[:3, 3]
        mujoco.mju_mulQuat(turn, quaternion, turn.copy())


def test_a_law_that_a_fit_sizes_with_zero_has_parameters() -> None:
    """No limit is one at infinity."""
    scenes = [scene(seconds=4.0)]
    for each in BUILT_IN:
        for places in each.candidates(scenes[0].arm, scenes):
            law = places[0]
            assert law.parameters(np.zeros(law.size))
