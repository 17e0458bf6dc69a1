"""Which name comes first where columns are the same, and which rivals no motion can tell apart."""

from armlab.effects.contract import Candidate

# the widths of the links' errors stand for `inertial_parameter_error`; the others are columns of a first name
SECOND_NAMES = {
    ("inertial_parameter_error", ""),
    ("gravity_compensator", "linear spring"),  # cable_stiffness
    ("asymmetric_friction", "levels"),  # coulomb_friction and torque_offset
}
IDENTICAL_EFFECTS: dict[tuple[str, str], tuple[str, ...]] = {
    ("cable_stiffness", "linear"): ("gravity_compensator",),
    ("gravity_compensator", "linear spring"): ("cable_stiffness",),
    ("rotor_inertia", ""): ("inertial_parameter_error",),
    ("payload", "body"): ("inertial_parameter_error",),
    ("payload", "point"): ("inertial_parameter_error",),
    ("torque_gain_error", ""): ("inertial_parameter_error",),
}


def is_first_name(candidate: Candidate) -> bool:
    """Whether a candidate is looked for itself, and not under the name that comes first for its columns."""
    return (candidate.effect, candidate.form) not in SECOND_NAMES
