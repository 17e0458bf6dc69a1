"""Which parameters of a servo differ from the simulation's, chosen on blocks of the runs that identify.

Even and odd windows take turns: parameters are fitted on one half and judged on the other. A parameter joins the model
where the model without it (the parameter at the value of the simulation) predicts the other half worse, by a share that
matters and hardly by chance. It is a finding where that holds after a correction for all tests.

Two tests say what chance does. Signed ranks of the windows need no assumption, and see little where few windows tell
much. So where the ranks agree at all, a matched filter may decide: with d the change of the predictions by the
parameter, learned on the other half, and e the errors without it,

    z = sum d e / (widening sqrt(sum_w sum_f |D_w(f)|^2 S(f)))

S is the mean power spectrum of the errors with the parameter; the widening is that of the intervals (see estimate.py).
"""

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student
from scipy.stats import wilcoxon

from armlab.common.arrays import Array
from armlab.diagnosis.motion.estimate import (
    ServoFit,
    Unstated,
    correlated_variances,
    fill_unknown,
    find_start,
    fit_servo,
    jacobian,
    needed_torque,
    settle,
    thin_windows,
    to_coordinates,
    unsaturated_limit,
    with_damping_inside,
)
from armlab.diagnosis.motion.joint_replay import joint_errors
from armlab.diagnosis.motion.servo import (
    INFINITE_LIMIT,
    OPTIONAL,
    SCALE,
    USUAL,
    Key,
    place,
)
from armlab.diagnosis.motion.tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.windows import Windows

JUDGED_TOLERANCE = 1e-4  # of fits that are judged on the other half, where a gain of percents matters


@dataclass(frozen=True)
class Gain:
    """What one parameter is worth on windows that took no part. share: of the squared error without it; p_value: of
    no gain, one-sided, not corrected. rms_without, rms_with: rad."""

    share: float
    p_value: float
    rms_without: float
    rms_with: float


@dataclass(frozen=True, eq=False)
class ChosenServo:
    """A joint's servo: a fit with the parameters that have a place in the model.

    nominal: numbers of the simulation, all damping outside the drive where the fit has it so. free: the parameters that
    were free when those that may be findings were judged; in `fit` the others have the numbers of the simulation where
    that explains as much. gains: what each parameter is worth that may be a finding, by its place in PARAMETERS. odd:
    windows that the servo of all others does not explain (contact, a lost command), left out of the fit.
    """

    nominal: Array
    fit: ServoFit
    free: NDArray[np.bool_]
    gains: dict[int, Gain]
    odd: NDArray[np.intp]

    def with_damping_inside(self) -> "ChosenServo | None":
        """The same with the change of damping in kd, on which the torque limit acts; None where there is no change.

        Where nothing saturates, both are the same servo.
        """
        kd, damping = place("kd"), place("damping")
        moved = float(self.fit.values[kd] + self.fit.values[damping] - self.nominal[damping])
        if damping not in self.gains or self.fit.values[kd] != self.nominal[kd] or moved < 0:
            return None
        values = self.fit.values.copy()
        values[[kd, damping]] = moved, self.nominal[damping]
        return replace(self, fit=replace(self.fit, values=values))

    def without(self, number: int, windows: Windows, tuning: MotionTuning = DEFAULT) -> "ChosenServo":
        """The same with the number of the simulation at a place, and the others fitted anew in these windows."""
        values, free, judged = self.fit.values.copy(), self.fit.free.copy(), self.free.copy()
        values[number], free[number], judged[number] = self.nominal[number], False, False
        if number == place("damping"):  # of joint and drive together
            values[place("kd")] = self.nominal[place("kd")]
        fit = fit_servo(windows.with_integral(self.fit.integral), values, free, tuning.max_evaluations)
        gains = {other: gain for other, gain in self.gains.items() if other != number}
        return replace(self, fit=fit, free=judged, gains=gains)

    @property
    def named(self) -> tuple[Array, NDArray[np.bool_]]:
        """The numbers of the simulation with those in their place that may be findings; which these are."""
        free = np.zeros(len(self.nominal), dtype=bool)
        free[list(self.gains)] = True
        return np.where(free, self.fit.values, fill_unknown(self.nominal)), free


