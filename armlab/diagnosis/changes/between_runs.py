"""How far the runs of one recording differ: a change between recordings must be larger."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.diagnosis.changes.changes import ChangeTable


@dataclass(frozen=True, eq=False)
class RunScatter:
    """What each run has more of a group's coefficients than its recording, everything else held.

    apart: (runs, coefficients); data: (runs, coefficients, coefficients), what each run tells of them. owner: (runs,),
    the recording of each. ends: first and last recording. pairs: (pairs, 2), runs of these that follow the same
    motions; none where a run has no such partner.
    """

    apart: Array
    data: Array
    owner: NDArray[np.intp]
    ends: tuple[int, int]
    pairs: NDArray[np.intp]

    def variances(self) -> Array:
        """Variances of a difference of the recordings, (coefficients,); zero where no recording has two runs."""
        return self._variances(self.apart)

    def variance_along(self, change: Array) -> float:
        """Variance of the size of a change (coefficients,), in units of its square."""
        towards = self.data @ change
        power = np.maximum(towards @ change, 1e-300)
        return float(self._variances((np.einsum("rk,rk->r", towards, self.apart) / power)[:, None])[0])

    def _variances(self, values: Array) -> Array:
        """Of the difference of the recordings' means. Runs of the same motions are taken in pairs: what they have by
        their motion is in both recordings.
        """
        if len(self.pairs) > 1:
            between = values[self.pairs[:, 1]] - values[self.pairs[:, 0]]
            return np.asarray(np.var(between, axis=0, ddof=1) / len(self.pairs))
        sizes = [self.owner == recording for recording in self.ends]
        scatters = [np.var(values[own], axis=0, ddof=1) for own in sizes if own.sum() > 1]
        if not scatters:
            return np.zeros(values.shape[1])
        return np.asarray(np.mean(scatters, axis=0) * sum(1 / own.sum() for own in sizes))


def scatter_between_runs(table: ChangeTable, chosen: Sequence[int], number: int) -> RunScatter:
    """The scatter of the runs in a chosen group."""
    mixed, group, width = table.mixed, table.groups[number], table.contrast.shape[1]
    inside = table.columns_with(chosen)
    values, _ = mixed.fit(inside)
    count = len(group.columns) // width
    runs = 1 + max(int(each.rows.runs.max()) for each in mixed.joints)
    owner = np.zeros(runs, dtype=np.intp)
    data, towards = np.zeros((runs, count, count)), np.zeros((runs, count))
    for joint, each in enumerate(mixed.joints):
        owner[each.rows.runs] = each.rows.members
        place = np.flatnonzero(np.isin(each.rows.index, group.columns))
        if not len(place):
            continue
        left = mixed.errors(joint, inside, values)
        contrast = table.contrast[each.rows.members]
        scaled = each.rows.columns[:, place].reshape(len(left), count, width)
        own = np.einsum("rkw,rw->rk", scaled, contrast) / np.sum(contrast**2, axis=1)[:, None]
        for run in range(runs):
            rows = each.rows.runs == run
            data[run] += own[rows].T @ own[rows] / each.variance
            towards[run] += own[rows].T @ left[rows] / each.variance
    prior = np.diag(group.scales[::width] ** -2.0)
    apart = np.array([np.linalg.solve(data[run] + prior, towards[run]) for run in range(runs)])
    ends = 0, len(table.contrast) - 1
    return RunScatter(apart, data, owner, ends, _runs_of_one_motion(table, owner, ends))


def _runs_of_one_motion(table: ChangeTable, owner: NDArray[np.intp], ends: tuple[int, int]) -> NDArray[np.intp]:
    """Pairs of runs of both recordings that share stretches of time; none where a run has not exactly one partner."""
    present = np.zeros((len(owner), table.mixed.stretches), dtype=bool)
    for joint in table.mixed.joints:
        present[joint.rows.runs, joint.rows.stretches] = True
    old, new = (np.flatnonzero(owner == each) for each in ends)
    shared = (present[old].astype(np.intp) @ present[new].T) > 0
    if np.any(shared.sum(axis=0) != 1) or np.any(shared.sum(axis=1) != 1):
        return np.empty((0, 2), dtype=np.intp)
    return np.column_stack([old, new[np.argmax(shared, axis=1)]])
