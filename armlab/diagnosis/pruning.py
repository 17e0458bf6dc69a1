"""Only what passes every test stays: the weakest effect that fails one leaves, and the rest is searched anew."""

from dataclasses import replace

from armlab.diagnosis.evidence import Evidence, Judge
from armlab.diagnosis.fitted_model import FittedModel
from armlab.diagnosis.search import Search, Step
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.solver import State

Pruned = tuple[FittedModel, dict[int, Evidence], dict[int, Evidence]]
_State = tuple[State, dict[int, Evidence], frozenset[int]]


def reason_to_reject(evidence: Evidence, settings: Settings) -> str | None:
    """Why an effect may not be claimed; None where it passes."""
    guards, tuning = settings.guards, settings.tuning.pruning
    if guards.physics_signs and evidence.objection is not None:
        return evidence.objection
    if evidence.corrected > tuning.level:
        return f"p = {evidence.corrected:.2g} after correction"
    if not evidence.usual and evidence.score < tuning.least_evidence and evidence.gain < tuning.self_evident_gain:
        return f"log evidence {evidence.score:.0f}: too little for a name"
    least = tuning.least_gain * (1.0 if evidence.repeatable else tuning.single_event_share)
    if guards.heldout_gain and evidence.gain < least:
        return f"held-out gain {100 * evidence.gain:.2g} %"
    if not evidence.repeatable:
        return None
    level = tuning.large_gain_level if evidence.gain > tuning.large_gain else tuning.held_out_level
    if guards.heldout_gain and not evidence.usual and evidence.held_p > level:
        return f"held-out gain not sure (p = {evidence.held_p:.2g})"
    if guards.heldout_gain and evidence.worse:
        return f"validation gets worse by {-100 * evidence.validation_gain:.2g} %"
    return None


def prune(model: FittedModel) -> Pruned:
    """The round with the effects that pass, and the evidence of those and of the links that do (from 0).

    After a withdrawal nothing is searched until all that is left passes: what stands in for a withdrawn effect would
    be its copy. Then the search looks once more, without the places that were withdrawn.
    """
    steps = list(model.steps)
    return _settle_links(model, _prune_and_search(model, model.state, frozenset(), steps), steps)


def _prune_and_search(
    model: FittedModel, state: State, banned: frozenset[int], steps: list[Step], fixed: bool = False
) -> _State:
    """What passes of a state, and of what the search finds once more. fixed: whether the links' widths stay."""
    for _ in range(model.design.settings.tuning.pruning.max_cycles):
        state, effects, banned = _remove_failing(model, state, banned, steps)
        known = fixed or state.widths is None
        search = Search(model.solver, model.design.settings, known, len(state.widths or ()), banned)
        again = search.climb(state, steps)
        if again == state:
            return state, effects, banned
        state = again
    return _remove_failing(model, state, banned, steps)


def withdraw(model: FittedModel, groups: frozenset[int], why: str) -> Pruned:
    """The same without some groups, and without what no longer passes; usual friction in the place of special laws."""
    judge, steps = Judge(model, model.state), list(model.steps)
    for group in groups:
        candidate = model.solver.groups[group].candidate
        steps.append(Step(f"withdrawn: {candidate.effect} {candidate.joint}: {why}", 0.0))
    back = {other for group in groups for other in judge.in_place_of(group)}
    state = State(tuple(sorted(set(model.state.groups) - groups | back)), model.state.widths)
    return _settle_links(model, _remove_failing(model, state, groups, steps), steps)


def _settle_links(model: FittedModel, passed: _State, steps: list[Step]) -> Pruned:
    """With the links that pass; where they do not, all is tested and searched again with links as simulated."""
    state, effects, banned = passed
    state, links = _test_links(model, state, steps)
    if links is None:
        state, effects, banned = _prune_and_search(model, state, banned, steps, fixed=True)
    return replace(model, state=state, steps=tuple(steps)), effects, links or {}


def _remove_failing(model: FittedModel, state: State, banned: frozenset[int], steps: list[Step]) -> _State:
    """The state without its failing effects, the weakest first; usual friction in the place of special laws."""
    groups, settings = model.solver.groups, model.design.settings
    while True:
        judge = Judge(model, state)
        effects = judge.effects()
        bad = {group: why for group, each in effects.items() if (why := reason_to_reject(each, settings)) is not None}
        if not bad:
            return state, effects, banned
        weakest = min(bad, key=lambda group: (not judge.simpler(group), effects[group].score))
        gone = _groups_to_remove(judge, weakest)
        for group in gone:
            what = groups[group].candidate
            steps.append(Step(f"withdrawn: {what.effect} {what.joint}: {bad.get(group, bad[weakest])}", 0.0))
        places = {groups[group].place for group in gone}
        banned |= {number for number, each in enumerate(groups) if each.place in places}
        back = {other for group in gone for other in judge.in_place_of(group)}
        state = State(tuple(sorted(set(state.groups) - gone | back)), state.widths)


def _groups_to_remove(judge: Judge, weakest: int) -> set[int]:
    """The group that fails; usual friction beside a special law takes that law with it, if it is likelier alone."""
    solver, state = judge.model.solver, judge.state
    joint = solver.groups[weakest].candidate.joint
    special = {each for each in state.groups if judge.simpler(each) and solver.groups[each].candidate.joint == joint}
    if not solver.groups[weakest].candidate.facts.usual or not special:
        return {weakest}
    usual = {other for group in special for other in judge.simpler(group)}
    plain = State(tuple(sorted(set(state.groups) - special | usual)), state.widths)
    return {weakest} if solver.fit(state.minus(weakest)).score > solver.fit(plain).score else special


def _test_links(model: FittedModel, state: State, steps: list[Step]) -> tuple[State, dict[int, Evidence] | None]:
    """The state, and the links that may be claimed: those that pass alone, or the likeliest if they do together.

    They stay as wide as they were found as long as any passes: that they are off is no claim about each. None where
    they had to be brought back to the simulation.
    """
    judge, settings = Judge(model, state), model.design.settings
    links = judge.links()
    if not links:
        return state, {}
    passed = {link: each for link, each in links.items() if reason_to_reject(each, settings) is None}
    together = judge.together()
    if passed or reason_to_reject(together, settings) is None:
        return state, passed or {max(links, key=lambda link: links[link].score): together}
    steps.append(Step(f"withdrawn: links: {reason_to_reject(together, settings)}", 0.0))
    return State(state.groups, (0.0,) * len(state.widths or ())), None