def choose_servo(
    windows: Windows,
    nominal: Array,
    looks: int,
    tuning: MotionTuning = DEFAULT,
    barred: Collection[int] = (),
) -> ChosenServo:
    """The servo of one joint. nominal: (parameters,), NaN where unknown. looks: number of tests in the diagnosis.

    barred: places of optional parameters that have none in the model.

    The usual parameters are fitted first; of the others, the one that is worth most joins, until none is worth it.
    """
    given, starts = nominal, _first_fits(windows, nominal, tuning)
    odd = _odd_with_any_limit(windows.with_integral(starts[-1][0].integral), starts[-1][0], tuning)
    sound = windows.select(np.setdiff1d(np.arange(windows.count), odd))
    few = thin_windows(sound, tuning.max_judged_windows)
    unstated = _find_unstated(few, nominal, tuning)
    if unstated is not None and _cost(unstated, tuning) < _cost(starts[-1][0], tuning):
        starts = [(unstated, nominal)]
    best, judged, nominal = _grow(few, *starts[0], tuning, barred)
    for another in starts[1:]:
        other, errors, own = _grow(few, *another, tuning, barred)
        if _cost(other, tuning) < _cost(best, tuning):
            best, judged, nominal = other, errors, own
    single = _with_one_difference(few, given, tuning)
    if single is not None and _cost(single, tuning) < _cost(best, tuning):
        best, judged, nominal = _grow(few, single, given, tuning, barred)
    few, base = few.with_integral(best.integral), fill_unknown(nominal)
    fit = fit_servo(sound.with_integral(best.integral), best.values, best.free, tuning.max_evaluations)
    gains = {number: _gain_of(few, best, number, (base, judged), tuning) for number in _differing(fit, base)}
    worth = {
        number: gain
        for number, gain in gains.items()
        if is_finding(gain, looks, tuning) and not is_hidden_by_encoder_steps(number, fit.values, base, sound)
    }
    free = np.isnan(nominal) & fit.free
    free[list(worth)] = True
    start = np.where(free | ~fit.free, fit.values, nominal)
    fewer = fit_servo(sound.with_integral(fit.integral), start, free, tuning.max_evaluations)
    predicts = _total(errors_on_other_half(few, start, free, tuning)) * (1 - tuning.min_gain) <= _total(judged)
    if predicts and _cost(fewer, tuning) <= _cost(fit, tuning):
        fit = fewer
    return ChosenServo(nominal, fit, best.free, worth, odd)


def _differing(fit: ServoFit, base: Array) -> list[int]:
    """Places of the free parameters that differ from the simulation by a standard error at least."""
    moved, error = np.abs(to_coordinates(fit.values) - to_coordinates(base)), fit.standard_errors()
    return [number for number in np.flatnonzero(fit.free).tolist() if not moved[number] < error[number]]


def _cost(fit: ServoFit, tuning: MotionTuning) -> float:
    """Of a fit: the logarithm of its squared error, with the price of its numbers."""
    return float(2 * np.log(max(fit.rms, 1e-300)) - np.log(1 - tuning.min_gain) * fit.free.sum())


