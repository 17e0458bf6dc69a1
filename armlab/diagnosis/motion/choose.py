"""Which parameters of a servo differ from the simulation's, chosen on blocks of the runs that identify.

Even and odd windows take turns: parameters are fitted on one half and judged on the other. A parameter joins the model
where the model without it (the parameter at the value of the simulation) predicts the other half worse, by a share that
matters and hardly by chance. It is a finding where that holds after a correction for all tests.

Two tests say what chance does, and either may decide. Signed ranks of the windows need no assumption, and see little
where few windows tell much. A matched filter sees these: with d the change of the predictions by the
parameter, learned on the other half, and e the errors without it,

    z = sum d e / sqrt(sum_w sum_f |D_w(f)|^2 S(f))

S is the mean power spectrum of the errors with the parameter, widened as that of the intervals (see estimate.py). The
window that tells most is left out: nothing is found that shows in one window alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student
from scipy.stats import wilcoxon

from armlab.common.arrays import Array
from armlab.diagnosis.motion.encoder_steps import is_made_by_encoder_steps
from armlab.diagnosis.motion.estimate import (
    ServoFit,
    Unstated,
    begin_integrals,
    coordinate_scales,
    correlated_variances,
    fill_unknown,
    find_start,
    fit_servo,
    jacobian,
    least_gain,
    price_of_number,
    settle,
    thin_windows,
    to_coordinates,
    unsaturated_limit,
    with_damping_inside,
    with_nominal,
)
from armlab.diagnosis.motion.joint_replay import joint_errors
from armlab.diagnosis.motion.motion_tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.servo import (
    INFINITE_LIMIT,
    KEYS,
    LIMITS,
    OPTIONAL,
    UNSTATED,
    USUAL,
    place,
)
from armlab.diagnosis.motion.windows import Windows

LIMIT_SLOPE = place("limit_slope")
# Beside a wrong damping within the limit of a drive, a limit that falls with speed looks as damping outside it does. So
# it does not grow with the others: it is tried alone, beside what was chosen without it, and where calm windows refute.
GROWTH_CANDIDATES = tuple(
    number for number in range(len(KEYS)) if (OPTIONAL[number] or USUAL[number]) and number != LIMIT_SLOPE
)
TESTS_OF_GAIN = 2  # ranks and the matched filter, of which the better one counts
JUDGED_TOLERANCE = 1e-4  # of fits that are judged on the other half, where a gain of percents matters


@dataclass(frozen=True)
class GainOfNumber:
    """What one parameter is worth on windows that took no part.

    share: of the squared error without it; enough: the share that matters. p_value: of no gain, one-sided, by the
    better of two tests, not corrected. rms_without, rms_with: rad.
    """

    share: float
    enough: float
    p_value: float
    rms_without: float
    rms_with: float


@dataclass(frozen=True, eq=False)
class ChosenServo:
    """A joint's servo: a fit with the parameters that have a place in the model.

    nominal: numbers of the simulation, all damping outside the drive where the fit has it so. free: the parameters that
    were free when those that may be findings were judged; in `fit` the others have the numbers of the simulation where
    that explains as much. gains: what each parameter is worth that may be a finding, by its place in PARAMETERS. odd:
    windows that the servo of all others does not explain (contact, a lost command), left out of the fit. cost: the
    logarithm of its squared error on the other half, with the price of its numbers, when it was chosen.
    """

    nominal: Array
    fit: ServoFit
    free: NDArray[np.bool_]
    gains: dict[int, GainOfNumber]
    odd: NDArray[np.intp]
    cost: float

    @property
    def has_other_kd(self) -> bool:
        """Whether kd differs from the simulation's by more than the damping outside the drive does."""
        changes = np.abs(self.fit.values - self.nominal)
        return bool(changes[place("kd")] > changes[place("damping")])

    def beside_kd(self, stated: float) -> Array:
        """The numbers, (parameters,), with the kd that is stated, where another one was not found, and the same sum.

        This is the servo as findings tell it: the fit may have more of the damping outside the drive, which is the same
        where the force of the drive has no limit.
        """
        kd, damping, values = place("kd"), place("damping"), self.fit.values.copy()
        left = float(values[damping] + values[kd] - stated)
        unlimited = values[place("limit")] >= INFINITE_LIMIT
        if unlimited and kd not in self.gains and not self.has_other_kd and left >= 0:
            values[[kd, damping]] = stated, left
        return values

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

    def refitted(self, windows: Windows, tuning: MotionTuning = DEFAULT) -> "ChosenServo":
        """The same numbers, fitted anew in the windows with other loads."""
        sound, own = _without_odd(windows, self.odd), self.fit
        fit = fit_servo(sound.with_integral(own.integral), own.values, own.free, tuning.refit_evaluations)
        return replace(self, fit=fit)

    def without(self, number: int, windows: Windows, tuning: MotionTuning = DEFAULT) -> "ChosenServo":
        """The same with the number of the simulation at a place, and the others fitted anew in these windows."""
        values, free = with_nominal(self.fit, self.nominal, number)
        judged = self.free.copy()
        judged[number] = False
        fit = fit_servo(windows.with_integral(self.fit.integral), values, free, tuning.max_evaluations)
        gains = {other: gain for other, gain in self.gains.items() if other != number}
        return replace(self, fit=fit, free=judged, gains=gains)

    def with_damping_outside(self) -> "ChosenServo":
        """The same with a change of kd that `with_damping_inside` made in damping again."""
        kd, damping = place("kd"), place("damping")
        if damping not in self.gains or kd in self.gains or self.fit.values[kd] == self.nominal[kd]:
            return self
        values = self.fit.values.copy()
        values[[kd, damping]] = self.nominal[kd], values[damping] + values[kd] - self.nominal[kd]
        return replace(self, fit=replace(self.fit, values=values))

    def with_one_finding(self, number: int, windows: Windows, tuning: MotionTuning = DEFAULT) -> "ChosenServo":
        """One finding fitted anew, all other numbers as in the simulation; a number that it lacks stays free."""
        outside = self.with_damping_outside()
        single = replace(outside, gains={number: self.gains[number]})
        values, free = single.named
        lacking = np.isnan(self.nominal) & self.fit.free
        values = np.where(lacking, single.fit.values, values)
        sound = _without_odd(windows, self.odd).with_integral(self.fit.integral)
        single = replace(single, fit=fit_servo(sound, values, free | lacking, tuning.refit_evaluations))
        return single if outside is self else single.with_damping_inside() or single

    @property
    def named(self) -> tuple[Array, NDArray[np.bool_]]:
        """The numbers of the simulation with those in their place that may be findings; which these are.

        Static friction has the speed at which it was found.
        """
        free = np.zeros(len(self.nominal), dtype=bool)
        free[list(self.gains)] = True
        found = free.copy()
        found[place("stribeck_speed")] = free[place("static_excess")]
        return np.where(found, self.fit.values, fill_unknown(self.nominal)), free


