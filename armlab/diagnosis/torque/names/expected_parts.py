"""Friction and offsets, which every joint has, where the search had no room for them: tested beside all that predicts.

The names of a search are tested one by one against all that was looked at. What every joint has is no discovery among
many: it is expected, and has only to show that it matters. It is tested in the model that predicts, where what is
present without a claim no longer disturbs it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from armlab.diagnosis.torque.belief import Belief
from armlab.diagnosis.torque.columns.solver import State
from armlab.diagnosis.torque.evidence.evidence import Evidence, Judge
from armlab.diagnosis.torque.evidence.pruning import first_failed_test
from armlab.diagnosis.torque.predict.parts import removal_of
from armlab.diagnosis.torque.predict.prediction import Prediction
from armlab.diagnosis.torque.search.fitted_model import FittedModel
from armlab.diagnosis.torque.search.search import Search, Step


def claim_expected_parts(belief: Belief) -> Belief:
    """The belief with usual friction and offsets of joints that have none, where leaving them out costs much held out.

    All friction of a joint is tested at once, without a correction for
    what else was looked at; it is missed by more than a minor change instead.
    """
    assert belief.prediction is not None
    model = belief.model
    found = dict(_that_matter(model, belief.prediction))
    if not found:
        return belief
    candidates = {group: model.candidate(group) for group in found}
    steps = [
        Step(f"+ {each.effect} {each.joint}, which predicts", found[group].score) for group, each in candidates.items()
    ]
    state = State(tuple(sorted({*model.state.groups, *found})), model.state.widths)
    return replace(belief.with_state(state, *steps), effects={**belief.effects, **found})


def _that_matter(model: FittedModel, prediction: Prediction) -> Iterator[tuple[int, Evidence]]:
    """The likeliest usual law of each kind at a joint that has none, and the evidence for all of its kind there."""
    settings, predicting = model.design.settings, prediction.model
    judge = Judge(predicting, predicting.state)
    search = Search(model.solver, settings, True, 0)
    for joint in range(1, model.columns.joints + 1):
        for dissipates in (True, False):
            usual = {
                place: group
                for group, place in prediction.places.items()
                if _is_usual(model, group, joint, dissipates) and not search.excluded(model.state, group)
            }
            if not usual or any(_is_alike(model, each, joint, dissipates) for each in model.state.groups):
                continue
            alike = [each for each in predicting.state.groups if _is_alike(predicting, each, joint, dissipates)]
            evidence = replace(judge.jointly(alike), usual=True)
            if not removal_of(predicting, alike).is_minor and first_failed_test(evidence, settings) is None:
                yield usual[_likeliest(predicting, alike, tuple(usual))], evidence


def _likeliest(model: FittedModel, alike: Sequence[int], usual: Sequence[int]) -> int:
    """The usual law that is likeliest alone, of all that are alike at a joint."""
    bare = State(tuple(each for each in model.state.groups if each not in alike), model.state.widths)
    return max(usual, key=lambda each: model.solver.fit(bare.plus(each)).score)


def _is_usual(model: FittedModel, group: int, joint: int, dissipates: bool) -> bool:
    candidate = model.candidate(group)
    return candidate.facts.usual and candidate.joint == joint and candidate.facts.dissipates == dissipates


def _is_alike(model: FittedModel, group: int, joint: int, dissipates: bool) -> bool:
    """Whether a group is a friction law of a joint; its usual part that does not dissipate, if that is asked."""
    candidate = model.candidate(group)
    if dissipates:
        return candidate.is_friction_of(joint)
    return _is_usual(model, group, joint, dissipates)
