"""How much of the gap between the refitted rigid model and the true floor a diagnosis has closed.

Counted on the held-out run, in the scorer's own filter, from the torque that the verdict's model predicts. Where there
is no prediction the verdict's own figures are taken, and the row says so.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from concealed.score.held_out import held_out, rms
from concealed.score.reading import Judged
from recordings.run import Array

LEAST_GAP = 1.15  # times the floor: where the rigid model is nearly there, no gap is left to close


@dataclass(frozen=True)
class Gap:
    """Shares closed over all joints, None where there is no gap, and whose figures these are.

    closed: from the refitted rigid links. beyond: from rigid links and plain friction, both refitted; None in the clean
    tier, where no friction stands beside what is hidden.
    """

    closed: float | None
    beyond: float | None
    source: Literal["counted", "reported", "none"]


def gap_closed(case: Judged) -> Gap:
    """What the diagnosis of one case has closed."""
    if not case.truth["injected"] or case.verdict["status"] == "invalid":
        return Gap(None, None, "none")
    if not (case.folder / "predicted").is_dir():
        return _reported(case)
    found = held_out(case)
    if found.after is None:
        return _reported(case)
    after, floor = rms(found.after), rms(found.floor)
    beyond = _share(rms(found.friction), after, floor) if case.truth["background"] else None
    return Gap(_share(rms(found.refit), after, floor), beyond, "counted")


def _share(before: Array, after: Array, floor: Array) -> float | None:
    """(before - after) / (before - floor) of the joints whose gap is worth closing, each by its own floor."""
    worth = before > LEAST_GAP * floor
    if not worth.any():
        return None
    scaled = [each[worth] / floor[worth] for each in (before, after)]
    return float(np.sum(scaled[0] - scaled[1]) / np.sum(scaled[0] - 1))


def _reported(case: Judged) -> Gap:
    """From the verdict's own errors and floor, in its own filter."""
    names = ("heldout_rms_before", "heldout_rms_after", "noise_floor")
    figures = np.array([[fit.get(name) for name in names] for fit in case.verdict["fit"]], dtype=np.float64)
    if not len(figures) or not np.all(np.isfinite(figures)) or np.any(figures[:, 2] <= 0):
        return Gap(None, None, "reported")
    return Gap(_share(*figures.T), None, "reported")
