"""Held-out errors of what is compared: the refitted rigid arm, plain least squares, a plain identification, named
effects, the model.
"""

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.result import HeldOutErrors, JointFit
from armlab.diagnosis.torque.predict.prediction import (
    filtered_residual,
    recorded_residual,
    with_smoothing_of,
)
from armlab.diagnosis.torque.predict.yardstick import Yardstick
from armlab.diagnosis.torque.rows.data import Observed, identification_runs, rows_in
from armlab.diagnosis.tuning import Tuning
from armlab.identification.identifier import Identifier
from armlab.identification.torque_model import TorqueModel


def joint_fits(
    refit: Array,
    models: tuple[TorqueModel, TorqueModel],
    plain: Yardstick | None,
    floor: Array,
    observed: Observed,
    tuning: Tuning,
) -> tuple[JointFit, ...]:
    """The fits of all joints. refit: residual (rows, joints) of the refitted rigid arm; models: the one that is found,
    and that of the named effects alone; floor: (joints,), N m (N).
    """
    found, alone = models
    runs, cutoff = identification_runs(observed), None if plain is None else plain.cutoff_hz
    rigid, identified = (
        with_smoothing_of(found, Identifier(found.arm, parts, cutoff_hz=cutoff).fit(runs).model_)
        for parts in ((), None)
    )
    every = (found, alone, identified)
    left = None if plain is None else plain.residual(observed)
    filtered = [refit, *(filtered_residual(each, observed) for each in every)]
    recorded = [recorded_residual(each, observed) for each in (rigid, *every)]
    out = []
    for joint, noise in enumerate(floor.tolist()):
        if joint in found.arm.unmeasured:
            continue
        rows = rows_in(observed.of_role("validate", joint), observed.rows)
        smooth, raw = (
            HeldOutErrors(*(float(np.sqrt(np.mean(each[rows, joint] ** 2))) for each in residuals))
            for residuals in (filtered, recorded)
        )
        gap = smooth.before - noise
        closed = (smooth.before - smooth.after) / gap if gap > tuning.claims.min_gap * noise else None
        yardstick = None if left is None else float(np.sqrt(np.mean(left[rows, joint] ** 2)))
        out.append(JointFit(joint + 1, smooth, raw, noise, closed, yardstick))
    return tuple(out)
