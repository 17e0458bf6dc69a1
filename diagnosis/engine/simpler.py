"""The simpler laws that a law contains, and has to be better than."""

from collections.abc import Sequence

from diagnosis.engine.columns import Group
from diagnosis.engine.solver import EXPECTED

SPECIAL = ("nonlinear_viscous_friction", "stribeck_friction", "asymmetric_friction", "presliding_hysteresis",
           "friction_drift", "load_dependent_friction")  # fmt: skip
FRICTION = ("coulomb_friction", "viscous_friction")  # what every joint has
SPRINGS = ("cable_stiffness", "gravity_compensator")  # a constant is a part of them


def simpler_than(groups: Sequence[Group], number: int) -> tuple[int, ...]:
    """Numbers of the usual friction that a special law of friction has to be better than, or of a spring's constant."""
    candidate = groups[number].candidate
    wanted = {name for name in candidate.replaces if name in EXPECTED}
    if candidate.effect in SPECIAL:
        wanted |= set(FRICTION)
    if candidate.effect in SPRINGS:
        wanted |= {"torque_offset"}
    return tuple(
        number
        for number, each in enumerate(groups)
        if each.candidate.effect in wanted and each.candidate.joint == candidate.joint
    )