def _find_unstated(windows: Windows, nominal: Array, tuning: MotionTuning) -> ServoFit | None:
    """The best fit with what the simulation does not state of the drive: a torque limit, an integral gain, or both."""
    limits = tuning.needed_limits if np.isinf(_stated_limit(nominal)) else ()
    rates = tuning.integral_rates if np.isnan(nominal[place("ki")]) else ()
    best, least = None, np.inf
    for unstated in dict.fromkeys([Unstated(limits), Unstated((), rates), Unstated(limits, rates)]):
        if unstated == Unstated():
            continue
        free = np.array(USUAL)
        free[[place("limit")]] |= bool(unstated.limits)
        free[[place("ki"), place("integral_limit")]] |= bool(unstated.rates)
        tried = replace(unstated, wound_up=tuning.wound_up_levels if unstated.rates else ())
        fit = find_start(windows, nominal, free, tuning, tried)
        if unstated.rates and not _integrates(fit, tuning):
            continue
        cost = _total(errors_on_other_half(windows.with_integral(fit.integral), fit.values, fit.free, tuning))
        if cost < (1 - tuning.min_gain) * least:
            best, least = fit, cost
    return best


def _integrates(fit: ServoFit, tuning: MotionTuning) -> bool:
    """Whether a fit has an integral gain: one that its windows tell, and that moves as that of a controller does.

    A slower one is an offset of each run, a faster one a friction.
    """
    gain, error = float(fit.values[place("ki")]), float(fit.standard_errors()[place("ki")])
    slowest, fastest = tuning.rate_bounds
    return bool(tuning.told * error < gain and slowest <= gain / fit.values[place("kp")] <= fastest)


def _with_one_difference(windows: Windows, nominal: Array, tuning: MotionTuning) -> ServoFit | None:
    """The best fit of one number with all others as the simulation has them, then with the usual ones free, too.

    Several wrong numbers may explain a motion as well as the right one. None where the simulation does not state all.
    """
    if np.isnan(nominal).any():
        return None
    fits = []
    for number in np.flatnonzero(np.array(USUAL) | np.array(OPTIONAL)).tolist():
        starts = [nominal] if USUAL[number] else first_guesses(windows, nominal, number, tuning)
        best = starts[int(np.argmin(np.sum(joint_errors(windows, np.stack(starts)) ** 2, axis=1)))]
        alone = np.zeros(len(nominal), dtype=bool)
        alone[number] = True
        fits.append(fit_servo(windows, best, alone, tuning.refit_evaluations))
    found = min(fits, key=lambda fit: fit.rms)
    return fit_servo(windows, found.values, found.free | np.array(USUAL), tuning.max_evaluations)


def _stated_limit(nominal: Array) -> float:
    """The torque limit of the simulation, infinite where it says nothing of the drive."""
    limit = float(fill_unknown(nominal)[place("limit")])
    return np.inf if np.isnan(nominal[place("kp")]) and limit >= INFINITE_LIMIT else limit


def _grow(
    windows: Windows, start: ServoFit, nominal: Array, tuning: MotionTuning, barred: Collection[int] = ()
) -> tuple[ServoFit, Array, Array]:
    """The fit from a start with all parameters that are worth a place; its errors on the other half, (samples,).

    The nominal numbers come back as they are.
    """
    windows = windows.with_integral(start.integral)
    base, unknown = fill_unknown(nominal), bool(np.isnan(nominal[place("kp")]))
    fit = fit_servo(windows, start.values, start.free, tuning.max_evaluations)
    judged = errors_on_other_half(windows, fit.values, fit.free, tuning)
    if unknown and fit.free[place("limit")]:
        fit, judged = _with_damping_inside(windows, fit, judged, base, tuning)
    waiting = [number for number in np.flatnonzero(np.array(OPTIONAL) & ~fit.free).tolist() if number not in barred]
    while waiting:
        windows = windows.with_integral(fit.integral)
        tried = {}
        for number, guess in _most_promising(windows, fit, waiting, tuning):
            more = _with_parameter(windows, fit, number, guess, tuning)
            if more.rms**2 <= (1 - tuning.min_gain) * fit.rms**2:
                tried[number] = more, errors_on_other_half(windows, more.values, more.free, tuning)
        gains = {number: gain_of(windows, judged, errors, tuning) for number, (_, errors) in tried.items()}
        if not gains:
            break
        best = max(gains, key=lambda number: gains[number].share)
        if gains[best].share < tuning.min_gain or gains[best].p_value > tuning.max_joining_p_value:
            break
        waiting.remove(best)
        if is_hidden_by_encoder_steps(best, tried[best][0].values, base, windows):
            continue
        fit, judged = tried[best]
        if best == place("limit") and unknown:
            fit, judged = _with_damping_inside(windows, fit, judged, base, tuning)
    return fit, judged, nominal


