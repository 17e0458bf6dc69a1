"""Each hidden effect leaves its own mark: at its joint, in the direction that its law says."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hidden_cases import MACHINE, case, residual

from armlab.common.arrays import Array
from armlab.effects.library import BUILT_IN
from armlab.proof.blind.effects.bodies import Geometry, LinkError, Payload, Tilt
from armlab.proof.blind.effects.channels import Contact, Delay, EncoderOffset, Offset, Saturation, Skew, TorqueGain
from armlab.proof.blind.effects.drives import Backlash, Coupling, Elasticity, Rotor
from armlab.proof.blind.effects.friction import (
    Asymmetric,
    Coulomb,
    Curve,
    Drift,
    LoadDependent,
    NonlinearViscous,
    Presliding,
    Stribeck,
    Viscous,
    bouc_wen,
    recursion,
)
from armlab.proof.blind.effects.hidden import HiddenEffect
from armlab.proof.blind.effects.library import LIBRARY
from armlab.proof.blind.effects.springs import Cable, Compensator, Ripple
from armlab.proof.blind.outside import OUTSIDE
from problem.arm import link_poses
from problem.motion import Motion

J = 1  # the second joint carries gravity
Column = Callable[[Motion, Array, HiddenEffect], Array]


def _velocity(motion: Motion, nominal: Array, effect: HiddenEffect) -> Array:
    return motion.velocity[:, J]


def _sign(motion: Motion, nominal: Array, effect: HiddenEffect) -> Array:
    return np.sign(motion.velocity[:, J])


def _slope(motion: Motion, nominal: Array, effect: HiddenEffect) -> Array:
    return np.gradient(nominal[:, J])


MARKS: dict[type[HiddenEffect], tuple[Column, float]] = {  # a column, and the least correlation with it
    Coulomb: (_sign, 0.95),
    Viscous: (_velocity, 0.97),
    NonlinearViscous: (_velocity, 0.8),
    Stribeck: (_sign, 0.9),
    Asymmetric: (_sign, 0.6),
    LoadDependent: (lambda m, t, e: np.abs(t[:, J]) * np.sign(m.velocity[:, J]), 0.95),
    Presliding: (_sign, 0.5),
    Drift: (_velocity, 0.9),
    Rotor: (lambda m, t, e: m.acceleration[:, J], 0.99),
    TorqueGain: (lambda m, t, e: e.shape["direction"] * t[:, J], 0.9),
    Offset: (lambda m, t, e: e.shape["direction"] * np.ones(len(t)), 0.9),
    Ripple: (lambda m, t, e: np.sin(e.shape["order"] * m.position[:, J] + e.shape["phase"]), 0.5),
    Coupling: (lambda m, t, e: m.velocity[:, 2], 0.8),
    Compensator: (lambda m, t, e: np.sin(m.position[:, J] + e.shape["phase"]), 0.8),
    Cable: (lambda m, t, e: m.position[:, J] - e.shape["rest"], 0.9),
    Delay: (lambda m, t, e: -_slope(m, t, e), 0.9),
    Skew: (lambda m, t, e: -e.shape["direction"] * _slope(m, t, e), 0.9),
    Curve: (_sign, 0.6),
    Saturation: (lambda m, t, e: -np.sign(t[:, J]) * np.maximum(np.abs(t[:, J]) - e.parameters()["limit"], 0), 0.9),
}


def _drawn(kind: type[HiddenEffect], form: str | None = None, joint: int = J) -> HiddenEffect:
    rng = np.random.default_rng(5)
    effect = kind.draw(rng, MACHINE, joint)
    while form is not None and effect.form != form:
        effect = kind.draw(rng, MACHINE, joint)
    return effect


def _cosine(first: Array, second: Array) -> float:
    return float(first @ second / np.linalg.norm(first) / np.linalg.norm(second))


FORMS = [(kind, form) for kind in MARKS for form in kind.forms]


@pytest.mark.parametrize(("kind", "form"), FORMS, ids=[f"{kind.effect}-{form}" for kind, form in FORMS])
def test_an_effect_shows_in_its_direction_at_its_joint_alone(kind: type[HiddenEffect], form: str) -> None:
    effect = _drawn(kind, form).with_peak_torque(np.full(3, 25.0))
    left, motion, nominal = residual(case(effect))
    column, least = MARKS[kind]
    assert _cosine(left[:, J], column(motion, nominal, effect)) > least
    if effect.place is not None:
        others = np.delete(np.sqrt(np.mean(left**2, axis=0)), J)
        assert others.max() < 0.05 * np.sqrt(np.mean(left[:, J] ** 2))


@pytest.mark.parametrize("kind", [Payload, LinkError, Tilt, Geometry, EncoderOffset, Elasticity])
def test_bodies_and_drives_leave_more_than_the_noise(kind: type[HiddenEffect]) -> None:
    made = case(_drawn(kind))
    left, *_ = residual(made)
    assert np.sqrt(np.mean(left[:, J] ** 2)) > 0.2 * made.plan.noise.level[J]
    assert made.multiples[0] > 1


def test_play_shows_where_the_load_changes_its_sign() -> None:
    wide = case(_drawn(Backlash, "gap").sized(0.01))
    assert wide.multiples[0] > 5
    shut = case(_drawn(Backlash, "gap").sized(1e-6))
    assert shut.multiples[0] < 0.1 * wide.multiples[0]  # its walls are no elasticity to speak of


def test_a_payload_adds_its_weight_and_its_inertia() -> None:
    effect = Payload(2, 2.0, 6.0, "compact", {"x": 0.05, "y": 0.0, "z": 0.1, "radius": 0.001})
    left, motion, _ = residual(case(effect))
    step = 1e-4

    def point(position: Array) -> Array:
        return (link_poses(MACHINE.arm, position)[2] @ np.array([0.05, 0.0, 0.1, 1.0]))[:3]

    def jacobian(position: Array) -> Array:
        shifts = step * np.eye(3)
        return np.column_stack([(point(position + each) - point(position - each)) / (2 * step) for each in shifts])

    path = np.array([point(position) for position in motion.position])
    force = 2.0 * np.gradient(np.gradient(path, 1 / 500, axis=0), 1 / 500, axis=0) + [0, 0, 2.0 * 9.81]
    needed = np.array([jacobian(each).T @ push for each, push in zip(motion.position, force, strict=True)])
    np.testing.assert_allclose(left[20:-20], needed[20:-20], atol=0.02)


def test_an_elastic_joint_moves_its_resonance_and_not_its_static_torque() -> None:
    effect = Elasticity(1, 1e-4, 1.0, "linear", {"damping": 3e-4})
    left, _, nominal = residual(case(effect))
    assert np.std(left[:, 1]) < 0.2 * np.std(nominal[:, 1])
    assert np.std(left[:, 1]) > 1e-3


def test_a_contact_is_felt_in_its_run_and_its_time_alone() -> None:
    shape = {"start": 2.0, "end": 3.0, "run": 0.0, "direction": -1.0}
    made = case(Contact(1, 4.0, 9.0, "half sine", shape))
    inside, *_ = residual(made, 0)
    other, *_ = residual(made, 1)
    assert inside[1000:1500, 1].min() == pytest.approx(-4.0, rel=0.02)
    assert np.abs(inside[1520:, 1]).max() < 0.05
    assert np.abs(other).max() < 0.05


def test_the_library_and_the_vocabulary_have_the_same_effects_at_the_same_kind_of_place() -> None:
    named = {family.effect: family.facts.where for family in BUILT_IN}
    del named["early_friction"]  # the joints of the second engine have it of themselves
    learnt = [kind for kind in OUTSIDE if not kind.is_outside]
    assert {kind.effect: kind.where for kind in (*LIBRARY, *learnt)} == named


@pytest.mark.parametrize("kind", LIBRARY, ids=[kind.effect for kind in LIBRARY])
def test_parameters_have_names_and_units_of_the_vocabulary(kind: type[HiddenEffect]) -> None:
    effect = next(family.facts for family in BUILT_IN if family.effect == kind.effect)
    units = {parameter.name: parameter.unit_for() for parameter in effect.parameters}
    assert kind.units.items() <= units.items()
    assert _drawn(kind).parameters().keys() == kind.units.keys()


def test_outside_effects_are_ten_and_what_the_library_has_learnt_is_not_outside() -> None:
    assert len(OUTSIDE) == 10
    named = {kind.effect for kind in OUTSIDE} & {family.effect for family in BUILT_IN}
    assert named == {kind.effect for kind in OUTSIDE if not kind.is_outside}


@pytest.mark.parametrize("kind", OUTSIDE, ids=[kind.effect for kind in OUTSIDE])
def test_an_outside_effect_can_be_seen(kind: type[HiddenEffect]) -> None:
    joint = next(iter(kind.places(MACHINE)))
    made = case(_drawn(kind, joint=joint))
    left, *_ = residual(made)
    assert np.sqrt(np.mean(left**2, axis=0)).max() > 0.1 * made.plan.noise.level.max()
    assert made.multiples[0] > 1


def test_a_third_of_the_draws_take_another_than_the_obvious_form() -> None:
    rng = np.random.default_rng(0)
    for kind in LIBRARY:
        if len(kind.forms) > 1:
            drawn = [kind.draw_form(rng) != kind.forms[0] for _ in range(400)]
            assert np.mean(drawn) > 1 / 3


def test_recursion_is_the_linear_recurrence() -> None:
    np.testing.assert_allclose(recursion(np.array([0.5, 0.5, 0.0]), np.array([1.0, 1.0, 3.0])), [1.0, 1.5, 3.0])


def test_hose_hysteresis_stays_within_one_and_forgets_nothing_at_rest() -> None:
    path = bouc_wen(np.concatenate([np.full(2000, 0.01), np.zeros(50), np.full(4000, -0.01)]))
    assert path[1999] == pytest.approx(1.0, abs=0.01)
    assert path[2049] == path[1999]
    assert path[-1] == pytest.approx(-1.0, abs=0.01)


@pytest.mark.parametrize("size", [1e-6, 0.01, 0.1])
@pytest.mark.parametrize("form", Saturation.forms)
def test_a_saturated_channel_takes_its_share_from_the_highest_torque(form: str, size: float) -> None:
    channel = Saturation(0, size, 0.6, form, {"peak": 20.0})
    assert channel.read(np.array([[20.0]]))[0, 0] == pytest.approx(20.0 * (1 - size), rel=1e-9)


@pytest.mark.parametrize("knee", [-0.2, 0.0, 0.2])
def test_a_bent_gain_reads_zero_as_zero_and_is_bent_at_its_knee(knee: float) -> None:
    channel = TorqueGain(0, 0.1, 0.5, "bent", {"direction": 1.0, "knee": knee, "peak": 20.0})
    torque = np.linspace(-20, 20, 401)[:, None]
    slope = np.diff(channel.read(torque)[:, 0]) / 0.1
    assert channel.read(np.zeros((1, 1)))[0, 0] == 0.0
    assert slope[0] == pytest.approx(1.06)
    assert slope[-1] == pytest.approx(1.1)
    assert torque[np.flatnonzero(slope > 1.08)[0], 0] == pytest.approx(20 * knee, abs=0.11)


def test_teeth_do_no_work_over_a_turn() -> None:
    teeth = Ripple(0, 1.0, 10.0, "teeth", {"order": 7.0, "phase": 0.3})
    turn = np.linspace(0, 2 * np.pi, 7000, endpoint=False)
    track: Any = SimpleNamespace(position=turn[:, None])
    assert np.mean(teeth.torque(track, 0)) == pytest.approx(0.0, abs=1e-12)
