"""The clock of a run: rows out of place, clocks that start anew or leap, stamps that come twice.

The values of the signals decide. Rows are sorted where neighbours become more alike by it and the sorted stamps are as
dense as those of one clock. A clock that starts anew is a new run. A run is cut where its signals jump; where they go
on as if nothing had been, the clock leapt and the leap is taken out. Equal stamps are spread where a tick is missing
beside them, else one row is kept of those that agree to a usual step.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.recordings.recording import AnyRun, Finding, MotionRun
from armlab.recordings.repair import MAX_LOST_SHARE, MAX_USUAL_STEPS, USUAL_STEP_SHARE
from armlab.recordings.stamps import MAX_ODD_SHARE, repair_stamps

Rows = NDArray[np.intp]
MIN_DENSITY = 0.75  # of one clock's usual step: between one (rows of one clock) and a half (two clocks)
MAX_ROUGHNESS_LEFT = 0.75  # of the steps between neighbours: sorting has to take the rest away
SMOOTH_LAG, MIN_SMOOTH_RATIO = 10, 2.0  # rows further apart differ more, where rows in order are smooth
MIN_TICK = 0.75  # of a usual step, between rows that are spread
MAX_ROWS_PER_STAMP = 3  # of a clock that is coarser than the sampling
MAX_BRIDGED_GAP = 5.5  # samples: over a shorter gap of a well sampled motion, interpolation is safe
MIN_PART_SAMPLES = 50  # samples: a shorter part tells nothing


def cut_into_clocks(run: AnyRun) -> tuple[AnyRun, ...]:
    """The stretches of a run in which its clock never steps back; rows out of place are sorted first.

    Raises InputError for rows in no order, by which no clock can be made out.
    """
    backwards = int(np.sum(np.diff(run.time) < 0))
    if not backwards:
        return (run,)
    pieces = _order(run, np.arange(run.samples))
    moved = sum(int(np.sum(np.diff(piece) < 0)) for piece in pieces)
    if moved:
        text = f"{moved} rows come after a later one; sorted by their stamps, which makes the motion smoother"
        run = run.with_findings(Finding("time_order", "repaired", text))
    if len(pieces) > 1:
        ends = [piece[-1] for piece in pieces[:-1]]
        first = run.time[pieces[1][0]] - run.time[ends[0]]
        text = (
            f"the clock starts anew {len(pieces) - 1} time(s), first after {run.time[ends[0]]:g} s by {first:+.4g} s; "
            f"cut into {len(pieces)} parts"
        )
        run = run.with_findings(Finding("time_backwards", "repaired", text))
    return tuple(run.rows(piece) for piece in pieces)


def _order(run: MotionRun, rows: Rows) -> list[Rows]:
    """Rows in the order of time, one array a clock."""
    time = run.time[rows]
    steps = np.diff(time)
    back = steps < 0
    if not back.any():
        return [rows]
    if back.sum() > (1 - MAX_LOST_SHARE) * len(rows):  # the last row first, as some databases list them
        return _order(run, rows[::-1])
    order = np.argsort(time, kind="stable")
    is_in_order = back.sum() <= MAX_LOST_SHARE * len(rows)
    if _is_one_clock(run.position[rows], time, order, is_in_order):
        return [rows[order]]
    if not is_in_order:
        raise InputError(
            f"{run.file}: {back.sum()} of {len(rows)} rows come after a later one, and sorted by their stamps the "
            "motion is not smooth: do several logs or drivers share the file? Import them apart"
        )
    cuts = np.flatnonzero(steps <= 0.5 * steps.min()) + 1  # clocks start anew by large steps, rows are misplaced by few
    return [piece for part in np.split(rows, cuts) for piece in _order(run, part)]


def _is_one_clock(position: Array, time: Array, order: Rows, is_in_order: bool) -> bool:
    """Whether rows belong in the order of their stamps: one clock's density, and neighbours that are alike.

    Where most of the order comes from the stamps, no more than a few rows may fit to no side.
    """
    together = np.diff(order) == 1
    apart = np.diff(np.argsort(order)) != 1  # neighbours in the file that sorting parts
    scale = np.mean(np.abs(np.diff(position, axis=0)), axis=0)
    scaled = position[:, scale > 0] / scale[scale > 0]
    step = np.abs(np.diff(scaled[order], axis=0)).sum(axis=1)
    after, before = step[~together].mean(), np.abs(np.diff(scaled, axis=0)).sum(axis=1)[apart].mean()
    if is_in_order:
        forward = np.diff(time)
        dense = np.diff(time[order])[~together].mean() < MIN_DENSITY * np.median(forward[forward > 0])
        return bool(not dense and together.any() and after <= MAX_USUAL_STEPS * step[together].mean())
    lag = np.abs(scaled[order][SMOOTH_LAG:] - scaled[order][:-SMOOTH_LAG]).sum(axis=1)
    is_smooth = len(lag) > 0 and lag.mean() >= MIN_SMOOTH_RATIO * step.mean()
    forward = np.diff(time[order])
    blocks = forward[: len(forward) // MIN_PART_SAMPLES * MIN_PART_SAMPLES].reshape(-1, MIN_PART_SAMPLES).mean(axis=1)
    is_even = len(blocks) > 0 and blocks.min() >= MIN_DENSITY * np.median(blocks)  # else clocks overlap for a while
    lone = _lone_share(scaled[order][position[order].any(axis=1)])  # rows of zeros are left out later
    return bool(is_smooth and is_even and after <= MAX_ROUGHNESS_LEFT * before and lone <= MAX_ODD_SHARE)


def _lone_share(scaled: Array) -> float:
    """Share of rows that fit to no side, as the few rows of one clock among those of another do.

    scaled: (rows, joints) in the order of time. Both steps of such a row are far longer than usual, and than the step
    between its neighbours.
    """
    if len(scaled) < SMOOTH_LAG:
        return 0.0
    steps = np.abs(np.diff(scaled, axis=0)).sum(axis=1)
    across = np.abs(scaled[2:] - scaled[:-2]).sum(axis=1)
    shorter = np.minimum(steps[:-1], steps[1:])
    return float(np.mean(shorter > MAX_USUAL_STEPS * np.maximum(across, steps.mean())))


def part_equal_stamps(run: AnyRun) -> AnyRun:
    """The run with stamps that rise: equal ones spread where the clock lost a tick, or put on an even grid that fits.

    Else one row of each is kept. Rows with one stamp that differ by more than a usual step stay, and the run is cut
    between them. Raises InputError for a clock that stands still most of the time.
    """
    tied = np.append(False, np.diff(run.time) <= 0)
    if not tied.any() or run.samples < SMOOTH_LAG:  # so few rows are no run
        return run
    require_fine_clock(run.file, run.time)
    stamps, counts = np.unique(run.time, return_counts=True)
    spread = _spread(run, stamps, counts)
    if np.all(np.diff(spread.time) > 0):
        return spread
    even = repair_stamps(run)
    within_tick = np.ptp(even.time - run.time) <= (1 + MAX_LOST_SHARE) * np.median(np.diff(stamps))  # else rows lack
    return even if within_tick and np.all(np.diff(even.time) > 0) else _keep_one_of_each(spread)


def require_fine_clock(file: str, time: Array) -> None:
    """Raises InputError for a clock that stands still most of the time; time: (rows,), s."""
    stamps = np.unique(time)
    if len(stamps) >= len(time) / MAX_ROWS_PER_STAMP:
        return
    if len(stamps) == 1:
        raise InputError(
            f"{file}: the time stands still at {stamps[0]:g} s: which column holds the time, or has it too few digits?"
        )
    raise InputError(
        f"{file}: {len(time) - len(stamps)} of {len(time)} rows have the stamp of the row before, the time counts in "
        f"steps of {np.median(np.diff(stamps)):g} s: which column holds the fraction of seconds? `recording import "
        "--time SECONDS,NANOSECONDS` takes two"
    )


def _spread(run: AnyRun, stamps: Array, counts: Rows) -> AnyRun:
    """Equal stamps evenly over the time until the next one, or since the last one, where a tick is missing there."""
    usual = (stamps[-1] - stamps[0]) / max(run.samples - 1, 1)
    ahead, behind = np.append(np.diff(stamps), 0.0) / counts, np.append(0.0, np.diff(stamps)) / counts
    forward = (counts > 1) & (ahead >= MIN_TICK * usual)
    backward = (counts > 1) & ~forward & (behind >= MIN_TICK * usual)
    if not (forward.any() or backward.any()):
        return run
    place = np.arange(run.samples) - np.repeat(np.cumsum(counts) - counts, counts)  # of a row among those of its stamp
    shift = np.where(forward, ahead, 0.0)[np.repeat(np.arange(len(stamps)), counts)] * place
    late = np.repeat(counts, counts) - 1 - place
    shift -= np.where(backward, behind, 0.0)[np.repeat(np.arange(len(stamps)), counts)] * late
    moved = int((counts[forward | backward] - 1).sum())
    text = f"{moved} rows have the stamp of a row beside them where the clock lost a tick; spread evenly"
    return run.with_signals(run.time + shift, {}).with_findings(Finding("equal_stamps", "repaired", text))


def _keep_one_of_each(run: AnyRun) -> AnyRun:
    """One row of those that have one stamp: without those that agree to a usual step, and those that fit to no side."""
    tied = np.diff(run.time) <= 0
    jumps = _jumps(run)[0]
    agree = np.append(False, tied & ~jumps)
    both = np.append(tied, False) | np.append(False, tied)
    odd = both & np.append(jumps, True) & np.append(True, jumps)
    if not (agree | odd).any():
        return run
    texts = [f"{agree.sum()} rows have the stamp of the row before, and its values to a usual step"] * bool(agree.any())
    texts += [f"{odd.sum()} rows have the stamp of another one, and values that fit to no side"] * bool(odd.any())
    text = f"{'; '.join(texts)}; left out"
    return run.rows(~(agree | odd)).with_findings(Finding("duplicate_stamp", "repaired", text))


def _jumps(run: MotionRun) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Whether a signal jumps between neighbours, (samples - 1,): by its value; by its value or by its slope."""
    values = np.column_stack([run.position, *([run.signals["torque"]] if "torque" in run.signals else [])])
    steps = np.abs(np.diff(values, axis=0))
    far = np.any(steps > MAX_USUAL_STEPS * np.quantile(steps, USUAL_STEP_SHARE, axis=0), axis=1)
    bends = np.abs(np.diff(run.position, n=2, axis=0))
    sharp = np.any(bends > MAX_USUAL_STEPS * np.quantile(bends, USUAL_STEP_SHARE, axis=0), axis=1)
    bent = np.append(sharp, False) | np.append(False, sharp)
    return far, far | bent


