"""What to do next: at most three instructions, each once, what decides most first."""

from collections.abc import Iterator, Sequence

import numpy as np

from armlab.common.report.wording import join_words
from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.torque.names.findings import FRICTION
from armlab.effects.contract import UNKNOWN
from armlab.effects.drive import TORQUE_OFFSET_FACTS
from armlab.effects.library import effect_named
from armlab.report.account.account import Account, StatedFinding
from armlab.report.words import SOMETHING_UNKNOWN, is_of_unknown_links, name_of_effect, variables_in_words
from problem.joint_words import joint_in_words, joints_in_words, links_in_words

MAX_STEPS = 3
POSES = 5  # at which a joint is held


def next_steps(diagnosis: Diagnosis, account: Account) -> tuple[str, ...]:
    """Instructions for what the told findings leave open, those that explain most first."""
    groups: dict[str, list[StatedFinding]] = {}
    for each in account.findings:
        if each.statement.kind != "name" or each.claim.rivals or is_of_unknown_links(each.claim):
            groups.setdefault(_experiment_of(each), []).append(each)
    steps = dict.fromkeys(
        f"{_purpose(text, own)}: {step[0].lower()}{step[1:]}"
        for text, own in groups.items()
        for step in _steps(text, own, diagnosis, account)
    )
    return tuple(steps)[:MAX_STEPS]


def _purpose(text: str, own: Sequence[StatedFinding]) -> str:
    """What an experiment decides of findings: which of some names, or whether the one that they have."""
    if text == FRICTION:
        return "To know the law of friction"
    effects = (each for one in own for each in (*one.statement.effects, *(rival.effect for rival in one.claim.rivals)))
    names = list(dict.fromkeys(name_of_effect(each) for each in effects))
    if all(is_of_unknown_links(each.claim) for each in own):
        return "To know which link is off"
    if names == [SOMETHING_UNKNOWN]:
        return "To name what is unknown"
    return f"To be sure of {names[0]}" if len(names) == 1 else f"To tell {names[0]} from {join_words(names[1:], 'or')}"


def _experiment_of(each: StatedFinding) -> str:
    """What would tell it from what else it may be: laws of friction that follow the speed need the same."""
    facts = effect_named(each.claim.effect)
    return FRICTION if facts.cause == FRICTION and facts.axis == "velocity" else facts.experiment


def _steps(text: str, own: Sequence[StatedFinding], diagnosis: Diagnosis, account: Account) -> Iterator[str]:
    arm = diagnosis.simulation.arm
    joints = sorted({each.claim.joint for each in own if each.claim.joint is not None})
    if all(is_of_unknown_links(each.claim) for each in own):
        yield "Compare the masses and centres of all links with CAD data, or repeat the motion with a known payload."
    elif text == FRICTION and any(account.friction_of(joint) for joint in joints):
        yield _friction_step(joints, diagnosis, account)
    elif text == TORQUE_OFFSET_FACTS.experiment and joints:
        yield _offset_step(joints, diagnosis)
    elif text:
        is_link = effect_named(own[0].claim.effect).where == "link"
        place = "" if not joints else links_in_words(arm, joints) if is_link else joints_in_words(arm, joints)
        depends = {each.claim.depends_on for each in own if each.claim.effect == UNKNOWN.id}
        variables = depends.pop() if len(depends) == 1 else ()
        of = f"{place}{f', by {variables_in_words(arm, variables)}' if variables else ''}"
        own_place = "the link" if is_link else "the joint"
        if len(joints) == 1 and not variables and own_place in text:
            text, of = text.replace(own_place, place), ""
        yield f"{text[0].upper()}{text[1:]}{f' ({of})' if of else ''}."


def _friction_step(joints: Sequence[int], diagnosis: Diagnosis, account: Account) -> str:
    """Constant speeds over the range of the recording, the middle one at equal ratios."""
    arm = diagnosis.simulation.arm
    rows = [each for each in (account.friction_of(joint) for joint in joints) if each is not None]
    unit = "rad/s" if all(arm.joints[joint - 1].kind == "revolute" for joint in joints) else "rad/s (m/s)"
    one = "" if len(joints) == 1 else ", one at a time,"
    low, high = min(each.speeds[0] for each in rows), max(each.speeds[1] for each in rows)
    speeds = ", ".join(f"{each:.2g}" for each in (low, np.sqrt(low * high), high))
    return f"Move {joints_in_words(arm, joints)}{one} at constant speeds of {speeds} {unit}, ten times each way."


def _offset_step(joints: Sequence[int], diagnosis: Diagnosis) -> str:
    """Poses over the travel of the recording, reached from both sides, so that friction falls out."""
    arm, observed = diagnosis.simulation.arm, diagnosis.observed
    assert observed is not None
    parts = []
    for joint in joints:
        position = observed.kept("position")[:, joint - 1]
        low, high = (float(each) for each in np.quantile(position, (0.05, 0.95)))
        unit = "rad" if arm.joints[joint - 1].kind == "revolute" else "m"
        parts.append(
            f"{joint_in_words(arm, joint)} at {POSES} positions from {low:.2g} to {high:.2g} {unit}".replace("-", "−")
        )
    return f"Hold {join_words(parts)}, 5 s each, reached from both sides."
