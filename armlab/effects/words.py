"""Effects, their places and their numbers in words."""

from collections.abc import Sequence

import numpy as np

from armlab.common.report.wording import format_number, format_unit
from armlab.effects.contract import Candidate
from armlab.effects.library import effect_named
from armlab.effects.parameters import ParameterValue
from problem.arm import Arm
from problem.joint_words import joint_in_words, links_in_words


def place_in_words(arm: Arm, effect: str, joint: int | None, joints: Sequence[int] = ()) -> str:
    """Where an effect is: a joint, a link, a coupling, or the whole robot."""
    if joint is None:
        return "the whole robot"
    if effect_named(effect).where == "link":
        return links_in_words(arm, (joint,))
    driver = f" from {joint_in_words(arm, joints[1])}" if len(joints) > 1 else ""
    return f"{joint_in_words(arm, joint)}{driver}"


def at_place(arm: Arm, name: str, effect: str, joint: int | None, joints: Sequence[int] = ()) -> str:
    """`friction at elbow`, `tilt of the whole robot`: a name of an effect with its place."""
    return f"{name} {'of' if joint is None else 'at'} {place_in_words(arm, effect, joint, joints)}"


def component_in_words(arm: Arm, part: Candidate, parameters: Sequence[ParameterValue]) -> str:
    """`joint elasticity at elbow (26420 N m/rad)`: a component of a model; several numbers have their names."""
    numbers = []
    for each in parameters:
        name = each.name.replace("_", " ") if len(parameters) > 1 else ""
        values = map(format_number, np.ravel(each.value).tolist())
        numbers.append(" ".join(filter(None, [name, *values, format_unit(each.unit)])))
    named = at_place(arm, part.facts.words, part.effect, part.joint, part.joints)
    return f"{named} ({', '.join(numbers)})"
