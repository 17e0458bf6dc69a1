"""Changes with their names and numbers: what changed, by how much in units and percent, and what else it could be."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from armlab.common.arrays import Array
from armlab.diagnosis.columns import place_of
from armlab.diagnosis.compare.changes import (
    ChangeGroup,
    ChangeTable,
    Tested,
    between_runs,
    find_rivals,
    held_out_errors,
)
from armlab.diagnosis.compare.mixed import JointRows
from armlab.diagnosis.compare.pooled import Pooled, is_body
from armlab.diagnosis.fitted_model import inertial_parameters
from armlab.diagnosis.result import Rival
from armlab.effects.contract import COULOMB_LEVEL, UNITS, Candidate, Scene, Value
from armlab.effects.drive import ROTOR_INERTIA
from armlab.effects.links import INERTIAL_ERROR_FACTS
from armlab.effects.parameters import ParameterValue, half_widths, parameter_slopes, parameter_values
from armlab.effects.term import SIGN_SIGMAS
from problem.motion import Motion

CONFIDENCE = 0.95
ALL_FRICTION = "all friction"  # of a joint, as one level
INERTIA_STATES = 50  # a run
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
    covariance = _as_wide_as_runs(covariance, between_runs(table, chosen, tested.group))
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


def _as_wide_as_runs(covariance: Array, between: Array) -> Array:
    """A covariance whose variances are no less than those between runs."""
    variances = np.maximum(np.diag(covariance), 1e-300)
    scale = np.sqrt(np.maximum(between / variances, 1.0))
    return np.asarray(covariance * np.outer(scale, scale))


def list_changes(pooled: Pooled, table: ChangeTable, found: Sequence[Tested], tested: Tested) -> Iterator[Change]:
    """The scalar parameters of a group in the recordings."""
    _, covariance = _between_ends(table, tested)
    if tested in found:
        covariance = _as_wide_as_runs(covariance, between_runs(table, [each.group for each in found], tested.group))
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


def common_values(table: ChangeTable, found: Sequence[Tested]) -> Array:
    """Values (size,) of the common model and of the changes, fitted together without other candidates."""
    columns = [table.model, *(table.groups[each.group].columns for each in found)]
    inside = np.concatenate(columns).astype(np.intp)
    out = np.zeros(table.mixed.size)
    out[inside], _ = table.mixed.fit(inside)
    return out


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
        at_mean = common_values(table, found)
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


def reason_impossible(pooled: Pooled, table: ChangeTable, found: Sequence[Tested], tested: Tested) -> str | None:
    """The law of physics that a change breaks in one of the recordings, in a few words; None where it breaks none."""
    group = table.groups[tested.group]
    if is_body(group.candidate):
        return _reason_no_body(pooled, table, tested)
    _, covariance = _between_ends(table, tested)
    for law, own, spread in _laws(pooled, table, found, tested):
        if not law.known or law.coefficients is not None:
            continue
        doubt = covariance if spread is None else covariance[0, 0] * spread
        reasons = (law.candidate.objection(each, doubt) for each in own)
        reason = next((each for each in reasons if each is not None), None)
        if reason is not None:
            return reason
    return None


def runs_differ_as_much(table: ChangeTable, found: Sequence[Tested], tested: Tested) -> bool:
    """Whether the runs of one recording differ by as much as two recordings do; more recordings are not asked."""
    if len(table.contrast) > 2:
        return False
    difference, covariance = _between_ends(table, tested)
    wide = _as_wide_as_runs(covariance, between_runs(table, [each.group for each in found], tested.group))
    return bool(np.all(np.abs(difference) < half_width_factor(table) * np.sqrt(np.diag(wide))))


def _reason_no_body(pooled: Pooled, table: ChangeTable, tested: Tested) -> str | None:
    """What speaks against a load: a joint that would have no inertia in one of the recordings."""
    body = table.groups[tested.group].candidate
    common, link = inertial_parameters(pooled.model), body.joints[0]
    place = slice(10 * link - 10, 10 * link)
    scenes = [_few_states(each) for each in pooled.design.scenes]

    def inertia(change: Array) -> Array:
        changed = common.copy()
        added = body.added_body(change)
        changed[place] += 0.0 if added is None else added
        return np.asarray(
            np.mean([replace(each, inertial=changed).own_inertia.mean(axis=0) for each in scenes], axis=0)
        )

    bare = inertia(np.zeros(body.size)) + _rotors(pooled)
    slopes = np.stack([inertia(unit) + _rotors(pooled) - bare for unit in np.eye(body.size)], axis=-1)
    _, covariance = _between_ends(table, tested)
    doubt = SIGN_SIGMAS * np.sqrt(np.maximum(np.einsum("ji,ik,jk->j", slopes, covariance, slopes), 0.0))
    for each in recording_values(table, tested):
        negative = np.flatnonzero((bare + slopes @ each + doubt < 0) & (bare > 0))
        if len(negative):
            return f"joint {negative[0] + 1} would have a negative inertia"
    return None


def _few_states(scene: Scene) -> Scene:
    """Some states of a run."""
    every = slice(None, None, max(len(scene.time) // INERTIA_STATES, 1))
    motion = Motion(
        *(each[every] for each in (scene.motion.position, scene.motion.velocity, scene.motion.acceleration))
    )
    return replace(scene, time=scene.time[every], motion=motion, torque=scene.torque[every])


def _rotors(pooled: Pooled) -> Array:
    """Inertia of the rotors in simulation and common model, (joints,)."""
    model, arm = pooled.model, pooled.design.simulation.arm
    out = np.array(arm.rotor_inertia or [0.0] * len(arm), dtype=float)
    for number, block in enumerate(model.design.blocks):
        if block.candidate.effect == ROTOR_INERTIA.facts.id:
            out[block.candidate.rows[0]] += float(model.solver.values(model.fit, number)[0])
    return out


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
    return (*rows, *friction_changes(pooled, table, found))


def friction_changes(pooled: Pooled, table: ChangeTable, found: Sequence[Tested]) -> Iterator[Change]:
    """All friction of each joint where a law of it changed, as one level."""
    joints = {table.groups[each.group].candidate.rows for each in found}
    for joint in range(pooled.observed.joints):
        changed = [each for each in found if is_friction(table.groups[each.group].candidate, joint)]
        if (joint,) in joints and changed:
            yield _friction_change(pooled, table, found, changed)


def is_friction(candidate: Candidate, joint: int) -> bool:
    """Whether it is a law of friction of a joint (from 0) alone: friction behind play has a level, too."""
    level = any(each.name == COULOMB_LEVEL.name for each in candidate.facts.parameters)
    return candidate.rows == (joint,) and len(candidate.joints) == 1 and (candidate.facts.dissipates or level)


def _friction_change(pooled: Pooled, table: ChangeTable, found: Sequence[Tested], changed: Sequence[Tested]) -> Change:
    """All friction of a joint as one level, N m (N): the root mean square of its torque over the rows.

    A run's level is what its torque has of the friction of the common model, everything else held. The interval is that
    of the scatter between runs, or between stretches of time where that is larger. changed: laws of this joint.
    """
    first = table.groups[changed[0].group].candidate
    joint, rows = first.rows[0], table.mixed.joints[first.rows[0]].rows
    at_mean = common_values(table, found)
    everything = np.arange(table.mixed.size)
    laws = [each.common for each in table.groups if each.shaped is None and is_friction(each.candidate, joint)]
    mean = _torque_of(rows, np.concatenate([np.intersect1d(each, table.model) for each in laws]), at_mean)
    own = _torque_of(rows, np.concatenate([table.groups[each.group].columns for each in changed]), at_mean)
    whole = table.mixed.errors(joint, everything, at_mean) + mean + own
    last = pooled.recordings - 1
    by_run, of_run = _levels(whole, mean, rows.runs, rows.members)
    by_stretch, of_stretch = _levels(whole, mean, rows.stretches * pooled.recordings + rows.members, rows.members)
    errors = [half_width_factor(table) * _error_of_difference(by_stretch, of_stretch, last)]
    spare = sum(int(np.sum(of_run == each)) - 1 for each in (0, last))
    if min(np.sum(of_run == 0), np.sum(of_run == last)) > 1:
        factor = float(student.ppf((1 + CONFIDENCE) / 2, spare))
        errors.append(factor * _error_of_difference(by_run, of_run, last))
    size, half = float(np.sqrt(np.mean(mean**2))), max(errors)
    levels = tuple(size * float(by_run[of_run == each].mean()) for each in range(pooled.recordings))
    change = levels[-1] - levels[0]
    return Change(
        effect=first.effect,
        joint=first.joint,
        joints=first.joints,
        parameter=ALL_FRICTION,
        levels=levels,
        difference=change,
        interval=(change - size * half, change + size * half),
        ratio=_ratio(levels, change, size * half),
        unit=UNITS[pooled.design.simulation.arm.joints[joint].kind]["torque"],
        p_value=min(min(each.p_value for each in changed) * len(table.groups), 1.0),
        detectable=size * half,
        changed=True,
    )


def _torque_of(rows: JointRows, numbers: Array, values: Array) -> Array:
    """Torque of some columns at a joint, (rows,)."""
    places = np.flatnonzero(np.isin(rows.index, numbers))
    return np.asarray(rows.columns[:, places] @ values[rows.index[places]])


def _levels(whole: Array, mean: Array, numbers: NDArray[np.intp], members: NDArray[np.intp]) -> tuple[Array, Array]:
    """Share of the mean torque that the rows of each number have, and the recording of each."""
    known, place = np.unique(numbers, return_inverse=True)
    power = np.bincount(place, mean * mean, minlength=len(known))
    size = np.bincount(place, whole * mean, minlength=len(known))
    owner = np.bincount(place, members, minlength=len(known)) / np.bincount(place, minlength=len(known))
    return size / np.maximum(power, 1e-300), np.rint(owner)


def _error_of_difference(levels: Array, owner: Array, last: int) -> float:
    """Standard error of the last recording's mean less the first one's."""
    parts = [levels[owner == each] for each in (0, last)]
    return float(np.sqrt(sum(np.var(part, ddof=1) / len(part) if len(part) > 1 else 0.0 for part in parts)))


def _is_told(table: ChangeTable, tested: Tested) -> bool:
    """Whether the recordings tell of a group more than its prior does."""
    scales = table.groups[tested.group].scales
    spread = tested.covariance / tested.inflation
    return bool(np.any(np.diag(spread) < 0.25 * scales**2))


def _unchanged(change: Change) -> Change:
    return Change(**{**vars(change), "changed": False})