def choose_servo(
    windows: Windows,
    nominal: Array,
    looks: int,
    tuning: MotionTuning = DEFAULT,
    start: Array | None = None,
) -> ChosenServo:
    """The servo of one joint. nominal: (parameters,), NaN where unknown. looks: number of tests in the diagnosis.

    start: numbers, (parameters,), that `first_fit` found in windows with nearly the same loads; without them they are
    searched here.

    The usual parameters are fitted first; of the others, the one that is worth most joins, until none is worth it.
    Where something is found, the same begins once more with the one number that explains most alone. The end that costs
    less counts, and a limit that falls with speed may join it.
    """
    starts = _start_fits(windows, nominal, start, tuning)
    first = _cheapest(starts, tuning)
    odd = _odd_with_any_limit(windows.with_integral(first.integral), first, nominal, tuning)
    few = thin_windows(_without_odd(windows, odd), tuning.max_judged_windows)
    grown = [(*_grow(few, fit, base, tuning), base) for fit, base in starts]
    best, judged, base = min(grown, key=lambda each: _cost(each[0], tuning))
    chosen = _judge(windows, (best, judged), (base, odd), looks, tuning)
    single = _with_one_difference(few, nominal, tuning) if chosen.gains else None
    if single is None:
        return chosen
    other = _judge(windows, _grow(few, single, nominal, tuning), (nominal, odd), looks, tuning)
    chosen = min(chosen, other, key=lambda each: each.cost)
    if chosen.fit.free[LIMIT_SLOPE]:
        return chosen
    falling = _grow(few, chosen.fit, chosen.nominal, tuning, (LIMIT_SLOPE,))
    if not falling[0].free[LIMIT_SLOPE]:
        return chosen
    return min(chosen, _judge(windows, falling, (chosen.nominal, odd), looks, tuning), key=lambda each: each.cost)


