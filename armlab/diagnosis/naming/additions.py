"""What would still raise the log evidence beside names that passed all tests, and is probable enough for a name.

The tests of a search ask for much at once: a gain on every kind of held-out data, and evidence far above what would do
for one law alone. An effect that fails one of them may still be far likelier than anything else. Its probability
weighs all of that together, as it was found to be worth on recordings whose truth is known.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from armlab.diagnosis.evidence import Evidence, Judge
from armlab.diagnosis.fitted_model import FittedModel
from armlab.diagnosis.naming.decide import MOTION_AXES, naming_of
from armlab.diagnosis.naming.weighing import weigh_addition
from armlab.diagnosis.plausibility import doubtful_names
from armlab.diagnosis.result import Claim, Weighed
from armlab.diagnosis.search import Search, Step
from armlab.diagnosis.solver import State
from armlab.diagnosis.surrogate import Structure
from armlab.diagnosis.unknown import is_structured, unknown_claim


@dataclass(frozen=True, eq=False)
class Additions:
    """A model with what was added, the evidence for it and its names by group.

    unnamed: what is there for certain without a probable name. nothing: names of what may be nothing.
    """

    model: FittedModel
    effects: dict[int, Evidence]
    names: dict[int, Weighed]
    unnamed: tuple[Claim, ...] = ()
    nothing: tuple[Weighed, ...] = ()


def add_probable(model: FittedModel, left: Sequence[Structure]) -> Additions:
    """Adds the likeliest effects one after the other, where they have a name or a class of names.

    What has as much evidence as a name needs, and validation runs do not refute, is there for certain: of its class
    `unknown` may be a part, and it is a finding without a name where none is likely. Else names alone have to reach the
    level. Laws whose numbers cannot be believed are neither. left: structure of the joints of the model.
    """
    exact = not any(is_structured(each, model.design.settings.tuning) for each in left)
    tuning, banned, out = model.design.settings.tuning, frozenset[int](), Additions(model, {}, {})
    for _ in range(tuning.naming.max_additions):
        found = _likeliest(out.model, banned)
        if found is None:
            break
        group, state, evidence = found
        names = weigh_addition(out.model, group, state, evidence, left)
        naming = naming_of(names, tuning.naming)
        believed = not doubtful_names(replace(out.model, state=state), {group: evidence}, exact=exact)
        certain = (
            evidence.score >= tuning.pruning.least_evidence
            and evidence.corrected <= tuning.pruning.level
            and not evidence.worse
        )
        what = out.model.solver.groups[group].candidate
        likeliest = naming.answers[0].is_of(what.effect, what.joint)
        if believed and (naming.sure or (certain and likeliest and not naming.is_unknown)):
            step = Step(f"+ {what.effect} {what.joint}, which is probable", out.model.solver.fit(state).score)
            added = replace(out.model, state=state, steps=(*out.model.steps, step))
            effects = {each: known for each, known in out.effects.items() if each in state.groups}
            out = replace(out, model=added, effects=effects | {group: evidence}, names=out.names | {group: names})
            continue
        banned |= _acting_at(out.model, what.rows[0])
        if believed and certain:
            out = replace(out, unnamed=(*out.unnamed, _unnamed(out.model, group, state, evidence, names)))
        else:
            out = replace(out, nothing=(*out.nothing, names))
    return out


def _unnamed(model: FittedModel, group: int, state: State, evidence: Evidence, names: Weighed) -> Claim:
    """The finding without a name of what a group explains beside a model."""
    own, columns = np.zeros(model.moments.size), model.solver.groups[group].columns
    own[columns] = model.solver.values(model.solver.fit(state), group)
    axis, joint = model.solver.groups[group].candidate.facts.axis, evidence.joint + 1
    depends_on = (f"{axis}_{joint}",) if axis in MOTION_AXES else ()
    return unknown_claim(joint, evidence, model.columns.torque_of(own), depends_on, names)


def _acting_at(model: FittedModel, joint: int) -> frozenset[int]:
    """Groups whose torque acts at a joint (from 0) first."""
    return frozenset(number for number, each in enumerate(model.solver.groups) if each.candidate.rows[0] == joint)


def _likeliest(model: FittedModel, banned: frozenset[int]) -> tuple[int, State, Evidence] | None:
    """The unusual effect that raises the score most and breaks no law of physics, the state with it, its evidence."""
    solver, tuning = model.solver, model.design.settings.tuning.naming
    search = Search(solver, model.design.settings, True, 0)
    gains, asked = search.gains(model.state), 0
    for group in map(int, np.argsort(-gains)):
        if gains[group] < tuning.least_addition or asked >= tuning.max_asked:
            return None
        usual = solver.groups[group].candidate.facts.usual
        if group in banned or usual or search.excluded(model.state, group):
            continue
        asked += 1
        state = search.with_group(model.state, group)
        if search.objection(state, group) is not None:
            continue
        evidence = Judge(replace(model, state=state), state).effects()[group]
        if evidence.objection is None and evidence.score >= tuning.least_addition:
            return group, state, evidence
    return None
