"""The numbers of the findings as the first screen shows them: a table of joints and kinds of torque, and the bodies."""

from collections.abc import Sequence

import numpy as np

from armlab.common.report.page import Table
from armlab.common.report.wording import format_number, join_words
from armlab.diagnosis.result import MAX_MINOR_GROWTH, Diagnosis
from armlab.diagnosis.torque.rows.simulation import Simulation
from armlab.effects.contract import UNKNOWN, Effect
from armlab.effects.drive import ROTOR_INERTIA_FACTS
from armlab.effects.friction import COULOMB_FACTS, VISCOUS_FACTS
from armlab.effects.library import effect_named
from armlab.effects.links import PAYLOAD_FACTS
from armlab.report.account.account import Account, StatedFinding, account_of
from armlab.report.account.summary import errors_at_start, format_speed, friction_in_words
from armlab.report.torque.sentences import claim_figures, finding_sentence, number_in_words
from armlab.report.words import (
    effect_in_words,
    format_measured,
    format_percent,
    is_doubtful,
    is_of_unknown_links,
    joint_unit,
    may_be_zero,
)
from problem.arm import Arm
from problem.joint_words import joint_in_table, joint_in_words, joints_in_words

OWN_COLUMN: tuple[Effect, ...] = (COULOMB_FACTS, VISCOUS_FACTS, ROTOR_INERTIA_FACTS)
NOTHING, OPTIONAL = "–", ("All friction", "Other", "Left unexplained")


def joint_table(diagnosis: Diagnosis) -> Table:
    """What was found at each joint, minor findings left out: all friction, then by its laws and other effects, and what
    is left. Laws and effects are what is to be added to the simulation.
    """
    arm, account = diagnosis.simulation.arm, account_of(diagnosis)
    found = [each for each in account.findings if each.claim.effect != PAYLOAD_FACTS.id]
    columns = [effect for effect in OWN_COLUMN if any(each.claim.effect == effect.id for each in found)]
    rows = list[list[str]]()
    for number in range(1, len(arm) + 1):
        own = [each for each in found if each.claim.joint == number]
        friction, (*cells, other) = friction_cell(account, number, arm), _cells(own, columns, diagnosis.simulation)
        if friction != NOTHING and (more := _more_friction(diagnosis, number, own)):
            other = more if other == NOTHING else f"{other}; {more}"
        rows.append([joint_in_table(arm, number), friction, *cells, other, _left_cell(account, number, arm)])
    whole = [each for each in found if each.claim.joint is None]
    if whole:
        rows.append(["whole robot", NOTHING, *_cells(whole, columns, diagnosis.simulation), NOTHING])
    headings = ["joint", "All friction", *map(_heading, columns), "Other", "Left unexplained"]
    shown = [place for place, heading in enumerate(headings) if heading not in OPTIONAL or _is_used(rows, place)]
    texts = tuple(at for at, place in enumerate(shown) if headings[place] in ("All friction", "Other"))
    table = [[row[place] for place in shown] for row in rows]
    return Table([headings[place] for place in shown], table, texts, stacked=True)


def _more_friction(diagnosis: Diagnosis, joint: int, own: Sequence[StatedFinding]) -> str:
    """What all friction of a joint has beside its findings, so that these are not taken for the whole."""
    assert diagnosis.model is not None
    laws = [each for each in diagnosis.model.structure.components if each.is_friction_of(joint)]
    told = {each.claim.effect for each in own}
    names = dict.fromkeys(effect_in_words(each.effect) for each in laws if each.effect not in told)
    return f"also {join_words(list(names))} (small or not sure)" if names else ""


def _is_used(rows: Sequence[Sequence[str]], place: int) -> bool:
    return any(row[place] != NOTHING for row in rows)


def friction_cell(account: Account, joint: int, arm: Arm) -> str:
    """`2.10 N m at 0.10 rad/s, 3.40 N m at 1.0 rad/s`, or `at most 0.30 N m`."""
    row = account.friction_of(joint)
    if row is None:
        return NOTHING
    unit = joint_unit(arm, joint - 1)
    low, high = map(_together, friction_in_words(row, unit))
    first, last = (_together(f"{format_speed(speed, unit)}") for speed in row.speeds)
    return f"{low} at {first}, {high} at {last}"