def judge_again(windows: Windows, chosen: ChosenServo, looks: int, tuning: MotionTuning = DEFAULT) -> ChosenServo:
    """A servo whose free parameters have become fewer, fitted and judged with those that are left."""
    few = thin_windows(_without_odd(windows, chosen.odd), tuning.max_judged_windows)
    few = few.with_integral(chosen.fit.integral)
    fit = fit_servo(few, chosen.fit.values, chosen.free, tuning.max_evaluations)
    judged = errors_on_other_half(few, fit.values, fit.free, tuning)
    return _judge(windows, (fit, judged), (chosen.nominal, chosen.odd), looks, tuning)


def choose_limits(windows: Windows, chosen: ChosenServo, looks: int, tuning: MotionTuning = DEFAULT) -> ChosenServo:
    """The same findings, fitted anew in other windows, and the torque limits that are worth a place there."""
    few = thin_windows(_without_odd(windows, chosen.odd), tuning.max_judged_windows)
    free = np.zeros(len(chosen.nominal), dtype=bool)
    free[list(chosen.gains)] = True
    start = fit_servo(few.with_integral(chosen.fit.integral), chosen.named[0], free, tuning.max_evaluations)
    grown = _grow(few, start, chosen.nominal, tuning, LIMITS)
    return _judge(windows, grown, (chosen.nominal, chosen.odd), looks, tuning)


def _judge(
    windows: Windows,
    found: tuple[ServoFit, Array],
    given: tuple[Array, NDArray[np.intp]],
    looks: int,
    tuning: MotionTuning,
) -> ChosenServo:
    """A servo with what each of its parameters is worth. What is no finding gets the number of the simulation.

    Static friction refines Coulomb friction, and each may stand for the other: where it is no finding, it leaves, and
    the others are judged without it.

    found: a fit, and its errors on the other half of some windows. given: numbers of the simulation, and odd windows.
    """
    (best, judged), (nominal, odd) = found, given
    sound, base, static = _without_odd(windows, odd), fill_unknown(nominal), place("static_excess")
    few = thin_windows(sound, tuning.max_judged_windows).with_integral(best.integral)
    fit = fit_servo(sound.with_integral(best.integral), best.values, best.free, tuning.max_evaluations)
    gains = {number: _gain_of(few, best, number, (base, judged), tuning) for number in _differing(fit, base)}
    worth = {
        number: gain
        for number, gain in gains.items()
        if is_finding(gain, looks, tuning) and not is_made_by_encoder_steps(few, fit, number, base, tuning)
    }
    if best.free[static] and static not in worth:
        best = fit_servo(few, *with_nominal(best, base, static), tuning.max_evaluations)
        judged = errors_on_other_half(few.with_integral(best.integral), best.values, best.free, tuning)
        return _judge(windows, (best, judged), given, looks, tuning)
    free = np.isnan(nominal) & fit.free
    free[list(worth)] = True
    start = np.where(free | ~fit.free, fit.values, nominal)
    fewer = fit_servo(sound.with_integral(fit.integral), start, free, tuning.max_evaluations)
    others = _total(errors_on_other_half(few, start, free, tuning))
    predicts = others * (1 - least_gain(fit.rms**2, fit.noise, tuning)) <= _total(judged)
    left = _total(judged)
    if predicts and _cost(fewer, tuning) <= _cost(fit, tuning):
        fit, left = fewer, others
    price = price_of_number(fit.rms**2, fit.noise, tuning)
    cost = float(np.log(max(left, 1e-300)) + price * fit.free.sum())
    return ChosenServo(nominal, fit, best.free, worth, odd, cost)


def _without_odd(windows: Windows, odd: NDArray[np.intp]) -> Windows:
    return windows.select(np.setdiff1d(np.arange(windows.count), odd))


