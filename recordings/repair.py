"""Repairs of rows and stamps that are safe; each says what it changed. What is not safe raises InputError."""

import numpy as np
from numpy.typing import NDArray

from problem.errors import InputError
from recordings.run import Array, Finding, Run

ABSURD = 1e9  # no arm moves, pulls or lasts this much in SI units
MOST_BAD = 0.05  # more bad rows than this, and the file is broken rather than a few rows
REQUIRED = ("position", "torque")
SHORT_GAP = 5.0  # samples: over a shorter gap of a well sampled motion, interpolation is safe
FEWEST = 50  # samples: a shorter part tells nothing


def without_bad_rows(run: Run, rows: NDArray[np.intp], names: dict[str, tuple[str, ...]]) -> Run:
    """Leaves out rows whose time, position or torque is no number, infinite or absurdly large.

    rows: (samples,), where each stands in the file. names: of the columns of each signal, for the message.
    Raises InputError where more than a few rows are bad.
    """
    wrong = {name: ~_plausible(signal) for name, signal in _required(run).items()}
    bad = np.any([flags.any(axis=1) for flags in wrong.values()], axis=0)
    if not bad.any():
        return run
    row = int(np.flatnonzero(bad)[0])
    signal, column = next((name, int(np.argmax(wrong[name][row]))) for name in wrong if wrong[name][row].any())
    value = _required(run)[signal][row, column]
    example = f"line {rows[row]}: {names[signal][column]} = {value:g}"
    text = f"{bad.sum()} of {len(bad)} rows hold what is no measurement ({example})"
    if bad.sum() > max(1, MOST_BAD * len(bad)):
        raise InputError(f"{run.file}: {text}: too many to repair; export the run again")
    return run.rows(~bad).noted(Finding("bad_value", "repaired", f"{text}; left out"))


def _required(run: Run) -> dict[str, Array]:
    return {"time": run.time[:, None], **{name: run.signals[name] for name in REQUIRED}}


def _plausible(values: Array) -> NDArray[np.bool_]:
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(values) < ABSURD)


def with_optional_filled(run: Run) -> Run:
    """Bridges cells that are missing in the optional signals by straight lines; empty columns stay empty."""
    for name, signal in run.signals.items():
        if name in REQUIRED:
            continue
        good = _plausible(signal)
        torn = good.any(axis=0) & ~good.all(axis=0)
        empty = ~good.any(axis=0) & ~np.isnan(signal).all(axis=0)
        if not (torn.any() or empty.any()):
            continue
        filled = np.where(good, signal, np.nan)
        for column in np.flatnonzero(torn):
            there = good[:, column]
            filled[:, column] = np.interp(run.time, run.time[there], signal[there, column])
        text = f"{(~good[:, torn | empty]).sum()} cells of {name} hold no number; filled by straight lines"
        run = run.with_signals(run.time, {name: filled}).noted(Finding("bad_value", "repaired", text))
    return run


def without_duplicates(run: Run) -> Run:
    """Leaves out rows that repeat the row before to the last digit."""
    table = np.column_stack([run.time, *run.signals.values()])
    same = np.append(False, np.all((table[1:] == table[:-1]) | np.isnan(table[1:]), axis=1))
    if not same.any():
        return run
    text = f"{same.sum()} rows repeat the row before (first at {run.time[same][0]:g} s); left out"
    return run.rows(~same).noted(Finding("duplicate_row", "repaired", text))


def in_order(run: Run) -> Run:
    """Sorts rows that stand in the wrong order, where the sorted stamps leave no doubt.

    A clock that stepped back overlaps with what was before: then the rows stay, and the run is cut there.
    """
    backwards = int(np.sum(np.diff(run.time) < 0))
    if not backwards:
        return run
    order = np.argsort(run.time, kind="stable")
    steps = np.diff(run.time[order])
    if steps.min() < 0.5 * np.median(steps):
        return run
    text = f"{backwards} rows stand before an earlier one; put in the order of their stamps"
    return run.rows(order).noted(Finding("time_order", "repaired", text))
