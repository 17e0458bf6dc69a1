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


def identified_model(
    found: TorqueModel, plain: Yardstick | None, observed: Observed, is_rigid: bool = False
) -> TorqueModel:
    """What `identify` makes of the runs that identify, of rigid links alone or with the usual terms."""
    cutoff = None if plain is None else plain.cutoff_hz
    identifier = Identifier(found.arm, () if is_rigid else None, cutoff_hz=cutoff)
    return with_smoothing_of(found, identifier.fit(identification_runs(observed)).model_)


def joint_fits(
    refit: Array,
    models: tuple[TorqueModel, TorqueModel, TorqueModel],
    plain: Yardstick | None,
    floor: Array,
    observed: Observed,
    tuning: Tuning,
) -> tuple[JointFit, ...]:
    """The fits of all joints.

    refit: residual (rows, joints) of the refitted rigid arm. models: of rigid links alone, the one that is found, and
    that of the named effects alone. floor: (joints,), N m (N), at most.
    """
    rigid, found, alone = models
    every = (found, alone, identified_model(found, plain, observed))
    left = None if plain is None else plain.residual(observed)
    filtered = [refit, *(filtered_residual(each, observed) for each in every)]
    recorded = [recorded_residual(each, observed) for each in (rigid, *every)]
    out = []
    for joint, most in enumerate(floor.tolist()):
        if joint in found.arm.unmeasured:
            continue
        rows = rows_in(observed.of_role("validate", joint), observed.rows)
        smooth, raw = (
            HeldOutErrors(*(float(np.sqrt(np.mean(each[rows, joint] ** 2))) for each in residuals))
            for residuals in (filtered, recorded)
        )
        yardstick = None if left is None else float(np.sqrt(np.mean(left[rows, joint] ** 2)))
        noise = min(most, smooth.after, yardstick or most)  # what leaves less on held-out rows shows that there is less
        gap = smooth.before - noise
        closed = (smooth.before - smooth.after) / gap if gap > tuning.claims.min_gap * noise else None
        out.append(JointFit(joint + 1, smooth, raw, noise, closed, yardstick))
    return tuple(out)
