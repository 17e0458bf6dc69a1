"""Every effect of the library says in a plain sentence that it was found."""

from dataclasses import replace
from typing import Any

import pytest

from armlab.diagnosis.result import Claim, Rival
from armlab.diagnosis.torque.rows.simulation import Simulation
from armlab.effects.contract import ANGLE, Effect, Parameter
from armlab.effects.library import EFFECT_IDS, effect_named
from armlab.effects.parameters import ParameterValue
from armlab.report.torque.sentences import finding_sentence
from armlab.report.words import finding_in_words, how_it_falls, variables_in_words
from problem.presets import load_arm

ARM = load_arm("irb120-arm")
SIMULATION = Simulation("nominal", ARM, None)
VECTORS = {
    "centre": (-1e-9, 0.02, 0.06),
    "inertia": (0.0,) * 6,
    "gravity": (0.17, 0.0, -9.81),
    "velocities": (0.1, 1.0),
    "torques": (1.0, 2.0),
}
SENTENCES = {
    "coulomb_friction": "The simulation lacks Coulomb friction at joint 2",
    "viscous_friction": "The simulation lacks viscous friction at joint 2",
    "nonlinear_viscous_friction": "The simulation lacks nonlinear viscous friction at joint 2",
    "stribeck_friction": "The simulation lacks Stribeck friction at joint 2",
    "asymmetric_friction": "The simulation lacks asymmetric friction at joint 2",
    "load_dependent_friction": "The simulation lacks load-dependent friction at joint 2",
    "presliding_hysteresis": "The simulation lacks presliding hysteresis at joint 2",
    "friction_drift": "The simulation lacks friction drift at joint 2",
    "early_friction": ("Friction turns before joint 2 does, which sticks at its reversals: 0.500 N m s (0.4 to 0.6)"),
    "rotor_inertia": "The simulation lacks rotor inertia at joint 2",
    "torque_gain_error": "The torque of joint 2 is read too large or too small: factor 0.500 (0.4 to 0.6)",
    "torque_offset": (
        "The torque of joint 2 has a constant part that the simulation does not have: 0.500 N m (0.4 to 0.6)"
    ),
    "torque_ripple": "The simulation lacks torque ripple at joint 2",
    "joint_elasticity": "The simulation lacks joint elasticity at joint 2",
    "backlash": "The simulation lacks backlash at joint 2",
    "joint_coupling": "The simulation lacks joint coupling at joint 2 from joint 1",
    "gravity_compensator": "A gravity compensator that the simulation does not have acts on joint 2: "
    "stiffness 0.500 N m/rad (0.4 to 0.6)",
    "cable_stiffness": "The simulation lacks cable stiffness at joint 2",
    "payload": (
        "The arm carries a load that the simulation does not have: 0.500 kg (0.4 to 0.6) at (0, 20, 60) mm from joint 2"
    ),
    "inertial_parameter_error": (
        "The mass, centre of mass or inertia of link 2 differs from that in the simulation: mass 0.500 kg (0.4 to 0.6)"
    ),
    "base_tilt": "Gravity points in another direction than in the simulation: (0.170, 0.00, −9.81) m/s²",
    "flexible_base": "What the arm stands on gives way: 0.500 rad/(N m) (0.4 to 0.6)",
    "encoder_offset": ("The zero position of joint 2 differs from that in the simulation: 0.500 rad (0.4 to 0.6)"),
    "geometry_error": "A length or a twist at joint 2 differs from that in the simulation: 0.500 m (0.4 to 0.6)",
    "time_delay": "Torque and motion are recorded at different times: 0.500 s (0.4 to 0.6)",
    "channel_skew": ("A channel of joint 2 is recorded at another time than the other channels: 0.500 s (0.4 to 0.6)"),
    "external_contact": (
        "Something pushes joint 2 during a stretch of time: 0.500 N m (0.4 to 0.6) at most, "
        "from 0.500 s (0.4 to 0.6) to 0.500 s (0.4 to 0.6)"
    ),
    "torque_saturation": (
        "The torque of joint 2 stays below a limit that the simulation does not have: 0.500 N m (0.4 to 0.6)"
    ),
    "friction_curve": "The friction of joint 2 follows a curve over velocity that the simulation does not have",
    "controller_gain_error": (
        "The controller gain of joint 2 differs from that in the simulation: kp 0.500 N m/rad (0.4 to 0.6)"
    ),
    "command_delay": "A command to joint 2 takes effect later than in the simulation: 0.500 s (0.4 to 0.6)",
    "controller_dead_band": (
        "The servo of joint 2 ignores small errors, and in the simulation it does not: 0.500 rad (0.4 to 0.6)"
    ),
    "command_offset": (
        "The command to joint 2 is off by a constant that the simulation does not have: 0.500 rad (0.4 to 0.6)"
    ),
    "unknown": "Something that no known effect explains acts at joint 2",
}


def claim(effect: str, joint: int | None = 2, rivals: tuple[str, ...] = ()) -> Claim:
    """A finding: every scalar 0.5, from 0.4 to 0.6; a robot's has no joint."""
    facts = effect_named(effect)
    values = [(each.name, VECTORS.get(each.name, 0.5), each.unit_for()) for each in facts.parameters]
    parameters = [
        ParameterValue(name, value, None if name in VECTORS else (0.4, 0.6), unit) for name, value, unit in values
    ]
    place = None if facts.where == "robot" else joint
    joints = (joint or 0, 1) if facts.where == "coupling" else ()
    evidence: Any = None
    return Claim(
        effect,
        place,
        joints,
        tuple(parameters),
        "",
        evidence,
        evidence,
        rivals=tuple(Rival(each, place) for each in rivals),
    )


