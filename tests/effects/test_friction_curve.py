"""The friction curve as a law: what it holds, what it reports, what physics asks of it."""

import numpy as np
import pytest

from armlab.effects.friction_curve import FrictionCurve
from armlab.effects.library import family_named
from armlab.effects.parameters import parameter_values
from armlab.effects.scene import instants
from problem.motion import Motion
from problem.robot_file import load_arm

ARM = load_arm("irb120-arm")
VELOCITIES = (0.0, 0.2, 0.5, 1.0)
CURVE = FrictionCurve.at(ARM, 2, velocities=VELOCITIES)


def torque(coefficients: list[float], speeds: list[float]) -> list[float]:
    """Torque of the curve at constant speeds of joint 2, N m."""
    velocity = np.zeros((len(speeds), 3))
    velocity[:, 1] = speeds
    scene = instants(ARM, Motion(np.zeros_like(velocity), velocity, np.zeros_like(velocity)))
    found: list[float] = (CURVE.columns(scene)[:, 0] @ np.array(coefficients)).tolist()
    return found


def test_the_torque_is_linear_between_knots_and_opposes_motion_both_ways() -> None:
    # 1 just above rest, 3 at 0.2 rad/s, 3 at 0.5 rad/s, 5 at 1 rad/s
    assert torque([1, 2, 0, 2], [0.1, 0.2, 0.35, 0.75, -0.75]) == pytest.approx([2, 3, 3, 4, -4])


def test_beyond_the_last_knot_the_curve_goes_on_as_before_it() -> None:
    assert torque([1, 2, 0, 2], [1.5, -2.0]) == pytest.approx([7, -9])


def test_coulomb_and_viscous_friction_are_curves() -> None:
    # 1.5 sgn(qd) + 4 qd
    assert torque([1.5, 0.8, 1.2, 2.0], [-2.0, 0.05, 0.3, 3.0]) == pytest.approx([-9.5, 1.7, 2.7, 13.5])


def test_parameters_are_the_knots_with_an_interval_each_and_give_the_same_curve_back() -> None:
    coefficients = np.array([1.0, 2.0, 0.5, 2.0])
    velocities, torques = parameter_values(CURVE, coefficients, 0.01 * np.eye(4), 2.0)
    assert (velocities.name, velocities.unit, velocities.value) == ("velocities", "rad/s", VELOCITIES)
    assert (torques.name, torques.unit, torques.value) == ("torques", "N.m", (1.0, 3.0, 3.5, 5.5))
    # independent rises: half an interval is 2 * 0.1 * sqrt(number of rises up to the knot)
    np.testing.assert_allclose(np.ptp(torques.interval, axis=1), 0.4 * np.sqrt([1, 2, 3, 4]))
    again, values = family_named("friction_curve").from_parameters(
        ARM, (2,), {"velocities": velocities.value, "torques": torques.value}
    )
    assert again == CURVE
    np.testing.assert_allclose(values, coefficients)


@pytest.mark.parametrize(
    ("velocities", "torques", "message"),
    [
        ((0.0, 1.0), (1.0, 2.0, 3.0), "2 velocities and 3 torques"),
        ((0.1, 1.0), (1.0, 2.0), "should rise from 0"),
        ((0.0, 1.0, 0.5), (1.0, 2.0, 3.0), "should rise from 0"),
        ((0.0,), (1.0,), "1 velocities and 1 torques"),
    ],
)
def test_knots_that_make_no_curve_are_refused(
    velocities: tuple[float, ...], torques: tuple[float, ...], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        family_named("friction_curve").from_parameters(ARM, (2,), {"velocities": velocities, "torques": torques})


@pytest.mark.parametrize(
    ("torques", "sigma", "objection"),
    [
        ([1.0, 3.0, 3.0, 5.0], 0.0, None),
        ([-1.0, 3.0, 3.0, 5.0], 0.1, "drives at some speed"),
        ([-0.1, 3.0, 3.0, 5.0], 0.1, None),  # zero is within its uncertainty
        ([3.0, 2.0, 3.0, 5.0], 0.1, "falls as the joint gets faster"),
        ([3.0, 2.9, 2.8, 2.2], 0.1, "falls as the joint gets faster"),  # little from knot to knot, much in all
        ([3.0, 2.0, 3.0, 5.0], 1.0, None),
    ],
)
def test_a_curve_brakes_and_does_not_fall_beyond_its_uncertainty(
    torques: list[float], sigma: float, objection: str | None
) -> None:
    found = CURVE.objection(np.diff(torques, prepend=0.0), sigma**2 * np.eye(4))
    assert found is None if objection is None else objection in (found or "")


def test_the_equation_lists_the_knots() -> None:
    text = CURVE.equation(np.array([1.0, 2.0, 0.5, 2.0]))
    assert text.startswith("tau_2 += F(|qd_2|) sgn(qd_2), F linear between (0, 1), (0.2, 3), (0.5, 3.5), (1, 5.5)")
