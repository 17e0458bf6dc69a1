"""What speaks for each name that a finding could have, and for none of them: the numbers behind its probabilities.

Every candidate of the library takes the place of the finding in turn, everything else fitted anew. One that predicts
held-out rows worse than no law in that place, or that needs numbers that no arm has, is no name. What a law lacks of
the best log evidence, and what it predicts worse than the finding, speaks against a name. That none is right is
likelier the more structure is left beside the finding, and the more is unusual about its joint. It is likelier, too,
where the errors of the model are coloured, for they are then more than noise, where a finding explains less of the
validation runs, and beside a simulation that was fitted to recordings of the arm, for it lacks little.

Two kinds of findings are weighed, each with numbers of its own: what passed all tests (`found`), and structure of which
only a surrogate knows (`structure`).
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.result import Weighed, WeighedName
from armlab.diagnosis.torque.columns.blocks import rows_of_fit
from armlab.diagnosis.torque.columns.links import Widths
from armlab.diagnosis.torque.columns.solver import LEAST_UNABSORBED, Fit, Solver, State
from armlab.diagnosis.torque.evidence.added_body import PlacedBody, payload_groups, place_body
from armlab.diagnosis.torque.evidence.evidence import Evidence
from armlab.diagnosis.torque.evidence.plausibility import is_of_no_arm
from armlab.diagnosis.torque.evidence.unknown import is_structured, predicted_share
from armlab.diagnosis.torque.search.fitted_model import FittedModel
from armlab.diagnosis.torque.search.search import Search
from armlab.diagnosis.torque.search.surrogate import Structure
from armlab.effects.contract import UNKNOWN, Candidate
from armlab.effects.library import effect_named
from armlab.effects.links import INERTIAL_ERROR_FACTS, PAYLOAD_FACTS
from armlab.effects.parameters import parameter_values
from armlab.effects.term import SIGN_SIGMAS

Place = int | None  # a joint or link, from 1; None for the whole robot
Kind = Literal["found", "structure"]
# the numbers that weigh otherwise beside a simulation that was fitted to recordings of the arm
BESIDE_FITTED = ("none", "gain", "score", "links off", "link", "deficit", "near deficit", "searched", "growth")
MOST_COLOUR = 1.0  # of errors, a logarithm; beyond, the rate of samples says more than the arm does


@dataclass(frozen=True)
class _NameTrial:
    """A law in the place of a finding. score: of the model with it; error: (joints,), its `heldout_error`.

    own: whether the search took it. early: whether it shifts the torque of a joint that sticks to before its motion,
    as friction at rest may seem to. in_motion: what such a shift adds to the log likelihood of rows in motion.
    """

    effect: str
    joint: Place
    joints: tuple[int, ...]
    score: float
    error: Array
    own: bool = False
    early: bool = False
    in_motion: float | None = None


def weigh_effect(model: FittedModel, group: int, claimed: Mapping[int, Evidence], left: Sequence[Structure]) -> Weighed:
    """The names of an effect of a model. claimed: all its effects; left: structure of its joints."""
    evidence, without, bent = claimed[group], model.state.minus(group), 0.0
    candidate = model.candidate(group)
    trials = list(_in_place(model, without, group, beside=model.state))
    trials += _other_friction(model, without, group)
    if group in payload_groups(model) and model.design.prior is not None:
        trials += _bodies(model, without, place_body(model, without), candidate.joints[0])
    others = [each for each in claimed if each != group]
    none = _against_found(model, evidence, candidate.joint, others, left)
    if candidate.facts.usual or candidate.is_friction:
        none |= _against_expected(model, candidate)
    if candidate.facts.scales_torque:
        bent = _bent_gain(model, without, group)
    return _weighed("found", trials, none, (candidate.joint, candidate.joints), model, without, model.fit.score + bent)


def weigh_link(
    model: FittedModel,
    link: int,
    evidence: Evidence,
    claimed: Iterable[int],
    left: Sequence[Structure],
) -> Weighed:
    """The names of a link (from 0) that is off. claimed: the effects of the model."""
    widths = model.state.widths or ()
    without = State(model.state.groups, _changed(widths, link, 0.0))
    error = _held_out(model, model.state)
    trials = [_NameTrial(INERTIAL_ERROR_FACTS.id, link + 1, (), model.fit.score, error, own=True)]
    trials += _in_place(model, without, None, beside=model.state)
    trials += _bodies(model, without, place_body(model, without), None)
    trials += _other_links(model, without, link, max(widths))
    none = _against_found(model, evidence, link + 1, list(claimed), left)
    none["found link"] = 1.0
    return _weighed("found", trials, none, (link + 1, ()), model, without)


def weigh_structure(model: FittedModel, structure: Structure, claimed: Iterable[int]) -> Weighed:
    """The names of structure that only a surrogate explains. claimed: effects of the model."""
    joint = structure.joint + 1
    none = {
        "structure none": 1.0,
        "structure gain": float(np.log1p(structure.gain)),
        "structure colour": _colour(model, structure.joint),
        "structure beside": float(_unusual_at(model, joint, claimed)),
    }
    trials = _in_place(model, model.state, None, structure.joint)
    return _weighed("structure", trials, none, (joint, (joint,)), model, model.state)


def _weighed(
    kind: Kind,
    trials: Iterable[_NameTrial],
    none: Mapping[str, float],
    place: tuple[Place, tuple[int, ...]],
    model: FittedModel,
    without: State,
    nameless: float = -np.inf,
) -> Weighed:
    """Each name once, by its likeliest law, and none of them.

    A law that predicts held-out rows worse than the model does without any is no name, as what is found would be none.
    place: joint and joints of the finding. without: the state with no law in that place. nameless: the score of a law
    that has no name.
    """
    most, own = float(np.sum(_held_out(model, without))), _held_out(model, model.state)
    known: dict[tuple[str, Place], _NameTrial] = {}
    for each in sorted(trials, key=lambda each: (not each.own, -each.score)):
        predicts = each.own or float(np.sum(each.error)) <= most
        if predicts and (kind == "found" or each.score > model.fit.score):
            known.setdefault((each.effect, each.joint), each)
    best = max((*(each.score for each in known.values()), nameless))
    names = [
        WeighedName(each.effect, each.joint, each.joints, _for_name(kind, each, best, model.fit.score, own))
        for each in known.values()
    ]
    joint, joints = place
    weighed = (*names, WeighedName(UNKNOWN.id, joint, joints, none))
    if model.design.simulation.is_fitted:
        weighed = tuple(replace(each, numbers=_beside_fitted(each.numbers)) for each in weighed)
    return weighed


def _beside_fitted(numbers: Mapping[str, float]) -> dict[str, float]:
    """The numbers of a name, and those once more that weigh otherwise beside a simulation that was fitted to the arm.

    Such a simulation lacks little: what it leaves is the form of its laws more often than an effect.
    """
    return {
        **numbers,
        **{f"fitted {key}": numbers[f"found {key}"] for key in BESIDE_FITTED if f"found {key}" in numbers},
    }


def _for_name(kind: Kind, trial: _NameTrial, best: float, score: float, error: Array) -> dict[str, float]:
    """best: the largest score of a trial; score, error: of the model that is weighed."""
    deficit = best - trial.score
    out = {
        f"is {trial.effect}": 1.0,
        f"{kind} deficit": float(np.log1p(deficit)),
        f"{kind} near deficit": min(deficit, 30.0) / 10,
    }
    if trial.in_motion is not None:
        out |= {
            "shifts where a joint sticks": 1.0,
            "early where a joint sticks": float(trial.early),
            "shifts in motion": float(np.log1p(max(trial.in_motion, 0.0))),
        }
    if kind == "structure":
        return out | {"structure earned": float(np.log1p(trial.score - score))}
    growth = min(float(np.log1p(10 * max(_growth(trial.error, error), 0.0))), 3.0)
    return out | {"found searched": float(trial.own), "found growth": growth}


def _against_found(
    model: FittedModel, evidence: Evidence, joint: Place, others: Sequence[int], left: Sequence[Structure]
) -> dict[str, float]:
    share = _structured_share(model, left, evidence.joint)
    unusual = [each for each in others if model.solver.unusual[each]]
    return {
        "found none": 1.0,
        "found score": float(np.log1p(max(evidence.score, 0.0))) / 5,
        "found gain": float(np.log1p(max(evidence.gain, 0.0))),
        "found p": negative_logarithm(evidence.corrected, 30) / 10,
        "found validated": _validated(evidence),
        "found colour": _colour(model, evidence.joint),
        "found structure": float(np.log1p(share / max(evidence.gain, 1e-3))),
        "found structure chance": _structure_chance(left, evidence.joint),
        "found structure elsewhere": float(any(is_structured(each, model.design.settings.tuning) for each in left)),
        "found beside": float(_unusual_at(model, joint, others)),
        "found crowd": float(len(unusual)),
        "found links off": float(any(model.state.widths or ())),
    }


def _against_expected(model: FittedModel, candidate: Candidate) -> dict[str, float]:
    """Friction and offsets are at every joint: where the simulation has them, what is found is their form at most."""
    if candidate.joint in model.design.simulation.joints_without_friction:
        return {"found usual": 1.0} if candidate.facts.usual else {}
    return {"found beside friction": 1.0}


def _validated(evidence: Evidence) -> float:
    """The logarithm of how much more a finding explains of validation runs than of those it was found on."""
    ratio = (1 + max(evidence.validation_gain, 0.0)) / (1 + max(evidence.gain, 0.0))
    return float(np.clip(np.log(ratio), -2.0, 2.0))


def _colour(model: FittedModel, joint: int) -> float:
    """How coloured the errors of a joint (from 0) are; more than noise for certain is not told apart."""
    return min(float(model.colours[joint]), MOST_COLOUR)


def _structure_chance(left: Sequence[Structure], joint: int) -> float:
    """How clear it is that a joint (from 0) has structure left, significant or not."""
    return max((negative_logarithm(each.p_value, 4) / 4 for each in left if each.joint == joint), default=0.0)


def negative_logarithm(p_value: float, most: int) -> float:
    """-log10 of a p-value, at most so many."""
    return float(-np.log10(max(p_value, 10.0**-most)))


def _structured_share(model: FittedModel, left: Sequence[Structure], joint: int) -> float:
    """What a surrogate predicts of what is left at a joint (from 0), a share; 0 where it is not more than chance."""
    tuning = model.design.settings.tuning
    here = (each for each in left if each.joint == joint and is_structured(each, tuning))
    return max((predicted_share(each) for each in here), default=0.0)


def _bent_gain(model: FittedModel, without: State, group: int) -> float:
    """By how much a scale that bends raises the log likelihood more than the scale of the library in whose place it is.

    It is the square of the torque that is scaled, with its sign or without. A scale that differs by the sign of the
    torque has a column for each sign: their sum is that torque.
    """
    joint, columns = model.candidate(group).rows[0], model.solver.groups[group].columns
    law, whole = np.zeros((2, model.moments.size))
    law[columns], whole[columns] = model.solver.values(model.fit, group), 1.0
    own, scaled = (model.columns.torque_at(joint, each) for each in (law, whole))
    gains = _log_gains(model, without, joint, np.column_stack([own, scaled**2, scaled * abs(scaled)]))
    return float(max(gains[1:].max() - gains[0], 0.0))


def _log_gains(model: FittedModel, state: State, joint: int, torques: Array) -> Array:
    """How much each torque (rows, laws) at a joint (from 0) would raise the log likelihood beside a state, (laws,)."""
    fit, observed = model.solver.fit(state), model.design.observed
    design, left = rows_of_fit(model.columns, fit, model.moments.lengths, joint)
    stacked = np.column_stack([torques, design, left])
    white = model.noise.white(stacked, joint, observed, "identify")
    count = torques.shape[1]
    laws, rows, errors = white[:, :count], white[:, count:-1], white[:, -1]
    lengths, shared = np.sum(laws**2, axis=0), rows.T @ laws
    # what the state absorbs counts for nothing
    alone = lengths - np.einsum("pl,pq,ql->l", shared, fit.inverse, shared)
    least = LEAST_UNABSORBED * lengths
    return np.asarray((laws.T @ errors) ** 2 / (2 * np.maximum(alone, least) + 1e-300))


def _unusual_at(model: FittedModel, joint: Place, groups: Iterable[int]) -> int:
    """How many of these groups are at a joint and not its friction as every joint has it."""
    facts = [model.candidate(each) for each in groups]
    return sum(each.joint == joint and not (each.facts.usual and each.facts.dissipates) for each in facts)


def _in_place(
    model: FittedModel, without: State, own: int | None, joint: int | None = None, beside: State | None = None
) -> Iterator[_NameTrial]:
    """The likeliest law of each effect at each place beside a state, the likeliest first.

    own: the group that stands there; its effect is always among them. joint: from 0, where the torque has to act.
    beside: the state with what is weighed; what it would still raise as much is another effect, and no rival.
    """
    solver, tuning = model.solver, model.design.settings.tuning.naming
    search = Search(solver, model.design.settings, True, 0)
    scores, seen = search.gains(without), set[tuple[str, Place]]()
    taken = None if own is None else (solver.candidate(own).effect, solver.candidate(own).joint)
    others = frozenset() if beside is None else _independent(search, scores, beside)
    for number in map(int, np.argsort(-scores)):
        candidate = solver.candidate(number)
        key = candidate.effect, candidate.joint
        full = len(seen) >= tuning.names
        if full and (taken is None or taken in seen):
            break
        if key in seen or (full and key != taken) or (joint is not None and joint not in candidate.rows):
            continue
        if number != own and (number in others or search.has_no_room(without, number)):
            continue
        state = search.with_group(without, number)
        if number != own and search.objection(state, number) is not None:
            continue
        seen.add(key)
        fit = solver.fit(state)
        named = candidate.first_name(solver.values(fit, number), model.design.scenes)
        if key != taken and _is_of_no_arm(solver, fit, number, named):
            continue
        error = model.moments.heldout_error(fit.coefficients)
        trial = _NameTrial(named.effect, named.joint, named.joints, fit.score, error, key == taken)
        if candidate.facts.cause == "timing" and _sticks_where_it_acts(model, state, candidate):
            early = bool(solver.values(fit, number)[0] < 0)
            trial = replace(trial, early=early, in_motion=_gain_in_motion(model, without, fit, candidate.rows))
        yield trial


def _is_of_no_arm(solver: Solver, fit: Fit, group: int, named: Candidate) -> bool:
    """Whether no arm has the numbers of a group, under its name, beside which nothing of it is simulated."""
    values, covariance = solver.values(fit, group), solver.covariance(fit, group)
    known = not solver.simulated[group].any()
    return known and is_of_no_arm(named, parameter_values(named, values, covariance, SIGN_SIGMAS))


def _other_friction(model: FittedModel, without: State, group: int) -> Iterator[_NameTrial]:
    """Other friction of a law's joint, beside the usual friction whose place the law took."""
    groups = model.solver.groups
    replaced = {each for each in model.solver.contained(group) if groups[each].candidate.facts.usual}
    if not replaced <= set(without.groups):
        plain = State(tuple(sorted({*without.groups, *replaced})), without.widths)
        for trial in _in_place(model, plain, group, beside=model.state):
            if trial.joint == groups[group].candidate.joint and effect_named(trial.effect).dissipates:
                yield trial


