"""Words and numbers of a diagnosis: effects, places, and values with units and intervals."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from string import Formatter

import numpy as np

from armlab.common.report.wording import format_number, format_unit, join_words
from armlab.diagnosis.result import Claim, Member, Rival, Survival
from armlab.diagnosis.settings import Baseline
from armlab.diagnosis.torque.names.findings import Statement
from armlab.diagnosis.torque.rows.simulation import Simulation
from armlab.effects.contract import UNKNOWN
from armlab.effects.library import effect_named
from armlab.effects.links import INERTIAL_ERROR_FACTS, PAYLOAD_FACTS
from armlab.effects.parameters import ParameterValue
from armlab.effects.words import at_place
from problem.arm import Arm
from problem.joint_words import joint_in_words

COMPARED: Mapping[Baseline, str] = {
    "nominal": "simulation as given",
    "refit": "rigid body refitted",
    "simulated": "torque simulated elsewhere",
}
STARTED: Mapping[Baseline, str] = {  # whose error falls
    "nominal": "the simulation",
    "refit": "the refitted rigid body",
    "simulated": "the simulated torque",
}
SOMETHING_UNKNOWN = "something unknown"
LESS_MASS = "less mass than modelled"
LINKS_IN_WORDS = "masses and inertias"  # where these data do not tell which of them is off
MAX_NAME_LENGTH = 24  # letters
PARAMETER_DIGITS = 4  # of a parameter
COMPONENT_NAMES = {3: ("x", "y", "z"), 6: ("xx", "yy", "zz", "xy", "xz", "yz")}
MAX_LENGTH_IN_MM = 0.1  # m
VALUE_DIGITS = 3  # of a value with its interval


def how_it_falls(arm: Arm, joint: int, falls: bool) -> str:
    """`falls most at joint 2`, or `falls` where there is no other joint: an error with what was found."""
    if len(arm) == 1:
        return "falls" if falls else "does not fall"
    return f"{'falls most' if falls else 'does not fall'} at {joint_in_words(arm, joint)}"


def effect_in_words(effect: str) -> str:
    """The name of an effect in a sentence; ValueError for an id that no effect has."""
    return effect_named(effect).words


def name_of_effect(effect: str) -> str:
    """The name of an effect without its place: links are masses and inertias, what has no name is unknown."""
    if effect == UNKNOWN.id:
        return SOMETHING_UNKNOWN
    return LINKS_IN_WORDS if effect == INERTIAL_ERROR_FACTS.id else effect_in_words(effect)


def compared_in_words(simulation: Simulation) -> str:
    """What the recording is compared with, before anything is found."""
    return COMPARED[simulation.kind]


def finding_in_words(arm: Arm, claim: Claim) -> str:
    """A finding with its place."""
    if is_of_unknown_links(claim):
        return f"{LINKS_IN_WORDS} of the links"
    return at_place(arm, claim_in_words(claim), claim.effect, claim.joint, claim.joints)


def stated_in_words(arm: Arm, claim: Claim, statement: Statement) -> str:
    """A finding with its place, by all names of its class, the likeliest first."""
    if statement.kind != "class":
        return finding_in_words(arm, claim)
    names = join_words([effect_in_words(each) for each in statement.effects], "or")
    return at_place(arm, names, claim.effect, claim.joint, claim.joints)


def rival_in_words(arm: Arm, rival: Rival) -> str:
    """An effect that fits as well, with its place."""
    return at_place(arm, effect_in_words(rival.effect), rival.effect, rival.joint, rival.joints)


def statement_in_words(statement: Statement) -> str:
    """How sure a finding is: `named with probability 0.96`, `backlash or joint elasticity, together 0.93`."""
    chance = format_chance(statement.probability)
    if statement.kind == "class":
        return f"{join_words([effect_in_words(each) for each in statement.effects], 'or')}, together {chance}"
    if statement.kind == "cause":
        return f"its law is not certain, the cause has probability {chance}"
    return f"named with probability {chance}"


def survival_in_words(survival: Survival) -> str:
    """How often a name is found again: `returns in 19 of 20 simulated recordings, appears in 1 of 10 without it`."""
    return (
        f"returns in {survival.returned} of {survival.simulated} simulated recordings, "
        f"appears in {survival.appeared} of {survival.left_out} without it"
    )


def member_in_words(arm: Arm, member: Member) -> str:
    """A name that a finding may have, with its place."""
    return SOMETHING_UNKNOWN if member.effect == UNKNOWN.id else rival_in_words(arm, member.as_rival)


def format_chance(value: float) -> str:
    """A probability with two digits, never 1."""
    return "above 0.99" if value > 0.99 else f"{value:.2f}"


def claim_in_words(claim: Claim) -> str:
    """The name of a finding, `perhaps` before one that may be nothing."""
    return f"{'perhaps ' if is_doubtful(claim) else ''}{claim_name(claim)}"


def claim_name(claim: Claim) -> str:
    """The name of a finding: of its effect, but a load that weighs less than nothing is called what it is."""
    if claim.effect == UNKNOWN.id:
        return SOMETHING_UNKNOWN
    if is_negative_load(claim):
        return LESS_MASS
    if is_of_unknown_links(claim):
        return LINKS_IN_WORDS
    return f"{'too much ' if is_excess(claim) else ''}{effect_in_words(claim.effect)}"


def is_of_unknown_links(claim: Claim) -> bool:
    """Whether links are off, and these data do not tell which: its link is the one that is missed most."""
    return effect_named(claim.effect).where == "link" and not claim.parameters


def is_negative_load(claim: Claim) -> bool:
    """Whether a load has a negative mass: then the arm has less mass there than the model."""
    mass = next((each.value for each in claim.parameters if each.name == "mass"), 0.0)
    return claim.effect == PAYLOAD_FACTS.id and isinstance(mass, float) and mass < 0


def is_excess(claim: Claim) -> bool:
    """Whether the simulation has more of a law than the arm: the first number of the finding takes some off."""
    first = next((each.value for each in claim.parameters if each.name in claim.simulated), 0.0)
    return isinstance(first, float) and first < 0


def is_doubtful(claim: Claim) -> bool:
    """Whether a finding may be nothing: the interval of its size reaches zero.

    The size is the number that stands first in the effect's figures, with all others of its unit; of an effect without
    figures, all its numbers. The numbers of a link that is off may each be nothing while the link is off.
    """
    facts = effect_named(claim.effect)
    if facts.in_links:
        return False
    first = next((field for _, field, _, _ in Formatter().parse(facts.figures) if field is not None), None)
    unit = next((each.unit for each in claim.parameters if each.name == first), None)
    sizes = [each for each in claim.parameters if np.ndim(each.value) == 0 and unit in (None, each.unit)]
    return bool(sizes) and all(map(may_be_zero, sizes))


def may_be_zero(parameter: ParameterValue) -> bool:
    """Whether the interval of a scalar reaches zero."""
    if parameter.interval is None or np.ndim(parameter.value) > 0:
        return False
    low, high = np.asarray(parameter.interval, dtype=float).tolist()
    return bool(low <= 0 <= high)


def variable_in_words(arm: Arm, name: str) -> str:
    """`velocity of shoulder_lift` of a variable like `velocity_2`; others, like `time`, as they are."""
    kind, _, joint = name.rpartition("_")
    return f"{kind} of {joint_in_words(arm, int(joint))}" if kind and joint.isdigit() else name


def variables_in_words(arm: Arm, names: Sequence[str]) -> str:
    """Variables that something depends on, with `and`; `the motion` where none is known."""
    return join_words([variable_in_words(arm, name) for name in names]) if names else "the motion"


def shorten_name(name: str) -> str:
    """The name of a file, cut to MAX_NAME_LENGTH letters."""
    return name if len(name) <= MAX_NAME_LENGTH else f"{name[: MAX_NAME_LENGTH - 1]}…"


def joint_unit(arm: Arm, joint: int) -> str:
    """Unit of the torque (force) of a joint, from 0."""
    return "N m" if arm.joints[joint].kind == "revolute" else "N"


@dataclass(frozen=True)
class ParameterRow:
    """One number of a finding as the page shows it."""

    name: str
    value: str
    interval: str
    unit: str


def parameter_rows(parameter: ParameterValue) -> list[ParameterRow]:
    """A parameter as rows, a vector's components one by one."""
    values = np.atleast_1d(np.array(parameter.value, dtype=float)).tolist()
    interval = parameter.interval
    pairs = [None] * len(values) if interval is None else np.array(interval, dtype=float).reshape(-1, 2).tolist()
    names = [parameter.name]
    if len(values) > 1:
        names = [f"{parameter.name} {part}" for part in COMPONENT_NAMES.get(len(values), range(1, len(values) + 1))]
    size = format_unit(parameter.unit)
    return [
        ParameterRow(
            name, format_number(value, PARAMETER_DIGITS), "–" if pair is None else _format_interval(*pair), size
        )
        for name, value, pair in zip(names, values, pairs, strict=True)
    ]


