"""Repair of time stamps that jitter, and of rows that were written again before the next one was read.

Either the samples were taken at uneven times, or even samples were stamped late. The data decide: in a sample that was
taken late, the position is ahead by velocity times lateness.

A log that is written faster than the joints are read repeats the row that was read last. Its stamps say when a row was
written, and a row is written up to a step after it was read. Rows that were read evenly are put on an even grid where
the motion becomes smooth by that.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.recordings.recording import AnyRun, Finding, MotionRun

MAX_ROUNDING_LATENESS = 0.01  # of a step: what stamps are rounded to in a file
MIN_WARNED_LATENESS = 0.1  # of a step: less is lost in what the splines do well
MAX_GAP_SCATTER_RATIO = 0.9  # times the scatter: samples are missing only where that explains the stamps better
MAX_ROUGHNESS_RATIO = 0.5  # repeated rows are left out where the motion becomes at least so much smoother
MAX_ODD_SHARE = 0.01  # of rows, that are no measure of how smooth a motion is
MAX_GRID_LATENESS = 1.5  # steps: stamps further from any even grid cannot be counted
NEIGHBOURS = (-2, -1, 1, 2)  # rows that tell where a row between them is


@dataclass(frozen=True, eq=False)
class Grid:
    """An even grid through the stamps: time = start + step * count, lateness = stamp - grid."""

    start: float
    step: float
    count: NDArray[np.intp]
    lateness: Array

    @property
    def time(self) -> Array:
        """The grid's own stamps."""
        return np.asarray(self.start + self.step * self.count, dtype=np.float64)

    @property
    def scatter(self) -> float:
        """Root mean square lateness, in steps."""
        return float(np.sqrt(np.mean(self.lateness**2)) / self.step)

    @property
    def missing(self) -> int:
        """Grid points without a sample."""
        return int(self.count[-1] + 1 - len(self.count))


def repair_stamps(run: AnyRun) -> AnyRun:
    """The run on an even grid, unless the samples were taken unevenly; its stamps rise already."""
    if run.even:
        return run
    grid = fit_even_grid(run.time)
    worst = float(np.abs(grid.lateness).max() / grid.step)
    if worst > MAX_GRID_LATENESS or (worst > MAX_ROUNDING_LATENESS and is_sampled_unevenly(run, grid)):
        return _keep_stamps(run, grid, worst)
    if worst > MAX_ROUNDING_LATENESS:
        text = (
            f"stamps stray from an even {1 / grid.step:.6g} Hz by up to {1e3 * worst * grid.step:.3g} ms, "
            "but the motion shows that the samples are even; stamps made even"
        )
        run = run.with_findings(Finding("time_jitter", "repaired", text))
    elif worst > 1e-4:
        text = f"stamps are rounded (by up to {worst:.1%} of a step); put on an even {1 / grid.step:.6g} Hz"
        run = run.with_findings(Finding("time_rounding", "repaired", text))
    if grid.missing:
        text = f"{grid.missing} single samples are missing; bridged by splines where the run is filtered"
        run = run.with_findings(Finding("time_gap", "repaired", text))
    return run.with_signals(grid.time, {})


def drop_repeated_rows(run: AnyRun) -> AnyRun:
    """The run without rows that repeat the row before; the others on the even times at which they were read.

    The run stays as it is if no row repeats, if the other rows did not come evenly, or if that does not make most of
    the motion smoother than even stamps do: a joint at rest may read the same twice.
    """
    if run.samples <= 2 * len(NEIGHBOURS) or np.any(np.diff(run.time) <= 0):
        return run
    again = np.append(False, np.ones(run.samples - 1, dtype=bool))
    for column in (own for signal in run.signals.values() for own in signal.T):
        again[1:] &= (column[1:] == column[:-1]) | np.isnan(column[1:])
    if not again.any() or run.samples - again.sum() <= 2 * len(NEIGHBOURS):
        return run
    fresh = run.rows(~again)
    grid = fit_grid(fresh.time, np.arange(fresh.samples))
    even = fresh.with_signals(grid.time, {})
    late = np.abs(grid.lateness).max() > MAX_GRID_LATENESS * grid.step
    if late or not _roughness(even) < MAX_ROUGHNESS_RATIO * _roughness(repair_stamps(run)):
        return run
    text = (
        f"{again.sum()} rows repeat the row before while the arm moves: the log was written at {run.rate_hz:.4g} Hz, "
        f"the joints were read at {1 / grid.step:.4g} Hz; repeats left out, the others put on the times of reading"
    )
    return even.with_findings(Finding("repeated_row", "repaired", text))


