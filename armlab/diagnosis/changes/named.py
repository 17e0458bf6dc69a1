"""Changes with their names: what changed, by how much, and what else it could be."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from armlab.diagnosis.changes.between_runs import scatter_between_runs
from armlab.diagnosis.changes.change_search import find_rivals, held_out_errors
from armlab.diagnosis.changes.changes import ChangeGroup, ChangeTable, Tested
from armlab.diagnosis.changes.friction_level import friction_changes
from armlab.diagnosis.changes.numbers import (
    Change,
    as_share_of_first,
    as_wide_as_runs,
    between_ends,
    half_width_factor,
    list_changes,
    moved_laws,
)
from armlab.diagnosis.changes.pooled import Pooled, is_body
from armlab.diagnosis.changes.soundness import held_out_gains
from armlab.diagnosis.result import Member, Rival
from armlab.diagnosis.torque.columns.columns import place_of
from armlab.diagnosis.torque.names.findings import sure_together
from armlab.effects.links import INERTIAL_ERROR_FACTS
from armlab.effects.parameters import ParameterValue, parameter_values

ONE_FACTOR = "all friction of the joint by one factor"


@dataclass(frozen=True, eq=False)
class NamedChange:
    """One thing that changed. parameters: as changes. changes: the same with levels, where they are known.

    gains: share by which the held-out error of each recording falls with it. rms_before, rms_after: held-out, N m (N),
    at the joint that profits most. probability: of the name among its rivals, and of what no motion tells from it.
    """

    effect: str
    joint: int | None
    joints: tuple[int, ...]
    form: str
    parameters: tuple[ParameterValue, ...]
    changes: tuple[Change, ...]
    equation: str
    p_value: float
    evidence: float
    gains: tuple[float, ...]
    rms_before: float
    rms_after: float
    probability: float
    rivals: tuple[Rival, ...]

    @property
    def members(self) -> tuple[Member, ...]:
        """The names that it may have, the likeliest first; together they have probability 1."""
        own = Rival(self.effect, self.joint, self.joints)
        names = (own, *(each for each in self.rivals if not each.identical))
        return tuple(Member(each.effect, each.joint, each.joints, self.probability * _weight(each)) for each in names)

    @property
    def told(self) -> tuple[Member, ...]:
        """The likeliest of them that are sure together."""
        return sure_together(self.members)

    @property
    def not_told(self) -> tuple[Rival, ...]:
        """What else it could be."""
        told = {(each.effect, each.joint) for each in self.told}
        return tuple(each for each in self.rivals if (each.effect, each.joint) not in told)


def name_changes(pooled: Pooled, table: ChangeTable, found: Sequence[Tested]) -> tuple[NamedChange, ...]:
    """The changes that were found, with what else each could be, the surest first."""
    named = tuple(_name(pooled, table, found, each) for each in found)
    return tuple(sorted(named, key=lambda each: -each.evidence))


def _name(pooled: Pooled, table: ChangeTable, found: Sequence[Tested], tested: Tested) -> NamedChange:
    group = table.groups[tested.group]
    chosen = [each.group for each in found]
    errors = held_out_errors(table, chosen, tested.group)
    pairs = zip(*errors, table.mixed.joints, strict=True)
    joint = int(np.argmax([float(one @ one - two @ two) / each.variance for one, two, each in pairs]))
    counted = float(table.mixed.joints[joint].rows.weights.sum())
    before, after = (float(np.sqrt(part[joint] @ part[joint] / counted)) for part in errors)
    rivals = tuple(_list_rivals(table, group, find_rivals(table, chosen, tested)))
    changes = tuple(list_changes(pooled, table, found, tested))
    factor = half_width_factor(tested.degrees)
    difference, covariance = between_ends(table, tested)
    covariance = as_wide_as_runs(covariance, scatter_between_runs(table, chosen, tested.group).variances())
    ends = as_share_of_first(pooled, table, tested, difference, covariance)
    assert ends is not None  # sound changes leave torque to the first recording (`reason_impossible`)
    difference, covariance = ends
    law = next(iter(moved_laws(table, tested)), group.candidate)
    if group.laws or group.whole_law or group.parts:
        changes = tuple(each for each in changes if each.changed or not group.parts)
        parameters = tuple(
            ParameterValue(each.parameter, each.difference, each.interval, each.unit) for each in changes
        )
        amounts = ", ".join(f"{each.parameter} {each.difference:+.4g} {each.unit}" for each in changes)
        equation = f"{law.effect} of joint {law.joint}: {amounts}"
    else:
        parameters = parameter_values(group.candidate, difference, covariance, factor)
        equation = group.candidate.equation(difference)
    return NamedChange(
        effect=law.effect,
        joint=law.joint,
        joints=law.joints,
        form=ONE_FACTOR if group.laws else law.form,
        parameters=parameters,
        changes=changes,
        equation=equation,
        p_value=min(tested.p_value * len(table.groups), 1.0),
        evidence=tested.evidence,
        gains=held_out_gains(table, tested.group, errors),
        rms_before=before,
        rms_after=after,
        probability=1 / (1 + sum(_weight(each) for each in rivals if not each.identical)),
        rivals=rivals,
    )


def _weight(rival: Rival) -> float:
    """How likely a rival is beside the name."""
    return float(np.exp(-rival.deficit))


def _list_rivals(table: ChangeTable, own: ChangeGroup, rivals: Sequence[tuple[int, float]]) -> Iterator[Rival]:
    """Rivals by name, each once; for a load an error of the same link, which no motion tells from it."""
    seen = {(own.candidate.effect, own.candidate.joint)}
    for number, deficit in rivals:
        candidate = table.groups[number].candidate
        if (candidate.effect, candidate.joint) not in seen:
            seen.add((candidate.effect, candidate.joint))
            yield Rival(candidate.effect, candidate.joint, candidate.joints, False, deficit)
    if is_body(own.candidate):
        yield Rival(INERTIAL_ERROR_FACTS.id, own.candidate.joint, (), True)


def list_table(pooled: Pooled, table: ChangeTable, found: Sequence[Tested]) -> tuple[Change, ...]:
    """Every parameter that was compared: those that changed as fitted together, each other one beside them."""
    chosen = [each.group for each in found]
    rows = [row for each in found for row in list_changes(pooled, table, found, each)]
    listed = {_what(row) for row in rows}
    changed = {place_of(law) for number in chosen for law, _ in table.groups[number].laws}
    for number, group in enumerate(table.groups):
        if number in chosen or group.laws or place_of(group.candidate) in changed:
            continue
        beside = table.test((*chosen, number))
        if is_told(table, beside[-1]):
            others = [each for each in list_changes(pooled, table, beside, beside[-1]) if _what(each) not in listed]
            rows += [replace(each, changed=False) for each in others]
            listed.update(_what(each) for each in others)
    return (*rows, *friction_changes(pooled, table, found))


def _what(change: Change) -> tuple[str, tuple[int, ...], str]:
    return change.effect, change.joints, change.parameter


def is_told(table: ChangeTable, tested: Tested) -> bool:
    """Whether the recordings tell of a group more than its prior does."""
    scales = table.groups[tested.group].scales
    spread = tested.covariance / tested.inflation
    return bool(np.any(np.diag(spread) < 0.25 * scales**2))
