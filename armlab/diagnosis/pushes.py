"""Whether what happened once is a push: a law may act at an end of the range that was reached but once."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.data import Observed, rows_in
from armlab.diagnosis.tuning import Tuning

POWERS = (0, 1, 2)  # of what is beyond the range: a limit, a spring, a spring that stiffens


@dataclass(frozen=True, eq=False)
class Stretch:
    """A stretch of time in which something is said to push a joint (from 0).

    push: (rows,), its torque; torque: (rows,), what the model says of the joint without it, N m (N).
    """

    push: Array
    joint: int
    torque: Array
    observed: Observed


def reason_no_contact(stretch: Stretch, lead: Callable[[Array], float], tuning: Tuning) -> str | None:
    """What speaks against a push, in a few words.

    lead: by how much the push is likelier, as log likelihood, than a law with columns (rows, numbers). A law that the
    library lacks, a spring that stiffens or a limit, shows where position, speed or torque is at an end of its range:
    where that end was reached but once, in this stretch, the push has to be clearly likelier than a function of what is
    beyond.
    """
    push, joint, observed, bounds = stretch.push, stretch.joint, stretch.observed, tuning.evidence
    pushed = np.abs(push) > bounds.push_level * np.abs(push).max()
    moving = pushed & rows_in(observed.used(joint), len(push))
    moving_s = float(np.sum(moving)) / observed.rate_hz
    if moving_s <= bounds.min_push_s or moving.sum() <= bounds.min_push_moving_share * pushed.sum():
        return "the joint hardly moves during it"
    if not np.any(push == 0):
        return "it goes on all the time"
    for name, laws in _laws_of_the_end(stretch, pushed, bounds.max_extreme_share):
        if min(lead(law) for law in laws) < tuning.pruning.least_evidence:
            return f"no other stretch has such a {name}"
    return None


def _laws_of_the_end(stretch: Stretch, pushed: Array, largest: float) -> Iterator[tuple[str, tuple[Array, ...]]]:
    """Position, speed or torque of which more than a share of the push is beyond all else, and laws of what is beyond.

    Each law has columns (rows, POWERS), by direction or not.
    """
    position, velocity = (stretch.observed.kept(each)[:, stretch.joint] for each in ("position", "velocity"))
    others, way = stretch.push == 0, np.sign(velocity)
    for name, values in (("position", position), ("speed", np.abs(velocity)), ("torque", np.abs(stretch.torque))):
        low, high = values[others].min(), values[others].max()
        beyond = np.maximum(values - high, 0) + np.maximum(low - values, 0)
        if np.mean(beyond[pushed] > 0) > largest:
            powers = np.column_stack([np.where(beyond > 0, (beyond / beyond.max()) ** power, 0.0) for power in POWERS])
            sign = np.sign(stretch.torque) if name == "torque" else way
            yield name, (powers, powers * sign[:, None])