def _sticks_where_it_acts(model: FittedModel, state: State, candidate: Candidate) -> bool:
    """Whether friction of a state that sticks acts where a law does."""
    facts = [model.candidate(each) for each in state.groups]
    return any(each.facts.sticks and each.rows[0] in candidate.rows for each in facts)


def _gain_in_motion(model: FittedModel, without: State, fit: Fit, joints: Sequence[int]) -> float:
    """By how much the log likelihood of rows in motion is larger with a fit than without it, at some joints."""
    observed, less, gain = model.design.observed, model.solver.fit(without), 0.0
    noise = model.noise.in_motion(observed)
    for joint in joints:
        left = np.column_stack([model.residual_at(joint, each) for each in (less, fit)])
        white = noise.white(left, joint, observed, "identify")
        gain += float(np.sum(white[:, 0] ** 2) - np.sum(white[:, 1] ** 2)) / 2
    return gain


def _independent(search: Search, scores: Array, beside: State) -> frozenset[int]:
    """Groups that raise the score of a state by most of what they do without what is weighed there, `scores`."""
    keep = search.gains(beside) > np.maximum(scores, 0.0) / 2
    return frozenset(int(each) for each in np.flatnonzero(keep) if not search.has_no_room(beside, int(each)))


def _bodies(model: FittedModel, without: State, placed: Sequence[PlacedBody], own: int | None) -> Iterator[_NameTrial]:
    """A body that can exist at each link. own: the link whose body is known already."""
    solver = model.solver
    crowd = solver.tuning.crowd_penalty * solver.crowd(without.groups)
    for each in placed:
        if each.link != own:
            score = solver.fit(without).score + each.gain - float(solver.prices[each.group]) - crowd
            yield _NameTrial(PAYLOAD_FACTS.id, each.link, (), score, each.error)


def _other_links(model: FittedModel, without: State, link: int, width: float) -> Iterator[_NameTrial]:
    """Another link that is off in the place of one (from 0)."""
    widths = without.widths or ()
    for other in range(len(widths)):
        if other != link:
            state = State(without.groups, _changed(widths, other, width))
            score, error = model.solver.fit(state).score, _held_out(model, state)
            yield _NameTrial(INERTIAL_ERROR_FACTS.id, other + 1, (), score, error)


def _held_out(model: FittedModel, state: State) -> Array:
    return model.moments.heldout_error(model.solver.fit(state).coefficients)


def _growth(error: Array, known: Array) -> float:
    return float(np.max(error / np.maximum(known, 1e-300))) - 1


def _changed(widths: Widths, link: int, width: float) -> Widths:
    return tuple(width if other == link else each for other, each in enumerate(widths))
