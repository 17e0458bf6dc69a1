"""Numbers of a change: levels of the recordings, differences with intervals, ratios, and the smallest that is seen."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.probabilities import student_quantile
from armlab.diagnosis.changes.between_runs import scatter_between_runs
from armlab.diagnosis.changes.changes import ChangeTable, Tested
from armlab.diagnosis.changes.pooled import Pooled, is_body
from armlab.diagnosis.torque.columns.columns import place_of
from armlab.effects.contract import Candidate, Value
from armlab.effects.parameters import half_widths, parameter_slopes

CONFIDENCE = 0.95


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


def half_width_factor(degrees: float) -> float:
    """From a standard error to half an interval."""
    return student_quantile((1 + CONFIDENCE) / 2, degrees)


def detectable_factor(table: ChangeTable, tested: Tested) -> float:
    """From a standard error to the smallest change that is named: the level of the test, corrected."""
    return -student_quantile(table.tuning.level / 2 / len(table.groups), tested.degrees)


def recording_values(table: ChangeTable, tested: Tested) -> Array:
    """Coefficients of a change in each recording, less their mean: (recordings, coefficients)."""
    return np.asarray(table.contrast @ tested.values.reshape(-1, table.contrast.shape[1]).T)


def between_ends(table: ChangeTable, tested: Tested) -> tuple[Array, Array]:
    """Last less first recording, and its covariance."""
    ends = table.contrast[-1] - table.contrast[0]
    width = len(ends)
    values = tested.values.reshape(-1, width) @ ends
    covariance = tested.covariance.reshape(len(values), width, len(values), width)
    return values, np.einsum("iajb,a,b->ij", covariance, ends, ends)


def mean_of_scale(pooled: Pooled, table: ChangeTable, tested: Tested) -> Array:
    """The mean torque of the first and the last recording, divided by the torque of the common model: (coefficients,).

    A scale is fitted as a share of the torque of the common model. The ratio is about one; it differs from one where
    drift within the runs takes a part of the torque.
    """
    group, own = table.groups[tested.group], recording_values(table, tested)
    columns, torque = group.block.values[:, 0], pooled.observed.torque[:, group.candidate.rows[0]]
    common = torque - np.sum(columns * own[pooled.members], axis=1)
    return np.asarray(common @ columns / np.sum(columns**2, axis=0) + (own[0] + own[-1]) / 2)


def as_share_of_first(
    pooled: Pooled, table: ChangeTable, tested: Tested, difference: Array, covariance: Array
) -> tuple[Array, Array] | None:
    """The difference between the ends and its covariance; of a scale, as a share of the torque of the first recording.

    difference: last less first recording. None where the first recording would have no torque.
    """
    if not table.groups[tested.group].candidate.facts.scales_torque:
        return difference, covariance
    mean = mean_of_scale(pooled, table, tested)
    first = mean - difference / 2
    if np.any(np.abs(difference) >= 2 * mean):
        return None
    slope = mean / first**2
    return difference / first, covariance * np.outer(slope, slope)


def as_wide_as_runs(covariance: Array, between: Array) -> Array:
    """A covariance whose variances are no less than those between runs."""
    variances = np.maximum(np.diag(covariance), 1e-300)
    scale = np.sqrt(np.maximum(between / variances, 1.0))
    return np.asarray(covariance * np.outer(scale, scale))


def list_changes(pooled: Pooled, table: ChangeTable, found: Sequence[Tested], tested: Tested) -> Iterator[Change]:
    """The scalar parameters of a group in the recordings."""
    _, covariance = between_ends(table, tested)
    if tested in found:
        covariance = as_wide_as_runs(
            covariance, scatter_between_runs(table, [each.group for each in found], tested.group).variances()
        )
    moved = moved_laws(table, tested)
    for law, own, slopes in laws_of(pooled, table, found, tested):
        changed = not moved or law.candidate in moved
        ends = as_share_of_first(pooled, table, tested, own[-1] - own[0], slopes @ covariance @ slopes.T)
        for each in () if ends is None else _parameters(table, tested, law, own, *ends):
            yield replace(each, changed=each.changed and changed)


def moved_laws(table: ChangeTable, tested: Tested) -> list[Candidate]:
    """Of laws that change together, those that differ between first and last recording, the largest torque first.

    Where no single one is sure, all of them; empty for a group of one law.
    """
    group = table.groups[tested.group]
    difference, covariance = between_ends(table, tested)
    size = np.abs(difference) * np.sqrt(np.mean(group.block.values**2, axis=(0, 1)))
    sure = np.abs(difference) > student_quantile(1 - table.tuning.level / 2, tested.degrees) * np.sqrt(
        np.diag(covariance)
    )
    out: list[tuple[float, int, Candidate]] = []
    start = 0
    for number, law in enumerate(group.parts):
        own = slice(start, start + law.size)
        start = own.stop
        if sure[own].any() or not sure.any():
            out.append((-float(size[own].sum()), number, law))
    return [law for _, _, law in sorted(out, key=lambda each: each[:2])]


def list_movements(pooled: Pooled, table: ChangeTable, found: Sequence[Tested], tested: Tested) -> Iterator[Movement]:
    """The scalar parameters of a group over all recordings."""
    width = table.contrast.shape[1]
    count = len(tested.values) // width
    between = tested.covariance.reshape(count, width, count, width)
    moved = moved_laws(table, tested)
    for law, own, of_group in laws_of(pooled, table, found, tested):
        if moved and law.candidate not in moved:
            continue
        for name, slope in law.slopes(own.mean(axis=0)).items():
            values = [law.parameters(each)[name] for each in own]
            if any(isinstance(each, tuple) for each in values):
                continue
            towards = slope[0] @ of_group
            covariance = np.einsum("i,iajb,j,ra,sb->rs", towards, between, towards, table.contrast, table.contrast)
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
                half_widths=half_width_factor(tested.degrees) * np.sqrt(np.maximum(np.diag(covariance), 0)),
            )


def common_values(table: ChangeTable, found: Sequence[Tested]) -> Array:
    """Values (size,) of the common model and of the changes, fitted together without other candidates."""
    columns = [table.model, *(table.groups[each.group].columns for each in found)]
    inside = np.concatenate(columns).astype(np.intp)
    out = np.zeros(table.mixed.size)
    out[inside], _ = table.mixed.fit(inside)
    return out


def laws_of(
    pooled: Pooled, table: ChangeTable, found: Sequence[Tested], tested: Tested
) -> Iterator[tuple["ChangedLaw", Array, Array]]:
    """Each law of a group with its numbers in the recordings, (recordings, numbers).

    The last is what a coefficient of the group moves of them, (numbers, coefficients).
    """
    group, offsets = table.groups[tested.group], recording_values(table, tested)
    every = np.eye(offsets.shape[1])
    if group.laws:
        for candidate, coefficients in group.laws:
            yield ChangedLaw(candidate, known=True), np.outer(1 + offsets[:, 0], coefficients), coefficients[:, None]
        return
    if group.whole_law:
        size = group.candidate.size
        level = common_values(table, found)[group.common[:size]] + pooled.design.simulation.coefficients_of(
            group.candidate
        )
        yield ChangedLaw(group.candidate, known=True), np.concatenate([level, group.candidate.shape]) + offsets, every
        return
    start = 0
    for candidate in group.parts or (group.candidate,):
        own = slice(start, start + candidate.size)
        start = own.stop
        mean = _level(pooled, table, found, candidate, group.common[own])
        yield (
            ChangedLaw(candidate, known=mean is not None),
            offsets[:, own] + (0.0 if mean is None else mean),
            every[own],
        )


@dataclass(frozen=True, eq=False)
class ChangedLaw:
    """A law whose numbers change: its coefficients, and after them its nonlinear parameters where these change, too.

    known: whether they have a level.
    """

    candidate: Candidate
    known: bool

    def shaped(self, numbers: Array) -> Candidate:
        """The law with the nonlinear parameters among the numbers."""
        shape = numbers[self.candidate.size :]
        return self.candidate.with_shape(tuple(shape.tolist())) if len(shape) else self.candidate

    def coefficients(self, numbers: Array) -> Array:
        """The coefficients among the numbers."""
        return numbers[: self.candidate.size]

    def parameters(self, numbers: Array) -> dict[str, Value]:
        """Named parameters of the law with these numbers."""
        return self.shaped(numbers).parameters(self.coefficients(numbers))

    def slopes(self, numbers: Array) -> dict[str, Array]:
        """Derivatives (components, numbers) of the parameters."""
        return parameter_slopes(self.shaped(numbers), self.coefficients(numbers), len(numbers))


def _level(
    pooled: Pooled, table: ChangeTable, found: Sequence[Tested], candidate: Candidate, common: NDArray[np.intp]
) -> Array | None:
    """The mean of the recordings, (coefficients,); None for faults of channels, which are known as differences alone.

    A law that the common model has in a wider form has no level in this one, and a body has one where each of its
    parameters is a base parameter of the arm.
    """
    if is_body(candidate):
        places = 10 * (candidate.joints[0] - 1) + np.array(getattr(candidate, "felt", range(10)))
        base = pooled.design.base
        if not np.isin(places, base.columns).all():
            return None
        nominal = pooled.design.simulation.inertial
        rows = np.searchsorted(base.columns, places)
        mean = common_values(table, found)[rows]
        return mean if nominal is None else mean + base.values(nominal)[rows]
    alike = (place_of(candidate), candidate.size)
    if alike not in ((place_of(each.candidate), each.candidate.size) for each in pooled.design.blocks):
        return None
    return np.asarray(common_values(table, found)[common] + pooled.design.simulation.coefficients_of(candidate))


def _parameters(
    table: ChangeTable, tested: Tested, law: ChangedLaw, own: Array, difference: Array, covariance: Array
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
        half = half_width_factor(tested.degrees) * error
        if law.known:
            change = value - float(np.asarray(start[name]))
            levels = tuple(float(np.asarray(law.parameters(each)[name])) for each in own)
            sized = is_body(candidate) or _is_positive(candidate, name)
            ratio = ratio_of_levels(levels, change, half) if sized else None
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
            detectable=detectable_factor(table, tested) * error,
            changed=table.is_sure(tested),
        )


def _is_positive(candidate: Candidate, name: str) -> bool:
    """Whether a parameter has a size that a change is a share of: a level of friction, and no zero of an encoder."""
    return any(each.name == name and each.positive for each in candidate.facts.parameters)


def ratio_of_levels(levels: Sequence[float], change: float, half: float) -> tuple[float, float, float] | None:
    """Last over first level; the interval keeps their mean, which is known far better."""
    mean = (levels[0] + levels[-1]) / 2
    if mean == 0 or abs(change) + half >= 2 * abs(mean):
        return None
    ends = sorted((mean + each / 2) / (mean - each / 2) for each in (change - half, change + half))
    return levels[-1] / levels[0], ends[0], ends[1]
