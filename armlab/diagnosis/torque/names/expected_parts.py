"""Friction and offsets, which every joint has, where no claim holds them: tested beside all that predicts.

The names of a search are tested one by one against all that was looked at. What every joint has is no discovery among
many: it is expected, and has only to show that it matters. It is tested in the model that predicts, where what is
present without a claim no longer disturbs it.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

from armlab.diagnosis.result import WeighedName
from armlab.diagnosis.torque.belief import Belief
from armlab.diagnosis.torque.columns.solver import State
from armlab.diagnosis.torque.evidence.evidence import Evidence, Judge
from armlab.diagnosis.torque.evidence.plausibility import doubtful_names
from armlab.diagnosis.torque.evidence.pruning import first_failed_test
from armlab.diagnosis.torque.names.findings import FRICTION
from armlab.diagnosis.torque.names.weighing import weigh_effect
from armlab.diagnosis.torque.predict.parts import removal_of
from armlab.diagnosis.torque.search.fitted_model import FittedModel
from armlab.diagnosis.torque.search.search import Search, Step
from armlab.effects.contract import UNKNOWN
from armlab.effects.library import effect_named


def claim_expected_parts(belief: Belief) -> Belief:
    """The belief with friction and offsets of joints that claim none, where leaving them out costs much held out.

    All friction of a joint is tested at once, without a correction for what else was looked at; it is missed by more
    than a minor change instead. Where the simulation says nothing of it, it is no discovery: that stretches of time
    share its gain on held-out data is enough, however unsure its numbers are, and the laws of friction of its joint
    share the probability. Where the numbers of its law cannot be believed, it is friction by no formula.
    """
    found, model = dict(_that_matter(belief)), belief.model
    doubts, unsaid = doubtful_names(_holding(model, found), found), model.design.simulation.joints_unsaid
    expected = {
        group for group in found if model.candidate(group).is_friction and model.candidate(group).joint in unsaid
    }
    found = {group: each for group, each in found.items() if group not in doubts or group in expected}
    if not found:
        return belief
    wide = _holding(model, found)
    candidates = {group: model.candidate(group) for group in found}
    steps = [
        Step(f"+ {each.effect} {each.joint}, which predicts", found[group].score) for group, each in candidates.items()
    ]
    effects, weighed = {**belief.effects, **found}, dict(belief.weighed)
    for group in sorted(expected):
        names, joint = weigh_effect(wide, group, effects, belief.left), candidates[group].joint
        weighed[group] = tuple(each for each in names if _may_be(each, joint, by_formula=group not in doubts))
    present = {group: each for group, each in belief.present.items() if group in set(wide.state.groups) - set(found)}
    return replace(belief.with_state(wide.state, *steps), effects=effects, weighed=weighed, present=present)


def _may_be(name: WeighedName, joint: int | None, *, by_formula: bool) -> bool:
    """Whether a name may be that of friction of a joint: of none of the laws, or of one where a formula is believed."""
    if name.effect == UNKNOWN.id:
        return True
    return by_formula and name.joint == joint and _is_told_as_friction(name.effect)


def _is_told_as_friction(effect: str) -> bool:
    """Whether the cause of an effect is friction: that of play with friction is play."""
    return effect_named(effect).cause == FRICTION


def _holding(model: FittedModel, groups: Collection[int]) -> FittedModel:
    search, state = Search(model.solver, model.design.settings, True, 0), model.state
    for group in groups:
        state = search.in_place(state, group)
    return replace(model, state=state)


def _that_matter(belief: Belief) -> Iterator[tuple[int, Evidence]]:
    """The likeliest law of each kind at a joint that claims none, of those that predict, and the evidence for all."""
    assert belief.prediction is not None
    model, settings, predicting = belief.model, belief.model.design.settings, belief.prediction.model
    judge, unsaid = Judge(predicting, predicting.state), model.design.simulation.joints_unsaid
    for joint in range(1, model.columns.joints + 1):
        for dissipates in (True, False):
            if any(_is_alike(model, each, joint, dissipates) for each in belief.effects):
                continue
            laws = {
                place: group
                for group, place in belief.prediction.places.items()
                if _is_alike(model, group, joint, dissipates)
                and (not dissipates or _is_told_as_friction(model.candidate(group).effect))
            }
            alike = [each for each in predicting.state.groups if _is_alike(predicting, each, joint, dissipates)]
            if not laws or not alike:
                continue
            evidence = replace(judge.jointly(alike), usual=True)
            tested = replace(evidence, corrected=evidence.held_p) if joint in unsaid else evidence
            if not removal_of(predicting, alike).is_minor and first_failed_test(tested, settings) is None:
                yield laws[_likeliest(predicting, alike, tuple(laws))], evidence


def _likeliest(model: FittedModel, alike: Sequence[int], laws: Sequence[int]) -> int:
    """The law that is likeliest alone, of all that are alike at a joint."""
    bare = State(tuple(each for each in model.state.groups if each not in alike), model.state.widths)
    return max(laws, key=lambda each: model.solver.fit(bare.plus(each)).score)


def _is_alike(model: FittedModel, group: int, joint: int, dissipates: bool) -> bool:
    """Whether a group is a friction law of a joint; its usual part that does not dissipate, if that is asked."""
    candidate = model.candidate(group)
    if dissipates:
        return candidate.is_friction_of(joint)
    return candidate.facts.usual and not candidate.facts.dissipates and candidate.joint == joint
