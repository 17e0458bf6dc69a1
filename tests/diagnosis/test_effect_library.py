"""Promises of every family: ids, shapes of columns, named parameters that make the same columns again."""

from dataclasses import dataclass, replace
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from effect_scenes import family, scene, torque_of

from armlab.effects import library as library_module
from armlab.effects.contract import Candidate, Effect, Family, Parameter, Scene
from armlab.effects.friction import CoulombFriction
from armlab.effects.library import (
    BUILT_IN,
    EFFECT_IDS,
    WITHOUT_FAMILY,
    BrokenEffectError,
    BrokenEffectWarning,
    effect_named,
    library,
)
from armlab.effects.term import EveryJoint, Term
from problem.arm import PARAMETER_NAMES

KINDS = ("RRR", "P", "PRR")
BEYOND = {
    "positive_slope",
    "negative_slope",
    "cubic",
    "offset",
    "force",
    "ratio",
    "exponent",
    "static_level",
    "velocity",
    "power",
    "gain_below",
    "knee",
}
BEYOND |= {"resonant_stiffness", "crossed_gap", "sensor", "coldest", "warmest", *PARAMETER_NAMES}


def scenes_of(kinds: str) -> list[Scene]:
    scenes = [scene(kinds, seed=seed, run=f"run-{seed}.csv") for seed in (1, 2)]
    return [replace(each, temperature=20 + each.time[:, None]) for each in scenes]


def every(kinds: str) -> list[Candidate]:
    scenes = scenes_of(kinds)
    return [each for one in BUILT_IN for place in one.candidates(scenes[0].arm, scenes) for each in place]


def drawn(candidate: Candidate, width: int) -> np.ndarray:
    return np.random.default_rng(len(candidate.effect)).uniform(0.2, 0.9, width)


def test_library_has_every_id_of_the_vocabulary_in_its_order() -> None:
    assert tuple(each.effect for each in BUILT_IN) == tuple(name for name in EFFECT_IDS if name not in WITHOUT_FAMILY)


@pytest.mark.parametrize("kinds", KINDS)
def test_columns_are_finite_and_have_one_row_a_joint_that_they_change(kinds: str) -> None:
    where = scenes_of(kinds)[0]
    for each in every(kinds):
        columns = each.columns(where)
        assert columns.shape[:2] == (len(where.time), len(each.rows)), each
        assert np.isfinite(columns).all(), each


@pytest.mark.parametrize("kinds", KINDS)
def test_every_joint_that_moves_has_each_effect_of_a_joint(kinds: str) -> None:
    scenes = scenes_of(kinds)
    for effect in ("coulomb_friction", "torque_ripple", "joint_elasticity", "cable_stiffness", "encoder_offset"):
        places = family(effect).candidates(scenes[0].arm, scenes)
        assert {place[0].joint for place in places} == set(range(1, len(kinds) + 1))


@pytest.mark.parametrize("kinds", KINDS)
def test_parameters_are_those_of_the_vocabulary_or_of_a_single_form_and_have_units(kinds: str) -> None:
    where = scenes_of(kinds)[0]
    for each in every(kinds):
        known = {parameter.name for parameter in effect_named(each.effect).parameters}
        named = each.parameters(drawn(each, each.columns(where).shape[2]))
        assert set(named) <= known | BEYOND, each
        assert all(each.unit(name) for name in named), each


@pytest.mark.parametrize("kinds", KINDS)
def test_named_parameters_make_the_same_torque_again(kinds: str) -> None:
    where = scenes_of(kinds)[0]
    for each in every(kinds):
        if each.effect == "external_contact" or getattr(each, "began", ()):
            continue  # bound to the runs of one recording
        coefficients = drawn(each, each.columns(where).shape[2])
        if each.effect == "torque_saturation":
            coefficients = np.ones(1)
        if each.effect == "time_delay" or each.form == "torque":
            coefficients = np.array(each.shape)
        named = each.parameters(coefficients)
        place = each.joints or (() if each.joint is None else (each.joint,))
        again, values = family(each.effect).from_parameters(where.arm, place, named, each.form)
        expected, got = torque_of(each, coefficients, where), torque_of(again, values, where)
        np.testing.assert_allclose(got, expected, atol=1e-9 * (1 + np.abs(expected).max()), err_msg=str(each))


@pytest.mark.parametrize("kinds", KINDS)
def test_reshaped_candidates_keep_their_place_and_take_the_shape(kinds: str) -> None:
    for each in every(kinds):
        middle = tuple(0.5 * (low + high) + 0.01 for low, high in each.bounds)
        other = each.with_shape(middle)
        assert len(each.shape) == len(each.bounds), each
        assert (other.effect, other.joint, other.joints, other.rows) == (
            each.effect,
            each.joint,
            each.joints,
            each.rows,
        )
        assert len(other.shape) == len(middle)
        assert each.shape == () or other.shape != each.shape


@pytest.mark.parametrize("kinds", KINDS)
def test_first_looks_stand_within_their_bounds(kinds: str) -> None:
    for each in every(kinds):
        assert all(low <= value <= high for value, (low, high) in zip(each.shape, each.bounds, strict=True)), each


