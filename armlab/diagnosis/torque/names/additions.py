"""What would still raise the log evidence beside names that passed all tests, and is probable enough for a name.

The tests of a search ask for much at once: a gain on every kind of held-out data, and evidence far above what would do
for one law alone. An effect that fails one of them may still be far likelier than anything else. Its probability
weighs all of that together, as it was found to be worth on recordings whose truth is known.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from armlab.diagnosis.result import Claim, Member, Weighed
from armlab.diagnosis.torque.belief import Belief
from armlab.diagnosis.torque.columns.solver import State
from armlab.diagnosis.torque.evidence.evidence import Evidence, Judge
from armlab.diagnosis.torque.evidence.plausibility import doubtful_names
from armlab.diagnosis.torque.evidence.unknown import remaining, unknown_claim, with_what_is_left
from armlab.diagnosis.torque.names.decide import MOTION_AXES, naming_of
from armlab.diagnosis.torque.names.weighing import weigh_addition, weigh_effect
from armlab.diagnosis.torque.search.fitted_model import FittedModel
from armlab.diagnosis.torque.search.search import Search, Step
from armlab.diagnosis.torque.search.surrogate import Structure
from armlab.effects.contract import UNKNOWN, Candidate

Found = tuple[int, State, Evidence]  # a group beside a model, the state with it, and what speaks for it


def add_probable(belief: Belief) -> Belief:
    """Adds the likeliest effects one after the other, where they have a name or a class of names.

    What has as much evidence as a name needs, and validation runs do not refute, is there for certain: of its class
    `unknown` may be a part, and it is a finding without a name where none is likely and held-out errors fall enough.
    Else names alone have to reach the level. Laws whose numbers cannot be believed are neither.
    """
    exact, tuning, left = not remaining(belief), belief.tuning, belief.left
    banned, out, added = frozenset[int](), belief, set[int]()
    for _ in range(tuning.naming.max_additions):
        first = _likeliest(out.model, banned)
        if first is None:
            break
        found, names = _named(out.model, first, left)
        group, state, evidence = found
        naming = naming_of(names, belief.model.design.settings)
        believed = not doubtful_names(replace(out.model, state=state), {group: evidence}, exact=exact)
        certain = (
            evidence.score >= tuning.pruning.least_evidence
            and evidence.corrected <= tuning.pruning.level
            and not evidence.is_refuted(tuning.evidence)
        )
        what = _candidate(out.model, group)
        likeliest = naming.answers[0].is_of(what.effect, what.joint)
        if believed and naming.may_be(what.effect, what.joint) and (naming.sure or (certain and likeliest)):
            step = Step(f"+ {what.effect} {what.joint}, which is probable", out.model.solver.fit(state).score)
            effects = {each: known for each, known in out.effects.items() if each in state.groups}
            weighed = {**out.weighed, group: names}
            out = replace(out.with_state(state, step), effects=effects | {group: evidence}, weighed=weighed)
            added |= {group}
            continue
        banned |= _acting_where(out.model, first) | _acting_where(out.model, found)
        if believed and certain and evidence.fall >= tuning.naming.least_unnamed_fall:
            out = replace(out, unnamed=(*out.unnamed, _unnamed(out.model, group, state, evidence, names)))
        else:
            out = replace(out, nothing=(*out.nothing, names))
    return with_what_is_left(out) if added & set(out.effects) else out


def _unnamed(model: FittedModel, group: int, state: State, evidence: Evidence, names: Weighed) -> Claim:
    """The finding without a name of what a group explains beside a model."""
    own, columns = np.zeros(model.moments.size), model.solver.groups[group].columns
    own[columns] = model.solver.values(model.solver.fit(state), group)
    axis, joint = _candidate(model, group).facts.axis, evidence.joint + 1
    depends_on = (f"{axis}_{joint}",) if axis in MOTION_AXES else ()
    return unknown_claim(joint, evidence, model.columns.torque_of(own), depends_on, names)


def _acting_where(model: FittedModel, found: Found) -> frozenset[int]:
    """Groups that act at the joint that shows a group best, and at no more joints than it does."""
    group, _, evidence = found
    rows, most = [each.candidate.rows for each in model.solver.groups], len(_candidate(model, group).rows)
    return frozenset(number for number, own in enumerate(rows) if evidence.joint in own and len(own) <= most)


def _likeliest(model: FittedModel, banned: frozenset[int]) -> Found | None:
    """The unusual effect that raises the score most and breaks no law of physics."""
    solver, tuning = model.solver, model.design.settings.tuning
    search = Search(solver, model.design.settings, True, 0)
    gains, asked = search.gains(model.state), 0
    for group in map(int, np.argsort(-gains)):
        if gains[group] < tuning.naming.least_addition or asked >= tuning.search.max_candidates_asked:
            return None
        if group in banned or not _may_be_added(model, search, group):
            continue
        asked += 1
        found = _added(model, search, group, tuning.naming.least_addition)
        if found is not None:
            return found
    return None


def with_likeliest_names(belief: Belief) -> Belief:
    """Effects that passed, each with the likeliest name of its finding where that has a name or a class of names.

    A search takes what raises the score most, and what fits best need not be likeliest. A name whose numbers cannot be
    believed takes no place.
    """
    exact = not remaining(belief)
    for group in belief.effects:
        model, out = belief.model, belief.effects
        if group not in out:
            continue
        weighed, own = weigh_effect(model, group, out, belief.left), _candidate(model, group)
        naming = naming_of(weighed, model.design.settings)
        first = naming.answers[0]
        if naming.is_unknown or first.effect == UNKNOWN.id or first.is_of(own.effect, own.joint):
            continue
        without = replace(model, state=model.state.minus(group))
        likelier = _with_name(without, first, least=0.0)
        if likelier is None:
            continue
        other, state, evidence = likelier
        if not doubtful_names(replace(model, state=state), {other: evidence}, exact=exact):
            what = _candidate(model, other)
            text = f"{own.effect} {own.joint} -> {what.effect} {what.joint}, which is likelier"
            step = Step(text, model.solver.fit(state).score)
            kept = {each: known for each, known in out.items() if each in state.groups}
            belief = replace(belief.with_state(state, step), effects=kept | {other: evidence})
    return belief


def _named(model: FittedModel, found: Found, left: Sequence[Structure]) -> tuple[Found, Weighed]:
    """What raises the score most, or the effect with the likeliest name in its place, and its names."""
    names = weigh_addition(model, *found, left)
    answer, own = naming_of(names, model.design.settings).answers[0], _candidate(model, found[0])
    least = model.design.settings.tuning.naming.least_addition
    likelier = None if answer.is_of(own.effect, own.joint) else _with_name(model, answer, least)
    return (found, names) if likelier is None else (likelier, weigh_addition(model, *likelier, left))


def _with_name(model: FittedModel, answer: Member, least: float) -> Found | None:
    """The model with the effect of a name that raises the score most; None where none raises it by the least, nats."""
    search = Search(model.solver, model.design.settings, True, 0)
    for group in map(int, np.argsort(-search.gains(model.state))):
        each = _candidate(model, group)
        if answer.is_of(each.effect, each.joint) and _may_be_added(model, search, group):
            added = _added(model, search, group, least)
            if added is not None:
                return added
    return None


def _candidate(model: FittedModel, group: int) -> Candidate:
    return model.candidate(group)


def _may_be_added(model: FittedModel, search: Search, group: int) -> bool:
    """Whether a group is nothing that every arm has, and has room beside a model: a link that is off has none."""
    what = _candidate(model, group)
    held = what.facts.where == "link" and what.joint is not None and _is_off(model, what.joint)
    return not (what.facts.usual or held or search.excluded(model.state, group))


def _is_off(model: FittedModel, link: int) -> bool:
    """Whether a model holds a link, from 1, that is not as simulated."""
    widths = model.state.widths
    return widths is not None and widths[link - 1] > 0


def _added(model: FittedModel, search: Search, group: int, least: float) -> Found | None:
    """A model with one more group, and its evidence; None where that breaks a law of physics or is too little."""
    state = search.with_group(model.state, group)
    if search.objection(state, group) is not None:
        return None
    evidence = Judge(replace(model, state=state), state).effects()[group]
    return (group, state, evidence) if evidence.score >= least and evidence.objection is None else None
