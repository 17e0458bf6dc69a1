"""Friction that no formula fits: looked for when the formulas have their shapes and the other effects their names.

A curve beside the formulas of a search would take their place before their shapes are known.
"""

from dataclasses import replace

from armlab.diagnosis.torque.belief import Belief
from armlab.diagnosis.torque.columns.solver import State
from armlab.diagnosis.torque.evidence.unknown import (
    is_form_error,
    is_structured,
    predicted_share,
    unknown_evidence,
    with_what_is_left,
)
from armlab.diagnosis.torque.search.fitted_model import FittedModel
from armlab.diagnosis.torque.search.search import Search, Step, rival_formulas


def name_friction_curves(belief: Belief) -> Belief:
    """The effects and the structure that is left, with friction curves where that is friction.

    A curve takes the place of all friction of its joint, and has to explain most of what a surrogate does. What a
    formula leaves is no fault of its form where it is most of all that is left.
    """
    tuning, named = belief.tuning, False
    for each in belief.left:
        model, effects = belief.model, belief.effects
        own = (f"velocity_{each.joint + 1}",)
        if each.depends_on != own or not is_structured(each, tuning):
            continue
        if is_form_error(each, effects, tuning.unknown) and predicted_share(each) < 1 / 2:
            continue
        state = _likeliest_curve(model, each.joint + 1)
        if state is None:
            continue
        changed = replace(model, state=state)
        before, after = (of.residual_at(each.joint, of.fit) for of in (model, changed))
        evidence = unknown_evidence(model, each, before, after)
        by_surrogate = unknown_evidence(model, each, before, before - each.prediction)
        explained, wanted = (found.rms_before**2 - found.rms_after**2 for found in (evidence, by_surrogate))
        if explained <= wanted / 2:
            continue
        (group,) = set(state.groups) - set(model.state.groups)
        kept = {number: known for number, known in effects.items() if number in state.groups}
        step = Step(f"what is left at joint {each.joint + 1} is a friction curve", model.solver.fit(state).score)
        belief, named = replace(belief.with_state(state, step), effects=kept | {group: evidence}), True
    return with_what_is_left(belief) if named else belief


def _likeliest_curve(model: FittedModel, joint: int) -> State | None:
    """The state with the likeliest law of the last resort as the only friction law of a joint; None for none."""
    groups, state = model.solver.groups, model.state
    last = [
        number
        for number, each in enumerate(groups)
        if each.candidate.facts.last_resort and each.candidate.joint == joint
    ]
    if not last or set(last) & set(state.groups):
        return None
    formulas = set(rival_formulas(groups, last[0]))
    bare = State(tuple(each for each in state.groups if each not in formulas), state.widths)
    search = Search(model.solver, model.design.settings, True, 0)
    found = [(search.with_group(bare, number), number) for number in last]
    fitting = [tried for tried, number in found if search.objection(tried, number) is None]
    return max(fitting, key=lambda tried: model.solver.fit(tried).score, default=None)
