"""Estimates the servo of one joint by output error: the parameters whose replay comes nearest to the measured motion.

A regression in which the controller's torque is the source and a coarse grid find starts; encoder noise is in error and
regressors alike in a closed loop, so no number of theirs is reported. The intervals take each window as one block: with
J_w and r_w the Jacobian and the errors of window w (Huber 1967, clustered),

    cov = H^-1 (sum_w J_w^T r_w r_w^T J_w) H^-1,  H = J^T J

What all windows have in common such blocks do not see. So no variance is less than that of errors which are correlated
over time within a window: with u_w the influence of window w's samples on a number, from J H^-1, and S the mean power
spectrum of the errors,

    var = sum_w sum_f |U_w(f)|^2 (S(f) + (widening^2 - 1) max(S(f) - N, 0))

The widening stands for what the law leaves out, which is no noise. N is the noise of reading an encoder in steps:
errors that are no more than that need no widening.

Where the drive integrates its error, what the integral holds at the start of each run is fitted, too.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.optimize import least_squares
from scipy.stats import t as student

from armlab.common.arrays import Array
from armlab.diagnosis.motion.joint_replay import joint_errors
from armlab.diagnosis.motion.motion_tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.servo import HIGHEST, INFINITE_LIMIT, KEYS, LOWEST, NEUTRAL, SCALE, place
from armlab.diagnosis.motion.windows import Windows, at_rest, needed_torque

LOGARITHMIC = np.isin(KEYS, ("kp", "limit"))  # positive and of any size: fitted as logarithms
NATURAL_SHARE = 0.1  # of a torque, of critical damping, of an inertia: a step that matters
LOGARITHMIC_SCALE = 0.2
RELATIVE_STEP, SCALE_STEP = 0.01, 0.02  # of finite differences: large, because a joint that sticks is not smooth
NEEDED_QUANTILE = 0.995  # of the torque that the motion needs: less than what few rows of noise say
SMOOTHED = 15  # places of a spectrum: fewer would call the scatter of noise more than noise
WIDENING = 2.5  # of a standard error, for what the law leaves out: with 1.5, 77 % of 125 development intervals held
SETTLING = 5  # evaluations: the motion is nearly linear in an integral
INTEGRAL_STEP = 0.005  # rad (m): position error whose torque is a step of an integral
INTEGRAL_ROOM = 2.0  # times its limit, where it is at the limit: a fit that ends on a bound cannot turn
INTEGRAL_SHARES = np.linspace(-1, 1, 9)  # of the most that an integral may hold at the start of a run


@dataclass(frozen=True, eq=False)
class ServoFit:
    """Parameters of one joint.

    values: (parameters,); free: which of them were fitted; estimate_covariance: of the coordinates (`to_coordinates`)
    that are free, which few fits are asked for. rms: of the errors, rad; noise: of reading (`reading_noise`), rad.
    windows: number of blocks. integral: of the drive at the start of each run, (runs,), N m.
    """

    values: Array
    free: NDArray[np.bool_]
    estimate_covariance: Callable[[], Array]
    rms: float
    noise: float
    windows: int
    integral: Array

    @cached_property
    def covariance(self) -> Array:
        """Of the coordinates that are free, (free, free)."""
        return self.estimate_covariance()

    def standard_errors(self) -> Array:
        """Of the coordinates, (parameters,); 0 for those that were not fitted, infinite where no sample tells."""
        errors = np.zeros(len(self.values))
        own = np.sqrt(np.diag(self.covariance))
        errors[self.free] = np.where(own > 0, own, np.inf)
        return errors

    @property
    def freedom(self) -> int:
        """Degrees of freedom of the covariance."""
        return max(self.windows - int(self.free.sum()), 1)

    def interval(self, level: float = 0.95) -> Array:
        """Lower and upper ends (2, parameters) of Student intervals within the bounds of each parameter."""
        half = student.ppf(0.5 + level / 2, self.freedom) * self.standard_errors()
        centre = to_coordinates(self.values)
        with np.errstate(over="ignore"):
            ends = from_coordinates(np.stack([centre - half, centre + half]))
        return np.clip(ends, LOWEST, HIGHEST)


def to_coordinates(values: Array) -> Array:
    """Coordinates of a fit: logarithms of gain and limit, the other parameters as they are."""
    return np.where(LOGARITHMIC, np.log(np.maximum(values, 1e-300)), values)


def from_coordinates(coordinates: Array) -> Array:
    """Parameters of coordinates."""
    return np.where(LOGARITHMIC, np.exp(np.where(LOGARITHMIC, coordinates, 0.0)), coordinates)


def coordinate_scales(windows: Windows, values: Array) -> Array:
    """Step of each coordinate that matters, (parameters,): of torques by what the motion needs, of a small motor's
    numbers by its inertia and gain."""
    scales, (inertia, torque) = SCALE.copy(), windows.sizes
    critical = np.sqrt(float(values[place("kp")]) * (inertia + max(float(values[place("armature")]), 0.0)))
    natural = {"damping": critical, "kd": critical, "armature": inertia, "friction": torque, "static_excess": torque}
    natural["limit_slope"] = torque  # at 1 rad/s (m/s)
    for key, size in natural.items():
        scales[KEYS.index(key)] = np.clip(NATURAL_SHARE * size, 1e-3 * SCALE[KEYS.index(key)], HIGHEST[KEYS.index(key)])
    return np.where(LOGARITHMIC, LOGARITHMIC_SCALE, scales)


def jacobian(windows: Windows, values: Array, free: NDArray[np.bool_]) -> Array:
    """Derivative (samples, free) of the errors by the coordinates, by central differences in one batch."""
    centre, chosen = to_coordinates(values), np.flatnonzero(free)
    scales = coordinate_scales(windows, values)
    steps = np.where(LOGARITHMIC, RELATIVE_STEP, RELATIVE_STEP * np.abs(values) + SCALE_STEP * scales)[chosen]
    sets = np.tile(centre, (2 * len(chosen), 1))
    for number, (column, step) in enumerate(zip(chosen, steps, strict=True)):
        sets[2 * number, column] += step
        sets[2 * number + 1, column] -= step
    moved = np.clip(from_coordinates(sets), LOWEST, HIGHEST)
    reached = to_coordinates(moved)
    widths = (reached[0::2] - reached[1::2])[np.arange(len(chosen)), chosen]
    errors = joint_errors(windows, moved)
    return np.asarray(((errors[0::2] - errors[1::2]) / widths[:, None]).T)


def fit_servo(
    windows: Windows,
    start: Array,
    free: NDArray[np.bool_],
    evaluations: int = DEFAULT.max_evaluations,
    tolerance: float = 1e-5,
) -> ServoFit:
    """The fit of the free parameters from a start, (parameters,); the others keep their values.

    tolerance: relative, of the cost and of the step of the last evaluation.
    """
    values = np.clip(start, LOWEST, HIGHEST)
    chosen = np.flatnonzero(free)
    runs = np.unique(windows.run) if values[place("ki")] > 0 else np.zeros(0, dtype=np.int64)
    wound_up, push = float(values[place("integral_limit")]), INTEGRAL_STEP * float(values[place("kp")])

    def whole(part: Array) -> tuple[Windows, Array]:
        coordinates, integral, found = to_coordinates(values), windows.integral.copy(), values.copy()
        coordinates[chosen], integral[runs] = part[: len(chosen)], part[len(chosen) :]
        found[chosen] = from_coordinates(coordinates)[chosen]
        return windows.with_integral(integral) if len(runs) else windows, found

    def slopes(part: Array) -> Array:
        moved, at = whole(part)
        return np.concatenate([jacobian(moved, at, free), _integral_slopes(moved, at, runs, push)], axis=1)

    part = np.concatenate([to_coordinates(values)[chosen], windows.integral[runs]])
    if len(part) == 0:
        errors = joint_errors(windows, values)[0]
        rms, noise = rms_of(errors), reading_noise(windows, values)
        return ServoFit(values, free, lambda: np.zeros((0, 0)), rms, noise, windows.count, windows.integral)
    low = np.concatenate([to_coordinates(LOWEST)[chosen], np.full(len(runs), -INTEGRAL_ROOM * wound_up)])
    high = np.concatenate([to_coordinates(HIGHEST)[chosen], np.full(len(runs), INTEGRAL_ROOM * wound_up)])
    margin = 1e-9 * (high - low)
    solution = least_squares(
        lambda part: joint_errors(*whole(part))[0],
        np.clip(part, low + margin, high - margin),
        jac=slopes,
        bounds=(low, high),
        x_scale=np.concatenate([coordinate_scales(windows, values)[chosen], np.full(len(runs), push)]),
        max_nfev=evaluations,
        ftol=tolerance,
        xtol=tolerance,
    )
    moved, values = whole(solution.x)
    rms, noise = rms_of(solution.fun), reading_noise(windows, values)

    def covariance() -> Array:
        return _covariance(solution.jac, solution.fun, windows.window, noise)[: len(chosen), : len(chosen)]

    return ServoFit(values, free, covariance, rms, noise, windows.count, moved.integral)


def reading_noise(windows: Windows, values: Array) -> float:
    """Standard deviation of the errors that the steps of the encoder make by reading alone, rad (m).

    A drive that makes more torque of a step than friction holds moves the joint by it: that is no noise of reading.
    """
    friction, kp = float(values[place("friction")]), float(values[place("kp")])
    held = 1 - kp * windows.encoder_noise / friction if friction > 0 else 0.0
    return float(windows.encoder_noise * np.sqrt(max(held, 0.0)))


def least_gain(square: float, noise: float, tuning: MotionTuning = DEFAULT) -> float:
    """Share of a mean squared error, rad2, that a number has to take: of what is not the noise of reading, rad."""
    beyond = 1 - noise**2 / max(square, 1e-300)
    return float(tuning.min_gain * max(beyond, tuning.min_share_beyond_noise))


def price_of_number(square: float, noise: float, tuning: MotionTuning = DEFAULT) -> float:
    """What a number has to take off the logarithm of a mean squared error."""
    return float(-np.log(1 - least_gain(square, noise, tuning)))


def rms_of(errors: Array) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def begin_integrals(windows: Windows, values: Array) -> Windows:
    """The windows with integrals at the start of each run from which a fit finds the best ones.

    The drive is at rest there, or it is not: of some values up to the torque that the motion needs, or to the limit of
    the integral, each run takes the best one. values: (parameters,).
    """
    rested = at_rest(windows, values)
    if values[place("ki")] == 0:
        return rested
    needed = float(np.quantile(np.abs(needed_torque(windows, float(values[place("armature")]))[-1]), NEEDED_QUANTILE))
    most = min(float(values[place("integral_limit")]), needed)
    tried = [rested.integral, *(np.full(len(rested.integral), most * share) for share in INTEGRAL_SHARES)]
    run = windows.run[windows.window]
    squares = [
        np.bincount(run, joint_errors(windows.with_integral(each), values)[0] ** 2, len(rested.integral))
        for each in tried
    ]
    return windows.with_integral(np.choose(np.argmin(squares, axis=0), tried))


def settle(windows: Windows, values: Array) -> Windows:
    """The windows with the integrals that fit a servo best, (parameters,), at the start of each run."""
    if values[place("ki")] == 0:
        return windows
    none = np.zeros(len(values), dtype=bool)
    return windows.with_integral(fit_servo(windows, values, none, SETTLING).integral)


def _integral_slopes(windows: Windows, values: Array, runs: NDArray[np.int64], push: float) -> Array:
    """Derivative (samples, runs) of the errors by the integrals at the start of the runs."""
    if len(runs) == 0:
        return np.zeros((len(windows.position), 0))
    ends = [joint_errors(windows.with_integral(windows.integral + side * push), values)[0] for side in (1, -1)]
    return np.where(windows.run[windows.window][:, None] == runs, ((ends[0] - ends[1]) / (2 * push))[:, None], 0.0)


def _covariance(slopes: Array, errors: Array, window: NDArray[np.intp], noise: float) -> Array:
    """Of the coordinates, (free, free), by windows as blocks; no variance is less than that of correlated errors."""
    scores = np.stack([np.bincount(window, column * errors) for column in slopes.T], axis=1)
    inverse = np.linalg.pinv(slopes.T @ slopes, hermitian=True)
    blocks = len(scores)
    clustered = inverse @ (scores.T @ scores) @ inverse * blocks / max(blocks - 1, 1)
    least = correlated_variances(slopes @ inverse, errors, window, noise)
    own = np.maximum(np.diag(clustered), 1e-300)
    wider = np.sqrt(np.clip(least / own, 1.0, 1e200))
    return np.asarray(clustered * np.outer(wider, wider))


def correlated_variances(influence: Array, errors: Array, window: NDArray[np.intp], noise: float) -> Array:
    """Variances (free,) of numbers with these influences (samples, free), under errors correlated within windows.

    What the errors have beyond the noise of reading, rad, is widened.
    """
    starts = np.searchsorted(window, np.arange(window[-1] + 1))
    place = np.arange(len(window)) - starts[window]
    shape = len(starts), int(place.max()) + 1

    def powers(signal: Array) -> Array:
        laid_out = np.zeros(shape)
        laid_out[window, place] = signal
        return np.asarray(np.sum(np.abs(np.fft.rfft(laid_out, 2 * shape[1], axis=1)) ** 2, axis=0))

    spectrum = powers(errors) / len(errors)
    beyond = np.maximum(uniform_filter1d(spectrum, SMOOTHED, mode="nearest") - noise**2, 0.0)
    of_errors = spectrum + (WIDENING**2 - 1) * beyond
    weights = np.full(len(of_errors), 2.0)
    weights[[0, -1]] = 1.0
    return np.array([float(weights @ (powers(each) * of_errors)) for each in influence.T]) / (2 * shape[1])


@dataclass(frozen=True)
class Unstated:
    """What a fit tries that the simulation does not state.

    limits: of torque, as shares of the torque that the motion needs; inside: whether damping is within them. rates: of
    integral gains over kp, 1/s. wound_up: limits of the integrals, as shares of the torque that the motion needs.
    """

    limits: tuple[float, ...] = ()
    inside: bool = False
    rates: tuple[float, ...] = ()
    wound_up: tuple[float, ...] = ()


def with_nominal(fit: ServoFit, base: Array, number: int) -> tuple[Array, NDArray[np.bool_]]:
    """Numbers of a fit with that of the simulation at a place, and which of them are free then.

    base: numbers of the simulation, (parameters,).
    """
    values, free = fit.values.copy(), fit.free.copy()
    values[number], free[number] = base[number], False
    if number == place("damping") and not free[place("kd")]:  # of joint and drive together
        values[place("kd")] = base[place("kd")]
    return values, free


def find_start(
    windows: Windows,
    nominal: Array,
    free: NDArray[np.bool_],
    tuning: MotionTuning = DEFAULT,
    unstated: Unstated = Unstated(),
) -> ServoFit:
    """The best of several fits of the free parameters: from the regression, a grid of gains, and the simulation.

    nominal: (parameters,), NaN where the simulation does not know a value. unstated: tried in place of its numbers.
    """
    few = thin_windows(windows, tuning.wanted_windows)
    starts = _starts(few, nominal, unstated, tuning)
    if unstated.rates:
        errors = np.concatenate([joint_errors(at_rest(few, start), start) for start in starts])
    else:
        errors = joint_errors(few, starts)
    best = _best_starts(starts, np.mean(errors**2, axis=1), tuning.starts)
    fits = [
        fit_servo(begin_integrals(few, starts[each]), starts[each], free, tuning.refit_evaluations) for each in best
    ]
    first = min(fits, key=lambda fit: fit.rms)
    return fit_servo(windows.with_integral(first.integral), first.values, free, tuning.max_evaluations)


def _best_starts(starts: Array, squares: Array, count: int) -> list[int]:
    """The starts with the least squared error, `count` of each torque limit."""
    limits = starts[:, place("limit")]
    order = np.argsort(squares)
    return [each for level in np.unique(limits) for each in order[limits[order] == level][:count].tolist()]


def with_damping_inside(values: Array, base: Array) -> Array:
    """The same with what the joint has beyond the damping of the simulation, `base`, in kd, which the limit acts on."""
    inside, (kd, damping) = values.copy(), (place("kd"), place("damping"))
    both = float(values[kd] + values[damping])
    inside[kd] = max(both - float(base[damping]), 0.0)
    inside[damping] = both - inside[kd]
    return inside


def thin_windows(windows: Windows, most: int) -> Windows:
    """At most so many windows, spread evenly over all."""
    return windows.select(evenly_spread(windows.count, most))


def evenly_spread(count: int, most: int) -> NDArray[np.intp]:
    """At most so many of the numbers below a count, ascending."""
    return np.unique(np.linspace(0, count - 1, min(most, count)).astype(np.intp))


def fill_unknown(nominal: Array) -> Array:
    """The nominal parameters with neutral ones where they are unknown."""
    return np.where(np.isnan(nominal), NEUTRAL, nominal)


def _starts(windows: Windows, nominal: Array, unstated: Unstated, tuning: MotionTuning) -> Array:
    """Parameter sets (starts, parameters)."""
    base = fill_unknown(nominal)
    mass = float(np.median(windows.inertia)) + base[place("armature")]
    found = [] if np.isnan(nominal).any() else [base]
    regressed, needed = _regress(windows, base, tuning.moving_speed)
    frictions = {0.0, float(regressed[place("friction")]), *((float(base[place("friction")]),) if len(found) else ())}
    for frequency in tuning.frequencies_hz:
        for ratio in tuning.damping_ratios:
            for friction in frictions:
                one = base.copy()
                one[place("kp")] = mass * (2 * np.pi * frequency) ** 2
                one[place("damping")] = 2 * ratio * np.sqrt(one[place("kp")] * mass)
                one[place("friction")] = friction
                found.append(one)
    if regressed[place("kp")] > 0:
        found.append(regressed)
    if unstated.limits:
        found = [with_damping_inside(one, base) for one in found] if unstated.inside else found
        found = [_with(one, limit=level * needed) for one in found for level in unstated.limits]
    if unstated.rates:
        found = [
            _with(one, ki=rate * float(one[place("kp")]), integral_limit=level * needed)
            for one in found
            for rate in unstated.rates
            for level in unstated.wound_up
        ]
    return np.clip(np.stack(found), LOWEST, HIGHEST)


def _with(values: Array, **numbers: float) -> Array:
    """The parameters with other numbers by their keys."""
    changed = values.copy()
    for key, number in numbers.items():
        changed[KEYS.index(key)] = number
    return changed


def _regress(windows: Windows, base: Array, moving_speed: float) -> tuple[Array, float]:
    """kp e - damping qd - friction sgn(qd) = inertia qdd + load, on moving rows, by least squares.

    And the torque that the motion needs beside damping and friction, N m: few rows are above it.
    """
    stride, velocity, known = needed_torque(windows, float(base[place("armature")]))
    command = windows.command[:, windows.history : windows.history + windows.measured.shape[1] : stride]
    error = command - windows.measured[:, ::stride]
    rows = np.abs(velocity) > moving_speed
    found, needed = base.copy(), float(np.quantile(np.abs(known), NEEDED_QUANTILE))
    if rows.sum() < 10:
        return found, needed
    columns = np.stack([error[rows], -velocity[rows], -np.sign(velocity[rows])], axis=1)
    solution = np.linalg.lstsq(columns, known[rows], rcond=None)[0]
    found[[place("kp"), place("damping"), place("friction")]] = np.maximum(solution, 0.0)
    return found, needed


def unsaturated_limit(windows: Windows, values: Array) -> float:
    """Torque that the drive would reach without a limit: where a fit of the limit starts, N m."""
    steps = windows.measured.shape[1]
    error = windows.command[:, windows.history : windows.history + steps] - windows.measured
    return float(min(values[place("kp")] * np.quantile(np.abs(error), 0.995), INFINITE_LIMIT))