def first_fit(windows: Windows, nominal: Array, tuning: MotionTuning = DEFAULT) -> ServoFit:
    """The fit of the usual parameters."""
    return _first_fits(windows, nominal, tuning)[-1][0]


def _first_fits(windows: Windows, nominal: Array, tuning: MotionTuning) -> list[tuple[ServoFit, Array]]:
    """The fit of the usual parameters with the simulation's kd, and, where that is clearly better, one with all damping
    outside the drive.

    Each with the nominal numbers of which it is a change: the same sum of kd and damping, and the kd of the fit.
    """
    start, kd = find_start(windows, nominal, np.array(USUAL), tuning), nominal[place("kd")]
    if not kd:
        return [(start, nominal)]
    outside = nominal.copy()
    outside[[place("kd"), place("damping")]] = 0.0, nominal[place("damping")] + kd
    other = find_start(windows, outside, np.array(USUAL), tuning)
    if other.rms**2 >= (1 - tuning.min_gain) * start.rms**2:
        return [(start, nominal)]
    return [(start, nominal), (other, outside)]


def _with_limit(windows: Windows, fit: ServoFit, tuning: MotionTuning) -> ServoFit:
    """The fit with a torque limit that is free, too."""
    starts = first_guesses(windows, fit.values, place("limit"), tuning)
    best = starts[int(np.argmin(np.sum(joint_errors(windows, np.stack(starts)) ** 2, axis=1)))]
    free = fit.free.copy()
    free[place("limit")] = True
    return fit_servo(windows, best, free, tuning.refit_evaluations)


def find_odd_windows(windows: Windows, values: Array, tuning: MotionTuning = DEFAULT) -> NDArray[np.intp]:
    """Windows whose error is far above that of the others in which the joint moves: at most a tenth of them."""
    errors = joint_errors(windows, values)[0]
    sizes = np.sqrt(np.bincount(windows.window, errors**2) / np.diff(windows.begin))
    moving = np.ptp(windows.measured, axis=1) > tuning.min_motion
    if moving.sum() < tuning.min_windows_for_odd:
        return np.zeros(0, dtype=np.intp)
    odd = np.flatnonzero(sizes > tuning.odd_factor * np.median(sizes[moving]))
    return np.sort(odd[np.argsort(-sizes[odd])][: int(tuning.max_odd_share * windows.count)])


def _odd_with_any_limit(windows: Windows, fit: ServoFit, tuning: MotionTuning) -> NDArray[np.intp]:
    """Windows that are odd with a torque limit, too: a drive that pushes fully in a few windows is no contact."""
    odd = find_odd_windows(windows, fit.values, tuning)
    if len(odd) == 0:
        return odd
    spread = np.linspace(0, windows.count - 1, min(tuning.max_start_windows, windows.count)).astype(int)
    limited = _with_limit(windows.select(np.union1d(spread, odd)), fit, tuning)
    still = find_odd_windows(windows.with_integral(limited.integral), limited.values, tuning)
    return np.intersect1d(odd, still)


