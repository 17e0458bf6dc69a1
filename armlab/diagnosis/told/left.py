"""What is left at each joint, beside its noise and what real arms leave."""

from dataclasses import dataclass

import numpy as np

from armlab.diagnosis.result import Diagnosis

MAX_USUAL_SHARE = 0.43  # of a joint's torque: nine of ten joints of results/real/folders_joints.csv, as plain least
# squares leaves them, leave less (one row a joint, those without a torque measurement left out)


@dataclass(frozen=True)
class Left:
    """joint: from 1. rms, noise: N m (N), held out. depends_on: variables. usual: whether real arms leave as much."""

    joint: int
    share_of_torque: float
    rms: float
    noise: float
    depends_on: tuple[str, ...]
    usual: bool


def left_by_joint(diagnosis: Diagnosis) -> tuple[Left, ...]:
    """One entry a joint; none where nothing was fitted."""
    observed = diagnosis.observed
    if observed is None:
        return ()
    known = {each.joint: each.depends_on for each in diagnosis.unexplained}
    out = []
    for fit in diagnosis.fit:
        rows = observed.rows_held_out(fit.joint - 1)
        torque = float(np.sqrt(np.mean(observed.torque[rows, fit.joint - 1] ** 2)))
        share = fit.after / max(torque, 1e-300)
        noise = min(fit.noise_floor, fit.after)
        out.append(Left(fit.joint, share, fit.after, noise, known.get(fit.joint, ()), share <= MAX_USUAL_SHARE))
    return tuple(out)
