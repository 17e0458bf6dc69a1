"""Changes with their names and numbers: what changed, by how much in units and percent, and what else it could be."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from armlab.common.arrays import Array
from armlab.diagnosis.columns import place_of
from armlab.diagnosis.compare.changes import ChangeGroup, ChangeTable, Tested, find_rivals, held_out_errors
from armlab.diagnosis.compare.pooled import Pooled, is_body
from armlab.diagnosis.result import Rival
from armlab.effects.contract import Candidate, Value
from armlab.effects.links import INERTIAL_ERROR_FACTS
from armlab.effects.parameters import ParameterValue, half_widths, parameter_slopes, parameter_values

CONFIDENCE = 0.95
ONE_FACTOR = "all friction of the joint by one factor"


@dataclass(frozen=True)
class Change:
    """One parameter in the recordings.

    levels: of each recording, None where only the difference is known. difference: last less first. interval: 95 %, of
    it. ratio: last over first with its interval, None where there is no level. p_value: of no difference, corrected
    for all that is compared. detectable: the smallest difference that would have been named.
    """

    effect: str
    joint: int | None
    joints: tuple[int, ...]
    parameter: str
    levels: tuple[float, ...] | None
    difference: float
    interval: tuple[float, float]
    ratio: tuple[float, float, float] | None
    unit: str
    p_value: float
    detectable: float
    changed: bool

    @property
    def old(self) -> float | None:
        """Level in the first recording."""
        return None if self.levels is None else self.levels[0]

    @property
    def new(self) -> float | None:
        """Level in the last recording."""
        return None if self.levels is None else self.levels[-1]


@dataclass(frozen=True, eq=False)
class Movement:
    """A parameter over all recordings. values: (recordings,), levels where they are known, else about their mean.

    covariance: (recordings, recordings), of the values about their mean. half_widths: (recordings,), of 95 % intervals.
    """

    effect: str
    joint: int | None
    joints: tuple[int, ...]
    parameter: str
    unit: str
    values: Array
    covariance: Array
    half_widths: Array


@dataclass(frozen=True, eq=False)
class NamedChange:
    """One thing that changed. parameters: as changes. changes: the same with levels, where they are known.

    gains: share by which the held-out error of each recording falls with it. rms_before, rms_after: held-out, N m (N),
    at the joint that profits most. probability: of the name among its rivals.
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


def name_changes(pooled: Pooled, table: ChangeTable, found: Sequence[Tested]) -> tuple[NamedChange, ...]:
    """The changes that were found and that predict held-out stretches of every recording better, surest first."""
    named = tuple(_name(pooled, table, found, each) for each in found)
    return tuple(sorted(named, key=lambda each: -each.evidence))


def predicts_better(gains: Sequence[float], least: float) -> bool:
    """Whether a change lowers the held-out error of each recording, and of all together enough."""
    return min(gains) > 0 and float(np.mean(gains)) > least


def held_out_gains(table: ChangeTable, errors: tuple[list[Array], list[Array]]) -> tuple[float, ...]:
    """Share by which the squared held-out error of each recording falls, joints weighted by their noise."""
    out = []
    for recording in range(len(table.contrast)):
        less, left = 0.0, 0.0
        for before, after, joint in zip(*errors, table.mixed.joints, strict=True):
            own = joint.rows.members == recording
            less += float(np.sum(before[own] ** 2 - after[own] ** 2)) / joint.variance
            left += float(np.sum(after[own] ** 2)) / joint.variance
        out.append(less / max(left, 1e-300))
    return tuple(out)


def _name(pooled: Pooled, table: ChangeTable, found: Sequence[Tested], tested: Tested) -> NamedChange:
    group = table.groups[tested.group]
    chosen = [each.group for each in found]
    errors = held_out_errors(table, chosen, tested.group)
    pairs = zip(*errors, table.mixed.joints, strict=True)
    joint = int(np.argmax([float(one @ one - two @ two) / each.variance for one, two, each in pairs]))
    before, after = (float(np.sqrt(np.mean(part[joint] ** 2))) for part in errors)
    rivals = find_rivals(table, chosen, tested)
    weights = np.exp(-np.array([0.0, *(deficit for _, deficit in rivals)]))
    changes = tuple(list_changes(pooled, table, found, tested))
    factor = half_width_factor(table)
    difference, covariance = _between_ends(table, tested)
    if group.laws or group.shaped is not None:
        parameters = tuple(
            ParameterValue(each.parameter, each.difference, each.interval, each.unit) for each in changes
        )
        amounts = ", ".join(f"{each.parameter} {each.difference:+.4g} {each.unit}" for each in changes)
        equation = f"{group.candidate.effect} of joint {group.candidate.joint}: {amounts}"
    else:
        parameters = parameter_values(group.candidate, difference, covariance, factor)
        equation = group.candidate.equation(difference)
    return NamedChange(
        effect=group.candidate.effect,
        joint=group.candidate.joint,
        joints=group.candidate.joints,
        form=ONE_FACTOR if group.laws else group.candidate.form,
        parameters=parameters,
        changes=changes,
        equation=equation,
        p_value=min(tested.p_value * len(table.groups), 1.0),
        evidence=tested.evidence,
        gains=held_out_gains(table, errors),
        rms_before=before,
        rms_after=after,
        probability=float(1 / weights.sum()),
        rivals=tuple(_list_rivals(table, group, rivals)),
    )


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


