"""What a fitted model holds, cause by cause: the share of the error that each explains, and what taking it away costs.

A cause is what a person fixes or models: all friction, the links, or one other effect. What is taken away together is
all of one cause at one place, with or without a claim: the rest is fitted anew, and the held-out error of the joint
that misses it most tells what it was worth. Taken away one by one, Coulomb and viscous friction hide behind each other.

The error is the squared held-out error over all joints, each in units of its own torque. It starts at the simulation as
given, at the rigid body as refitted where there is none, and falls with each cause that is added, the one with which it
falls most first; so shares sum to at most one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.diagnosis.result import Claim, Part, Removal
from armlab.diagnosis.torque.columns.solver import State
from armlab.diagnosis.torque.rows.data import Observed
from armlab.diagnosis.torque.search.fitted_model import FittedModel
from armlab.effects.contract import UNKNOWN, Effect
from armlab.effects.library import effect_named
from armlab.effects.links import INERTIAL_ERROR_FACTS

K = TypeVar("K")
Place = tuple[int | None, tuple[int, ...]]  # joint or link, and both joints of a coupling
SHARED_CAUSES = ("friction", "links", "unknown")  # of several effects that a person fixes or models at once
LINKS, UNKNOWN_CAUSE = "links", "unknown"


def cause_of(effect: Effect) -> str:
    """What a person fixes or models: `friction`, `links`, `unknown`, or the effect by its id."""
    return effect.cause if effect.cause in SHARED_CAUSES else effect.id


def claim_facts(claim: Claim) -> Effect:
    """The effect of a claim."""
    return effect_named(claim.effect) if claim.candidate is None else claim.candidate.facts


def weigh_parts(model: FittedModel, claims: Sequence[Claim]) -> tuple[Part, ...]:
    """The parts of the model that predicts, with the claims about each; shares are of the error before noise is known.

    claims: by their group in this model.
    """
    return _Parts(model, tuple(claims)).weighed()


def weigh_claims(model: FittedModel, claims: Sequence[Claim]) -> tuple[Claim, ...]:
    """The claims with what the removal of each alone costs, beside the other claims at its place.

    What the model holds of the same cause at the same place without a claim is taken away before: it would hide it.
    What is in no model costs what its own test says.
    """
    return _Parts(model, tuple(claims)).claims_weighed()


def removal_of(model: FittedModel, groups: Sequence[int]) -> Removal:
    """What it costs to take groups of a model away together."""
    parts = _Parts(model, ())
    return parts.removal(model.state, _without(model.state, groups), parts.rows_of(groups))


@dataclass(frozen=True, eq=False)
class _Parts:
    model: FittedModel
    claims: tuple[Claim, ...]

    @cached_property
    def _rows_and_units(self) -> tuple[list[NDArray[np.bool_]], Array]:
        return _rows_and_units(self.model.design.observed)

    @cached_property
    def _groups(self) -> dict[tuple[str, Place], list[int]]:
        """Groups of the model by cause and place."""
        claimed = {group: claim for claim in self.claims for group in _groups_of(claim)}
        out: dict[tuple[str, Place], list[int]] = {}
        for group in self.model.state.groups:
            candidate, claim = self.model.candidate(group), claimed.get(group)
            facts = candidate.facts if claim is None else claim_facts(claim)
            joint = candidate.joint if claim is None else claim.joint
            joints = candidate.joints if facts.where == "coupling" else ()
            out.setdefault((cause_of(facts), (joint, joints)), []).append(group)
        return out

    @cached_property
    def _links_are_off(self) -> bool:
        widths = self.model.state.widths
        return self.model.design.simulation.kind != "refit" and (widths is None or any(widths))

    def _claims_of(self, groups: Sequence[int]) -> tuple[int, ...]:
        return tuple(number for number, claim in enumerate(self.claims) if set(_groups_of(claim)) & set(groups))

    def weighed(self) -> tuple[Part, ...]:
        parts, torques = list[Part](), list[Array]()
        for (cause, (joint, joints)), groups in self._groups.items():
            removal = self.removal(self.model.state, _without(self.model.state, groups), self.rows_of(groups))
            effects = tuple(self.model.candidate(each).effect for each in groups)
            parts.append(Part(cause, joint, joints, effects, self._claims_of(groups), removal))
            torques.append(self._torque_of_groups(groups))
        if self._links_are_off:
            own = tuple(number for number, claim in enumerate(self.claims) if claim.in_links)
            parts.append(Part(LINKS, None, (), (INERTIAL_ERROR_FACTS.id,), own, self._removal_of_links()))
            torques.append(self._torque_of_links())
        return self._with_falls(parts, torques)

    def claims_weighed(self) -> tuple[Claim, ...]:
        out = list(self.claims)
        for groups in self._groups.values():
            own = self._claims_of(groups)
            claimed = {group for number in own for group in _groups_of(self.claims[number])}
            present = _without(self.model.state, [each for each in groups if each not in claimed])
            for number in own:
                mine = _groups_of(self.claims[number])
                removal = self.removal(present, _without(present, mine), self.rows_of(mine))
                out[number] = replace(self.claims[number], removal=removal)
        widths = self.model.state.widths
        for number, claim in enumerate(self.claims):
            if is_in_no_model(claim):
                out[number] = replace(claim, removal=self._removal_by_test(claim))
            if claim.in_links and claim.candidate is None:  # these data do not tell which link is off
                out[number] = replace(claim, removal=self._removal_of_links())
            elif claim.in_links and widths is not None:
                less = tuple(0.0 if claim.joint == link else width for link, width in enumerate(widths, 1))
                without, last = State(self.model.state.groups, less), claim.joint or self.model.columns.joints
                out[number] = replace(claim, removal=self.removal(self.model.state, without, range(last)))
        return tuple(out)

    def rows_of(self, groups: Sequence[int]) -> list[int]:
        """Joints, from 0, whose torque groups change."""
        return sorted({row for each in groups for row in self.model.candidate(each).rows})

    def _removal_of_links(self) -> Removal | None:
        """None where all links are free, so that nothing of them can be taken away alone."""
        widths = self.model.state.widths
        if widths is None:
            return None
        without = State(self.model.state.groups, (0.0,) * len(widths))
        return self.removal(self.model.state, without, range(self.model.columns.joints))

    def removal(self, present: State, without: State, joints: Sequence[int]) -> Removal:
        """At the joint, of these, whose held-out error grows most, before those where it changes little."""
        every = [self._removal_at(joint, present, without) for joint in joints]
        worst = max(every, key=lambda each: (not each.is_minor, each.growth))
        changed = [each for each in every if not each.is_minor]
        better = [each for each in every if each.growth < 0 and not replace(each, growth=-each.growth).is_minor]
        return replace(
            worst,
            joints=tuple(each.joint for each in changed),
            better=tuple(each.joint for each in better),
        )

    def _removal_at(self, joint: int, present: State, without: State) -> Removal:
        before, after = self._rms(joint, without), self._rms(joint, present)
        return Removal(joint, before / max(after, 1e-300) - 1, after, float(self._rows_and_units[1][joint]))

    def _removal_by_test(self, claim: Claim) -> Removal:
        assert claim.joint is not None
        joint, after = claim.joint - 1, max(claim.evidence.rms_after, 1e-300)
        return Removal(joint, claim.evidence.rms_before / after - 1, after, float(self._rows_and_units[1][joint]))

    def _rms(self, joint: int, state: State) -> float:
        residual = self.model.residual_at(joint, self.model.solver.fit(state))
        return float(np.sqrt(np.mean(residual[self._rows_and_units[0][joint]] ** 2)))

    def _torque_of_groups(self, groups: Sequence[int]) -> Array:
        whole, own = self.model.coefficients(self.model.fit), np.zeros(self.model.moments.size)
        for each in groups:
            columns = self.model.solver.groups[each].columns
            own[columns] = whole[columns]
        return self.model.columns.torque_of(own)

    def _torque_of_links(self) -> Array:
        whole, own = self.model.coefficients(self.model.fit), np.zeros(self.model.moments.size)
        own[: self.model.columns.base] = whole[: self.model.columns.base]
        return self.model.columns.torque_of(own)

    def _stacked(self, torque: Array) -> Array:
        """Held-out rows of all joints, each joint's mean square in units of its torque's."""
        return stack_in_units(torque, *self._rows_and_units)

    def _with_falls(self, parts: Sequence[Part], torques: Sequence[Array]) -> tuple[Part, ...]:
        """Shares of the error at the start, cause by cause, then part by part and claim by claim."""
        own = [self._stacked(torque) for torque in torques]
        left = self._stacked(self.model.residual(self.model.fit))
        start = left + np.sum(own, axis=0) if own else left
        whole = float(start @ start)
        causes: dict[str, list[int]] = {}
        for number, part in enumerate(parts):
            causes.setdefault(part.cause, []).append(number)
        out, remaining = list(parts), start
        sums = {cause: np.sum([own[each] for each in numbers], axis=0) for cause, numbers in causes.items()}
        for cause in add_in_order(start, sums):
            for number, fall in add_in_order(remaining, {each: own[each] for each in causes[cause]}).items():
                shares = self._shares_of_claims(parts[number], remaining, torques[number], fall)
                out[number] = replace(parts[number], share=fall / whole, shares=tuple(x / whole for x in shares))
            remaining = remaining - sums[cause]
        return tuple(out)

    def _shares_of_claims(self, part: Part, start: Array, torque: Array, fall: float) -> list[float]:
        """The fall of a part among its claims, in the ratio of what each takes off alone; they sum to that of the part.

        torque: (rows, joints), of the part.
        """
        if len(part.claims) < 2:
            return [fall] * len(part.claims)
        groups = [_groups_of(self.claims[number]) for number in part.claims]
        alone = [self._torque_of_groups(each) if each else torque / len(groups) for each in groups]
        falls = add_in_order(start, {number: self._stacked(each) for number, each in enumerate(alone)})
        weights = np.array([max(falls[number], 0.0) for number in range(len(groups))])
        if not weights.any():
            weights[:] = 1.0
        return [float(each) for each in fall * weights / weights.sum()]


def is_in_no_model(claim: Claim) -> bool:
    """Whether a finding is structure that a surrogate alone knows."""
    return claim.effect == UNKNOWN.id and not claim.unnamed


def _groups_of(claim: Claim) -> tuple[int, ...]:
    """The groups of the model that predicts which hold what a claim is about."""
    return claim.unnamed if claim.group is None else (claim.group,)


def _without(state: State, groups: Sequence[int]) -> State:
    return State(tuple(each for each in state.groups if each not in groups), state.widths)


NO_TORQUE = 1e-9  # of the largest torque: what rounding leaves of a drive that is off


def stack_in_units(torque: Array, rows: Sequence[NDArray[np.bool_]], units: Array) -> Array:
    """Some rows of each joint (rows, joints) one after the other, the mean square of each joint in its own unit."""
    scales = [float(unit) * np.sqrt(max(int(own.sum()), 1)) for unit, own in zip(units, rows, strict=True)]
    return np.concatenate([torque[own, joint] / scales[joint] for joint, own in enumerate(rows)])


def explain_error(
    model: FittedModel, observed: Observed, claims: Sequence[Claim], errors: tuple[Array, Array], noise: Array
) -> tuple[Part, ...]:
    """The parts of the model that predicts, and what has no name, with their shares of the error above the noise.

    observed: the rows on which the claims were tested; errors: (rows, joints) there, what there was to explain and what
    the model found leaves. noise: (joints,), N m (N). Shares sum to at most one, and so do those of the claims.
    """
    rows, units = _rows_and_units(observed)
    whole, left = (stack_in_units(each, rows, units) for each in errors)
    power = max(float(whole @ whole), 1e-300)
    floor = min(float(np.sum((noise / units) ** 2)), float(left @ left))
    parts = list(weigh_parts(model, claims))
    for number, claim in enumerate(claims):
        if claim.effect == UNKNOWN.id and np.any(claim.left_out):
            after = left - stack_in_units(np.asarray(claim.left_out), rows, units)
            share = float(left @ left - after @ after) / power
            parts.append(Part(UNKNOWN_CAUSE, claim.joint, (), (UNKNOWN.id,), (number,), None, share, (share,)))
    above = max(1 - floor / power, 1e-300)
    shares = [max(each.share / above, 0.0) for each in parts]
    total = max(sum(shares), 1.0)
    return tuple(_with_share(each, share / total) for each, share in zip(parts, shares, strict=True))


def as_found(removal: Removal | None, errors: Mapping[int, float], observed: Observed) -> Removal | None:
    """A removal with the error, N m (N), of the model found on these rows, in the place of the fit's own.

    errors: by joint, from 0.
    """
    if removal is None:
        return None
    _, units = _rows_and_units(observed)
    return replace(removal, rms=errors[removal.joint], torque=float(units[removal.joint]))


def _rows_and_units(observed: Observed) -> tuple[list[NDArray[np.bool_]], Array]:
    """The held-out rows of each joint, and the rms of its torque there, N m (N); the largest one where it has none."""
    rows = [observed.rows_held_out(joint) for joint in range(observed.joints)]
    torque = observed.torque
    sizes = np.array([np.sqrt(np.mean(torque[own, joint] ** 2)) for joint, own in enumerate(rows)])
    return rows, np.where(sizes > NO_TORQUE * sizes.max(), sizes, sizes.max() or 1.0)


def _with_share(part: Part, share: float) -> Part:
    """A part with another share, its claims in the same ratio."""
    factor = share / part.share if part.share > 0 else 0.0
    return replace(part, share=share, shares=tuple(max(factor * each, 0.0) for each in part.shares))


def add_in_order(start: Array, torques: Mapping[K, Array]) -> dict[K, float]:
    """How much the squared error falls with each torque, added to those with which it falls more."""
    left, waiting, out = start, dict(torques), dict[K, float]()
    while waiting:
        falls = {key: float(left @ left - (left - torque) @ (left - torque)) for key, torque in waiting.items()}
        best = max(falls, key=lambda key: falls[key])
        out[best] = falls[best]
        left = left - waiting.pop(best)
    return out
