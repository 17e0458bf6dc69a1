"""Only what passes every test stays: the weakest effect that fails one leaves, and the rest is searched anew."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.belief import Belief
from armlab.diagnosis.torque.columns.solver import State
from armlab.diagnosis.torque.evidence.added_body import (
    find_body_anew,
    hold_body,
    holds_body,
    impossible_bodies,
    other_bodies,
    payload_groups,
    predicts_as_well,
)
from armlab.diagnosis.torque.evidence.evidence import Evidence, Judge
from armlab.diagnosis.torque.search.fitted_model import FittedModel, follow_model, scan_residual, with_design
from armlab.diagnosis.torque.search.refine import refine_shapes
from armlab.diagnosis.torque.search.search import FailedTest, Search, Step


def first_failed_test(evidence: Evidence, settings: Settings) -> FailedTest | None:
    """The first test that an effect does not pass; None where it may be claimed."""
    guards, p_value = settings.guards, evidence.corrected
    level, least = settings.tuning.pruning.level, settings.tuning.surrogate.least_gain
    if guards.physics_signs and evidence.objection is not None:
        return FailedTest("laws of physics", evidence.objection)
    if p_value > level:
        text = f"p = {p_value:.2g} after correction"
        return FailedTest("significance", text, p_value, level, "pruning.level", at_least=False)
    if guards.heldout_gain and evidence.gain < least:
        text = f"held-out gain {100 * evidence.gain:.3g} %"
        return FailedTest("held-out gain", text, evidence.gain, least, "surrogate.least_gain")
    if guards.heldout_gain and evidence.repeatable and evidence.growth_p < level:
        text = f"the error of validation runs grows, p = {evidence.growth_p:.2g}"
        return FailedTest("error of validation runs", text, evidence.growth_p, level, "pruning.level")
    return None


def prune(belief: Belief) -> Belief:
    """The effects and links that pass, with their evidence.

    After a withdrawal nothing is searched until all that is left passes: what stands in for a withdrawn effect would
    be its copy. Then the search looks once more, without the places that were withdrawn. A body that can exist is held
    from the start, and found anew after withdrawals: they change what is left to it.
    """
    held = hold_body(belief.model)
    return _settle_links(_prune_and_search(replace(belief, model=held, banned=other_bodies(held))))


def _prune_and_search(belief: Belief, fixed: bool = False) -> Belief:
    """What passes of a model, and of what the search finds once more, where that predicts as well in the end.

    What is found may be a copy of what passed, so that neither is needed beside the other and both are lost.
    fixed: whether the links' widths stay. They stay beside a body that is held, too: links that are off would take what
    its form, which was found before, does not explain.
    """
    passed = _remove_failing(belief)
    for _ in range(belief.tuning.pruning.max_cycles):
        searched = _search_again(passed, fixed)
        if searched.model.state == passed.model.state:
            break
        again = _remove_failing(searched)
        if not _lasts(passed.model, again.model):
            return replace(_back_to(passed, again, "what was found beside it"), banned=again.banned)
        passed = again
    return passed


def _back_to(passed: Belief, tried: Belief, what: str) -> Belief:
    """What passed before, with the log of what was tried."""
    step = Step(f"back to what passed before: {what} does not last", passed.model.fit.score)
    return replace(passed, model=replace(passed.model, steps=(*tried.model.steps, step)))


def _search_again(belief: Belief, fixed: bool) -> Belief:
    """What a search finds beside effects that passed."""
    model = belief.model
    steps, widths = list(model.steps), model.state.widths
    known = fixed or widths is None or holds_body(model)
    search = Search(model.solver, model.design.settings, known, len(widths or ()), belief.banned)
    state = search.climb(model.state, steps)
    return replace(belief, model=replace(model, state=state, steps=tuple(steps)))


def withdraw(belief: Belief, failed: Mapping[int, FailedTest]) -> Belief:
    """The belief without some groups, and without what no longer passes; usual friction in the place of special laws.

    failed: why, for each group. They do not come back.
    """
    model = belief.model
    judge, groups = Judge(model, model.state), frozenset(failed)
    steps = [Step.against(model.candidate(group), test) for group, test in failed.items()]
    back = {other for group in groups for other in judge.simpler(group)}
    state = State(tuple(sorted(set(model.state.groups) - groups | back)), model.state.widths)
    less = belief.with_state(state, *steps)
    return _settle_links(_remove_failing(replace(less, banned=groups | other_bodies(model))))


def scan_what_is_left(belief: Belief) -> Belief:
    """The belief with what scans find in what it leaves, where that passes, too, and is more likely in the end.

    The first scans looked at what links and plain friction leave: what had no name then can hide a gap or a push. Nor
    were they, or the last round, made with the links that passed: a gap is crossed where the load of these is zero.
    """
    before = belief.model
    moved = with_design(before, follow_model(before.design, before))
    design, known = scan_residual(moved), frozenset(range(len(before.design.blocks)))
    if design is moved.design:
        return belief
    model = with_design(moved, design)
    searched = _search_again(replace(belief, model=model, banned=known), fixed=True)
    found = searched.model
    if known.issuperset(found.state.groups):
        return belief
    better = refine_shapes(design, found.noise, found.solver, found.state, but=known)
    if better:
        searched = replace(searched, model=with_design(found, design.with_blocks(better)))
    again = _settle_links(_remove_failing(searched))
    return again if _is_likelier(model, again.model) else _back_to(belief, again, "what scans found beside it")


def _is_likelier(before: FittedModel, after: FittedModel) -> bool:
    """Whether what a search has changed has more evidence, and predicts held-out rows as well."""
    return after.fit.score > before.fit.score and _lasts(before, after)


def _lasts(before: FittedModel, after: FittedModel) -> bool:
    """Whether what a search has changed predicts held-out rows as well as before."""
    tolerance = after.design.settings.tuning.claims.body_tolerance
    errors = [each.moments.heldout_error(each.fit.coefficients) for each in (before, after)]
    return predicts_as_well(errors[1], errors[0], tolerance)


def prefer_one_body(belief: Belief) -> Belief:
    """One body that can exist in the place of bodies and links of what passed, see `hold_body`, where that passes.

    Bodies that cannot exist are withdrawn: these data do not tell.
    """
    held = hold_body(belief.model)
    if held is not belief.model:
        tested = withdraw(replace(belief, model=held), {})
        belief = tested if payload_groups(tested.model) else belief
    failed = FailedTest("bodies that can exist", "no body has such a mass, centre and inertia")
    impossible = dict.fromkeys(impossible_bodies(belief.model), failed)
    return withdraw(belief, impossible) if impossible else belief


def _settle_links(belief: Belief) -> Belief:
    """With the links that pass; where they do not, all is tested and searched again with links as simulated."""
    model, links = _test_links(belief.model)
    settled = replace(belief, model=model)
    if links is None:
        settled = _prune_and_search(settled, fixed=True)
    return replace(settled, links=links or {})


def _remove_failing(belief: Belief) -> Belief:
    """The model without its failing effects, the weakest first; usual friction in the place of special laws."""
    model, banned = belief.model, belief.banned
    settings, found_anew = model.design.settings, 0
    while True:
        groups, state = model.solver.groups, model.state
        judge = Judge(model, state)
        tested = _test_in_turn(judge, settings)
        if tested.failed is None:
            anew = find_body_anew(model)
            if anew is model or found_anew >= settings.tuning.pruning.max_cycles:
                effects, present = dict[int, Evidence](), dict[int, Evidence]()
                for group, each in tested.effects.items():
                    (effects if first_failed_test(each, settings) is None else present)[group] = each
                return replace(belief, model=model, effects=effects, present=present, banned=banned)
            model, found_anew = anew, found_anew + 1
            continue
        weakest, failed = tested.failed
        gone = _groups_to_remove(judge, weakest)
        steps = [*model.steps, *(Step.against(model.candidate(group), failed) for group in gone)]
        places = {groups[group].place for group in gone}
        banned |= {number for number, each in enumerate(groups) if each.place in places}
        back = {other for group in gone for other in judge.simpler(group)}
        state = State(tuple(sorted(set(state.groups) - gone | back)), state.widths)
        model = replace(model, state=state, steps=tuple(steps))


@dataclass(frozen=True, eq=False)
class TestsInTurn:
    """The evidence for effects, by group, up to the first one that has to leave; failed: that one, and why."""

    effects: dict[int, Evidence]
    failed: tuple[int, FailedTest] | None = None


def _test_in_turn(judge: Judge, settings: Settings) -> TestsInTurn:
    """Tests effects in the order in which they would leave: those that are stronger need no test once one leaves.

    The weakest special law at a joint is the first, then the weakest of the others. Usual friction that no law
    contradicts is held.
    """
    special = [group for group in judge.state.groups if judge.simpler(group)]
    others = sorted(set(judge.state.groups) - set(special), key=lambda group: judge.scores[group])
    effects = dict[int, Evidence]()
    for some in (special, *([group] for group in others)):
        failed = dict[int, FailedTest]()
        for group in some:
            effects[group] = judge.effect(group)
            why = first_failed_test(effects[group], settings)
            is_held = effects[group].objection is None and judge.model.solver.is_held(judge.state, group)
            if why is not None and not is_held:
                failed[group] = why
        if failed:
            weakest = min(failed, key=lambda group: effects[group].score)
            return TestsInTurn(effects, (weakest, failed[weakest]))
    return TestsInTurn({group: effects[group] for group in judge.state.groups})


def _groups_to_remove(judge: Judge, weakest: int) -> set[int]:
    """The group that fails; usual friction beside a special law takes that law with it, if it is likelier alone."""
    solver, state = judge.model.solver, judge.state
    joint = solver.candidate(weakest).joint
    special = {each for each in state.groups if judge.simpler(each) and solver.candidate(each).joint == joint}
    if not solver.candidate(weakest).facts.usual or not special:
        return {weakest}
    usual = {other for group in special for other in judge.simpler(group)}
    plain = State(tuple(sorted(set(state.groups) - special | usual)), state.widths)
    return {weakest} if solver.fit(state.minus(weakest)).score > solver.fit(plain).score else special


def _test_links(model: FittedModel) -> tuple[FittedModel, dict[int, Evidence] | None]:
    """The model, and the links that may be claimed: those that pass alone, or the likeliest if they do together.

    They stay as wide as they were found as long as any passes: that they are off is no claim about each. None where
    they had to be brought back to the simulation.
    """
    state, settings = model.state, model.design.settings
    judge = Judge(model, state)
    links = judge.links()
    if not links:
        return model, {}
    passed = {link: each for link, each in links.items() if first_failed_test(each, settings) is None}
    together = judge.together()
    failed = first_failed_test(together, settings)
    if passed or failed is None:
        return model, passed or {max(links, key=lambda link: links[link].score): together}
    step = Step(f"withdrawn: links: {failed.text}", 0.0, failed)
    back = State(state.groups, (0.0,) * len(state.widths or ()))
    return replace(model, state=back, steps=(*model.steps, step)), None