def _left_cell(account: Account, joint: int, arm: Arm) -> str:
    """`18 %, 3.76 N m`, marked where real arms leave less."""
    for each in account.left:
        if each.joint == joint:
            usual = "" if each.usual else ", unusual"
            size = f"{format_number(each.rms)} {joint_unit(arm, joint - 1)}"
            return _together(f"{format_percent(each.share_of_torque)}, {size}{usual}")
    return NOTHING


def joints_without_finding(diagnosis: Diagnosis) -> str:
    """`Nothing of practical size was found at joints 1, 2 and 5.`: joints that no finding names and none mends."""
    guilty = {each.claim.joint for each in account_of(diagnosis).findings if each.claim.effect != PAYLOAD_FACTS.id}
    arm, start = diagnosis.simulation.arm, errors_at_start(diagnosis)
    guilty |= {each.joint for each in diagnosis.fit if start[each.joint - 1] > (1 + MAX_MINOR_GROWTH) * each.after}
    free = [number for number in range(1, len(arm) + 1) if number not in guilty]
    return f"Nothing of practical size was found at {joints_in_words(arm, free)}." if free else ""


def _heading(effect: Effect) -> str:
    return effect.words[0].upper() + effect.words[1:]


def _cells(found: Sequence[StatedFinding], columns: Sequence[Effect], simulation: Simulation) -> list[str]:
    cells = []
    for effect in columns:
        own = [each for each in found if each.claim.effect == effect.id]
        values = [
            f"{'perhaps ' if may_be_zero(value) else ''}{_together(format_measured(value))}{doubt_in_words(each)}"
            for each in own
            for value in each.claim.parameters
        ]
        cells.append("; ".join(values) or NOTHING)
    shown = {effect.id for effect in columns}
    others = [_other_cell(each, simulation) for each in found if each.claim.effect not in shown]
    return [*cells, "; ".join(others) or NOTHING]


def _other_cell(found: StatedFinding, simulation: Simulation) -> str:
    """The effect with the numbers that its sentence has, else with its first one."""
    claim = found.claim
    if claim.effect == UNKNOWN.id:
        return "something that no known effect explains"
    facts, words = effect_named(claim.effect), effect_in_words(claim.effect)
    if facts.where == "link":
        if is_of_unknown_links(claim):
            return "masses and inertias of the links, which of them is not certain"
        return f"{words} of its link: {_together(claim_figures(claim, simulation))}{doubt_in_words(found)}"
    if facts.where == "coupling":
        words = f"{words} from {joint_in_words(simulation.arm, claim.joints[1])}"
    if is_doubtful(claim):
        words = f"perhaps {words}"
    scalars = [each for each in claim.parameters if np.ndim(each.value) == 0]
    numbers = [_together(format_measured(each)) for each in scalars if f"{{{each.name}}}" in facts.figures]
    if not numbers and scalars:
        name = number_in_words(scalars[0].name)
        shown = "" if name in words.split() else f"{name} "
        numbers = [f"{shown}{_together(format_measured(scalars[0]))}"]
    return f"{words}{': ' if numbers else ''}{', '.join(numbers)}{doubt_in_words(found)}"


def _together(text: str) -> str:
    """A value with its interval on one line."""
    return text.replace(" ", "\N{NO-BREAK SPACE}")


def law_in_words(found: StatedFinding) -> str:
    """The name of a finding, then what else it may be; of a class the likeliest first."""
    if found.statement.kind != "class":
        return f"{effect_in_words(found.claim.effect)}{doubt_in_words(found)}"
    first, *others = (effect_in_words(each) for each in found.statement.effects)
    return f"{first}, or {join_words(others, 'or')}" if others else first


def doubt_in_words(found: StatedFinding) -> str:
    """What else it may be: the other names of its class, or that its law is not certain."""
    if found.statement.kind == "class":
        others = [effect_in_words(each) for each in found.statement.effects if each != found.claim.effect]
        return f", or {join_words(others, 'or')}" if others else ""
    return ", law not certain" if found.statement.kind == "cause" else ""


def body_sentences(diagnosis: Diagnosis) -> list[str]:
    """Each payload that has no other name, with its mass, and its centre of mass in the frame of its joint."""
    return [
        f"{finding_sentence(each.claim, diagnosis.simulation)}."
        for each in account_of(diagnosis).findings
        if each.claim.effect == PAYLOAD_FACTS.id and each.statement.kind == "name"
    ]
