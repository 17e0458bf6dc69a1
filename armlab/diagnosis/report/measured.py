"""The numbers of the findings as the first screen shows them: a table of joints and kinds of torque, and the bodies."""

from collections.abc import Sequence

import numpy as np

from armlab.common.report.page import Table
from armlab.diagnosis.report.sentences import claim_figures, finding_sentence, number_in_words, rivals_in_words
from armlab.diagnosis.report.words import effect_in_words, format_measured, is_doubtful, may_be_zero
from armlab.diagnosis.result import Claim, Diagnosis
from armlab.diagnosis.simulation import Simulation
from armlab.diagnosis.story import claims_by_share
from armlab.effects.contract import UNKNOWN, Effect
from armlab.effects.drive import ROTOR_INERTIA_FACTS
from armlab.effects.friction import COULOMB_FACTS, VISCOUS_FACTS
from armlab.effects.library import effect_named
from armlab.effects.links import PAYLOAD_FACTS
from problem.joint_words import joint_in_table, joint_in_words, joints_in_words

OWN_COLUMN: tuple[Effect, ...] = (COULOMB_FACTS, VISCOUS_FACTS, ROTOR_INERTIA_FACTS)
NOTHING = "–"


def joint_table(diagnosis: Diagnosis) -> Table:
    """What is to be added to the simulation at each joint of a finding, with units and 95 % intervals."""
    arm, claims = diagnosis.simulation.arm, [each for each in diagnosis.claims if each.effect != PAYLOAD_FACTS.id]
    columns = [effect for effect in OWN_COLUMN if any(claim.effect == effect.id for claim in claims)]
    rows = []
    for number in range(1, len(arm) + 1):
        own = [claim for claim in claims if claim.joint == number]
        if own:
            rows.append([joint_in_table(arm, number), *_cells(own, columns, diagnosis.simulation)])
    whole = [claim for claim in claims if claim.joint is None]
    if whole:
        rows.append(["whole robot", *_cells(whole, columns, diagnosis.simulation)])
    if all(row[-1] == NOTHING for row in rows):
        return Table(["joint", *map(_heading, columns)], [row[:-1] for row in rows], (), stacked=True)
    return Table(["joint", *map(_heading, columns), "Other"], rows, (len(columns) + 1,), stacked=True)


def joints_without_finding(diagnosis: Diagnosis) -> str:
    """`Nothing was found at joints 1, 2 and 5.`; empty where each has a finding."""
    guilty = {claim.joint for claim in diagnosis.claims if claim.effect != PAYLOAD_FACTS.id}
    arm = diagnosis.simulation.arm
    free = [number for number in range(1, len(arm) + 1) if number not in guilty]
    return f"Nothing was found at {joints_in_words(arm, free)}." if free else ""


def _heading(effect: Effect) -> str:
    return effect.words[0].upper() + effect.words[1:]


def _cells(claims: Sequence[Claim], columns: Sequence[Effect], simulation: Simulation) -> list[str]:
    cells = []
    for effect in columns:
        own = [claim for claim in claims if claim.effect == effect.id]
        values = [
            f"{'perhaps ' if may_be_zero(each) else ''}{_together(format_measured(each))}{_rivals(claim)}"
            for claim in own
            for each in claim.parameters
        ]
        cells.append("; ".join(values) or NOTHING)
    shown = {effect.id for effect in columns}
    others = [_other_cell(claim, simulation) for claim in claims if claim.effect not in shown]
    return [*cells, "; ".join(others) or NOTHING]


def _other_cell(claim: Claim, simulation: Simulation) -> str:
    """The effect with the numbers that its sentence has, else with its first one."""
    if claim.effect == UNKNOWN.id:
        return "something that no known effect explains"
    facts, words = effect_named(claim.effect), effect_in_words(claim.effect)
    if facts.where == "link":
        return f"{words} of its link: {_together(claim_figures(claim, simulation))}{_rivals(claim)}"
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
    return f"{words}{': ' if numbers else ''}{', '.join(numbers)}{_rivals(claim)}"


def _together(text: str) -> str:
    """A value with its interval on one line."""
    return text.replace(" ", "\N{NO-BREAK SPACE}")


def _rivals(claim: Claim) -> str:
    rivals = rivals_in_words(claim)
    return f", or {rivals}" if rivals else ""


def body_sentences(diagnosis: Diagnosis) -> list[str]:
    """Each payload with its mass, and where its centre of mass is in the frame of its joint."""
    return [
        f"{finding_sentence(claim, diagnosis.simulation)}."
        for claim, _ in claims_by_share(diagnosis)
        if claim.effect == PAYLOAD_FACTS.id
    ]