def _differing(fit: ServoFit, base: Array) -> list[int]:
    """Places of the free parameters that differ from the simulation by a standard error at least."""
    moved, error = np.abs(to_coordinates(fit.values) - to_coordinates(base)), fit.standard_errors()
    return [number for number in np.flatnonzero(fit.free).tolist() if not moved[number] < error[number]]


def _cost(fit: ServoFit, tuning: MotionTuning) -> float:
    """Of a fit: the logarithm of its squared error, with the price of its numbers."""
    price = price_of_number(fit.rms**2, fit.noise, tuning)
    return float(2 * np.log(max(fit.rms, 1e-300)) + price * fit.free.sum())


def _find_unstated(windows: Windows, nominal: Array, tuning: MotionTuning) -> ServoFit | None:
    """The best fit with what the simulation does not state of the drive: a torque limit, an integral gain, or both."""
    limited = Unstated(limits=() if _states_limit(nominal) else tuning.needed_limits)
    inside = replace(limited, inside=bool(limited.limits) and not nominal[place("kd")])
    integrating = Unstated()
    if np.isnan(nominal[place("ki")]):
        integrating = Unstated(rates=tuning.integral_rates, wound_up=tuning.wound_up_levels)
    both = replace(inside, rates=integrating.rates, wound_up=integrating.wound_up)
    few, best, least = thin_windows(windows, tuning.wanted_windows), None, np.inf
    for unstated in dict.fromkeys((limited, inside, integrating, both)):
        if unstated == Unstated():
            continue
        free = np.array(USUAL)
        free[place("limit")] |= bool(unstated.limits)
        if unstated.inside:
            free[place("kd")], free[place("damping")] = True, False
        free |= np.array(UNSTATED) & bool(unstated.rates)
        fit = find_start(few, nominal, free, tuning, unstated)
        if unstated.rates and not _integrates(fit, tuning):
            continue
        cost = _total(errors_on_other_half(few.with_integral(fit.integral), fit.values, fit.free, tuning))
        if cost < (1 - least_gain(fit.rms**2, fit.noise, tuning)) * least:
            best, least = fit, cost
    if best is None:
        return None
    return fit_servo(windows.with_integral(best.integral), best.values, best.free, tuning.max_evaluations)


def _integrates(fit: ServoFit, tuning: MotionTuning) -> bool:
    """Whether a fit has an integral gain: one that its windows tell, and that moves as that of a controller does.

    A slower one is an offset of each run, a faster one a friction.
    """
    gain, error = float(fit.values[place("ki")]), float(fit.standard_errors()[place("ki")])
    slowest, fastest = tuning.rate_bounds
    return bool(tuning.class_factor * error < gain and slowest <= gain / fit.values[place("kp")] <= fastest)


def _with_one_difference(windows: Windows, nominal: Array, tuning: MotionTuning) -> ServoFit | None:
    """The best fit of one number with all others as the simulation has them, then with the usual ones free, too.

    Several wrong numbers may explain a motion as well as the right one. kd is one of them where it explains more than
    damping in the joint does. None where the simulation does not state all.
    """
    if np.isnan(nominal).any():
        return None
    alone = {}
    tried = np.array(USUAL) | np.array(OPTIONAL)
    tried[place("kd")] = nominal[place("kd")] > 0
    for number in np.flatnonzero(tried).tolist():
        starts = first_guesses(windows, nominal, number, tuning) if OPTIONAL[number] else [nominal]
        best = starts[int(np.argmin(np.sum(joint_errors(windows, np.stack(starts)) ** 2, axis=1)))]
        free = np.zeros(len(nominal), dtype=bool)
        free[number] = True
        alone[number] = fit_servo(windows, best, free, tuning.refit_evaluations)
    kd, damping = alone.get(place("kd")), alone[place("damping")]
    if kd is not None and kd.rms**2 > (1 - least_gain(damping.rms**2, damping.noise, tuning)) * damping.rms**2:
        del alone[place("kd")]
    found = min(alone.values(), key=lambda fit: fit.rms)
    free = found.free | np.array(USUAL)
    free[place("damping")] = not found.free[place("kd")]
    return fit_servo(windows, found.values, free, tuning.max_evaluations)