def cut_at_jumps(run: AnyRun, exclude: Sequence[tuple[float, float]]) -> tuple[AnyRun, ...]:
    """The parts of a run between gaps at which its signals jump; leaps of the clock alone are taken out.

    Rows with one stamp and other values are such a place, too, and stretches [first, last], s, that were left out.
    """
    if run.samples < MIN_PART_SAMPLES:
        return (run,)
    steps = np.diff(run.time)
    breaks = _long_steps(run.time)
    if not len(breaks):
        return (run,)
    usual, jumps = float(np.median(steps)), _jumps(run)[1]
    chosen = np.zeros(len(breaks), dtype=bool)
    for start, end in exclude:
        chosen |= (run.time[breaks] < end) & (run.time[breaks + 1] > start)
    leaps = breaks[~jumps[breaks] & (steps[breaks] > 0) & ~chosen & _goes_on(run, breaks, usual)]
    if len(leaps):
        excess = np.zeros(run.samples)
        excess[leaps + 1] = steps[leaps] - usual
        text = (
            f"the clock leaps {len(leaps)} time(s), first after {run.time[leaps[0]]:g} s by {steps[leaps[0]]:+.4g} s, "
            "and the signals go on without a jump; leaps taken out"
        )
        run = run.with_signals(run.time - np.cumsum(excess), {}).with_findings(Finding("clock_leap", "repaired", text))
    cuts = np.setdiff1d(breaks, leaps)
    if not len(cuts):
        return (run,)
    place = cuts[0]
    first = f"first after {run.time[place]:g} s by {steps[place]:+.4g} s"
    text = f"{len(cuts)} gap(s), {first}; cut into {len(cuts) + 1} parts"
    run = run.with_findings(Finding("time_gap", "repaired", text))
    return tuple(run.rows(piece) for piece in np.split(np.arange(run.samples), cuts + 1))


