"""Rows of a run that are no measurement, and cells that are missing. Each repair says how many rows it takes.

A repair may take a tenth of a run. What takes more is no repair: InputError says what stands in the file.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.recordings.recording import AnyRun, Finding, MotionRun, Run, Transmission
from problem.arm import Joint

MAX_PLAUSIBLE_VALUE = 1e9  # no arm moves, pulls or lasts this much in SI units
MAX_LOST_SHARE = 0.1  # of the rows of a run: a repair that takes more is a question
USUAL_SHARE = 0.9  # of the rows, whose values are usual
USUAL_STEP_SHARE, MAX_USUAL_STEPS = 0.98, 3.0  # of the steps are usual ones; a longer one than three of them is a jump
BEYOND_LIMITS = 10.0  # times a limit: no arm is there
BEYOND_USUAL, BEYOND_LEAST = 1e3, 1e3  # times the usual size, and in SI units at least: no sensor reads so (by eye)


def required_names(run: MotionRun) -> tuple[str, str]:
    """The signals without which a row of a run is worth nothing."""
    return ("position", "torque") if isinstance(run, Run) else ("position", "reference_position")


def drop_bad_rows(run: AnyRun, rows: NDArray[np.intp], names: dict[str, tuple[str, ...]]) -> AnyRun:
    """Leaves out rows whose time, position or torque is not a number, infinite, or beyond any sensor.

    In a run without torque the command counts instead.

    rows: (samples,), number of each row in the file. names: of the columns of each signal, for the message.
    Raises InputError where more than a tenth of the rows are bad.
    """
    wrong = {name: _is_no_measurement(name, signal) for name, signal in _required_signals(run).items()}
    bad = np.any([flags.any(axis=1) for flags in wrong.values()], axis=0)
    if not bad.any():
        return run
    row = int(np.flatnonzero(bad)[0])
    signal, column = next((name, int(np.argmax(wrong[name][row]))) for name in wrong if wrong[name][row].any())
    value = _required_signals(run)[signal][row, column]
    example = f"line {rows[row]}: {names[signal][column]} = {value:g}"
    text = f"{bad.sum()} of {len(bad)} rows hold a value that is not a measurement ({example})"
    if bad.sum() > max(1, MAX_LOST_SHARE * len(bad)):
        raise InputError(f"{run.file}: {text}: {_cause_of_bad_rows(wrong, names)}")
    return run.rows(~bad).with_findings(Finding("bad_value", "repaired", f"{text}; left out"))


def _required_signals(run: MotionRun) -> dict[str, Array]:
    return {"time": run.time[:, None], **{name: run.signals[name] for name in required_names(run)}}


def _is_no_measurement(name: str, values: Array) -> NDArray[np.bool_]:
    """Where values are no numbers or far beyond the usual ones of their column; stamps have no usual size."""
    wrong = np.empty(values.shape, dtype=bool)
    for place, column in enumerate(values.T):  # of a long run, memory holds one more column
        size = np.abs(column)
        wrong[:, place] = ~(size < MAX_PLAUSIBLE_VALUE)
        if name != "time" and len(size):
            size[np.isnan(size)] = 0.0
            usual = np.quantile(np.where(wrong[:, place], 0.0, size), USUAL_SHARE)
            wrong[:, place] |= size > max(BEYOND_USUAL * usual, BEYOND_LEAST)
    return wrong


def _cause_of_bad_rows(wrong: dict[str, NDArray[np.bool_]], names: dict[str, tuple[str, ...]]) -> str:
    """What to do, by the pattern of what is missing."""
    for name, flags in wrong.items():
        empty = np.flatnonzero(flags.all(axis=0))
        if len(empty):
            column = names[name][int(empty[0])]
            instead = "name another column, import the log" + (
                ", or state the joint in `without_torque`" * (name == "torque")
            )
            return f"column {column} ({name}) holds no number in any row: {instead}"
    missing = {name: flags.all(axis=1) for name, flags in wrong.items()}
    for name, alone in missing.items():
        others = [flags for other, flags in missing.items() if other not in (name, "time")]
        if name != "time" and any(np.any(alone & ~other) and np.any(other & ~alone) for other in others):
            return "its signals stand in different rows: `armlab recording import` puts them on common stamps"
    return "too many to repair; export the run again"


def drop_zero_rows(run: AnyRun) -> AnyRun:
    """Leaves out rows that hold zeros alone between rows that do not, as drivers send them that had nothing to say.

    A signal that comes to rest at zero stays: no joint jumps there. Raises InputError where that is more than a tenth.
    """
    bad = find_zero_rows([column for name in required_names(run) for column in run.signals[name].T])
    if not bad.any():
        return run
    first = f"first at {run.time[bad][0]:g} s"
    text = f"{bad.sum()} of {len(bad)} rows hold zeros alone, between rows that do not ({first})"
    if bad.sum() > MAX_LOST_SHARE * len(bad):
        raise InputError(f"{run.file}: {text}: does another driver write into the log? Export the arm's rows alone")
    return run.rows(~bad).with_findings(Finding("bad_value", "repaired", f"{text}; left out"))


def find_zero_rows(columns: Sequence[Array]) -> NDArray[np.bool_]:
    """Rows that hold zeros alone where a column jumps to zero and back; columns: (rows,) each, NaN where empty.

    Where there are such rows, stretches of zeros that are no longer are of their kind, too: no column has to jump.
    """
    zero, filled = np.ones(len(columns[0]), dtype=bool), np.zeros(len(columns[0]), dtype=bool)
    for column in columns:
        zero &= (column == 0) | ~np.isfinite(column)
        filled |= np.isfinite(column)
    zero &= filled
    found = np.zeros(len(zero), dtype=bool)
    if not zero.any() or zero.all():
        return found
    for column in columns:
        own = np.flatnonzero(np.isfinite(column))
        there, gone = np.flatnonzero(~zero[own]), np.flatnonzero(zero[own])
        if len(there) < 2 or not len(gone):
            continue
        signal = column[own][there]
        usual = np.quantile(np.abs(np.diff(signal)), USUAL_STEP_SHARE)
        after = np.clip(np.searchsorted(there, gone), 1, len(there) - 1)
        found[own[gone]] |= np.minimum(np.abs(signal[after - 1]), np.abs(signal[after])) > MAX_USUAL_STEPS * usual
    ends = np.flatnonzero(np.diff(np.concatenate([[False], zero, [False]])))
    stretches = [slice(start, end) for start, end in ends.reshape(-1, 2).tolist()]
    longest = max((each.stop - each.start for each in stretches if found[each].any()), default=0)
    for each in stretches:
        found[each] |= each.stop - each.start <= longest
    return found


def drop_rows_beyond_limits(run: AnyRun, joints: Sequence[Joint], transmission: Transmission) -> AnyRun:
    """Leaves out rows in which a joint stands beyond ten times its limits, or its torque is, as it is in few rows.

    Limits that most of the run exceeds are placeholders, or its unit is another one: that is no matter of single rows.
    """
    bad = np.zeros(run.samples, dtype=bool)
    worst = ""
    for name in ("position", "torque") if isinstance(run, Run) else ("position",):
        for place, joint in enumerate(joints):  # of a long run, memory holds one more column
            if name == "position":
                values = run.position @ transmission.position[place] + transmission.offset[place]
                limit = float(np.abs(joint.limits.position).max())
            else:
                values = run.signals["torque"] @ (transmission.gains * transmission.torque[place])
                limit = joint.limits.torque
            size = np.abs(values)
            beyond = size > BEYOND_LIMITS * max(limit, float(np.quantile(size, 1 - MAX_LOST_SHARE)))
            if beyond.any() and not worst:
                row = int(np.argmax(beyond))
                worst = f"{name} of {joint.name} {values[row]:.4g} at {run.time[row]:.4g} s, limit {limit:.4g}"
            bad |= beyond
    if not bad.any():
        return run
    text = f"{bad.sum()} of {len(bad)} rows are beyond ten times a limit ({worst}); left out"
    return run.rows(~bad).with_findings(Finding("bad_value", "repaired", text))


def drop_copied_rows(run: AnyRun) -> AnyRun:
    """Leaves out rows that are equal to an earlier one, stamp and all: written twice, they are one measurement."""
    same = duplicated_rows([run.time, *run.signals.values()])
    if not same.any():
        return run
    text = f"{same.sum()} rows repeat an earlier one, stamp and all (first at {run.time[same][0]:g} s); left out"
    return run.rows(~same).with_findings(Finding("duplicate_row", "repaired", text))


def duplicated_rows(signals: Sequence[Array]) -> NDArray[np.bool_]:
    """Which rows are equal to an earlier one; a missing number equals another. signals: (rows,) or (rows, columns).

    Column by column those rows stay under suspicion whose number comes again: mostly none, after the stamps.
    """
    columns = [column for signal in signals for column in (signal[:, None] if signal.ndim == 1 else signal).T]
    suspects = np.arange(len(columns[0]))
    for column in columns:
        _, kinds, counts = np.unique(column[suspects] + 0.0, return_inverse=True, return_counts=True)
        suspects = suspects[counts[kinds] > 1]
    same = np.zeros(len(columns[0]), dtype=bool)
    if len(suspects):
        same[suspects] = True
        rows = np.column_stack([_bits(column[suspects]) for column in columns])
        same[suspects[np.unique(rows, axis=0, return_index=True)[1]]] = False
    return same


def _bits(column: Array) -> NDArray[np.uint64]:
    """The same for equal numbers: -0.0 equals 0.0, and a missing number another one."""
    return np.where(np.isnan(column), np.nan, column + 0.0).view(np.uint64)


def fill_optional_signals(run: AnyRun) -> AnyRun:
    """Fills missing cells of the optional signals by linear interpolation; empty columns stay empty."""
    for name, signal in run.signals.items():
        if name in required_names(run):
            continue
        good = np.abs(signal) < MAX_PLAUSIBLE_VALUE
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


def leave_out(run: AnyRun, stretches: tuple[tuple[float, float], ...]) -> AnyRun:
    """The run without the rows within stretches of time [first, last], s; InputError for one that holds no row."""
    for first, last in stretches:
        inside = (run.time >= first) & (run.time <= last)
        if not inside.any():
            where = f"{run.time.min():g} s to {run.time.max():g} s"
            raise InputError(f"exclude [{first:g}, {last:g}] of {run.file} holds no row: its time runs from {where}")
        text = f"{inside.sum()} rows from {first:g} s to {last:g} s are left out, as `exclude` says"
        if inside.all():
            raise InputError(f"exclude of {run.file} leaves no row: leave the run out of `runs`")
        run = run.rows(~inside).with_findings(Finding("excluded", "note", text))
    return run