def _format_interval(low: float, high: float) -> str:
    return f"{format_number(low, PARAMETER_DIGITS)} to {format_number(high, PARAMETER_DIGITS)}"


def format_probability(value: float) -> str:
    """A p-value with three digits; a smaller one than 1e-12 only as this bound."""
    return "below 1e−12" if value < 1e-12 else format_number(value)


def format_share(value: float) -> str:
    """A share in percent, `below 0.1 %` where it is that small, `above 99.9 %` where it is nearly all."""
    if 0.9995 <= value < 1 - 1e-9:
        return "above 99.9 %"
    return "below 0.1 %" if 0 <= value < 0.001 else f"{100 * value:.1f} %"


def format_percent(value: float) -> str:
    """A share in whole percent, with one digit below that: 12 %, 0.4 %."""
    return f"{100 * value:.0f} %" if value >= 0.01 else f"{format_number(100 * value, 1)} %"


def format_growth(before: float, after: float) -> str:
    """`42 times as large` of an error without a finding, before, and with it, after."""
    ratio = format_number(before / max(after, 1e-300), 3 if before < 2 * after else 2)
    return "as large" if ratio == "1" else f"{ratio} times as large"


def format_gap(closed: float | None) -> str:
    """The share of a gap that is closed: 100 % at most, as the noise floor is an estimate too."""
    return "–" if closed is None else f"{100 * min(closed, 1.0):.1f} %"