@pytest.mark.parametrize("effect", EFFECT_IDS)
def test_every_effect_has_a_plain_sentence(effect: str) -> None:
    assert finding_sentence(claim(effect), SIMULATION) == SENTENCES[effect]


def test_a_load_of_which_the_arm_feels_only_some_numbers_tells_these() -> None:
    numbers = (ParameterValue("hx", 0.1, (0.09, 0.11), "kg.m"),)
    felt = Claim("payload", 2, (2,), numbers, "", claim("payload").evidence, claim("payload").prediction)
    assert finding_sentence(felt, SIMULATION).endswith("does not have: hx 0.100 kg m (0.09 to 0.11)")


def with_numbers(effect: str, **numbers: tuple[float, tuple[float, float]]) -> Claim:
    """A finding at joint or link 2 whose numbers of these names have another value and interval."""
    found = claim(effect)
    return replace(
        found,
        parameters=tuple(
            replace(each, value=numbers[each.name][0], interval=numbers[each.name][1]) if each.name in numbers else each
            for each in found.parameters
        ),
    )


def test_a_size_whose_interval_reaches_zero_is_told_as_perhaps() -> None:
    load = with_numbers("payload", mass=(0.1, (-0.05, 0.25)))
    assert finding_sentence(load, SIMULATION).startswith(
        "Perhaps the arm carries a load that the simulation does not have: 0.100 kg (−0.1 to 0.2)"
    )
    assert finding_in_words(ARM, load) == "perhaps payload at link 2"
    friction = with_numbers("viscous_friction", coefficient=(0.01, (0.0, 0.02)))
    assert finding_sentence(friction, SIMULATION) == "Perhaps the simulation lacks viscous friction at joint 2"


def test_friction_that_acts_in_one_direction_alone_is_no_doubtful_friction() -> None:
    alone = with_numbers("asymmetric_friction", positive=(0.0, (-0.1, 0.1)), negative=(2.0, (1.9, 2.1)))
    assert finding_in_words(ARM, alone) == "asymmetric friction at joint 2"
    neither = with_numbers("asymmetric_friction", positive=(0.0, (-0.1, 0.1)), negative=(0.0, (-0.1, 0.1)))
    assert finding_in_words(ARM, neither) == "perhaps asymmetric friction at joint 2"


def test_a_load_of_negative_mass_is_called_less_mass() -> None:
    load = with_numbers("payload", mass=(-0.5, (-0.6, -0.4)))
    assert finding_sentence(load, SIMULATION) == (
        "The arm has less mass than the simulation: 0.500 kg (0.4 to 0.6) at (0, 20, 60) mm from joint 2"
    )
    assert finding_in_words(ARM, load) == "less mass than modelled at link 2"


def test_a_link_that_is_off_stays_certain_where_its_mass_may_be_right() -> None:
    for mass, interval, figures in (
        (0.1, (-0.05, 0.25), "mass perhaps 0.100 kg (−0.1 to 0.2)"),
        (-0.5, (-0.6, -0.4), "0.500 kg (0.4 to 0.6) less mass"),
    ):
        link = with_numbers("inertial_parameter_error", mass=(mass, interval))
        assert finding_sentence(link, SIMULATION) == (
            f"The mass, centre of mass or inertia of link 2 differs from that in the simulation: {figures}"
        )


def test_joints_and_links_are_named_as_the_robot_file_does() -> None:
    names = ("shoulder_pan", "shoulder_lift", "elbow")
    arm = replace(ARM, joints=tuple(replace(one, name=name) for one, name in zip(ARM.joints, names, strict=True)))
    named = Simulation("nominal", arm, None)
    coupling = finding_sentence(claim("joint_coupling"), named)
    assert coupling == "The simulation lacks joint coupling at shoulder_lift from shoulder_pan"
    assert finding_sentence(claim("payload"), named).endswith("at (0, 20, 60) mm from shoulder_lift")
    assert "of the link of shoulder_lift differs" in finding_sentence(claim("inertial_parameter_error"), named)


def test_a_sentence_with_a_field_that_nothing_fills_is_refused() -> None:
    with pytest.raises(ValueError, match=r"seal: '\{joint\} leaks' has the fields joint, known are model, place"):
        Effect("seal", "a seal that leaks", sentence="{joint} leaks")
    with pytest.raises(ValueError, match="has the fields level, known are frame, offset"):
        Effect("seal", "a seal that leaks", (Parameter("offset", ANGLE),), sentence="It leaks", figures="{level}")


def test_what_depends_on_nothing_that_is_known_depends_on_the_motion() -> None:
    assert variables_in_words(ARM, ()) == "the motion"
    assert variables_in_words(ARM, ("velocity_2", "time")) == "velocity of joint 2 and time"


def test_where_an_error_falls_most_is_told_where_there_is_another_joint() -> None:
    alone = replace(ARM, joints=ARM.joints[:1], links=None)
    assert how_it_falls(ARM, 2, falls=True) == "falls most at joint 2"
    assert how_it_falls(ARM, 2, falls=False) == "does not fall at joint 2"
    assert how_it_falls(alone, 1, falls=True) == "falls"