def _states_limit(nominal: Array) -> bool:
    """Whether the simulation says something of the torque limit: of a drive that it knows, it does."""
    return not np.isnan(nominal[place("kp")]) or bool(fill_unknown(nominal)[place("limit")] < INFINITE_LIMIT)


def _grow(
    windows: Windows,
    start: ServoFit,
    nominal: Array,
    tuning: MotionTuning,
    candidates: Sequence[int] = GROWTH_CANDIDATES,
) -> tuple[ServoFit, Array]:
    """The fit from a start with all candidates that are worth a place; its errors on the other half, (samples,)."""
    windows = windows.with_integral(start.integral)
    base = fill_unknown(nominal)
    fit = fit_servo(windows, start.values, start.free, tuning.max_evaluations)
    judged = errors_on_other_half(windows, fit.values, fit.free, tuning)
    waiting = [number for number in candidates if not fit.free[number]]
    while waiting:
        windows = windows.with_integral(fit.integral)
        promising = _most_promising(windows, fit, waiting, tuning)
        fits = {number: _with_parameter(windows, fit, number, guess, nominal, tuning) for number, guess in promising}
        tried = {
            number: (more, errors_on_other_half(windows, more.values, more.free, tuning))
            for number, more in sorted(fits.items(), key=lambda each: each[1].rms)[: tuning.judged_parameters]
            if more.rms**2 <= (1 - least_gain(fit.rms**2, fit.noise, tuning)) * fit.rms**2
        }
        gains = {number: gain_of(windows, judged, errors, fit.noise, tuning) for number, (_, errors) in tried.items()}
        if not gains:
            break
        best = max(gains, key=lambda number: gains[number].share)
        if gains[best].share < gains[best].enough or gains[best].p_value > tuning.max_joining_p_value:
            break
        waiting.remove(best)
        if is_made_by_encoder_steps(windows, tried[best][0], best, base, tuning):
            continue
        fit, judged = tried[best]
    return fit, judged


def first_fit(windows: Windows, nominal: Array, tuning: MotionTuning = DEFAULT) -> ServoFit:
    """The fit of the usual parameters, and of what the simulation does not state of the drive."""
    return _cheapest(_start_fits(windows, nominal, None, tuning), tuning)


def _cheapest(starts: Sequence[tuple[ServoFit, Array]], tuning: MotionTuning) -> ServoFit:
    return min((fit for fit, _ in starts), key=lambda fit: _cost(fit, tuning))


def _start_fits(
    windows: Windows, nominal: Array, start: Array | None, tuning: MotionTuning
) -> list[tuple[ServoFit, Array]]:
    """The fit of the usual parameters with the simulation's kd, and, where that is clearly better, one with all damping
    outside the drive. Or one with what the simulation does not state of the drive.

    Each with the nominal numbers of which it is a change: the same sum of kd and damping, and the kd of the fit. start:
    as in `choose_servo`.
    """
    kd, outside = float(nominal[place("kd")]), nominal.copy()
    outside[[place("kd"), place("damping")]] = 0.0, nominal[place("damping")] + kd
    bases = [nominal, outside] if kd else [nominal]
    if start is None:
        fits = [(find_start(windows, base, np.array(USUAL), tuning), base) for base in bases]
        unstated = _find_unstated(windows, nominal, tuning)
        if unstated is not None and _cost(unstated, tuning) < _cost(fits[0][0], tuning):
            return [(unstated, nominal)]
    else:
        fits = [(_fit_from(windows, start, base, tuning), base) for base in bases]
        if fits[0][0].free[place("limit")] and not kd:
            moved = _with_damping_moved(start, nominal)
            return [min(fits[0], (_fit_from(windows, moved, nominal, tuning), nominal), key=lambda each: each[0].rms)]
    first, last = fits[0][0], fits[-1][0]
    clearly = last.rms**2 < (1 - least_gain(first.rms**2, first.noise, tuning)) * first.rms**2
    return fits if clearly else fits[:1]


def _with_damping_moved(start: Array, nominal: Array) -> Array:
    """The same with the damping that is in the drive outside it, or the other way round."""
    kd, damping = place("kd"), place("damping")
    if not start[kd]:
        return with_damping_inside(start, nominal)
    moved = start.copy()
    moved[[kd, damping]] = 0.0, start[kd] + start[damping]
    return moved


