"""Was it a push? A thing that happened once in a stretch of time, while nothing else was as never before or after."""

import numpy as np

from diagnosis.engine.observed import Observed
from diagnosis.engine.segments import rows_of
from recordings.run import Array

PUSHED = 0.3  # of a push's peak
PUSH_S = 0.15  # s in motion: a shorter push is a reversal
MOST = 0.5  # of the push's samples


def no_push(push: Array, joint: int, observed: Observed, torque: Array) -> str | None:
    """What speaks against a push at a joint (from 0), in a few words.

    push: (rows,), its torque; torque: (rows,), what the model says of the joint without it, N m. A law that the library
    lacks, a spring that stiffens or a limit, shows where position, speed or torque is at an end of its range: where
    that end was reached but once, in this stretch, nothing tells the law from a push.
    """
    pushed = np.abs(push) > PUSHED * np.abs(push).max()
    moving = pushed & rows_of(observed.used(joint), len(push))
    if float(np.sum(moving)) / observed.rate_hz <= PUSH_S or moving.sum() <= 0.5 * pushed.sum():
        return "the joint hardly moves during it"
    position, velocity = (observed.kept(name)[:, joint] for name in ("position", "velocity"))
    others = push == 0
    for name, values in (("position", position), ("speed", np.abs(velocity)), ("torque", np.abs(torque))):
        low, high = values[others].min(), values[others].max()
        if np.mean((values[pushed] < low) | (values[pushed] > high)) > MOST:
            return f"no other stretch has such a {name}"
    return None
