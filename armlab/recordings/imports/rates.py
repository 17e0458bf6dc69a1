"""Signals that come in rows of their own, at their own rates: put on the stamps of the slowest one, and said so.

A log of several topics or messages holds cells that are empty in turn. Each column is interpolated between its own
rows, by a cubic spline if it is smooth, else linearly; over a gap of its own it is not. A line between positions would
lose part of the motion: a dt^2 / 8 of an acceleration a.

Rows with one stamp are of one instant where all signals share it. Elsewhere a clock may be coarser than the rows: they
are put on an even grid that fits, unless the motion shows that they came when their stamps say. Where stamps and motion
do not tell when the rows of one signal came beside those of another, the torques are asked.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline as _spline

from armlab.common.arrays import Array
from armlab.common.errors import DataError, InputError
from armlab.recordings.channels import read_late
from armlab.recordings.clock import MAX_BRIDGED_GAP, SMOOTH_LAG, require_fine_clock
from armlab.recordings.plain_least_squares import fit_plain
from armlab.recordings.recording import Finding, MotionRun, Run
from armlab.recordings.repair import (
    BEYOND_LIMITS,
    MAX_LOST_SHARE,
    MAX_USUAL_STEPS,
    USUAL_SHARE,
    USUAL_STEP_SHARE,
    duplicated_rows,
    find_zero_rows,
)
from armlab.recordings.stamps import (
    MAX_GRID_LATENESS,
    MAX_ROUNDING_LATENESS,
    Grid,
    fit_grid,
    is_sampled_unevenly,
)
from armlab.recordings.table import Table
from problem.arm import Arm

EDGE_ROWS = 2  # of a clock, before and after which the other signal has no row
MAX_TICKS_PER_ROW = 2  # of a clock that is coarse beside the rows
SMOOTH_SIGNALS = ("position", "link_position", "velocity")


@dataclass(frozen=True)
class UnsureTimes(Finding):
    """Stamps of different signals of which the torques have to tell whether they are right.

    half_step_s: by which signals may be apart, half of what the stamps tell apart.
    """

    half_step_s: float = 0.0


@dataclass(frozen=True, eq=False)
class OnStamps:
    """values: (rows, columns) on the stamps of the slowest column. rows: their places. lags: s, (columns,), mean."""

    values: Array
    rows: NDArray[np.intp]
    lags: Array


def put_on_common_stamps(table: Table, columns: Mapping[str, Sequence[str]], time_factor: float) -> Table:
    """The table with all signals in each row, where they came in rows of their own.

    columns: of all signals, time first. time_factor: s per unit of the stamps. A table whose rows with a stamp are
    whole but for a tenth stays as it is. Raises InputError where two signals never come close to each other.
    """
    stamps = table.columns(columns["time"], "time")[:, 0]
    wanted = [(signal, name) for signal, names in columns.items() if signal != "time" for name in names]
    whole = is_stamped = np.isfinite(stamps)
    for _, name in wanted:
        whole = whole & np.isfinite(table.columns([name], "import")[:, 0])
    if whole.sum() >= (1 - MAX_LOST_SHARE) * is_stamped.sum():
        return table
    values = table.columns([name for _, name in wanted], "import")
    stamped = np.flatnonzero(is_stamped)
    odd = _far_beyond(values)
    values[odd] = np.nan
    empty = find_zero_rows(list(values[stamped].T))
    others = f"; {empty.sum()} rows hold zeros alone, between rows that do not, and are left out" if empty.any() else ""
    others += f"; {odd.sum()} values are far beyond all others and left out" if odd.any() else ""
    others += f"; {np.sum(~is_stamped)} rows have no stamp and are left out" if not is_stamped.all() else ""
    values, stamped = values[stamped][~empty], stamped[~empty]
    again = duplicated_rows([stamps[stamped], values])
    time, values, stamped = stamps[stamped][~again], values[~again], stamped[~again]
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
    findings = list[Finding]()
    position = [place for place, (signal, _) in enumerate(wanted) if signal == "position"]
    for clock in clocks:
        run = MotionRun(table.file, "identify", time[clock] * time_factor, values[clock][:, position])
        own, found = _times_of_rows(run, np.isfinite(values[clock]), slowest)
        time[clock] = own / time_factor if found is not None else time[clock]
        findings += [found] if found is not None else []
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
    out[:, table.names.index(columns["time"][0])] = time[rows]
    lag = np.max([part.lags.max() for part in parts if len(part.rows)]) * time_factor
    most = dict[str, int]()
    for (signal, _), count in zip(wanted, counts.tolist(), strict=True):
        most[signal.replace("_", " ")] = max(count, most.get(signal.replace("_", " "), 0))
    listed = ", ".join(f"{signal} {count}" for signal, count in most.items())
    text = (
        f"signals come in rows of their own ({listed} of {len(table.values)} rows): all put on {len(rows)} stamps of "
        f"{slow[1]} by interpolation, from rows up to {1e3 * lag:.3g} ms away on average{others}"
    )
    known = {finding.text: finding for finding in (*table.findings, Finding("several_rates", "note", text), *findings)}
    return replace(table, values=out, row_numbers=table.row_numbers[stamped[rows]], findings=tuple(known.values()))


def _times_of_rows(run: MotionRun, known: NDArray[np.bool_], slowest: int) -> tuple[Array, Finding | None]:
    """When the rows of one clock came, s, and what is said of it.

    run: position is NaN in rows of other signals. known: (rows, columns), whether a cell has a number. slowest: the
    column that sets the stamps. Raises InputError for a clock that is too coarse to tell.
    """
    whole = np.flatnonzero(np.isfinite(run.position).all(axis=1))
    if len(whole) < SMOOTH_LAG:  # so few rows are no run
        return run.time, None
    place = np.unique(run.time, return_inverse=True)[1]
    shared = np.all([np.isin(place[known[:, slowest]], place[column]) for column in known.T], axis=0)
    once = [len(np.unique(place[column])) >= (1 - MAX_LOST_SHARE) * column.sum() for column in known.T]
    if all(once) and np.mean(shared) >= 1 - MAX_LOST_SHARE:
        text = "rows of different signals with one stamp are taken as one instant"
        half_step = float(np.median(np.diff(np.unique(run.time[known[:, slowest]])))) / 2
        return run.time, UnsureTimes("one_instant", "note", text, half_step_s=half_step)
    require_fine_clock(run.file, run.time)
    grid = fit_grid(run.time, np.arange(run.samples))
    worst = float(np.abs(grid.lateness).max() / grid.step)
    own = Grid(grid.start, grid.step, grid.count[whole], grid.lateness[whole])
    if MAX_ROUNDING_LATENESS < worst <= MAX_GRID_LATENESS and not is_sampled_unevenly(run.rows(whole), own):
        text = f"stamps stray from the even {1 / grid.step:.6g} Hz that the motion shows; rows put there"
        return grid.time, Finding("coarse_stamps", "repaired", text)
    if worst > MAX_GRID_LATENESS and place[-1] + 1 < (1 - MAX_LOST_SHARE) * run.samples:
        raise InputError(
            f"{run.file}: the time counts in steps of {np.median(np.diff(np.unique(run.time))):.4g} s, and the rows "
            "come unevenly, a signal in each: export them with stamps that tell rows apart, or in common rows"
        )
    tick = _coarse_tick(run.time)
    if tick is None:
        return run.time, None
    text = (
        f"the time counts in steps of {1e3 * tick:.4g} ms, and rows come unevenly: when signals came beside each other "
        f"is known to {5e2 * tick:.3g} ms"
    )
    return run.time, UnsureTimes("coarse_stamps", "note", text, half_step_s=tick / 2)


def _coarse_tick(time: Array) -> float | None:
    """The step, s, in which the time counts, if it is half as long as rows are apart, or more, and rows come unevenly.

    Where an even clock lost every second row by chance, two steps come half as often as one, else less often.
    """
    stamps = np.unique(time)
    steps = np.diff(stamps)
    ticks = np.rint(steps / steps.min()).astype(np.intp)
    grid = fit_grid(stamps, np.append(0, np.cumsum(ticks)))
    is_counted = np.abs(grid.lateness).max() <= MAX_ROUNDING_LATENESS * grid.step
    is_uneven = np.sum(ticks == 2) > 0.5 * np.sum(ticks == 1)
    return grid.step if is_counted and is_uneven and np.median(ticks) <= MAX_TICKS_PER_ROW else None


def require_times(runs: Sequence[Run], arm: Arm, half_step_s: float) -> None:
    """Raises InputError where torques explain the motion better half a step earlier or later: the clock is too coarse.

    Each of three clocks is judged by what plain least squares on the arm leaves of the torque. A wrong clock adds the
    square of its error: squares whose parabola has no bottom within a step tell nothing.
    """
    fitted = [replace(run, role="identify") for run in runs]
    try:
        left = [
            fit_plain(arm, [read_late(run, np.full(run.joints, late)) for run in fitted]).rms
            for late in (0.0, half_step_s, -half_step_s)
        ]
    except DataError:
        return  # too short for a fit, and so for all that asks more of it
    now, late, early = (float(np.sum((each / left[0]) ** 2)) for each in left)
    has_bottom = abs(early - late) / 2 < 2 * (early + late - 2 * now)
    logarithms = [float(np.log(each).sum()) for each in left]
    if has_bottom and logarithms[0] > min(logarithms):
        raise InputError(
            f"{runs[0].file}: signals stand in rows of their own, and torques fit the motion better half a step of "
            f"{2e3 * half_step_s:.4g} ms away: the clock is coarser than the rows; export stamps that tell rows apart"
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
