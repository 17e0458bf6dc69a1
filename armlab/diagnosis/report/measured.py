"""The numbers of the findings as the first screen shows them: a table of joints and kinds of torque, and the bodies."""

from collections.abc import Sequence

import numpy as np

from armlab.common.report.page import Table
from armlab.diagnosis.report.sentences import finding_sentence
from armlab.diagnosis.report.words import effect_in_words, format_measured
from armlab.diagnosis.result import Claim, Diagnosis
from armlab.effects.contract import UNKNOWN, Effect
from armlab.effects.drive import ROTOR_INERTIA_FACTS
from armlab.effects.friction import COULOMB_FACTS, VISCOUS_FACTS
from armlab.effects.library import effect_named
from armlab.effects.links import PAYLOAD_FACTS

OWN_COLUMN: tuple[Effect, ...] = (COULOMB_FACTS, VISCOUS_FACTS, ROTOR_INERTIA_FACTS)
NOTHING = "–"


def joint_table(diagnosis: Diagnosis) -> Table:
    """What is to be added to the simulation, joint by joint, with units and 95 % intervals."""
    arm, rows = diagnosis.simulation.arm, []
    for number, joint in enumerate(arm.joints, 1):
        own = [claim for claim in diagnosis.claims if claim.joint == number and claim.effect != PAYLOAD_FACTS.id]
        rows.append([f"{number}  {joint.name}", *_cells(own)])
    whole = [claim for claim in diagnosis.claims if claim.joint is None]
    if whole:
        rows.append(["whole robot", *_cells(whole)])
    headings = ["joint", *(_heading(effect) for effect in OWN_COLUMN), "other"]
    return Table(headings, rows, (4,), stacked=True)


def _heading(effect: Effect) -> str:
    return effect.words[0].upper() + effect.words[1:]


def _cells(claims: Sequence[Claim]) -> list[str]:
    cells = []
    for effect in OWN_COLUMN:
        own = [claim for claim in claims if claim.effect == effect.id]
        cells.append("; ".join(format_measured(each) for claim in own for each in claim.parameters) or NOTHING)
    columns = {effect.id for effect in OWN_COLUMN}
    others = [_other_cell(claim) for claim in claims if claim.effect not in columns]
    return [*cells, "; ".join(others) or NOTHING]


def _other_cell(claim: Claim) -> str:
    """The effect, and the number that its facts name first."""
    if claim.effect == UNKNOWN.id:
        return "something that no known effect explains"
    words = effect_in_words(claim.effect)
    if effect_named(claim.effect).where == "link":
        words = f"{words} of its link"
    scalars = [each for each in claim.parameters if np.ndim(each.value) == 0]
    return f"{words}: {scalars[0].name.replace('_', ' ')} {format_measured(scalars[0])}" if scalars else words


def body_sentences(diagnosis: Diagnosis) -> list[str]:
    """Each payload with its mass, and where its centre of mass is in the frame of its joint."""
    return [
        f"{finding_sentence(claim, diagnosis.simulation)}."
        for claim in diagnosis.claims
        if claim.effect == PAYLOAD_FACTS.id
    ]
