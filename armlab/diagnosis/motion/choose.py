"""Which parameters of a servo differ from the simulation's, chosen on blocks of the runs that identify.

Even and odd windows take turns: parameters are fitted on one half and judged on the other. A parameter joins the model
where the model without it (the parameter at the value of the simulation) predicts the other half worse, by a share that
matters and hardly by chance. It is a finding where that holds after a correction for all tests.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import wilcoxon

from armlab.common.arrays import Array
from armlab.diagnosis.motion.estimate import (
    ServoFit,
    fill_unknown,
    find_start,
    fit_servo,
    jacobian,
    settle,
    thin_windows,
    unsaturated_limit,
    with_damping_inside,
)
from armlab.diagnosis.motion.joint_replay import joint_errors
from armlab.diagnosis.motion.servo import INFINITE_LIMIT, OPTIONAL, PARAMETERS, SCALE, USUAL, Key, place
from armlab.diagnosis.motion.tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.windows import Windows


@dataclass(frozen=True)
class Gain:
    """What one parameter is worth on windows that took no part. share: of the squared error without it; p_value: of
    no gain, one-sided, over windows, not corrected. rms_without, rms_with: rad."""

    share: float
    p_value: float
    rms_without: float
    rms_with: float


@dataclass(frozen=True, eq=False)
class ChosenServo:
    """A joint's servo: a fit with the parameters that have a place in the model.

    nominal: numbers of the simulation, all damping outside the drive where the fit has it so.
    gains: what each parameter is worth that may be a finding, by its place in PARAMETERS. odd: windows that the servo
    of all others does not explain (contact, a lost command), left out of the fit.
    """

    nominal: Array
    fit: ServoFit
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

    @property
    def named(self) -> tuple[Array, NDArray[np.bool_]]:
        """The numbers of the simulation with those in their place that may be findings; which these are."""
        free = np.zeros(len(self.nominal), dtype=bool)
        free[list(self.gains)] = True
        return np.where(free, self.fit.values, fill_unknown(self.nominal)), free


def choose_servo(windows: Windows, nominal: Array, looks: int, tuning: MotionTuning = DEFAULT) -> ChosenServo:
    """The servo of one joint. nominal: (parameters,), NaN where unknown. looks: number of tests in the diagnosis.

    The usual parameters are fitted first; of the others, the one that is worth most joins, until none is worth it.
    """
    start, nominal = _choose_damping(windows, nominal, np.array(USUAL), tuning)
    base = fill_unknown(nominal)
    windows = windows.with_integral(start.integral)
    odd = _odd_with_any_limit(windows, start, tuning)
    sound = windows.select(np.setdiff1d(np.arange(windows.count), odd))
    few = thin_windows(sound, tuning.max_judged_windows)
    fit, judged = _grow(few, start, nominal, tuning)
    if tuning.needed_limits and np.isnan(nominal[place("kp")]) and base[place("limit")] >= INFINITE_LIMIT:
        limited = find_start(few, nominal, _with(np.array(USUAL), "limit"), tuning, tuning.needed_limits)
        other, errors = _grow(few, limited, nominal, tuning)
        if errors.sum() < (1 - tuning.min_gain) * judged.sum():
            fit, judged = other, errors
    gains = {number: _gain_of(few, fit, number, (base, judged), tuning) for number in np.flatnonzero(fit.free).tolist()}
    last = fit_servo(sound, fit.values, fit.free, tuning.max_evaluations)
    worth = {
        number: gain
        for number, gain in gains.items()
        if is_finding(gain, looks, tuning)
        and not is_hidden_by_encoder_steps(number, float(last.values[number] - base[number]), sound)
    }
    return ChosenServo(nominal, last, worth, odd)


def _grow(windows: Windows, start: ServoFit, nominal: Array, tuning: MotionTuning) -> tuple[ServoFit, Array]:
    """The fit from a start with all parameters that are worth a place; its squared error of each window, (windows,)."""
    base, unknown = fill_unknown(nominal), bool(np.isnan(nominal[place("kp")]))
    fit = fit_servo(windows, start.values, start.free, tuning.max_evaluations)
    judged = errors_on_other_half(windows, fit.values, fit.free, tuning)
    if unknown and fit.free[place("limit")]:
        fit, judged = _with_damping_inside(windows, fit, judged, base, tuning)
    waiting = np.flatnonzero(np.array(OPTIONAL) & ~fit.free).tolist()
    while waiting:
        promising = _most_promising(windows, fit, waiting, tuning)[: tuning.tried_parameters]
        tried = {number: _with_parameter(windows, fit, number, guess, tuning) for number, guess in promising}
        samples = len(windows.position)
        gains = {number: gain_over_windows(samples, judged, errors) for number, (_, errors) in tried.items()}
        best = max(gains, key=lambda number: gains[number].share)
        if gains[best].share < tuning.min_gain or gains[best].p_value > tuning.max_joining_p_value:
            break
        waiting.remove(best)
        if is_hidden_by_encoder_steps(best, float(tried[best][0].values[best] - base[best]), windows):
            continue
        fit, judged = tried[best]
        if best == place("limit") and unknown:
            fit, judged = _with_damping_inside(windows, fit, judged, base, tuning)
    return fit, judged


def _with(free: NDArray[np.bool_], key: Key) -> NDArray[np.bool_]:
    more = free.copy()
    more[place(key)] = True
    return more


def first_fit(windows: Windows, nominal: Array, tuning: MotionTuning = DEFAULT) -> ServoFit:
    """The fit of the usual parameters."""
    return _choose_damping(windows, nominal, np.array(USUAL), tuning)[0]


def _choose_damping(
    windows: Windows, nominal: Array, free: NDArray[np.bool_], tuning: MotionTuning
) -> tuple[ServoFit, Array]:
    """The first fit, with the simulation's kd or, where that is clearly better, with all damping outside the drive.

    The nominal numbers that come back have the same sum of kd and damping, and the kd of the fit.
    """
    start = find_start(windows, nominal, free, tuning)
    kd = nominal[place("kd")]
    if not kd:
        return start, nominal
    outside = nominal.copy()
    outside[[place("kd"), place("damping")]] = 0.0, nominal[place("damping")] + kd
    other = find_start(windows, outside, free, tuning)
    if other.rms**2 < (1 - tuning.min_gain) * start.rms**2:
        return other, outside
    return start, nominal


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
    few = windows.select(np.union1d(spread, odd))
    starts = first_guesses(few, fit.values, place("limit"), tuning)
    best = starts[int(np.argmin(np.sum(joint_errors(few, np.stack(starts)) ** 2, axis=1)))]
    free = fit.free.copy()
    free[place("limit")] = True
    limited = fit_servo(few, best, free, tuning.refit_evaluations)
    still = find_odd_windows(windows.with_integral(limited.integral), limited.values, tuning)
    return np.intersect1d(odd, still)


def _most_promising(
    windows: Windows, fit: ServoFit, waiting: list[int], tuning: MotionTuning
) -> list[tuple[int, Array]]:
    """The parameters, each with a start from which it has a slope, (parameters,).

    First come those that a linear model of the errors gains most from: one replay of each start, and no fit.
    """
    windows = windows.with_integral(fit.integral)
    starts = [(number, start) for number in waiting for start in first_guesses(windows, fit.values, number, tuning)]
    errors = joint_errors(windows, np.stack([fit.values, *(start for _, start in starts)]))
    slopes = np.linalg.qr(jacobian(windows, fit.values, fit.free))[0]
    left = errors[0] - slopes @ (slopes.T @ errors[0])
    columns = (errors[1:] - errors[0]).T
    columns = columns - slopes @ (slopes.T @ columns)
    sizes = np.linalg.norm(columns, axis=0)
    gains = np.abs(left @ columns) / np.where(sizes > 0, sizes, np.inf)
    best: dict[int, Array] = {}
    for place_of in np.argsort(-gains).tolist():
        best.setdefault(*starts[place_of])
    return list(best.items())


def _with_parameter(
    windows: Windows, fit: ServoFit, number: int, start: Array, tuning: MotionTuning
) -> tuple[ServoFit, Array]:
    """The fit with one parameter more, and its squared error of each window, learned on the other half."""
    free = fit.free.copy()
    free[number] = True
    more = fit_servo(windows, start, free, tuning.refit_evaluations)
    return more, errors_on_other_half(windows, more.values, free, tuning)


def _with_damping_inside(
    windows: Windows, fit: ServoFit, judged: Array, base: Array, tuning: MotionTuning
) -> tuple[ServoFit, Array]:
    """The same, or the fit of an unknown drive whose damping acts within its torque limit, where that is better.

    What the joint has beyond the simulation's damping goes into kd, again and again while that lowers the error.
    judged: squared error of each window. base: the simulation's numbers, with the damping of the joint.
    """
    for _ in range(tuning.damping_rounds):
        inside = with_damping_inside(fit.values, base)
        other = fit_servo(windows, inside, fit.free, tuning.refit_evaluations)
        errors = errors_on_other_half(windows, other.values, fit.free, tuning)
        if errors.sum() >= judged.sum():
            break
        fit, judged = other, errors
    return fit, judged


def is_hidden_by_encoder_steps(number: int, difference: float, windows: Windows) -> bool:
    """Whether a difference from the simulation is one that the steps of the encoder make as well, and below a step.

    A drive that reads its position in counts does not act on an error within a count either.
    """
    return PARAMETERS[number].hidden_by_encoder_steps and abs(difference) < windows.encoder_step


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
    out = []
    for start in starts:
        guess = values.copy()
        guess[number] = start
        out.append(guess)
    return out


def _halves(windows: Windows) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    numbers = np.arange(windows.count)
    return numbers[0::2], numbers[1::2]


def errors_on_other_half(windows: Windows, values: Array, free: NDArray[np.bool_], tuning: MotionTuning) -> Array:
    """Squared error of each window, (windows,), by parameters that were fitted on the other half."""
    squares = np.zeros(windows.count)
    first, second = _halves(windows)
    for train, test in ((first, second), (second, first)):
        squares[test] = learned_errors((windows.select(train), windows.select(test)), values, free, tuning)
    return squares


def learned_errors(
    halves: tuple[Windows, Windows], values: Array, free: NDArray[np.bool_], tuning: MotionTuning
) -> Array:
    """Squared error of each window of the second half, by parameters that were fitted on the first.

    What an integral holds at the start of a run is no parameter of the servo: it is settled where it is judged.
    """
    train, test = halves
    fitted = fit_servo(train, values, free, tuning.refit_evaluations)
    judged = settle(test.with_integral(fitted.integral), fitted.values)
    errors = joint_errors(judged, fitted.values)[0]
    return np.bincount(judged.window, errors**2, judged.count).astype(float)


def _gain_of(windows: Windows, fit: ServoFit, number: int, known: tuple[Array, Array], tuning: MotionTuning) -> Gain:
    """What a fitted parameter is worth. known: the simulation's numbers; squared error of each window with it."""
    base, judged = known
    if not np.isfinite(base[number]):
        return gain_over_windows(len(windows.position), np.full(windows.count, np.inf), judged)
    fixed, held = fit.free.copy(), fit.values.copy()
    fixed[number], held[number] = False, base[number]
    if number == place("damping"):  # of joint and drive together
        held[place("kd")] = base[place("kd")]
    return gain_over_windows(len(windows.position), errors_on_other_half(windows, held, fixed, tuning), judged)


def chance_of_gain(difference: Array) -> float:
    """P-value of no gain by Wilcoxon's signed ranks (1945): few windows with large errors do not decide.

    difference: (windows,), squared error without a parameter minus that with it. Windows without a difference, in which
    the joint rests, say nothing; with them scipy would leave the exact distribution for the normal one.
    """
    told = difference[difference != 0]
    return float(wilcoxon(told, alternative="greater").pvalue) if len(told) else 1.0


def gain_over_windows(samples: int, without: Array, with_it: Array) -> Gain:
    """Squared errors of each window without and with a parameter, (windows,) each; samples: of all windows."""
    if not np.isfinite(without).all():
        return Gain(1.0, 0.0, np.inf, float(np.sqrt(with_it.sum() / samples)))
    difference = without - with_it
    return Gain(
        share=float(difference.sum() / max(without.sum(), 1e-300)),
        p_value=chance_of_gain(difference),
        rms_without=float(np.sqrt(without.sum() / samples)),
        rms_with=float(np.sqrt(with_it.sum() / samples)),
    )
