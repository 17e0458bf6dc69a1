"""Whether what happened once is a push: a law may act at an end of the range that was reached but once."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.diagnosis.torque.rows.data import Observed, rows_in
from armlab.diagnosis.tuning import Tuning

POWERS = (0, 1, 2)  # of what is beyond the range: a limit, a spring, a spring that stiffens


@dataclass(frozen=True, eq=False)
class Stretch:
    """A stretch of time in which something is said to push a joint, at every sample of all runs, (samples,).

    window: the push at a coefficient of one, not filtered. position, velocity; torque: what the model says of the joint
    without the push, N m (N). moving: whether the joint moves. unsettled: where friction with a memory is not known,
    because the joint has not reversed twice in the run; nowhere without such friction. filtered: columns (samples,
    columns) through the filter of the torque, (rows, columns).
    """

    window: Array
    position: Array
    velocity: Array
    torque: Array
    moving: NDArray[np.bool_]
    unsettled: NDArray[np.bool_]
    rate_hz: float
    filtered: Callable[[Array], Array]


def make_stretch(
    observed: Observed, joint: int, windows: list[Array], torque: Array, creep_ratio: float | None
) -> Stretch:
    """A stretch of a joint (from 0). windows: one a run, (samples,). torque: (rows,), of the rows that were kept.

    creep_ratio: of the highest speed of a run, below which a joint creeps; None where its friction has no memory.
    """
    moving = rows_in(observed.used(joint), observed.rows)
    parts, start = list[tuple[Array, Array]](), 0
    for signals in observed.signals:
        stop = start + len(signals.torque)
        between = [np.interp(signals.run.time, signals.time, each[start:stop]) for each in (torque, moving)]
        parts.append((between[0], between[1]))
        start = stop
    edges = np.cumsum([len(each) for each in windows])[:-1]

    def filtered(columns: Array) -> Array:
        runs = zip(observed.signals, np.split(columns, edges), strict=True)
        return np.concatenate([signals.filter(run) for signals, run in runs])

    motions = [signals.motion for signals in observed.signals]
    unsettled = [
        np.zeros(each.samples, dtype=bool) if creep_ratio is None else _unsettled(each.velocity[:, joint], creep_ratio)
        for each in motions
    ]
    return Stretch(
        window=np.concatenate(windows),
        position=np.concatenate([each.position[:, joint] for each in motions]),
        velocity=np.concatenate([each.velocity[:, joint] for each in motions]),
        torque=np.concatenate([each[0] for each in parts]),
        moving=np.concatenate([each[1] for each in parts]) > 0.5,
        unsettled=np.concatenate(unsettled),
        rate_hz=observed.signals[0].run.rate_hz,
        filtered=filtered,
    )


def _unsettled(velocity: Array, creep_ratio: float) -> NDArray[np.bool_]:
    """Samples of a run before its second reversal."""
    fast = np.flatnonzero(np.abs(velocity) > creep_ratio * np.abs(velocity).max())
    reversals = fast[1:][np.diff(np.sign(velocity[fast])) != 0]
    return np.arange(len(velocity)) < (reversals[1] if len(reversals) > 1 else len(velocity))


def reason_no_contact(stretch: Stretch, lead: Callable[[Array], float], tuning: Tuning) -> str | None:
    """What speaks against a push, in a few words.

    lead: by how much the push is likelier, as log likelihood, than a law with columns (rows, numbers). A law that the
    library lacks, a spring that stiffens or a limit, shows where position, speed or torque is at an end of its range:
    where that end was reached but once, in this stretch, the push has to be clearly likelier than a function of what is
    beyond. How far friction with a memory was bent when a run began is not known, and looks like a push.
    """
    window, bounds = np.abs(stretch.window), tuning.pushes
    pushed = window > bounds.level * window.max()
    moving = pushed & stretch.moving
    moving_s = float(np.sum(moving)) / stretch.rate_hz
    if moving_s <= bounds.least_s or moving.sum() <= pushed.sum() / 2:
        return "the joint hardly moves during it"
    if not np.any(window == 0):
        return "it goes on all the time"
    if np.all(stretch.unsettled[pushed]):
        return "the friction of the joint may have been bent before"
    for name, laws in _laws_of_the_end(stretch, pushed):
        if min(lead(stretch.filtered(law)) for law in laws) < tuning.claims.max_deficit:
            return f"no other stretch has such a {name}"
    return None


def _laws_of_the_end(stretch: Stretch, pushed: NDArray[np.bool_]) -> Iterator[tuple[str, tuple[Array, ...]]]:
    """Position, speed or torque of which most of the push is beyond all else, and laws of what is beyond.

    Each law has columns (samples, POWERS), by direction or not.
    """
    others, way = stretch.window == 0, np.sign(stretch.velocity)
    variables = (
        ("position", stretch.position, way),
        ("speed", np.abs(stretch.velocity), way),
        ("torque", np.abs(stretch.torque), np.sign(stretch.torque)),
    )
    for name, values, sign in variables:
        low, high = values[others].min(), values[others].max()
        beyond = np.maximum(values - high, 0) + np.maximum(low - values, 0)
        if np.mean(beyond[pushed] > 0) > 1 / 2:
            powers = np.column_stack([np.where(beyond > 0, (beyond / beyond.max()) ** power, 0.0) for power in POWERS])
            yield name, (powers, powers * sign[:, None])
