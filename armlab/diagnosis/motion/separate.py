"""Which parameters of a servo the data cannot tell apart: what a fit would lose if another parameter were free, too.

The covariance with one more free parameter comes from the same Jacobian, without another fit. Where the standard error
of a parameter grows by a factor that matters, the two are a class.
"""

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.motion.estimate import ServoFit, jacobian
from armlab.diagnosis.motion.motion_tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.servo import INFINITE_LIMIT, OPTIONAL, SHARED, USUAL, place
from armlab.diagnosis.motion.windows import Windows

# one factor for all of them, and for the inertia
TORQUE_SCALED = ("kp", "kd", "damping", "friction", "static_excess", "limit", "limit_slope", "armature")


def confused_parameters(
    windows: Windows, fit: ServoFit, mass_error: float = np.inf, tuning: MotionTuning = DEFAULT
) -> dict[int, tuple[int, ...]]:
    """For each fitted parameter, the places of the parameters that these data do not separate from it.

    mass_error: standard error of a payload that was found on all joints together, kg. What the other joints tell of it
    counts as one measurement more.
    """
    every = np.array(USUAL) | np.array(OPTIONAL) | np.array(SHARED) | fit.free
    every[place("limit")] = fit.values[place("limit")] < INFINITE_LIMIT
    slopes = jacobian(windows, fit.values, every)
    columns = dict(zip(np.flatnonzero(every).tolist(), slopes.T, strict=True))
    fitted = np.flatnonzero(fit.free & every).tolist()  # a limit that never acts has no slope
    if not fitted:
        return {}
    alone = _inverse([columns[number] for number in fitted])
    found: dict[int, list[int]] = {number: [] for number in fitted}
    for first in range(len(fitted)):
        for second in range(len(fitted)):
            known = alone[first, first] - alone[first, second] ** 2 / alone[second, second]  # with the second one known
            if first != second and alone[first, first] > tuning.class_factor**2 * known:
                found[fitted[first]].append(fitted[second])
    for other in set(columns) - set(fitted):
        if not np.any(columns[other]):
            continue
        together = [columns[number] for number in (*fitted, other)]
        wider = _inverse(together)
        if other == place("payload") and np.isfinite(mass_error):
            noise = len(windows.position) / windows.count * fit.rms**2
            told = max(noise / mass_error**2 - 1 / float(wider[-1, -1]), 0.0)
            wider = _inverse([*(np.append(each, 0.0) for each in together[:-1]), np.append(together[-1], told**0.5)])
        for position, number in enumerate(fitted):
            if wider[position, position] > tuning.class_factor**2 * alone[position, position] > 0:
                found[number].append(other)
    return {number: tuple(sorted(others)) for number, others in found.items()}


def has_weak_load(windows: Windows, values: Array, tuning: MotionTuning = DEFAULT) -> bool:
    """Whether gravity is too weak at a joint to set the scale of torques: the simulation's inertia alone does."""
    command = windows.command[:, windows.history : windows.history + windows.measured.shape[1]]
    drive = values[place("kp")] * (command - windows.measured)
    return bool(np.sqrt(np.mean(windows.load**2)) < tuning.min_load_share * np.sqrt(np.mean(drive**2)))


def _inverse(columns: list[Array]) -> Array:
    """Inverse of the Gram matrix, scaled so that its units do not matter."""
    stacked = np.stack(columns, axis=1)
    sizes = np.linalg.norm(stacked, axis=0)
    sizes = np.where(sizes > 0, sizes, 1.0)
    scaled = stacked / sizes
    return np.asarray(np.linalg.pinv(scaled.T @ scaled, hermitian=True) / np.outer(sizes, sizes))