def format_measured(parameter: ParameterValue) -> str:
    """`2.31 N m (2.28 to 2.34)` of a scalar: three digits, and an interval as fine as it is wide."""
    value, unit, scale = float(np.asarray(parameter.value)), format_unit(parameter.unit), 1.0
    if parameter.unit == "m" and abs(value) < MAX_LENGTH_IN_MM:
        unit, scale = "mm", 1e3
    shown = f"{format_fixed(scale * value)} {unit}".rstrip()
    if parameter.interval is None:
        return shown
    low, high = np.asarray(parameter.interval, dtype=float).tolist()
    return f"{shown} ({format_interval(scale * low, scale * high)})"


def format_fixed(value: float) -> str:
    """A number with three digits, zeros at its end included."""
    if value and not 1e-4 <= abs(value) < 1e3:
        return format_number(value)
    return f"{value:#.{VALUE_DIGITS}g}".rstrip(".").replace("-", "−")


def format_interval(low: float, high: float) -> str:
    """Both ends with as many decimals as show half the width."""
    half = (high - low) / 2
    if not math.isfinite(half) or half <= 0 or max(abs(low), abs(high)) >= 1e6 or half < 1e-7:
        return f"{format_number(low)} to {format_number(high)}"
    decimals = max(-math.floor(math.log10(half)), 0)
    return f"{low:.{decimals}f} to {high:.{decimals}f}".replace("-", "−")
