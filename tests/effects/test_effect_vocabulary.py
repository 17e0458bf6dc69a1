"""The vocabulary of effects: the ids and parameter names that every part of armlab writes."""

import pytest

from armlab.effects.library import BUILT_IN, EFFECT_IDS, effect_named

FACTS = tuple(family.facts for family in BUILT_IN)

# design, missing physics
IDS = [
    *("coulomb_friction", "viscous_friction", "nonlinear_viscous_friction", "stribeck_friction"),
    *("asymmetric_friction", "load_dependent_friction", "presliding_hysteresis", "friction_drift"),
    *("rotor_inertia", "torque_gain_error", "torque_offset", "torque_ripple", "joint_elasticity", "backlash"),
    *("joint_coupling", "gravity_compensator", "cable_stiffness", "payload", "inertial_parameter_error"),
    *("base_tilt", "flexible_base", "encoder_offset", "geometry_error", "time_delay", "channel_skew"),
    *("external_contact", "torque_saturation", "friction_curve", "early_friction"),
    *("controller_gain_error", "command_delay", "controller_dead_band", "command_offset", "unknown"),
]
# design, contract of the diagnosis
NAMES = {
    *("level", "coefficient", "positive", "negative", "static_level", "velocity", "exponent", "gain", "inertia"),
    *("offset", "order", "amplitude", "phase", "stiffness", "rest", "gap", "mass", "centre", "gravity", "seconds"),
    *("start", "end", "peak", "limit", "initial", "final", "time_constant", "velocities", "torques", "way"),
    *("impulse", "lead", "compliance", "direction", "resonance", "damping"),
}


def test_effects_have_the_agreed_ids_in_the_agreed_order() -> None:
    assert list(EFFECT_IDS) == IDS


def test_parameters_have_the_agreed_names_and_each_is_used() -> None:
    used = {parameter.name for effect in FACTS for parameter in effect.parameters}
    assert used == NAMES


def test_units_follow_the_kind_of_joint() -> None:
    viscous = effect_named("viscous_friction").parameter("coefficient")
    assert viscous.unit_for() == "N.m.s/rad"
    assert viscous.unit_for("prismatic") == "N.s/m"
    assert effect_named("rotor_inertia").parameter("inertia").unit_for() == "kg.m2"
    assert effect_named("encoder_offset").parameter("offset").unit_for() == "rad"


def test_every_unit_can_be_written_for_both_kinds_of_joint() -> None:
    units = [p.unit_for(kind) for effect in FACTS for p in effect.parameters for kind in ("revolute", "prismatic")]
    assert not any("{" in unit for unit in units)


def test_an_unknown_name_is_told_with_the_nearest() -> None:
    with pytest.raises(ValueError, match="did you mean 'viscous_friction'"):
        effect_named("viscous_frction")
    with pytest.raises(ValueError, match="did you mean 'level'"):
        effect_named("coulomb_friction").parameter("levl")
