"""Held-out errors of what is compared: the refitted rigid arm, a plain identification, named effects, the model."""

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.data import Observed, rows_in
from armlab.diagnosis.prediction import filtered_residual, identification_runs, recorded_residual, with_smoothing_of
from armlab.diagnosis.result import HeldOutErrors, JointFit
from armlab.diagnosis.tuning import Tuning
from armlab.identification.identifier import Identifier
from armlab.identification.torque_model import TorqueModel


def joint_fits(
    refit: Array, found: TorqueModel, alone: TorqueModel, floor: Array, observed: Observed, tuning: Tuning
) -> tuple[JointFit, ...]:
    """The fits of all joints. refit: residual (rows, joints) of the refitted rigid arm; floor: (joints,), N m (N)."""
    runs = identification_runs(observed)
    rigid, identified = (
        with_smoothing_of(found, Identifier(found.arm, parts).fit(runs).model_) for parts in ((), None)
    )
    models = (found, alone, identified)
    filtered = [refit, *(filtered_residual(each, observed) for each in models)]
    recorded = [recorded_residual(each, observed) for each in (rigid, *models)]
    out = []
    for joint, noise in enumerate(floor.tolist()):
        rows = rows_in(observed.of_role("validate", joint), observed.rows)
        smooth, raw = (
            HeldOutErrors(*(float(np.sqrt(np.mean(each[rows, joint] ** 2))) for each in residuals))
            for residuals in (filtered, recorded)
        )
        gap = smooth.before - noise
        closed = (smooth.before - smooth.after) / gap if gap > tuning.claims.min_gap * noise else None
        out.append(JointFit(joint + 1, smooth, raw, noise, closed))
    return tuple(out)
