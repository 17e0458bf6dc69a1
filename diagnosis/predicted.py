"""The torque that the model found predicts on runs that took no part, as CSV."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.interpolate import make_interp_spline

from diagnosis.result import Diagnosis
from recordings.differentiate import Signals
from recordings.run import Array

FOLDER = "predicted"


def predicted_texts(diagnosis: Diagnosis) -> dict[str, str]:
    """`predicted/RUN.csv` of each validation run: t in s, tau1, ... in N m (N).

    The torque passed the filter of the diagnosis, and stands at the run's own even stamps, ends left out.
    """
    observed, final = diagnosis.observed, diagnosis.final
    if observed is None or final is None:
        return {}
    rows = zip(observed.signals, _by_run(final, observed.signals), strict=True)
    return {
        f"{FOLDER}/{Path(each.run.file).stem}.csv": _csv(each, each.torque - left)
        for each, left in rows
        if each.run.role == "validate" and not each.run.part
    }


def _by_run(stacked: Array, signals: tuple[Signals, ...]) -> Iterator[Array]:
    ends = np.cumsum([len(each.torque) for each in signals])
    return iter(np.split(stacked, ends[:-1]))


def _csv(signals: Signals, torque: Array) -> str:
    known, time = signals.time, signals.run.time
    inside = time[(time >= known[0]) & (time <= known[-1])]
    values = make_interp_spline(known, torque, k=3)(inside)
    head = ",".join(["t", *(f"tau{joint}" for joint in range(1, values.shape[1] + 1))])
    return "\n".join([head, *(",".join(f"{x:.6g}" for x in row) for row in np.column_stack([inside, values])), ""])
