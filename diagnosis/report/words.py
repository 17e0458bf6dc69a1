"""The words of a diagnosis: effects, places, numbers with units, and the verdict in two sentences."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from armlab.diagnosis.result import Claim, Diagnosis, JointFit, Parameter, Rival
from diagnosis.report.memory import white
from diagnosis.report.rows import shown
from problem.arm import Arm

OF_LINKS = ("payload", "inertial_parameter_error")
BRIEF = 24  # letters
DIGITS = 4  # of a parameter
COMPONENTS = {3: ("x", "y", "z"), 6: ("xx", "yy", "zz", "xy", "xz", "yz")}
NAMED = 3  # findings that the verdict names; the others are counted


def plain(effect: str) -> str:
    """An effect in words."""
    special = {"coulomb_friction": "Coulomb friction", "stribeck_friction": "Stribeck friction"}
    return special.get(effect, effect.replace("_", " "))


def place(effect: str, joint: int | None, joints: Sequence[int] = ()) -> str:
    """Where an effect is: a joint, a link, a coupling, or the whole robot."""
    if joint is None:
        return "the whole robot"
    if effect in OF_LINKS:
        return f"link {joint}"
    return f"joint {joint} from joint {joints[1]}" if len(joints) > 1 else f"joint {joint}"


def told(claim: Claim | Rival) -> str:
    """An effect with its place."""
    if claim.effect == "unknown":
        return f"something unknown at {place(claim.effect, claim.joint)}"
    where = place(claim.effect, claim.joint, claim.joints)
    return f"{plain(claim.effect)} {'of' if claim.joint is None else 'at'} {where}"


def brief(name: str) -> str:
    """A file's name where there is little room."""
    return name if len(name) <= BRIEF else f"{name[: BRIEF - 1]}…"


def number(value: float, digits: int = 3) -> str:
    """The digits that count, no needless exponent."""
    if not math.isfinite(value):
        return "none" if math.isnan(value) else ("∞" if value > 0 else "−∞")
    size = abs(value)
    text = f"{value:.{digits}g}"
    if 10**digits <= size < 1e6:
        text = f"{value:.0f}"
    elif size >= 1e6 or 0 < size < 1e-4:
        text = f"{value:.{digits - 1}e}"
    return text.replace("-", "−")


def unit(text: str) -> str:
    """A unit as people write it: N m s/rad, kg m²."""
    return "" if text == "1" else text.replace("m2", "m²").replace("s2", "s²").replace(".", " ")


def joint_unit(arm: Arm, joint: int) -> str:
    """Unit of the torque (force) of a joint, from 0."""
    return "N m" if arm.joints[joint].kind == "revolute" else "N"


@dataclass(frozen=True)
class Row:
    """One number of a finding as the page shows it."""

    name: str
    value: str
    interval: str
    unit: str


def rows_of(parameter: Parameter) -> list[Row]:
    """A parameter as rows, a vector's components one by one."""
    values = np.atleast_1d(np.array(parameter.value, dtype=float)).tolist()
    found = parameter.interval
    pairs = [None] * len(values) if found is None else np.array(found, dtype=float).reshape(-1, 2).tolist()
    names = [parameter.name]
    if len(values) > 1:
        names = [f"{parameter.name} {part}" for part in COMPONENTS.get(len(values), range(1, len(values) + 1))]
    size = unit(parameter.unit)
    return [
        Row(name, number(value, DIGITS), "–" if pair is None else _between(*pair), size)
        for name, value, pair in zip(names, values, pairs, strict=True)
    ]


def _between(low: float, high: float) -> str:
    return f"{number(low, DIGITS)} to {number(high, DIGITS)}"


def probability(value: float) -> str:
    """A p-value that does not pretend to more than it knows."""
    return "below 1e−12" if value < 1e-12 else number(value)


def verdict_sentences(diagnosis: Diagnosis) -> tuple[str, str]:
    """What is missing, and how much better the model is with it."""
    if diagnosis.status == "inconclusive":
        return "These recordings allow no verdict.", diagnosis.summary
    worst = max(diagnosis.fit, key=lambda each: each.after, default=None)
    arm = diagnosis.simulation.arm
    subject = "The rigid-body model" if diagnosis.simulation.kind == "refit" else "The simulation"
    if diagnosis.status == "none":
        left = f"On data that took no part the largest error is {_sized(worst, arm)}." if worst else ""
        return f"Nothing is missing: t{subject[1:]} explains the recordings down to their noise.", left
    return f"{subject} of {arm.name} misses {_listed(diagnosis.claims)}.", gain_sentence(diagnosis)


def _sized(worst: JointFit, arm: Arm) -> str:
    size = joint_unit(arm, worst.joint - 1)
    return f"{number(worst.after)} {size} (joint {worst.joint}, noise {number(worst.noise_floor)} {size})"


def _listed(claims: Sequence[Claim]) -> str:
    known = [_with_rivals(claim) for claim in claims if claim.effect != "unknown"]
    unknown = [f"joint {claim.joint}" for claim in claims if claim.effect == "unknown"]
    parts = known[:NAMED]
    if len(known) > NAMED:
        parts.append(f"{len(known) - NAMED} more effect{'s' if len(known) > NAMED + 1 else ''} (below)")
    if unknown:
        parts.append(f"something that no known effect explains at {joined(unknown)}")
    return joined(parts)


def _with_rivals(claim: Claim) -> str:
    rivals = list(dict.fromkeys(plain(each.effect) for each in claim.rivals if each.effect != claim.effect))
    return told(claim) + (f" (or {joined(rivals, 'or')})" if rivals else "")


def gain_sentence(diagnosis: Diagnosis) -> str:
    """How far the held-out error falls, at the joint that gains most, and how much of the gap that is."""
    data = shown(diagnosis)
    refit = np.array([each.before for each in diagnosis.fit])
    start = refit if data is None or data.given is None else data.held_out_rms(data.given)
    after = np.array([each.after for each in diagnosis.fit])
    joint = int(np.argmax(start / np.maximum(after, 1e-300)))
    best = diagnosis.fit[joint]
    size = joint_unit(diagnosis.simulation.arm, joint)
    before = f"{number(best.before)} {size} with the rigid body refitted"
    if start is not refit:
        before = f"{number(float(start[joint]))} {size} ({before})"
    closed = "" if best.gap_closed is None else f", {100 * min(best.gap_closed, 1.0):.0f} % of the way to the noise"
    if data is not None and not white(data.final[:, joint], joint, data.observed):
        closed = "; what is left there still holds structure"
    this = "With it" if len(diagnosis.claims) == 1 else "With these"
    return (
        f"{this} the error on data that took no part falls from {before} to {number(best.after)} {size} "
        f"at joint {best.joint}{closed}."
    )


def joined(parts: Sequence[str], last: str = "and") -> str:
    """a, b and c."""
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} {last} {parts[-1]}"
