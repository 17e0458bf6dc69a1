"""Effects take the likeliest names of their findings: what fits best need not be likeliest."""

from dataclasses import replace

import numpy as np

from armlab.diagnosis.result import Member
from armlab.diagnosis.torque.belief import Belief
from armlab.diagnosis.torque.columns.solver import State
from armlab.diagnosis.torque.evidence.evidence import Evidence, Judge
from armlab.diagnosis.torque.evidence.plausibility import doubtful_names
from armlab.diagnosis.torque.evidence.unknown import remaining
from armlab.diagnosis.torque.names.decide import naming_of
from armlab.diagnosis.torque.names.weighing import weigh_effect
from armlab.diagnosis.torque.search.fitted_model import FittedModel
from armlab.diagnosis.torque.search.search import Search, Step
from armlab.effects.contract import UNKNOWN

Found = tuple[int, State, Evidence]  # a group beside a model, the state with it, and what speaks for it


def with_likeliest_names(belief: Belief) -> Belief:
    """Effects that passed, each with the likeliest name of its finding where that has a name or a class of names.

    A search takes what raises the score most. A name whose numbers cannot be believed takes no place.
    """
    exact = not remaining(belief)
    for group in belief.effects:
        model, out = belief.model, belief.effects
        if group not in out:
            continue
        weighed, own = weigh_effect(model, group, out, belief.left), model.candidate(group)
        naming = naming_of(weighed, model.design.settings)
        first = naming.answers[0]
        if naming.is_unknown or first.effect == UNKNOWN.id or first.is_of(own.effect, own.joint):
            continue
        without = replace(model, state=model.state.minus(group))
        likelier = _with_name(without, first)
        if likelier is None:
            continue
        other, state, evidence = likelier
        if not doubtful_names(replace(model, state=state), {other: evidence}, exact=exact):
            what = model.candidate(other)
            text = f"{own.effect} {own.joint} -> {what.effect} {what.joint}, which is likelier"
            step = Step(text, model.solver.fit(state).score)
            kept = {each: known for each, known in out.items() if each in state.groups}
            belief = replace(belief.with_state(state, step), effects=kept | {other: evidence})
    return belief


def _with_name(model: FittedModel, answer: Member) -> Found | None:
    """The model with the effect of a name that raises the score most; None where none raises it."""
    search = Search(model.solver, model.design.settings, True, 0)
    for group in map(int, np.argsort(-search.gains(model.state))):
        each = model.candidate(group)
        if answer.is_of(each.effect, each.joint) and _may_be_added(model, search, group):
            added = _added(model, search, group)
            if added is not None:
                return added
    return None


def _may_be_added(model: FittedModel, search: Search, group: int) -> bool:
    """Whether a group is nothing that every arm has, and has room beside a model: a link that is off has none."""
    what = model.candidate(group)
    held = what.facts.where == "link" and what.joint is not None and _is_off(model, what.joint)
    return not (what.facts.usual or held or search.excluded(model.state, group))


def _is_off(model: FittedModel, link: int) -> bool:
    """Whether a model holds a link, from 1, that is not as simulated."""
    widths = model.state.widths
    return widths is not None and widths[link - 1] > 0


def _added(model: FittedModel, search: Search, group: int) -> Found | None:
    """A model with one more group, and its evidence; None where that breaks a law of physics or has no evidence."""
    state = search.with_group(model.state, group)
    if search.objection(state, group) is not None:
        return None
    evidence = Judge(replace(model, state=state), state).effect(group)
    return (group, state, evidence) if evidence.score >= 0 and evidence.objection is None else None
