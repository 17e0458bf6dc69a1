"""The signs of physics: what an effect says against coefficients, and that doubt silences it."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from effect_scenes import candidate, scene, scene_of, waves

from armlab.common.arrays import Array
from armlab.effects.links import link_law
from armlab.effects.springs import LinearSpring
from problem.pseudo_inertia import link_from_centre_of_mass
from problem.regressor import rigid_body_torque
from problem.robot_file import load_arm

WRONG: list[tuple[str, str, int | None, list[float], str]] = [
    ("coulomb_friction", "", 1, [-1.0], "level"),
    ("viscous_friction", "", 1, [-1.0], "coefficient"),
    ("nonlinear_viscous_friction", "", 1, [-1.0], "coefficient"),
    ("stribeck_friction", "", 1, [2.0, -1.0], "static friction below sliding"),
    ("stribeck_friction", "", 1, [-2.0, 1.0], "level"),
    ("asymmetric_friction", "levels", 1, [1.0, -2.0], "drives over a loop"),
    ("asymmetric_friction", "slopes", 1, [3.0, -1.0], "drives in one direction"),
    ("load_dependent_friction", "", 1, [-0.1], "coefficient"),
    ("presliding_hysteresis", "", 1, [-1.0], "level"),
    ("friction_drift", "viscous over time", 1, [1.0, -2.0], "final"),
    ("rotor_inertia", "", 1, [-0.1], "inertia"),
    ("torque_gain_error", "", 1, [-1.5], "gain"),
    ("torque_gain_error", "by sign", 1, [-1.5, 0.1], "gain"),
    ("joint_elasticity", "", 1, [-1e-4], "stiffness"),
    ("backlash", "", 1, [-1e-3], "gap"),
    ("cable_stiffness", "linear", 1, [-2.0, 1.0], "stiffness"),
    ("cable_stiffness", "cubic", 1, [2.0, -1.0, 0.0], "stiffness below zero"),
    ("payload", "point", 3, [-1.0], "negative mass"),
    ("torque_saturation", "", 1, [0.2], "takes away 0.20"),
    ("torque_saturation", "soft", 1, [-0.2], "reads more"),
    ("base_tilt", "", None, [6.0, 0.0], "tilt of more than"),
]


@pytest.mark.parametrize(("effect", "form", "joint", "coefficients", "message"), WRONG)
def test_physics_objects_and_doubt_silences_it(
    effect: str, form: str, joint: int | None, coefficients: list[float], message: str
) -> None:
    chosen, values = candidate(effect, [scene()], joint, form), np.array(coefficients)
    assert message in str(chosen.objection(values))
    assert message in str(chosen.objection(values, 1e-8 * np.diag(values**2)))
    if effect != "base_tilt":
        assert chosen.objection(values, np.diag((2 * values) ** 2)) is None


@pytest.mark.parametrize(("effect", "form", "joint", "coefficients", "message"), WRONG)
def test_physics_has_nothing_against_plausible_coefficients(
    effect: str, form: str, joint: int | None, coefficients: list[float], message: str
) -> None:
    plausible = {"torque_saturation": [0.95], "base_tilt": [0.3, 0.1], "friction_drift": [2.0, -1.0]}
    values = np.array(plausible.get(effect, np.abs(coefficients).tolist()))
    assert candidate(effect, [scene()], joint, form).objection(values) is None


def test_levels_by_direction_may_hold_an_offset_larger_than_friction() -> None:
    levels = candidate("asymmetric_friction", [scene()], 1, "levels")
    assert levels.objection(np.array([3.0, -1.0])) is None


def test_payload_has_to_be_a_body() -> None:
    payload = candidate("payload", [scene("RRRR")], 4, "body")
    body = link_from_centre_of_mass(1.0, np.array([0.1, 0.0, 0.05]), 0.01 * np.eye(3)).parameters
    assert payload.objection(body) is None
    impossible = body.copy()
    impossible[4:7] -= 0.1
    assert "no body" in str(payload.objection(impossible))
    assert payload.objection(impossible, 0.1**2 * np.eye(10)) is None
    assert candidate("inertial_parameter_error", [scene("RRRR")], 4).objection(-body) is None


def test_a_compensator_carries_gravity() -> None:
    where = scene("RRR")
    position = where.motion.position
    sine = candidate("gravity_compensator", [where], 2, "sine")
    gravity = np.array(sine.gravity)
    assert np.linalg.norm(gravity) > 0.5 * np.abs(_gravity_torque(where)).mean()
    assert sine.objection(-0.5 * gravity) is None
    assert "adds to gravity" in str(sine.objection(0.5 * gravity))
    linkage = candidate("gravity_compensator", [where], 2, "linkage")
    with_gravity = linkage.with_shape((float(np.arctan2(gravity[1], gravity[0])), 0.5))
    assert "adds to gravity" in str(with_gravity.objection(np.array([1.0, 1.0])))
    assert with_gravity.objection(np.array([-1.0, -1.0])) is None
    assert len(position) == len(where.time)


def _gravity_torque(where: object) -> Array:
    from problem.motion import Motion

    found = where
    position = found.motion.position
    still = Motion(position, np.zeros_like(position), np.zeros_like(position))
    torque = rigid_body_torque(found.arm, still, found.inertial)
    return np.asarray(torque[:, 1])


def test_couplings_may_have_either_sign() -> None:
    coupling = candidate("joint_coupling", [scene()], 1)
    assert all(coupling.objection(sign * np.ones(1)) is None for sign in (1, -1))


def test_doubt_of_a_stiffness_follows_from_that_of_the_compliance() -> None:
    spring = candidate("joint_elasticity", [scene()], 1)
    doubts = [spring.objection(np.array([-1e-4]), np.array([[size**2]])) for size in (4e-5, 6e-5)]
    assert doubts[0] is not None
    assert doubts[1] is None
    assert [first != second for first, second in pairwise(doubts)] == [True]


def test_a_spring_at_a_joint_that_gravity_does_not_load_is_a_cable_whatever_rounding_says() -> None:
    arm = replace(load_arm("irb120-arm"), gravity=(1e-12, 0.0, -9.81))  # as rounded angles of a robot file make it
    time, motion = waves(len(arm), 0)
    seen = scene_of(arm, motion, time)
    for stiffness in (5.0, -5.0):
        assert LinearSpring.at(arm, 1).first_name(np.array([stiffness, 0.3]), [seen]).effect == "cable_stiffness"


def test_no_claim_about_a_link_leaves_it_a_negative_mass() -> None:
    arm, spread = load_arm("irb120-arm"), 1e-4 * np.eye(10)
    mass = arm.links[2].mass
    assert link_law(arm, 3, np.array([-1.01 * mass, *np.zeros(9)]), spread, added=False) is None
    assert link_law(arm, 3, np.array([-0.99 * mass, *np.zeros(9)]), spread, added=False) is not None