def _roughness(run: MotionRun) -> float:
    """How far positions are from the cubic through their neighbours, RMS over the travel of each joint.

    Few rows that are far off do not count: where an encoder wraps, or a single row was lost.
    """
    travel = np.ptp(run.position, axis=0)
    off = np.sum((_off_neighbours(run.time, run.position)[:, travel > 0] / travel[travel > 0]) ** 2, axis=1)
    usual = off[off <= np.quantile(off, 1 - MAX_ODD_SHARE)]
    return float(np.sqrt(np.mean(usual)))


def _off_neighbours(time: Array, signal: Array) -> Array:
    """How far rows are from the cubic through their neighbours, (rows - 4, columns); steps may differ."""
    middle = np.arange(2, len(time) - 2)
    off = signal[middle].copy()
    for own in NEIGHBOURS:
        weight = np.ones(len(middle))
        for other in NEIGHBOURS:
            if other != own:
                weight *= (time[middle] - time[middle + other]) / (time[middle + own] - time[middle + other])
        off -= weight[:, None] * signal[middle + own]
    return off


def fit_even_grid(time: Array) -> Grid:
    """The even grid that fits the stamps best: with none missing, or counted by the length of the steps."""
    steps = np.diff(time)
    usual = float(np.median(steps)) or float(np.mean(steps))
    counted = np.append(0, np.cumsum(np.maximum(1, np.rint(steps / usual)))).astype(np.intp)
    complete = fit_grid(time, np.arange(len(time)))
    with_gaps = fit_grid(time, counted)
    return with_gaps if with_gaps.scatter < MAX_GAP_SCATTER_RATIO * complete.scatter else complete


def fit_grid(time: Array, count: NDArray[np.intp]) -> Grid:
    """The even grid that fits the stamps best, of samples that stand at these counts of it."""
    middle = count.mean()
    step = float((count - middle) @ (time - time[0]) / np.sum((count - middle) ** 2))
    start = float(np.mean(time - time[0]) - step * middle + time[0])
    return Grid(start, step, count, time - start - step * count)


def is_sampled_unevenly(run: MotionRun, grid: Grid) -> bool:
    """True if the motion follows the lateness of the stamps: q(stamp) = q(grid) + velocity * lateness.

    The cubic through the neighbours takes the smooth motion out of both sides; the slope between them is one for
    samples that were taken when their stamps say, zero for even samples with late stamps. What stands still says
    nothing.
    """
    velocity = np.gradient(run.position, grid.time, axis=0)
    moved = _off_neighbours(grid.time, velocity * grid.lateness[:, None])
    seen = _off_neighbours(grid.time, run.position)
    scale = np.array([np.median(own[own > 0]) if np.any(own > 0) else 0.0 for own in np.abs(seen).T])
    weight = np.where(scale > 0, 1 / np.where(scale > 0, scale, 1.0), 0.0)
    moved, seen = moved * weight, seen * weight
    length = float(np.sum(moved**2))
    return length > 0 and float(np.sum(moved * seen)) / length > 0.5


def _keep_stamps(run: AnyRun, grid: Grid, worst: float) -> AnyRun:
    text = (
        f"samples were taken at uneven times (up to {worst:.2g} steps off {1 / grid.step:.6g} Hz); "
        "stamps kept, even samples made by splines where the run is filtered"
    )
    return run.with_findings(Finding("time_jitter", "warning" if worst > MIN_WARNED_LATENESS else "note", text))
