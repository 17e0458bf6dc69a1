"""Random cases of a real recording, on a recording that stands in for it: what is drawn, and how strong it is."""

import numpy as np
import pytest
from small_recordings import ARM, motion_at
from small_reference import reference_in

from armlab.common.arrays import Array
from armlab.proof.open.real_concealed.conceal import (
    ReferenceModel,
    add_disturbance,
    links_hold_rotor,
    sought_of_disturbance,
)
from armlab.proof.open.real_concealed.concealed_case import Case, Disturbance, Piece
from armlab.proof.open.real_concealed.draw import (
    INJECTED_KINDS,
    STRENGTHS,
    DrawnCase,
    delay_of_strength,
    draw_cases,
    make_gauge,
)

SEED, CASES = 1001, 16


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> ReferenceModel:
    return reference_in(tmp_path_factory.mktemp("recordings") / "emps")


@pytest.fixture(scope="module")
def drawn(reference: ReferenceModel) -> tuple[DrawnCase, ...]:
    return draw_cases(reference, SEED, CASES)


def _added(reference: ReferenceModel, what: Disturbance) -> tuple[Array, Array]:
    """What a disturbance adds, and the torque as recorded."""
    run = reference.recording.runs[0]
    return add_disturbance(run, ARM, what)[1], run.torque


def test_cases_follow_from_the_seed_and_the_first_ones_from_no_other(
    drawn: tuple[DrawnCase, ...], reference: ReferenceModel
) -> None:
    assert draw_cases(reference, SEED, 5) == drawn[:5]
    assert draw_cases(reference, SEED + 1, 5) != drawn[:5]


def test_each_kind_comes_once_before_any_comes_twice(drawn: tuple[DrawnCase, ...]) -> None:
    kinds = [each.case.injected.effect if each.case.injected else each.case.withheld[0].kind for each in drawn]
    first = kinds[: len(INJECTED_KINDS) + 1]  # the reference has friction, no coupling and no counterbalance
    assert sorted(first) == sorted([*INJECTED_KINDS, "friction"])


def test_a_part_of_the_reference_is_withheld_once_at_most(reference: ReferenceModel) -> None:
    pieces = [each.case.withheld for each in draw_cases(reference, SEED, 50) if each.case.withheld]
    assert len(pieces) == 3
    assert set(pieces) == {(Piece("friction", joint),) for joint in (1, 2, 3)}


def test_injected_strengths_are_those_that_are_aimed_at(drawn: tuple[DrawnCase, ...]) -> None:
    strengths = [each.strength for each in drawn if each.case.injected is not None]
    low, high = STRENGTHS
    assert all(0.99 * low <= each <= 1.01 * high for each in strengths)
    assert min(strengths) < 1 < max(strengths)


def test_the_strength_of_an_offset_is_its_size_over_the_error_of_the_reference(
    drawn: tuple[DrawnCase, ...], reference: ReferenceModel
) -> None:
    (signals,) = (reference.model.signals(run) for run in reference.recording.with_role("identify"))
    error = np.sqrt(np.mean((signals.torque - reference.model.filtered_torque(signals)) ** 2, axis=0))
    for each in drawn:
        what = each.case.injected
        if what is not None and what.effect == "torque_offset":
            assert what.joint is not None
            assert each.strength == pytest.approx(abs(what.size) / error[what.joint - 1], rel=1e-3)


def test_strength_grows_in_proportion_to_a_size_and_is_that_of_the_joint_where_it_is_largest(
    reference: ReferenceModel,
) -> None:
    gauge = make_gauge(reference)
    one, two = (
        gauge.strength(Case("emps", (), Disturbance("payload", 3, size, "kg", centre=(0.0, 0.0, 0.1))))
        for size in (1.0, 2.0)
    )
    assert two == pytest.approx(2 * one)


def test_a_delay_is_sought_and_is_never_longer_than_a_tenth_of_a_second() -> None:
    assert delay_of_strength(lambda delay: 100 * delay, 2.0) == pytest.approx(0.02, rel=0.02)
    assert delay_of_strength(lambda delay: 5 * np.tanh(30 * delay), 3.0) == pytest.approx(
        np.arctanh(0.6) / 30, rel=0.03
    )
    assert delay_of_strength(lambda delay: delay, 3.0) == pytest.approx(0.1)


def test_a_late_channel_leaves_the_others_as_they_were(reference: ReferenceModel) -> None:
    added, torque = _added(reference, Disturbance("channel_skew", 2, 0.01, "s"))  # two samples of 5 ms
    np.testing.assert_allclose(added[:, 1], torque[:-2, 1] - torque[2:, 1], atol=1e-9)
    assert not added[:, [0, 2]].any()


def test_laws_at_one_joint_add_what_they_say(reference: ReferenceModel) -> None:
    run = reference.recording.runs[0]
    motion = motion_at(np.arange(run.samples) / run.rate_hz, 0)
    position, velocity, acceleration = motion.position[:, 1], motion.velocity[:, 1], motion.acceleration[:, 1]
    laws = {
        Disturbance("torque_gain_error", 2, -0.1, "1"): -0.1 * run.torque[:, 1],
        Disturbance("torque_offset", 2, 3.0, "N m"): np.full(run.samples, 3.0),
        Disturbance("coulomb_friction", 2, 2.0, "N m", width=0.1): 2 * np.tanh(velocity / 0.1),
        Disturbance("torque_ripple", 2, 2.0, "N m", order=10, phase=0.5): 2 * np.sin(10 * position + 0.5),
        Disturbance("rotor_inertia", 2, 0.5, "kg m2"): 0.5 * acceleration,
    }
    for what, law in laws.items():
        added, _ = _added(reference, what)
        inside = slice(200, -200)
        assert np.sqrt(np.mean((added[inside, 1] - law[inside]) ** 2)) < 0.02 * np.sqrt(np.mean(law**2)), what.effect
        assert not added[:, [0, 2]].any()


def test_a_rotor_is_sought_as_a_link_too_where_no_motion_separates_them() -> None:
    assert links_hold_rotor(ARM, 1)
    assert not links_hold_rotor(ARM, 3)  # its axis is parallel to that of joint 2, which carries the rotor along
    held = sought_of_disturbance(Disturbance("rotor_inertia", 1, 0.5, "kg m2"), ARM)
    assert "inertial_parameter_error" in held.identical
    assert sought_of_disturbance(Disturbance("rotor_inertia", 3, 0.5, "kg m2"), ARM).identical == ()


def test_a_gain_is_sought_as_the_factor_that_is_read() -> None:
    sought = sought_of_disturbance(Disturbance("torque_gain_error", 2, -0.1, "1"), ARM)
    assert sought.numbers["torque_gain_error"]["gain"] == pytest.approx(0.9)
    assert sought.label == "torque of joint 2 times 0.9"
