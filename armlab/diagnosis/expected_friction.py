"""Friction that every joint has, where the search had no room for it: tested beside all that predicts.

The names of a search are tested one by one against all that was looked at. Friction of a joint is no discovery among
many: it is expected, and has only to show that it matters. It is tested in the model that predicts, where what is
present without a claim no longer disturbs it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from armlab.diagnosis.evidence import Evidence, Judge
from armlab.diagnosis.fitted_model import FittedModel
from armlab.diagnosis.prediction import Prediction
from armlab.diagnosis.pruning import reason_to_reject
from armlab.diagnosis.search import Step
from armlab.diagnosis.solver import State


def claim_expected_friction(
    model: FittedModel, effects: dict[int, Evidence], prediction: Prediction
) -> tuple[FittedModel, dict[int, Evidence]]:
    """The same with usual friction of joints that have no friction law, where leaving it out costs much held out.

    model, effects: with the names of the search. All friction of a joint is tested at once, without a correction for
    what else was looked at; its gain is large instead.
    """
    found = dict(_that_matters(model, prediction))
    if not found:
        return model, effects
    groups = model.solver.groups
    steps = [
        Step(f"+ {groups[group].candidate.effect} {groups[group].candidate.joint}, which predicts", evidence.score)
        for group, evidence in found.items()
    ]
    state = State(tuple(sorted({*model.state.groups, *found})), model.state.widths)
    return replace(model, state=state, steps=(*model.steps, *steps)), effects | found


def _that_matters(model: FittedModel, prediction: Prediction) -> Iterator[tuple[int, Evidence]]:
    """The likeliest usual law of each joint without friction whose friction matters, and the evidence for all of it."""
    settings, predicting = model.design.settings, prediction.model
    with_friction = _joints_with_friction(model)
    judge = Judge(predicting, predicting.state)
    for joint in range(1, model.columns.joints + 1):
        laws = [each for each in predicting.state.groups if _is_friction(predicting, each, joint)]
        usual = {
            place: group
            for group, place in prediction.places.items()
            if place in laws and model.solver.groups[group].candidate.facts.usual
        }
        if joint in with_friction or not usual:
            continue
        evidence = judge.jointly(laws)
        if evidence.gain > settings.tuning.pruning.large_gain and reason_to_reject(evidence, settings) is None:
            yield usual[_likeliest(predicting, laws, tuple(usual))], replace(evidence, usual=True)


def _likeliest(model: FittedModel, laws: Sequence[int], usual: Sequence[int]) -> int:
    """The usual law that is likeliest alone, of all laws at a joint."""
    bare = State(tuple(each for each in model.state.groups if each not in laws), model.state.widths)
    return max(usual, key=lambda each: model.solver.fit(bare.plus(each)).score)


def _joints_with_friction(model: FittedModel) -> set[int | None]:
    groups = model.solver.groups
    return {groups[each].candidate.joint for each in model.state.groups if _is_friction(model, each)}


def _is_friction(model: FittedModel, group: int, joint: int | None = None) -> bool:
    candidate = model.solver.groups[group].candidate
    own = candidate.facts.dissipates and candidate.facts.where == "joint"
    return own and joint in (None, candidate.joint)