def _fit_from(windows: Windows, start: Array, nominal: Array, tuning: MotionTuning) -> ServoFit:
    """The fit of what is `free_at_first`, from numbers, (parameters,); the others are those of the simulation."""
    kd, damping = place("kd"), place("damping")
    free = free_at_first(start, nominal)
    values = np.where(free, start, fill_unknown(nominal))
    if free[damping]:
        values[damping] = max(float(start[kd] + start[damping] - values[kd]), 0.0)
    return fit_servo(begin_integrals(windows, values), values, free, tuning.max_evaluations)


def free_at_first(start: Array, nominal: Array) -> NDArray[np.bool_]:
    """The usual parameters, and those of a start, (parameters,), that the simulation does not state of the drive."""
    free, kd = np.array(USUAL), place("kd")
    differs = start != fill_unknown(nominal)
    if not _states_limit(nominal):
        free[place("limit")] = differs[place("limit")]
        free[kd] = differs[kd] and not nominal[kd]
        free[place("damping")] = not free[kd]
    if np.isnan(nominal[place("ki")]):
        free |= np.array(UNSTATED) & differs[place("ki")]
    return free


def find_odd_windows(windows: Windows, values: Array, tuning: MotionTuning = DEFAULT) -> NDArray[np.intp]:
    """Windows whose error is far above that of the others in which the joint moves: at most a tenth of them."""
    errors = joint_errors(windows, values)[0]
    sizes = np.sqrt(np.bincount(windows.window, errors**2) / np.diff(windows.begin))
    moving = np.ptp(windows.measured, axis=1) > tuning.min_motion
    if not moving.any():
        return np.zeros(0, dtype=np.intp)
    odd = np.flatnonzero(sizes > tuning.odd_factor * np.median(sizes[moving]))
    return np.sort(odd[np.argsort(-sizes[odd])][: int(tuning.max_odd_share * windows.count)])


def _odd_with_any_limit(windows: Windows, fit: ServoFit, nominal: Array, tuning: MotionTuning) -> NDArray[np.intp]:
    """Windows that are odd with a torque limit, too: a drive that pushes fully in a few windows is no contact."""
    odd = find_odd_windows(windows, fit.values, tuning)
    if len(odd) == 0:
        return odd
    spread = np.linspace(0, windows.count - 1, min(tuning.wanted_windows, windows.count)).astype(int)
    few = windows.select(np.union1d(spread, odd))
    starts = first_guesses(few, fit.values, place("limit"), tuning)
    best = starts[int(np.argmin(np.sum(joint_errors(few, np.stack(starts)) ** 2, axis=1)))]
    limited = _with_parameter(few, fit, place("limit"), best, nominal, tuning)
    still = find_odd_windows(windows.with_integral(limited.integral), limited.values, tuning)
    return np.intersect1d(odd, still)


def _most_promising(
    windows: Windows, fit: ServoFit, waiting: list[int], tuning: MotionTuning
) -> list[tuple[int, Array]]:
    """The parameters that may be worth a place, each with a start from which it has a slope, (parameters,).

    They are those that a linear model of the errors gains most from, and start where it ends: one replay of each, and
    no fit. A torque limit starts at its guess, because errors are not linear in it.
    """
    starts = [(number, start) for number in waiting for start in first_guesses(windows, fit.values, number, tuning)]
    errors = joint_errors(windows, np.stack([fit.values, *(start for _, start in starts)]))
    slopes = np.linalg.qr(jacobian(windows, fit.values, fit.free))[0]
    left = errors[0] - slopes @ (slopes.T @ errors[0])
    columns = (errors[1:] - errors[0]).T
    columns = columns - slopes @ (slopes.T @ columns)
    sizes = np.linalg.norm(columns, axis=0)
    sizes = np.where(sizes > 0, sizes, np.inf)
    gains, shares = np.abs(left @ columns) / sizes, np.clip(-(left @ columns) / sizes**2, -1, 1)
    enough = tuning.min_promise * least_gain(fit.rms**2, fit.noise, tuning) * _total(errors[0])
    best: dict[int, Array] = {}
    for place_of in np.argsort(-gains).tolist():
        number, start = starts[place_of]
        if gains[place_of] ** 2 > enough:
            share = 1.0 if number == place("limit") else shares[place_of]
            best.setdefault(number, fit.values + share * (start - fit.values))
    return list(best.items())[: tuning.tried_parameters]


