"""Signals that come in rows of their own, at their own rates: put on the stamps of the slowest one, and said so.

A log of several topics or messages holds cells that are empty in turn. Each column is interpolated between its own
rows, by a cubic spline if it is smooth, else linearly; over a gap of its own it is not. A line between positions would
lose part of the motion: a dt^2 / 8 of an acceleration a.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline as _spline

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.recordings.clock import MAX_BRIDGED_GAP
from armlab.recordings.recording import Finding
from armlab.recordings.repair import (
    BEYOND_LIMITS,
    MAX_LOST_SHARE,
    MAX_USUAL_STEPS,
    USUAL_SHARE,
    USUAL_STEP_SHARE,
    find_zero_rows,
)
from armlab.recordings.table import Table

EDGE_ROWS = 2  # of a clock, before and after which the other signal has no row
SMOOTH_SIGNALS = ("position", "link_position", "velocity")


@dataclass(frozen=True, eq=False)
class OnStamps:
    """values: (rows, columns) on the stamps of the slowest column. rows: their places. lags: s, (columns,), mean."""

    values: Array
    rows: NDArray[np.intp]
    lags: Array


def put_on_common_stamps(table: Table, columns: Mapping[str, Sequence[str]], time_factor: float) -> Table:
    """The table with all signals in each row, where they came in rows of their own.

    columns: of all signals, time first. time_factor: s per unit of the stamps. A table whose rows are whole but for a
    tenth stays as it is. Raises InputError where two signals never come close to each other.
    """
    stamps = table.columns(columns["time"], "time")[:, 0]
    wanted = [(signal, name) for signal, names in columns.items() if signal != "time" for name in names]
    whole = np.isfinite(stamps)
    for _, name in wanted:
        whole &= np.isfinite(table.columns([name], "import")[:, 0])
    if whole.sum() >= (1 - MAX_LOST_SHARE) * len(whole):
        return table
    values = table.columns([name for _, name in wanted], "import")
    stamped = np.flatnonzero(np.isfinite(stamps))
    odd = _far_beyond(values)
    values[odd] = np.nan
    empty = find_zero_rows(values[stamped])
    others = f"; {empty.sum()} rows hold zeros alone, between rows that do not, and are left out" if empty.any() else ""
    others += f"; {odd.sum()} values are far beyond all others and left out" if odd.any() else ""
    stamped = stamped[~empty]
    time, values = stamps[stamped], values[stamped]
    if np.sum(np.diff(time) < 0) > MAX_LOST_SHARE * len(time):
        raise InputError(
            f"{table.file}: signals stand in rows of their own, and the rows in no order of time: sort them by their "
            "stamps"
        )
    counts = np.isfinite(values).sum(axis=0)
    few = counts <= (1 + MAX_LOST_SHARE) * counts.min()
    # of columns that come as rarely, the torque keeps its stamps: positions are smooth, it has noise and steps
    slowest = min(np.flatnonzero(few).tolist(), key=lambda column: wanted[column][0] != "torque")
    clocks = np.split(np.arange(len(time)), np.flatnonzero(np.diff(time) < 0) + 1)
    orders = [3 if signal in SMOOTH_SIGNALS else 1 for signal, _ in wanted]
    parts = [_interpolate(time, values, clock, slowest, orders) for clock in clocks]
    rows = np.concatenate([part.rows for part in parts])
    slow = wanted[slowest]
    if len(rows) < (1 - MAX_LOST_SHARE) * counts[slowest] - len(clocks) * EDGE_ROWS:
        other = wanted[int(np.argmax(counts))]
        raise InputError(
            f"{table.file}: {slow[1]} ({slow[0]}) and {other[1]} ({other[0]}) stand in different rows, and only "
            f"{len(rows)} of {counts[slowest]} are close to each other in time: export them with common stamps"
        )
    out = table.values[stamped[rows]].copy()
    places = [table.names.index(name) for _, name in wanted]
    out[:, places] = np.concatenate([part.values for part in parts])
    lag = np.max([part.lags.max() for part in parts if len(part.rows)]) * time_factor
    most = dict[str, int]()
    for (signal, _), count in zip(wanted, counts.tolist(), strict=True):
        most[signal.replace("_", " ")] = max(count, most.get(signal.replace("_", " "), 0))
    listed = ", ".join(f"{signal} {count}" for signal, count in most.items())
    text = (
        f"signals come in rows of their own ({listed} of {len(table.values)} rows): all put on {len(rows)} stamps of "
        f"{slow[1]} by interpolation, from rows up to {1e3 * lag:.3g} ms away on average{others}"
    )
    finding = Finding("several_rates", "note", text)
    return replace(
        table,
        values=out,
        row_numbers=table.row_numbers[stamped[rows]],
        findings=(*table.findings, finding),
    )


def _far_beyond(values: Array) -> NDArray[np.bool_]:
    """Single values far beyond those of their column, from which no number can be made for other rows."""
    found = np.zeros(values.shape, dtype=bool)
    for place, column in enumerate(values.T):
        own = np.flatnonzero(np.isfinite(column))
        if len(own) <= 2:
            continue
        size = np.abs(column[own])
        steps = np.abs(np.diff(column[own]))
        jumps = steps > MAX_USUAL_STEPS * np.quantile(steps, USUAL_STEP_SHARE)
        alone = np.append(True, jumps) & np.append(jumps, True)
        found[own, place] = alone & (size > BEYOND_LIMITS * np.quantile(size, USUAL_SHARE))
    return found


def _interpolate(time: Array, values: Array, clock: NDArray[np.intp], slowest: int, orders: Sequence[int]) -> OnStamps:
    """The columns on the stamps at which the slowest one has a number, within a stretch of time that rises."""
    own = values[clock]
    rows = clock[np.isfinite(own[:, slowest])]
    wanted = time[rows]
    out, lags = np.full((len(rows), values.shape[1]), np.nan), np.zeros(values.shape[1])
    for column in range(values.shape[1]):
        there = clock[np.isfinite(own[:, column])]
        stamps, first = np.unique(time[there], return_index=True)
        if len(stamps) <= orders[column] or not len(rows):
            continue
        after = np.clip(np.searchsorted(stamps, wanted), 1, len(stamps) - 1)
        gap = stamps[after] - stamps[after - 1]
        steps = np.diff(stamps)
        near = gap <= MAX_BRIDGED_GAP * max(float(np.median(steps)), float(np.mean(steps)))
        distance = np.minimum(np.abs(wanted - stamps[after - 1]), np.abs(wanted - stamps[after]))
        inside = (wanted >= stamps[0]) & (wanted <= stamps[-1])
        known = inside & (near | (distance == 0))
        out[known, column] = _spline(stamps, values[there[first], column], orders[column])(wanted[known])
        lags[column] = float(distance[known].mean()) if known.any() else 0.0
    whole = np.isfinite(out).all(axis=1)
    return OnStamps(out[whole], rows[whole], lags)
