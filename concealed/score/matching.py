"""Is a finding right? Injected, in the background, identical to one of them, at the wrong place, or wrong.

What counts as identical is the table of what no motion separates, fixed before any verdict was scored: asymmetric
Coulomb friction is Coulomb friction and an offset; a rotor is its link's inertia where no motion tells; a linear
spring is a cable; a payload is a change of its link; an equal delay is viscous friction.
"""

from typing import Any, Literal

from concealed.score.reading import Judged

Category = Literal["injected", "background", "identical", "misplaced", "unknown", "wrong"]
CONTAINED = {  # what the law of an effect holds as a part
    "stribeck_friction": ("coulomb_friction", "viscous_friction"),
    "asymmetric_friction": ("coulomb_friction", "torque_offset", "viscous_friction"),
    "presliding_hysteresis": ("coulomb_friction",),
    "friction_drift": ("viscous_friction",),
    "cable_stiffness": ("gravity_compensator", "torque_offset"),
    "gravity_compensator": ("cable_stiffness", "torque_offset"),
    "payload": ("inertial_parameter_error",),
    "inertial_parameter_error": ("payload",),
    "rotor_inertia": ("inertial_parameter_error",),
    "torque_gain_error": ("inertial_parameter_error",),
    "sticky_patches": ("coulomb_friction",),
}
DELAY_LIKE = ("viscous_friction",)


def category(case: Judged, finding: dict[str, Any]) -> Category:
    """Of one finding of a case."""
    truth, effect = case.truth, finding["effect"]
    if effect == "unknown":
        return "injected" if any(each["outside"] for each in truth["injected"]) else "unknown"
    if any(same(finding, each) for each in truth["injected"]):
        return "injected"
    if any(same(finding, each) for each in (*truth["background"], *truth["cad_errors"])):
        return "background"
    if any(
        _identical(finding, each, truth) for each in (*truth["injected"], *truth["background"], *truth["cad_errors"])
    ):
        return "identical"
    if _sum_of_parts(finding, truth):
        return "identical"
    return "misplaced" if any(effect == each["effect"] for each in truth["injected"]) else "wrong"


def same(finding: dict[str, Any], effect: dict[str, Any]) -> bool:
    """The same name at the same place."""
    return bool(finding["effect"] == effect["effect"] and finding["joint"] == effect["joint"])


def _identical(finding: dict[str, Any], effect: dict[str, Any], truth: dict[str, Any]) -> bool:
    """One finding that no motion tells from an effect, or that is part of its law."""
    found, place = finding["effect"], finding["joint"]
    if effect["effect"] == "time_delay":
        return found in DELAY_LIKE
    if effect["effect"] == "slosh":
        return found in ("payload", "inertial_parameter_error") and place == truth["joints"]
    if found == "rotor_inertia" and effect["effect"] == "inertial_parameter_error":
        return place in truth["absorbed_rotors"]
    if found not in CONTAINED.get(effect["effect"], ()) or place is None:
        return False
    if found == "payload":
        return bool(place == truth["joints"] and abs(place - effect["joint"]) <= 1)
    if found != "inertial_parameter_error":
        return bool(place == effect["joint"])
    if effect["effect"] == "payload":
        return bool(abs(place - effect["joint"]) <= 1)
    return bool(place >= effect["joint"])


def _sum_of_parts(finding: dict[str, Any], truth: dict[str, Any]) -> bool:
    """Asymmetric friction where Coulomb friction and an offset are both there."""
    if finding["effect"] != "asymmetric_friction":
        return False
    there = {each["effect"] for each in (*truth["injected"], *truth["background"]) if each["joint"] == finding["joint"]}
    return {"coulomb_friction", "torque_offset"} <= there