def _goes_on(run: MotionRun, places: Rows, usual: float) -> NDArray[np.bool_]:
    """Whether joints moved over long steps, after these places, as in one usual step, and not as in all that time."""
    last = run.samples - 1
    before = [np.maximum(places - 2, 0), places]
    after = [places + 1, np.minimum(places + 3, last)]
    time, position = run.time[:, None], run.position
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = [
            np.nan_to_num(np.diff(position[each], axis=0) / np.diff(time[each], axis=0))[0] for each in (before, after)
        ]
    slope, scale = np.mean(slopes, axis=0), np.maximum(np.ptp(position, axis=0), np.finfo(float).tiny)
    moved, step = position[places + 1] - position[places], run.time[places + 1] - run.time[places]
    off = [np.abs((moved - slope * each) / scale).sum(axis=1) for each in (usual, step[:, None])]
    return np.asarray(off[0] < off[1])


def _long_steps(time: Array) -> Rows:
    """Places before steps that are far longer than usual, or no steps; a long pause does not hide shorter ones."""
    steps = np.diff(time)
    found = steps <= 0
    while True:
        rest = steps[~found]
        if not len(rest):
            return np.flatnonzero(found)
        long = ~found & (steps > MAX_BRIDGED_GAP * max(float(np.median(rest)), float(np.mean(rest))))
        if not long.any():
            return np.flatnonzero(found)
        found |= long


