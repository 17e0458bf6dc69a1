"""The state of friction that turns over a way after a reversal (Dahl 1968)."""

import numpy as np

from armlab.common.arrays import Array


def dahl_state(position: Array, way: float) -> Array:
    """Exact solution of dz/dq = (1 - z sgn(dq)) / way along positions (samples,), from z = 0.

    Between reversals z closes in on the direction exponentially with the way gone, so that only the states at
    the reversals follow from one another.
    """
    steps = np.diff(position, prepend=position[0])
    direction = _held_sign(steps)
    gone = np.cumsum(np.abs(steps)) / way
    starts = np.concatenate([[0], np.flatnonzero(np.diff(direction)) + 1])
    # a stretch begins at the sample before its first step
    before = gone[np.maximum(starts - 1, 0)]
    lengths = np.diff(np.append(before, gone[-1]))
    state, states = 0.0, np.empty(len(starts))
    for index, (turn, decay) in enumerate(zip(direction[starts].tolist(), np.exp(-lengths).tolist(), strict=True)):
        states[index] = state
        state = turn + (state - turn) * decay
    counts = np.diff(np.append(starts, len(position)))
    since = np.exp(-(gone - np.repeat(before, counts)))
    return np.asarray(direction + (np.repeat(states, counts) - direction) * since)


def _held_sign(steps: Array) -> Array:
    """Sign of each step, the last one where there is no step."""
    places = np.where(steps != 0, np.arange(len(steps)), 0)
    return np.sign(steps)[np.maximum.accumulate(places)]
