"""Cuts a run where its clock steps back or pauses: no filter may run across such a place."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from problem.errors import InputError
from recordings.run import Array, Finding, Run

LONG_GAP = 5.5  # samples: over a shorter gap of a well sampled motion, interpolation is safe
FEWEST = 50  # samples: a shorter part tells nothing


def parts(run: Run) -> tuple[Run, ...]:
    """The parts of a run between gaps of the clock and steps back; parts that are too short are left out.

    Raises InputError if nothing is left.
    """
    pieces = _pieces(run.time, np.arange(run.samples))
    long = [piece for piece in pieces if len(piece) >= FEWEST]
    if not long:
        longest = max(len(piece) for piece in pieces)
        raise InputError(f"{run.file}: {longest} samples in a row at most; at least {FEWEST} are needed")
    if len(pieces) == 1:
        return (run,)
    run = run.noted(_finding(run.time, pieces, len(long)))
    return tuple(replace(run.rows(piece), part=number) for number, piece in enumerate(long, 1))


def _pieces(time: Array, rows: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """Rows between breaks, looked for again in each piece: a long pause hides shorter ones."""
    steps = np.diff(time[rows])
    forward = steps[steps > 0]
    if not len(forward):
        return [rows]
    usual = max(float(np.median(forward)), float(np.mean(forward)))
    breaks = np.flatnonzero((steps < 0) | (steps > LONG_GAP * usual)) + 1
    if not len(breaks):
        return [rows]
    return [piece for part in np.split(rows, breaks) for piece in _pieces(time, part)]


def _finding(time: Array, pieces: list[NDArray[np.intp]], kept: int) -> Finding:
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
