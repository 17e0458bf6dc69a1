"""All friction of a joint as one level, whatever its laws."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.diagnosis.changes.changes import ChangeTable, Tested
from armlab.diagnosis.changes.mixed import JointRows
from armlab.diagnosis.changes.numbers import (
    Change,
    common_values,
    half_width_factor,
    ratio_of_levels,
)
from armlab.diagnosis.changes.pooled import Pooled
from armlab.effects.contract import UNITS

ALL_FRICTION = "all friction"  # of a joint, as one level


def friction_changes(pooled: Pooled, table: ChangeTable, found: Sequence[Tested]) -> Iterator[Change]:
    """All friction of each joint where a law of it changed, as one level."""
    for joint in range(1, pooled.observed.joints + 1):
        changed = [each for each in found if table.groups[each.group].candidate.is_friction_of(joint)]
        if changed:
            yield _friction_change(pooled, table, found, changed)


def _friction_change(pooled: Pooled, table: ChangeTable, found: Sequence[Tested], changed: Sequence[Tested]) -> Change:
    """All friction of a joint as one level, N m (N): the root mean square of its torque over the rows that count.

    A run's level is what its torque has of the friction of the common model, everything else held. The interval is that
    of the scatter between runs, or between stretches of time where that is larger. changed: laws of this joint.
    """
    first = table.groups[changed[0].group].candidate
    joint, rows = first.rows[0], table.mixed.joints[first.rows[0]].rows
    at_mean = common_values(table, found)
    everything = np.arange(table.mixed.size)
    laws = [each.common for each in table.groups if not each.whole_law and each.candidate.is_friction_of(joint + 1)]
    mean = _torque_of(rows, np.concatenate([np.intersect1d(each, table.model) for each in laws]), at_mean)
    own = _torque_of(rows, np.concatenate([table.groups[each.group].columns for each in changed]), at_mean)
    whole = table.mixed.errors(joint, everything, at_mean) + mean + own
    last = pooled.recordings - 1
    by_run, of_run = _levels(whole, mean, rows.runs, rows.members)
    by_stretch, of_stretch = _levels(whole, mean, rows.stretches * pooled.recordings + rows.members, rows.members)
    errors = [half_width_factor(table.degrees) * _error_of_difference(by_stretch, of_stretch, last)]
    spare = sum(int(np.sum(of_run == each)) - 1 for each in (0, last))
    if min(np.sum(of_run == 0), np.sum(of_run == last)) > 1:
        errors.append(half_width_factor(spare) * _error_of_difference(by_run, of_run, last))
    size, half = float(np.sqrt(mean @ mean / rows.weights.sum())), max(errors)
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
        ratio=ratio_of_levels(levels, change, size * half),
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