def half_width_factor(table: ChangeTable) -> float:
    """From a standard error to half an interval."""
    return float(student.ppf((1 + CONFIDENCE) / 2, table.degrees))


def detectable_factor(table: ChangeTable) -> float:
    """From a standard error to the smallest change that is named: the level of the test, corrected."""
    return float(student.isf(table.tuning.level / 2 / len(table.groups), table.degrees))


def recording_values(table: ChangeTable, tested: Tested) -> Array:
    """Coefficients of a change in each recording, less their mean: (recordings, coefficients)."""
    return np.asarray(table.contrast @ tested.values.reshape(-1, table.contrast.shape[1]).T)


def _between_ends(table: ChangeTable, tested: Tested) -> tuple[Array, Array]:
    """Last less first recording, and its covariance."""
    ends = table.contrast[-1] - table.contrast[0]
    width = len(ends)
    values = tested.values.reshape(-1, width) @ ends
    covariance = tested.covariance.reshape(len(values), width, len(values), width)
    return values, np.einsum("iajb,a,b->ij", covariance, ends, ends)


def list_changes(pooled: Pooled, table: ChangeTable, found: Sequence[Tested], tested: Tested) -> Iterator[Change]:
    """The scalar parameters of a group in the recordings."""
    _, covariance = _between_ends(table, tested)
    for law, own, spread in _laws(pooled, table, found, tested):
        between = own[-1] - own[0]
        own_spread = covariance if spread is None else covariance[0, 0] * spread
        yield from _parameters(table, tested, law, own, between, own_spread)


def list_movements(pooled: Pooled, table: ChangeTable, found: Sequence[Tested], tested: Tested) -> Iterator[Movement]:
    """The scalar parameters of a group over all recordings."""
    width = table.contrast.shape[1]
    count = len(tested.values) // width
    between = tested.covariance.reshape(count, width, count, width)
    for law, own, spread in _laws(pooled, table, found, tested):
        slopes = law.slopes(own.mean(axis=0))
        for name, slope in slopes.items():
            values = [law.parameters(each)[name] for each in own]
            if any(isinstance(each, tuple) for each in values):
                continue
            if spread is None:
                covariance = np.einsum(
                    "i,iajb,j,ra,sb->rs", slope[0], between, slope[0], table.contrast, table.contrast
                )
            else:
                covariance = (
                    float(slope[0] @ spread @ slope[0]) * table.contrast @ between[0, :, 0, :] @ table.contrast.T
                )
            if np.trace(covariance) <= 0:
                continue
            candidate = law.candidate
            yield Movement(
                effect=candidate.effect,
                joint=candidate.joint,
                joints=candidate.joints,
                parameter=name,
                unit=candidate.unit(name),
                values=np.array(values, dtype=float),
                covariance=covariance,
                half_widths=half_width_factor(table) * np.sqrt(np.maximum(np.diag(covariance), 0)),
            )


def _laws(
    pooled: Pooled, table: ChangeTable, found: Sequence[Tested], tested: Tested
) -> Iterator[tuple["_Law", Array, Array | None]]:
    """Each law of a group with its numbers in the recordings, (recordings, numbers).

    Where all change by one factor, also what the factor's variance is to be multiplied by, (numbers, numbers).
    """
    group, offsets = table.groups[tested.group], recording_values(table, tested)
    if group.laws:
        for candidate, coefficients in group.laws:
            own = np.outer(1 + offsets[:, 0], coefficients)
            yield _Law(candidate, known=True), own, np.outer(coefficients, coefficients)
    elif group.shaped is not None:
        own = np.array(group.candidate.shape) + offsets
        yield _Law(group.candidate, known=True, coefficients=group.shaped), own, None
    elif _level_is_known(pooled, group.candidate):
        columns = [table.model, *(table.groups[each.group].columns for each in found)]
        inside = np.concatenate(columns).astype(np.intp)
        at_mean = np.zeros(table.mixed.size)
        at_mean[inside], _ = table.mixed.fit(inside)
        mean = at_mean[group.common] + _simulated(pooled, group.candidate)
        yield _Law(group.candidate, known=True), mean + offsets, None
    else:
        yield _Law(group.candidate, known=False), offsets, None