def keep_long_parts(parts: tuple[AnyRun, ...], rows: int) -> tuple[AnyRun, ...]:
    """Parts that are long enough to tell something, numbered where there are several.

    rows: of the file that are measurements. Raises InputError where the repairs of all parts took more than a tenth.
    """
    file, long = parts[0].file, list(require_samples(parts))
    lost = rows - sum(part.samples for part in long)
    if lost > MAX_LOST_SHARE * rows:
        said = "; ".join(dict.fromkeys(finding.text for part in parts for finding in part.repairs))
        short = len(parts) - len(long)
        tail = f"; {short} of {len(parts)} parts have less than {MIN_PART_SAMPLES} samples" if short else ""
        raise InputError(
            f"{file}: repairs would take {lost} of {rows} rows, more than a tenth ({said}{tail}): mend the log, or "
            "leave stretches out with `exclude`"
        )
    if len(parts) == 1:
        return (long[0],)
    if len(long) < len(parts):
        short = len(parts) - len(long)
        note = f"{short} of {len(parts)} parts, {lost} rows, are too short to use and left out"
        long = [part.with_findings(Finding("short_part", "repaired", note)) for part in long]
    return tuple(replace(part, part=number) for number, part in enumerate(long, 1))


def require_samples(parts: tuple[AnyRun, ...]) -> tuple[AnyRun, ...]:
    """The parts that are long enough to tell something; InputError where there is none."""
    long = tuple(part for part in parts if part.samples >= MIN_PART_SAMPLES)
    if not long:
        most = max(parts, key=lambda part: part.samples)
        said = "; ".join(finding.text for finding in most.repairs)
        reason = f" ({said})" if said else ""
        raise InputError(
            f"{most.file}: {most.samples} samples in a row at most{reason}; at least {MIN_PART_SAMPLES} are needed"
        )
    return long
