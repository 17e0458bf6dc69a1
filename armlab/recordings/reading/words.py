"""Setup mistakes in words: what is wrong, how the recording is to be read, and which measurement decides."""

import numpy as np

from armlab.recordings.reading.reading import LINK_DATA, OF_LINKS, SPRING, Mistake
from problem.arm import Arm
from problem.joint_words import joint_in_words, joints_in_words, links_in_words

INERTIAL_ERROR = "inertial_parameter_error"
NAMES = {
    "torque_sign": "torque of the other sign",
    "joint_direction": "a joint that counts the other way round",
    "channel_swap": "exchanged columns",
    "channel_order": "columns in another order",
    "axis_coupling": "a column that counts two joints",
    "unsigned_current": "a current without its sign",
    "no_torque": "a column without torque",
    "unit_error": "another unit",
    "gear_ratio": "recorded on the other side of a gear",
    "encoder_offset": "a wrong zero",
    "base_tilt": "gravity of another direction",
    "gravity_compensated_torque": "torque without gravity",
    "dh_convention": "the D-H table of the other convention",
    "inertia_reference": "inertias or centres about another point",
    "link_data_error": "wrong numbers of a link",
    "clock_error": "a clock that is wrong",
    "time_delay": "late torque",
    "channel_skew": "late torque of one joint",
    INERTIAL_ERROR: "links that are not as simulated",
    SPRING: "a spring or a gravity compensator",
}

MEASUREMENTS = {
    "torque_sign": "push {joint} by hand in the direction in which its position grows: the drive's torque has to "
    "point the other way",
    "joint_direction": "turn {joint} alone in the direction that the drawing of the robot calls positive: its "
    "position has to grow",
    "channel_swap": "move one joint alone: the column that changes is its own",
    "channel_order": "move one joint alone: the column that changes is its own",
    "axis_coupling": "move one joint alone: the columns that change are those that count it",
    "unsigned_current": "log the current with its sign, or its direction bit",
    "no_torque": "log the torque or the current of the drive of {joint}",
    "unit_error": "turn a joint by a known angle, or hold a known load, and compare with the numbers of the file",
    "gear_ratio": "turn {joint} by a known angle and compare with its position",
    "encoder_offset": "drive {joint} to the zero of the drawing and read its position",
    "base_tilt": "lay a level on the base, and hold one pose with the arm stretched out",
    "gravity_compensated_torque": "hold one pose with the arm stretched out: the torque has to carry the arm",
    "dh_convention": "measure where the second joint axis is, and compare with the D-H table",
    "inertia_reference": "ask the source of the robot file about which point its inertias are",
    "link_data_error": "weigh {link}, or the tool, and measure its centre",
    "clock_error": "compare the length of a run with a watch",
    "time_delay": "step one joint and compare when torque and position begin to move",
    "channel_skew": "step {joint} alone and compare when torque and position begin to move",
    INERTIAL_ERROR: "weigh the link, or the tool, and measure its centre",
    SPRING: "hold {joint} still in three poses and compare its torque with that of the links",
}


def describe(mistake: Mistake, arm: Arm) -> str:
    """What is wrong, in a clause."""
    numbers = {name: value for name, value, _ in mistake.parameters}
    place = "all joints" if mistake.joint is None else joint_in_words(arm, mistake.joint)
    link = "all links" if mistake.joint is None else links_in_words(arm, [mistake.joint])
    pair = joints_in_words(arm, mistake.joints) if mistake.joints else ""
    form = mistake.form
    texts = {
        SPRING: f"{place} has a spring or a gravity compensator",
        "torque_sign": f"the torque of {place} has the other sign",
        "joint_direction": f"{place} counts the other way round ({form})",
        "channel_swap": f"the {form} columns of {pair} are exchanged",
        "channel_order": f"the {form} columns stand in the order {', '.join(map(str, mistake.joints))}",
        "gravity_compensated_torque": "the gravity of the links of the robot file is taken from the recorded torque"
        if form == OF_LINKS
        else "the recorded torque holds no gravity",
        "dh_convention": f"the D-H table is of the {form} convention",
        "inertia_reference": _reference_text(form),
    }
    if mistake.effect in texts:
        return texts[mistake.effect]
    if mistake.effect == "no_torque":
        return f"{place} has no torque"
    if mistake.effect == "unsigned_current":
        return "the recorded current has no sign: it is a magnitude"
    if mistake.effect == "axis_coupling":
        first, second = (joint_in_words(arm, each) for each in mistake.joints)
        how = "plus" if mistake.value("factor") > 0 else "less"
        also = ", and its torque acts on both" if form != "position" else ""
        return f"the position column of {second} counts {second} {how} {first}{also}"
    value = float(np.sum(next(iter(numbers.values()), 0.0)))
    if mistake.effect == "base_tilt":
        gravity = ", ".join(f"{each:.2f}" for each in np.atleast_1d(np.array(numbers["gravity"])))
        return f"gravity in the base frame is [{gravity}] m/s2: the base is mounted otherwise"
    if mistake.effect == "encoder_offset":
        turn = f"{np.rad2deg(value):+.1f} deg" if mistake.parameters[0][2] == "rad" else f"{value:+.4g} m"
        return f"the zero of {place} is off: add {turn}"
    if mistake.effect == LINK_DATA:
        what = {"centre_sign": "the centre has the other sign", "mass_unit": f"mass data are {value:g} times the true"}
        return f"{link}: {what.get(form, f'inertias are {value:g} times the true')}"
    if mistake.effect in ("time_delay", "channel_skew"):
        return f"the torque of {place} is {1e3 * abs(value):.0f} ms {'late' if value > 0 else 'early'}"
    if mistake.effect == "clock_error":
        return f"the clock counts {value:.3g} times the true time"
    if mistake.effect == "gear_ratio":
        return f"{place} is recorded on the other side of a gear of ratio {value:.4g}"
    return f"the {form} {'' if form == 'time' else f'of {place} '}is {value:.4g} times the true one: another unit"


def _reference_text(form: str) -> str:
    meanings = {
        "inertia": "inertias are about the centres of mass, not about the link frames",
        "centre": "first moments are given as centres of mass",
        "inertia and centre": "centres of mass are given, and inertias about them",
    }
    return f"in the robot file {meanings.get(form, form)}"


def measurement(effect: str, joint: int | None, arm: Arm) -> str:
    """What to measure to decide whether an effect is there."""
    if joint is None:
        return MEASUREMENTS[effect].format(joint="one joint after the other", link="one link after the other")
    return MEASUREMENTS[effect].format(joint=joint_in_words(arm, joint), link=links_in_words(arm, [joint]))
