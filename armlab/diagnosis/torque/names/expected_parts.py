"""Friction and offsets, which every joint has, where no claim holds them: tested beside all that predicts.

The names of a search are tested one by one against all that was looked at. What every joint has is no discovery among
many: it is expected, and has only to show that it matters. It is tested in the model that predicts, where what is
present without a claim no longer disturbs it.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

from armlab.diagnosis.torque.belief import Belief
from armlab.diagnosis.torque.columns.solver import State
from armlab.diagnosis.torque.evidence.evidence import Evidence, Judge
from armlab.diagnosis.torque.evidence.plausibility import doubtful_names
from armlab.diagnosis.torque.evidence.pruning import first_failed_test
from armlab.diagnosis.torque.names.weighing import weigh_effect
from armlab.diagnosis.torque.predict.parts import removal_of
from armlab.diagnosis.torque.search.fitted_model import FittedModel
from armlab.diagnosis.torque.search.search import Search, Step


def claim_expected_parts(belief: Belief) -> Belief:
    """The belief with friction and offsets of joints that claim none, where leaving them out costs much held out.

    All friction of a joint is tested at once, without a correction for what else was looked at; it is missed by more
    than a minor change instead. Friction of which that is so is there, whatever its law: a law whose numbers cannot be
    believed stands for it without its own name.
    """
    found, model = dict(_that_matter(belief)), belief.model
    wide = _holding(model, found)
    doubts = doubtful_names(wide, found)
    found = {group: each for group, each in found.items() if group not in doubts or model.candidate(group).is_friction}
    if not found:
        return belief
    candidates = {group: model.candidate(group) for group in found}
    steps = [
        Step(f"+ {each.effect} {each.joint}, which predicts", found[group].score) for group, each in candidates.items()
    ]
    effects, weighed = {**belief.effects, **found}, dict(belief.weighed)
    for group in set(doubts) & set(found):
        names, own = weigh_effect(wide, group, effects, belief.left), candidates[group]
        weighed[group] = tuple(each for each in names if (each.effect, each.joint) != (own.effect, own.joint))
    present = {group: each for group, each in belief.present.items() if group not in found}
    held = belief.with_state(_holding(model, found).state, *steps)
    return replace(held, effects=effects, weighed=weighed, present=present)


def _holding(model: FittedModel, groups: Collection[int]) -> FittedModel:
    return replace(model, state=State(tuple(sorted({*model.state.groups, *groups})), model.state.widths))


def _that_matter(belief: Belief) -> Iterator[tuple[int, Evidence]]:
    """The likeliest law of each kind at a joint that claims none, and the evidence for all of its kind there.

    The law is usual, or present there without a claim.
    """
    assert belief.prediction is not None
    model, settings, predicting = belief.model, belief.model.design.settings, belief.prediction.model
    judge = Judge(predicting, predicting.state)
    search = Search(model.solver, settings, True, 0)
    for joint in range(1, model.columns.joints + 1):
        for dissipates in (True, False):
            if any(_is_alike(model, each, joint, dissipates) for each in belief.effects):
                continue
            laws = {
                place: group
                for group, place in belief.prediction.places.items()
                if _is_alike(model, group, joint, dissipates)
                and (
                    group in belief.present
                    or (model.candidate(group).facts.usual and not search.excluded(model.state, group))
                )
            }
            alike = [each for each in predicting.state.groups if _is_alike(predicting, each, joint, dissipates)]
            if not laws or not alike:
                continue
            evidence = replace(judge.jointly(alike), usual=True)
            if not removal_of(predicting, alike).is_minor and first_failed_test(evidence, settings) is None:
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