def test_equations_say_the_joint_and_the_number() -> None:
    scenes = scenes_of("RRR")
    for effect in ("viscous_friction", "rotor_inertia", "cable_stiffness", "joint_coupling", "torque_ripple"):
        place = family(effect).candidates(scenes[0].arm, scenes)[0]
        text = place[0].equation(np.array([2.3456, 1.0, 1.0][: place[0].columns(scenes[0]).shape[2]]))
        assert text.startswith("tau_1 += ")
        assert "2.346" in text or effect == "torque_ripple"


def spring_of(form: str, where: Scene) -> Term:
    """The first spring of a form at joint 2."""
    places = family("cable_stiffness").candidates(where.arm, [where])
    return next(each for place in places for each in place if (each.joint, each.form) == (2, form))


@pytest.mark.parametrize("form", ["linear", "cubic"])
def test_a_spring_holds_an_offset_of_the_torque(form: str) -> None:
    """So that no offset is found beside a spring that rests far from its travel."""
    where = scenes_of("RRR")[0]
    columns = spring_of(form, where).columns(where)[:, 0]
    left = np.linalg.lstsq(columns, np.ones(len(columns)), rcond=None)[1]
    assert float(np.sum(left)) < 1e-20


def test_equation_of_a_spring_reads_as_a_law() -> None:
    where = scenes_of("RRR")[0]
    assert spring_of("linear", where).equation(np.array([2.0, -1.0])) == "tau_2 += 2 (q_2 - 0.5)"
    hardens, values = spring_of("cubic", where), np.array([2.0, 1.0, -0.5])
    assert hardens.equation(values).startswith("tau_2 += 2 x + 1 x^3 - 0.5, x = q_2 - (")
    rest = hardens.parameters(values)["rest"]
    assert hardens.parameters(values) == {"stiffness": 2, "rest": rest, "cubic": 1, "offset": -0.5}


def test_a_joint_that_never_moves_has_no_friction() -> None:
    moving = scene("RRR")
    position = moving.motion.position.copy()
    position[:, 1] = 0.3
    still = replace(moving, motion=replace(moving.motion, position=position))
    joints = {place[0].joint for place in family("coulomb_friction").candidates(still.arm, [still])}
    assert joints == {1, 3}


class Own(EveryJoint):
    """A user's effect."""

    def __init__(self, effect: str = "sticky_seal") -> None:
        super().__init__(Effect(effect, "a seal that sticks"), (CoulombFriction,))


TAKEN = Own("coulomb_friction")


def registered(monkeypatch: pytest.MonkeyPatch, *values: str) -> None:
    entries = [EntryPoint(f"own{number}", value, "armlab.effects") for number, value in enumerate(values)]
    monkeypatch.setattr(library_module, "entry_points", lambda group: entries if group == "armlab.effects" else [])


def test_users_effects_follow_the_built_in_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    registered(monkeypatch, f"{__name__}:Own")
    assert [each.effect for each in library()][-1] == "sticky_seal"
    assert library()[: len(BUILT_IN)] == BUILT_IN


def test_an_id_that_is_taken_is_refused_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    registered(monkeypatch, f"{__name__}:TAKEN")
    with pytest.raises(BrokenEffectError, match=r"^effect 'coulomb_friction' is registered by armlab and by test_"):
        library()


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("no_such_module:X", "cannot be imported"),
        ("math:pi", "is no armlab.effects.contract.Family"),
        (f"{__name__}:RaisesWhenMade", "cannot be made: RuntimeError: boom"),
        (f"{__name__}:ExitsWhenMade", r"it ends the program \(sys.exit\)"),
    ],
)
def test_a_broken_plug_in_is_left_out_and_troubles_only_who_may_mean_it(
    monkeypatch: pytest.MonkeyPatch, value: str, message: str
) -> None:
    registered(monkeypatch, value)
    with pytest.warns(BrokenEffectWarning, match=message):
        assert library() == BUILT_IN
    assert effect_named("coulomb_friction").id == "coulomb_friction"
    with pytest.raises(BrokenEffectError, match=message):
        effect_named("own0")


class RaisesWhenMade:
    def __init__(self) -> None:
        raise RuntimeError("boom")


class ExitsWhenMade:
    def __init__(self) -> None:
        raise SystemExit(3)


def test_a_family_without_restoring_says_so() -> None:
    class Bare(Family):
        facts = Effect("sticky_seal", "a seal that sticks")

        def candidates(self, arm: object, scenes: object) -> list[list[Candidate]]:
            return []

    with pytest.raises(ValueError, match="sticky_seal cannot be computed"):
        Bare().from_parameters(scene().arm, (1,), {})


def test_the_effect_in_the_documentation_works() -> None:
    text = (Path(__file__).parents[2] / "docs" / "effects.md").read_text()
    code = text.split("```python\n")[1].split("```")[0]
    names: dict[str, Any] = {"dataclass": dataclass, "Term": Term, "EveryJoint": EveryJoint, "np": np}
    names |= {"Effect": Effect, "Parameter": Parameter}
    exec(code, names)
    where = scene()
    seal = names["SEAL_FRICTION"].candidates(where.arm, [where])[1][0]
    expected = 2.0 * np.tanh(where.motion.velocity[:, 1] / 0.05)
    np.testing.assert_allclose(torque_of(seal, np.array([2.0]), where)[:, 1], expected)
    assert seal.parameters(np.array([2.0])) == {"level": 2.0}


def test_the_documentation_has_every_effect() -> None:
    text = (Path(__file__).parents[2] / "docs" / "effects.md").read_text()
    assert all(f"| `{each.effect}` |" in text for each in BUILT_IN)
