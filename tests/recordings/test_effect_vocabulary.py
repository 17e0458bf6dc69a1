"""The vocabulary of effects: the ids and parameter names that every part of armlab writes."""

import json
from pathlib import Path

import pytest

from armlab.recordings.vocabulary import EFFECT_IDS, EFFECTS, effect_named

SCHEMA = json.loads((Path(__file__).parents[1] / "schemas" / "verdict.schema.json").read_text())
# design, contract of the diagnosis
NAMES = {
    *("level", "coefficient", "positive", "negative", "static_level", "velocity", "exponent", "gain", "inertia"),
    *("offset", "order", "amplitude", "phase", "stiffness", "rest", "gap", "mass", "centre", "gravity", "seconds"),
    *("start", "end", "peak", "limit", "initial", "final", "time_constant"),
}


def test_effects_are_those_of_the_verdict_schema_in_its_order() -> None:
    finding = SCHEMA["properties"]["findings"]["items"]["properties"]["effect"]
    assert list(EFFECT_IDS) == finding["examples"]


def test_parameters_have_the_agreed_names_and_each_is_used() -> None:
    used = {parameter.name for effect in EFFECTS for parameter in effect.parameters}
    assert used == NAMES


def test_units_follow_the_kind_of_joint() -> None:
    viscous = effect_named("viscous_friction").parameter("coefficient")
    assert viscous.unit_for() == "N.m.s/rad"
    assert viscous.unit_for("prismatic") == "N.s/m"
    assert effect_named("rotor_inertia").parameter("inertia").unit_for() == "kg.m2"
    assert effect_named("encoder_offset").parameter("offset").unit_for() == "rad"


def test_every_unit_can_be_written_for_both_kinds_of_joint() -> None:
    units = [p.unit_for(kind) for effect in EFFECTS for p in effect.parameters for kind in ("revolute", "prismatic")]
    assert not any("{" in unit for unit in units)


def test_an_unknown_name_is_told_with_the_nearest() -> None:
    with pytest.raises(ValueError, match="did you mean 'viscous_friction'"):
        effect_named("viscous_frction")
    with pytest.raises(ValueError, match="did you mean 'level'"):
        effect_named("coulomb_friction").parameter("levl")