def _with_parameter(
    windows: Windows, fit: ServoFit, number: int, start: Array, nominal: Array, tuning: MotionTuning
) -> ServoFit:
    """The fit with one parameter more.

    nominal: numbers of the simulation. A torque limit may act on the damping of a drive of which nothing is stated.
    """
    free = fit.free.copy()
    free[number] = True
    fits = [fit_servo(windows, start, free, tuning.refit_evaluations)]
    if number == place("limit") and not _states_limit(nominal) and not (free[place("kd")] or nominal[place("kd")]):
        free[place("kd")], free[place("damping")] = True, False
        fits.append(fit_servo(windows, with_damping_inside(start, nominal), free, tuning.refit_evaluations))
    return min(fits, key=lambda each: each.rms)


def is_finding(gain: GainOfNumber, looks: int, tuning: MotionTuning = DEFAULT) -> bool:
    """Whether a gain matters, and is hardly chance. looks: number of tests in the diagnosis."""
    return gain.share > gain.enough and gain.p_value * TESTS_OF_GAIN * looks < tuning.max_p_value


def first_guesses(windows: Windows, values: Array, number: int, tuning: MotionTuning = DEFAULT) -> list[Array]:
    """Starts from which a parameter that was not fitted yet has a slope; a limit cuts a little or much."""
    starts = [float(values[number] + 2 * coordinate_scales(windows, values)[number])]
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


def _gain_of(
    windows: Windows, fit: ServoFit, number: int, known: tuple[Array, Array], tuning: MotionTuning
) -> GainOfNumber:
    """What a fitted parameter is worth. known: the simulation's numbers; the errors (samples,) with the parameter."""
    base, judged = known
    if not np.isfinite(base[number]):
        return GainOfNumber(1.0, tuning.min_gain, 0.0, np.inf, float(np.sqrt(np.mean(judged**2))))
    held, fixed = with_nominal(fit, base, number)
    return gain_of(windows, errors_on_other_half(windows, held, fixed, tuning), judged, fit.noise, tuning)


def gain_of(
    windows: Windows, without: Array, with_it: Array, noise: float, tuning: MotionTuning = DEFAULT
) -> GainOfNumber:
    """What a parameter is worth: errors without and with it, (samples,) each, learned on the other half; noise: of
    reading, rad."""
    squares = [window_squares(windows, errors) for errors in (without, with_it)]
    match = chance_of_match(windows.window, without, with_it, noise)
    before, after = (float(np.mean(errors**2)) for errors in (without, with_it))
    return GainOfNumber(
        share=1 - after / max(before, 1e-300),
        enough=least_gain(before, noise, tuning),
        p_value=min(chance_of_gain(squares[0] - squares[1]), match),
        rms_without=float(np.sqrt(before)),
        rms_with=float(np.sqrt(after)),
    )


def chance_of_match(window: NDArray[np.intp], without: Array, with_it: Array, noise: float) -> float:
    """P-value of no gain by the matched filter, without the window that tells most.

    window: of each sample, (samples,). without, with_it: errors without and with a parameter, (samples,) each. noise:
    of the encoder, in the same unit.
    """
    change = without - with_it
    told = np.bincount(window, change * without)
    change = np.where(window == int(np.argmax(told)), 0.0, change)
    variance = float(correlated_variances(change[:, None], with_it, window, noise)[0])
    if variance <= 0:
        return 1.0
    return float(student.sf(float(change @ without) / np.sqrt(variance), max(len(told) - 1, 1)))


def chance_of_gain(difference: Array) -> float:
    """P-value of no gain by Wilcoxon's signed ranks (1945): few windows with large errors do not decide.

    difference: (windows,), squared error without a parameter minus that with it. Windows without a difference, in which
    the joint rests, say nothing; with them scipy would leave the exact distribution for the normal one.
    """
    told = difference[difference != 0]
    return float(wilcoxon(told, alternative="greater").pvalue) if len(told) else 1.0