def _most_promising(
    windows: Windows, fit: ServoFit, waiting: list[int], tuning: MotionTuning
) -> list[tuple[int, Array]]:
    """The parameters that may be worth a place, each with a start from which it has a slope, (parameters,).

    They are those that a linear model of the errors gains most from: one replay of each start, and no fit.
    """
    starts = [(number, start) for number in waiting for start in first_guesses(windows, fit.values, number, tuning)]
    errors = joint_errors(windows, np.stack([fit.values, *(start for _, start in starts)]))
    slopes = np.linalg.qr(jacobian(windows, fit.values, fit.free))[0]
    left = errors[0] - slopes @ (slopes.T @ errors[0])
    columns = (errors[1:] - errors[0]).T
    columns = columns - slopes @ (slopes.T @ columns)
    sizes = np.linalg.norm(columns, axis=0)
    gains = np.abs(left @ columns) / np.where(sizes > 0, sizes, np.inf)
    enough = tuning.min_promise * tuning.min_gain * _total(errors[0])
    best: dict[int, Array] = {}
    for place_of in np.argsort(-gains).tolist():
        if gains[place_of] ** 2 > enough:
            best.setdefault(*starts[place_of])
    return list(best.items())[: tuning.tried_parameters]


def _with_parameter(windows: Windows, fit: ServoFit, number: int, start: Array, tuning: MotionTuning) -> ServoFit:
    """The fit with one parameter more."""
    free = fit.free.copy()
    free[number] = True
    return fit_servo(windows, start, free, tuning.refit_evaluations)


def _with_damping_inside(
    windows: Windows, fit: ServoFit, judged: Array, base: Array, tuning: MotionTuning
) -> tuple[ServoFit, Array]:
    """The same, or the fit of an unknown drive whose damping acts within its torque limit, where that is better.

    What the joint has beyond the simulation's damping goes into kd, again and again while that lowers the error.
    judged: errors on the other half. base: the simulation's numbers, with the damping of the joint.
    """
    for _ in range(tuning.damping_rounds):
        inside = with_damping_inside(fit.values, base)
        other = fit_servo(windows, inside, fit.free, tuning.refit_evaluations)
        errors = errors_on_other_half(windows, other.values, fit.free, tuning)
        if _total(errors) >= _total(judged):
            break
        fit, judged = other, errors
    return fit, judged


def is_hidden_by_encoder_steps(number: int, values: Array, base: Array, windows: Windows) -> bool:
    """Whether a difference from the simulation is one that the steps of the encoder make as well.

    A drive that reads its position in counts does not act on an error within a count either. And at each count its
    torque jumps, which shakes the joint loose: friction looks less than it is, by a part of what the drive makes of the
    noise of a step. values, base: (parameters,), fitted and of the simulation.
    """
    difference, step = abs(float(values[number] - base[number])), windows.encoder_step
    shaken = float(values[place("kp")]) * step / np.sqrt(12)
    if number == place("dead_band"):
        return bool(difference < step)
    if number == place("load_friction"):
        difference *= float(np.sqrt(np.mean(needed_torque(windows, 0.0)[-1] ** 2)))
    frictions: tuple[Key, ...] = ("friction", "static_excess", "load_friction")
    return bool(number in [place(key) for key in frictions] and difference < shaken)


def is_finding(gain: Gain, looks: int, tuning: MotionTuning = DEFAULT) -> bool:
    """Whether a gain matters, and is hardly chance. looks: number of tests in the diagnosis."""
    return gain.share > tuning.min_gain and gain.p_value * looks < tuning.max_p_value


def first_guesses(windows: Windows, values: Array, number: int, tuning: MotionTuning = DEFAULT) -> list[Array]:
    """Starts from which a parameter that was not fitted yet has a slope; a limit cuts a little or much."""
    starts = [float(values[number] + 2 * SCALE[number])]
    if number == place("limit"):
        starts = [
            level * min(float(values[number]), unsaturated_limit(windows, values)) for level in tuning.limit_levels
        ]
    guesses = np.tile(values, (len(starts), 1))
    guesses[:, number] = starts
    if number == place("static_excess"):
        guesses = np.tile(guesses, (len(tuning.stribeck_speeds), 1))
        guesses[:, place("stribeck_speed")] = tuning.stribeck_speeds
    return list(guesses)


def _halves(windows: Windows) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    numbers = np.arange(windows.count)
    return numbers[0::2], numbers[1::2]