@dataclass(frozen=True, eq=False)
class _Law:
    """A law whose numbers change. known: whether they have a level. coefficients: given where its shape changes."""

    candidate: Candidate
    known: bool
    coefficients: Array | None = None

    def parameters(self, numbers: Array) -> dict[str, Value]:
        """Named parameters of the law with these coefficients, or this shape."""
        if self.coefficients is None:
            return self.candidate.parameters(numbers)
        return self.candidate.with_shape(tuple(numbers.tolist())).parameters(self.coefficients)

    def slopes(self, numbers: Array) -> dict[str, Array]:
        """Derivatives (components, numbers) of the parameters."""
        if self.coefficients is None:
            return parameter_slopes(self.candidate, numbers, len(numbers))
        shaped = self.candidate.with_shape(tuple(numbers.tolist()))
        own = len(self.coefficients)
        slopes = parameter_slopes(shaped, self.coefficients, own + len(numbers))
        return {name: each[:, own:] for name, each in slopes.items()}


def _level_is_known(pooled: Pooled, candidate: Candidate) -> bool:
    """Whether the common model has a level of it: faults of channels and loads are known as differences alone."""
    place = place_of(candidate)
    return not is_body(candidate) and any(place_of(each.candidate) == place for each in pooled.design.blocks)


def _simulated(pooled: Pooled, candidate: Candidate) -> Array:
    """Coefficients of the same law in the simulation, whose torque is taken off before anything is fitted."""
    model = pooled.design.simulation.model
    out = np.zeros(candidate.size)
    for each in () if model is None else model.effects:
        if place_of(each.candidate) == place_of(candidate) and len(each.coefficients) == len(out):
            out = out + each.coefficients
    return out


def _parameters(
    table: ChangeTable, tested: Tested, law: _Law, own: Array, difference: Array, covariance: Array
) -> Iterator[Change]:
    """own: (recordings, numbers) of each recording; difference, covariance: of last less first."""
    candidate = law.candidate
    slopes = law.slopes(own.mean(axis=0) if law.known else difference)
    start, end, zero = law.parameters(own[0]), law.parameters(own[-1]), np.zeros(len(difference))
    shown = end if law.known else law.parameters(difference)
    for name, value in shown.items():
        error = float(half_widths(slopes[name], covariance, 1.0)[0])
        if isinstance(value, tuple) or error <= 0:
            continue
        levels: tuple[float, ...] | None = None
        ratio: tuple[float, float, float] | None = None
        half = half_width_factor(table) * error
        if law.known:
            change = value - float(np.asarray(start[name]))
            levels = tuple(float(np.asarray(law.parameters(each)[name])) for each in own)
            ratio = _ratio(levels, change, half) if _is_positive(candidate, name) else None
        else:
            change = value - float(np.asarray(law.parameters(zero)[name])) if name == "gain" else value
            ratio = (1 + change, 1 + change - half, 1 + change + half) if name == "gain" else None
        yield Change(
            effect=candidate.effect,
            joint=candidate.joint,
            joints=candidate.joints,
            parameter=name,
            levels=levels,
            difference=change,
            interval=(change - half, change + half),
            ratio=ratio,
            unit=candidate.unit(name),
            p_value=min(tested.p_value * len(table.groups), 1.0),
            detectable=detectable_factor(table) * error,
            changed=table.is_sure(tested),
        )


def _is_positive(candidate: Candidate, name: str) -> bool:
    """Whether a parameter has a size that a change is a share of: a level of friction, and no zero of an encoder."""
    return any(each.name == name and each.positive for each in candidate.facts.parameters)


def _ratio(levels: Sequence[float], change: float, half: float) -> tuple[float, float, float] | None:
    """Last over first level; the interval keeps their mean, which is known far better."""
    mean = (levels[0] + levels[-1]) / 2
    if mean == 0 or abs(change) + half >= 2 * abs(mean):
        return None
    ends = sorted((mean + each / 2) / (mean - each / 2) for each in (change - half, change + half))
    return levels[-1] / levels[0], ends[0], ends[1]


def list_table(pooled: Pooled, table: ChangeTable, found: Sequence[Tested]) -> tuple[Change, ...]:
    """Every parameter that was compared: those that changed as fitted together, each other one beside them."""
    chosen = [each.group for each in found]
    rows: list[Change] = []
    sure = {each.group: each for each in found}
    scaled = {place_of(law) for number in chosen for law, _ in table.groups[number].laws}
    for number, group in enumerate(table.groups):
        if number in sure:
            rows += list_changes(pooled, table, found, sure[number])
        elif not group.laws and place_of(group.candidate) not in scaled:
            beside = table.test((*chosen, number))
            if _is_told(table, beside[-1]):
                rows += [_unchanged(each) for each in list_changes(pooled, table, beside, beside[-1])]
    return tuple(rows)


def _is_told(table: ChangeTable, tested: Tested) -> bool:
    """Whether the recordings tell of a group more than its prior does."""
    scales = table.groups[tested.group].scales
    spread = tested.covariance / tested.inflation
    return bool(np.any(np.diag(spread) < 0.25 * scales**2))


def _unchanged(change: Change) -> Change:
    return Change(**{**vars(change), "changed": False})
