"""Held-out errors of what is compared: the refitted rigid arm, plain least squares, a plain identification, named
effects, the model.
"""

from collections.abc import Sequence

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import DataError
from armlab.diagnosis.data import Observed, rows_in
from armlab.diagnosis.prediction import filtered_residual, identification_runs, recorded_residual, with_smoothing_of
from armlab.diagnosis.result import HeldOutErrors, JointFit
from armlab.diagnosis.tuning import Tuning
from armlab.identification.identifier import Identifier
from armlab.identification.torque_model import TorqueModel
from armlab.recordings.cutoff_trial import choose_cutoff_hz
from armlab.recordings.plain_least_squares import fit_plain_model
from armlab.recordings.recording import Run
from problem.arm import Arm


def joint_fits(
    refit: Array, found: TorqueModel, alone: TorqueModel, floor: Array, observed: Observed, tuning: Tuning
) -> tuple[JointFit, ...]:
    """The fits of all joints. refit: residual (rows, joints) of the refitted rigid arm; floor: (joints,), N m (N)."""
    runs = identification_runs(observed)
    cutoff = _best_cutoff(found.arm, runs)
    rigid = with_smoothing_of(found, Identifier(found.arm, ()).fit(runs).model_)
    identified = with_smoothing_of(found, Identifier(found.arm, cutoff_hz=cutoff).fit(runs).model_)
    models, plain = (found, alone, identified), plain_residual(found.arm, observed, cutoff)
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
        yardstick = None if plain is None else float(np.sqrt(np.mean(plain[rows, joint] ** 2)))
        out.append(JointFit(joint + 1, smooth, raw, noise, closed, yardstick))
    return tuple(out)


def _best_cutoff(arm: Arm, runs: Sequence[Run]) -> float | None:
    """The cut-off that predicts best inside the runs that identify, Hz; None where they are too short to tell."""
    try:
        return choose_cutoff_hz(arm, runs)
    except DataError:
        return None


def plain_residual(arm: Arm, observed: Observed, cutoff_hz: float | None) -> Array | None:
    """What plain least squares leaves behind the filter of the torque, (rows, joints); None where it has no rows.

    It is fitted to the stretches that identify. cutoff_hz: None where these are too short to tell one.
    """
    try:
        model = None if cutoff_hz is None else fit_plain_model(arm, identification_runs(observed), cutoff_hz)
    except DataError:
        model = None
    if model is None:
        return None
    return np.concatenate([each.torque - each.filter(model.predict(each.run)) for each in observed.signals])