def errors_on_other_half(windows: Windows, values: Array, free: NDArray[np.bool_], tuning: MotionTuning) -> Array:
    """Errors (samples,), rad, by parameters that were fitted on the other half of the windows."""
    errors = np.zeros(len(windows.position))
    first, second = _halves(windows)
    for train, test in ((first, second), (second, first)):
        halves = windows.select(train), windows.select(test)
        errors[np.isin(windows.window, test)] = learned_errors(halves, values, free, tuning)
    return errors


def learned_errors(
    halves: tuple[Windows, Windows], values: Array, free: NDArray[np.bool_], tuning: MotionTuning
) -> Array:
    """Errors (samples,) in the windows of the second half, rad, by parameters that were fitted on the first.

    What an integral holds at the start of a run is no parameter of the servo: it is settled where it is judged.
    """
    train, test = halves
    fitted = fit_servo(train, values, free, tuning.refit_evaluations, JUDGED_TOLERANCE)
    judged = settle(test.with_integral(fitted.integral), fitted.values)
    return np.asarray(joint_errors(judged, fitted.values)[0])


def window_squares(windows: Windows, errors: Array) -> Array:
    """Squared error of each window, (windows,), of errors (samples,)."""
    return np.bincount(windows.window, errors**2, windows.count).astype(float)


def _total(errors: Array) -> float:
    return float(np.sum(errors**2))


def _gain_of(windows: Windows, fit: ServoFit, number: int, known: tuple[Array, Array], tuning: MotionTuning) -> Gain:
    """What a fitted parameter is worth. known: the simulation's numbers; the errors (samples,) with the parameter."""
    base, judged = known
    if not np.isfinite(base[number]):
        return Gain(1.0, 0.0, np.inf, float(np.sqrt(np.mean(judged**2))))
    fixed, held = fit.free.copy(), fit.values.copy()
    fixed[number], held[number] = False, base[number]
    if number == place("damping"):  # of joint and drive together
        held[place("kd")] = base[place("kd")]
    return gain_of(windows, errors_on_other_half(windows, held, fixed, tuning), judged, tuning)


def gain_of(windows: Windows, without: Array, with_it: Array, tuning: MotionTuning = DEFAULT) -> Gain:
    """What a parameter is worth: errors without and with it, (samples,) each, learned on the other half."""
    gain = gain_over_windows(len(without), window_squares(windows, without), window_squares(windows, with_it))
    if gain.p_value > tuning.max_p_value:
        return gain
    return replace(gain, p_value=min(gain.p_value, chance_of_match(windows, without, with_it, tuning)))


def chance_of_match(windows: Windows, without: Array, with_it: Array, tuning: MotionTuning = DEFAULT) -> float:
    """P-value of no gain by the matched filter; errors without and with a parameter, (samples,) each."""
    change = without - with_it
    variance = float(correlated_variances(change[:, None], with_it, windows.window)[0])
    if variance <= 0:
        return 1.0
    size = float(change @ without) / (tuning.widening * np.sqrt(variance))
    return float(student.sf(size, max(windows.count - 1, 1)))


def chance_of_gain(difference: Array) -> float:
    """P-value of no gain by Wilcoxon's signed ranks (1945): few windows with large errors do not decide.

    difference: (windows,), squared error without a parameter minus that with it. Windows without a difference, in which
    the joint rests, say nothing; with them scipy would leave the exact distribution for the normal one.
    """
    told = difference[difference != 0]
    return float(wilcoxon(told, alternative="greater").pvalue) if len(told) else 1.0


def gain_over_windows(samples: int, without: Array, with_it: Array) -> Gain:
    """Squared errors of each window without and with a parameter, (windows,) each; samples: of all windows."""
    difference = without - with_it
    return Gain(
        share=float(difference.sum() / max(without.sum(), 1e-300)),
        p_value=chance_of_gain(difference),
        rms_without=float(np.sqrt(without.sum() / samples)),
        rms_with=float(np.sqrt(with_it.sum() / samples)),
    )
