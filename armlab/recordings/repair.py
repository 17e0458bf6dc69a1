"""Safe repairs of a run: bad rows, missing cells, the order of rows, gaps of the clock, and encoders that wrap around.

Each repair reports what it changed. Data that cannot be repaired safely raise InputError.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.recordings.recording import AnyRun, Finding, MotionRun, Run

MAX_PLAUSIBLE_VALUE = 1e9  # no arm moves, pulls or lasts this much in SI units
MAX_BAD_ROW_SHARE = 0.05  # more bad rows than this, and the file is broken rather than a few rows


def required_names(run: MotionRun) -> tuple[str, str]:
    """The signals without which a row of a run is worth nothing."""
    return ("position", "torque") if isinstance(run, Run) else ("position", "reference_position")


def drop_bad_rows(run: AnyRun, rows: NDArray[np.intp], names: dict[str, tuple[str, ...]]) -> AnyRun:
    """Leaves out rows whose time, position or torque is not a number, infinite, or larger than any arm can give.

    In a run without torque the command counts instead.

    rows: (samples,), number of each row in the file. names: of the columns of each signal, for the message.
    Raises InputError where more than a few rows are bad.
    """
    wrong = {name: ~_is_plausible(signal) for name, signal in _required_signals(run).items()}
    bad = np.any([flags.any(axis=1) for flags in wrong.values()], axis=0)
    if not bad.any():
        return run
    row = int(np.flatnonzero(bad)[0])
    signal, column = next((name, int(np.argmax(wrong[name][row]))) for name in wrong if wrong[name][row].any())
    value = _required_signals(run)[signal][row, column]
    example = f"line {rows[row]}: {names[signal][column]} = {value:g}"
    text = f"{bad.sum()} of {len(bad)} rows hold a value that is not a measurement ({example})"
    if bad.sum() > max(1, MAX_BAD_ROW_SHARE * len(bad)):
        raise InputError(f"{run.file}: {text}: too many to repair; export the run again")
    return run.rows(~bad).with_findings(Finding("bad_value", "repaired", f"{text}; left out"))


def _required_signals(run: MotionRun) -> dict[str, Array]:
    return {"time": run.time[:, None], **{name: run.signals[name] for name in required_names(run)}}


def _is_plausible(values: Array) -> NDArray[np.bool_]:
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(values) < MAX_PLAUSIBLE_VALUE)


def fill_optional_signals(run: AnyRun) -> AnyRun:
    """Fills missing cells of the optional signals by linear interpolation; empty columns stay empty."""
    for name, signal in run.signals.items():
        if name in required_names(run):
            continue
        good = _is_plausible(signal)
        torn = good.any(axis=0) & ~good.all(axis=0)
        empty = ~good.any(axis=0) & ~np.isnan(signal).all(axis=0)
        if not (torn.any() or empty.any()):
            continue
        filled = np.where(good, signal, np.nan)
        for column in np.flatnonzero(torn):
            there = good[:, column]
            filled[:, column] = np.interp(run.time, run.time[there], signal[there, column])
        text = f"{(~good[:, torn | empty]).sum()} cells of {name} hold no number; filled by linear interpolation"
        run = run.with_signals(run.time, {name: filled}).with_findings(Finding("bad_value", "repaired", text))
    return run


def drop_duplicate_rows(run: AnyRun) -> AnyRun:
    """Leaves out rows that are equal to the row before."""
    table = np.column_stack([run.time, *run.signals.values()])
    same = np.append(False, np.all((table[1:] == table[:-1]) | np.isnan(table[1:]), axis=1))
    if not same.any():
        return run
    text = f"{same.sum()} rows repeat the row before (first at {run.time[same][0]:g} s); left out"
    return run.rows(~same).with_findings(Finding("duplicate_row", "repaired", text))


def sort_rows(run: AnyRun) -> AnyRun:
    """Sorts rows that are in the wrong order, if the sorted stamps are evenly spaced.

    If the clock stepped back, sorted stamps would overlap: then the rows stay, and the run is split there.
    """
    backwards = int(np.sum(np.diff(run.time) < 0))
    if not backwards:
        return run
    order = np.argsort(run.time, kind="stable")
    steps = np.diff(run.time[order])
    if steps.min() < 0.5 * np.median(steps):
        return run
    text = f"{backwards} rows come after a later one; sorted by their stamps"
    return run.rows(order).with_findings(Finding("time_order", "repaired", text))


MAX_BRIDGED_GAP = 5.5  # samples: over a shorter gap of a well sampled motion, interpolation is safe
MIN_PART_SAMPLES = 50  # samples: a shorter part tells nothing


def split_at_gaps(run: AnyRun) -> tuple[AnyRun, ...]:
    """The parts of a run between gaps and backward steps of the clock; parts that are too short are left out.

    Raises InputError if nothing is left.
    """
    pieces = _split_rows_at_breaks(run.time, np.arange(run.samples))
    long = [piece for piece in pieces if len(piece) >= MIN_PART_SAMPLES]
    if not long:
        longest = max(len(piece) for piece in pieces)
        raise InputError(f"{run.file}: {longest} samples in a row at most; at least {MIN_PART_SAMPLES} are needed")
    if len(pieces) == 1:
        return (run,)
    run = run.with_findings(_describe_cut(run.time, pieces, len(long)))
    return tuple(replace(run.rows(piece), part=number) for number, piece in enumerate(long, 1))


def _split_rows_at_breaks(time: Array, rows: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """Rows between breaks. Each piece is searched again, because a long pause hides shorter ones."""
    steps = np.diff(time[rows])
    forward = steps[steps > 0]
    if not len(forward):
        return [rows]
    usual = max(float(np.median(forward)), float(np.mean(forward)))
    breaks = np.flatnonzero((steps < 0) | (steps > MAX_BRIDGED_GAP * usual)) + 1
    if not len(breaks):
        return [rows]
    return [piece for part in np.split(rows, breaks) for piece in _split_rows_at_breaks(time, part)]


def _describe_cut(time: Array, pieces: list[NDArray[np.intp]], kept: int) -> Finding:
    before = np.array([piece[-1] for piece in pieces[:-1]])
    steps = time[before + 1] - time[before]
    back = int(np.sum(steps < 0))
    kind, cause = (
        ("time_backwards", f"the clock steps back {back} time(s)") if back else ("time_gap", f"{len(steps)} gap(s)")
    )
    short = len(pieces) - kept
    tail = f", {short} of them too short to use and left out" if short else ""
    text = f"{cause}, first after {time[before[0]]:g} s by {steps[0]:+.4g} s; cut into {len(pieces)} parts{tail}"
    return Finding(kind, "repaired", text)


TURN_RAD = 2 * np.pi
ENCODER_SIGNALS = ("position", "link_position", "reference_position", "simulated_position")
MIN_STEP_TURNS = 1e-3  # of a turn, at rest
PARTS_OF_TURN = (1, 2, 3, 4)  # encoders that repeat within a turn
FULL_SHARE = 0.9  # of its period that such an encoder has run through, and never more than all of it
MIN_SIGN_CHANGES = 4  # that tell a direction bit from a bad row


def unwrap_encoders(run: AnyRun, angles: dict[str, tuple[bool, ...]]) -> AnyRun:
    """Adds whole turns where a channel jumps by some between two samples.

    angles: for each signal, which of its channels are angles. A jump that is no whole turn is left alone.
    """
    for name in ENCODER_SIGNALS:
        if name in run.signals:
            for channel in np.flatnonzero(angles[name]):
                run = _unwrap_channel(run, name, int(channel))
    return run


def _unwrap_channel(run: AnyRun, name: str, channel: int) -> AnyRun:
    signal = run.signals[name]
    for parts in PARTS_OF_TURN:
        period = TURN_RAD / parts
        turns = _wraps(signal[:, channel], period)
        if turns is None or (parts > 1 and not FULL_SHARE <= np.ptp(signal[:, channel]) / period <= 1 + MIN_STEP_TURNS):
            continue
        mended = signal.copy()
        mended[1:, channel] -= period * np.cumsum(turns)
        what, kind = "whole turns", "wrapped_encoder"
        if parts > 1:
            what, kind = f"{360 / parts:g} degrees, its encoder repeats within a turn,", "encoder_period"
        text = f"{name} of channel {channel + 1} jumps by {what} {np.count_nonzero(turns)} time(s); unwrapped"
        return run.with_signals(run.time, {name: mended}).with_findings(Finding(kind, "repaired", text, channel + 1))
    return run


def _wraps(signal: Array, period: float) -> Array | None:
    """Periods by which a signal jumps between two samples, (samples - 1,); None where it does not or moves as fast."""
    steps = np.diff(signal)
    turns = np.rint(steps / period)
    moved = np.abs(steps - period * turns)
    # whole periods aside, most steps are motion
    ordinary = max(3 * float(np.quantile(moved, 0.98)), MIN_STEP_TURNS * period)
    wraps = (turns != 0) & (moved <= ordinary)
    return None if not wraps.any() or ordinary > period / 2 else np.where(wraps, turns, 0.0)


DIRECTION_BITS = range(8, 16)


def read_direction_bit(run: AnyRun) -> AnyRun:
    """Torque or current that servos count as a size with a bit for its direction becomes a number with a sign.

    Such a channel holds whole counts from zero to twice the bit's value, and jumps by that value where it changes sign.
    """
    if "torque" not in run.signals:
        return run
    torque = run.signals["torque"]
    for channel, signal in enumerate(torque.T):
        bit = next((each for each in DIRECTION_BITS if _has_direction_bit(signal, 1 << each)), None)
        if bit is not None:
            signed = torque.copy()
            signed[:, channel] = np.where(signal >= 1 << bit, (1 << bit) - signal, signal)
            text = (
                f"the current of channel {channel + 1} holds its direction in bit {bit}: values above "
                f"{(1 << bit) - 1} are negative; read so (unsigned_current)"
            )
            run = run.with_signals(run.time, {"torque": signed})
            run, torque = run.with_findings(Finding("unsigned_current", "repaired", text, channel + 1)), signed
    return run


def _has_direction_bit(signal: Array, size: int) -> bool:
    if signal.min() < 0 or not size <= signal.max() < 2 * size or np.any(signal != np.rint(signal)):
        return False
    jumps = np.abs(np.diff(signal)) > size / 2
    signed = np.where(signal >= size, size - signal, signal)
    return bool(jumps.sum() >= MIN_SIGN_CHANGES and not np.any(np.abs(np.diff(signed)) > size / 2))


def leave_out(run: AnyRun, stretches: tuple[tuple[float, float], ...]) -> AnyRun:
    """The run without the rows within stretches of time [first, last], s; InputError for one that holds no row."""
    for first, last in stretches:
        inside = (run.time >= first) & (run.time <= last)
        if not inside.any():
            where = f"{run.time.min():g} s to {run.time.max():g} s"
            raise InputError(f"exclude [{first:g}, {last:g}] of {run.file} holds no row: its time runs from {where}")
        text = f"{inside.sum()} rows from {first:g} s to {last:g} s are left out, as `exclude` says"
        run = run.rows(~inside).with_findings(Finding("excluded", "note", text))
    return run
