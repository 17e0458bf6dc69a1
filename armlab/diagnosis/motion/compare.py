"""What changed between two recordings of motion only: one servo for both, in which each number may change.

Each recording has its own numbers at first. The number whose two values are missed least on the other half of the
windows is tied, and so on, until each number that is left is missed: by a share of the squared error that matters and
in enough windows not to be chance. So a gain that was raised is one change, not a new set of all numbers.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import t as student

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.diagnosis.motion.choose import ChosenServo, chance_of_gain, choose_servo
from armlab.diagnosis.motion.diagnose_motion import reason_unusable
from armlab.diagnosis.motion.estimate import (
    LOGARITHMIC,
    coordinate_scales,
    from_coordinates,
    jacobian,
    thin_windows,
    to_coordinates,
    with_damping_inside,
)
from armlab.diagnosis.motion.joint_replay import joint_errors
from armlab.diagnosis.motion.motion_tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.servo import HIGHEST, LOWEST, PARAMETERS, ServoParameter, place
from armlab.diagnosis.motion.servo_simulation import read_servo_simulation
from armlab.diagnosis.motion.windows import Windows, make_windows
from armlab.recordings.motion import MotionRecording
from problem.arm import Arm

CONFIDENCE = 0.95  # of intervals
MIN_RUNS = 3  # of each recording, for a scatter between runs
POWER_QUANTILE = 1.2816  # of 90 % power, for the smallest change that would have been seen
Pair = tuple[Windows, Windows]


@dataclass(frozen=True)
class ServoChange:
    """One number in both recordings. joint: from 1. old, new: SI units. difference, difference_interval: new minus old.

    ratio: new over old with its interval, of a number that is fitted as a logarithm. p_value: of no change, corrected.
    before, after: error on the other half of the windows without and with the change, rad; None where it was not found.
    detectable: the smallest change that would have been seen.
    """

    parameter: ServoParameter
    joint: int
    old: float
    new: float
    difference_interval: tuple[float, float]
    ratio: tuple[float, float, float] | None
    p_value: float
    changed: bool
    detectable: float
    before: float | None = None
    after: float | None = None

    @property
    def difference(self) -> float:
        """New minus old."""
        return self.new - self.old


@dataclass(frozen=True, eq=False)
class MotionComparison:
    """What changed. arm: of the new recording. reason: of an inconclusive one.

    notes: temperature and voltage in both recordings.
    """

    names: tuple[str, str]
    arm: Arm
    reason: str
    changes: tuple[ServoChange, ...]
    notes: tuple[str, ...] = ()

    @property
    def changed(self) -> tuple[ServoChange, ...]:
        """The numbers that changed."""
        return tuple(each for each in self.changes if each.changed)


def compare_motion(
    old: MotionRecording,
    new: MotionRecording,
    progress: Callable[[str], None] = lambda message: None,
    tuning: MotionTuning = DEFAULT,
) -> MotionComparison:
    """What changed from one recording to another of the same robot; all runs of both take part.

    Raises InputError where the recordings have other joints.
    """
    if [joint.name for joint in old.recorded_arm.joints] != [joint.name for joint in new.recorded_arm.joints]:
        raise InputError(f"{old.name} and {new.name} have different joints: compare recordings of one robot")
    names = (old.name, new.name)
    for recording in (old, new):
        reason = reason_unusable(recording)
        if reason is not None:
            return MotionComparison(names, new.arm, f"{recording.name}: {reason}", ())
    simulations = [read_servo_simulation(recording) for recording in (old, new)]
    windows = [
        make_windows(each.runs, simulation, tuning) for each, simulation in zip((old, new), simulations, strict=True)
    ]
    looks = len(PARAMETERS) * len(old.joints)
    changes: list[ServoChange] = []
    for row, pair in enumerate(zip(*windows, strict=True)):
        progress(f"comparing joint {row + 1} of {len(old.joints)}")
        same_law = replace(tuning, needed_limits=(), integral_rates=())  # none that one recording alone starts from
        fits = [
            choose_servo(each, simulation.nominal.values[row], looks, same_law)
            for each, simulation in zip(pair, simulations, strict=True)
        ]
        sound = [
            each.select(np.setdiff1d(np.arange(each.count), fit.odd)).with_integral(fit.fit.integral)
            for each, fit in zip(pair, fits, strict=True)
        ]
        thinned = tuple(thin_windows(each, tuning.max_judged_windows) for each in sound)
        starts, free = _common_start(fits, simulations[0].nominal.values[row])
        named = simulations[1].number_of(row), looks
        changes += _compare_joint((thinned[0], thinned[1]), starts, free, named, tuning)
    return MotionComparison(names, new.arm, "", tuple(changes), tuple(_notes(old, new)))


def _common_start(fits: Sequence[ChosenServo], nominal: Array) -> tuple[tuple[Array, Array], NDArray[np.bool_]]:
    """Numbers of both recordings, (parameters,) each, from which a fit of both starts, and which are free in it.

    Where one of them has its damping in the drive, the other one has, too.
    """
    kd, damping = place("kd"), place("damping")
    inside = any(each.free[kd] for each in fits)
    values, free = [], []
    for each in fits:
        moves = inside and not each.free[kd]
        values.append(with_damping_inside(each.fit.values, nominal) if moves else each.fit.values)
        free.append(each.free.copy())
        free[-1][[kd, damping]] = (True, False) if moves else each.free[[kd, damping]]
    starts = np.where(free[0], values[0], values[1]), np.where(free[1], values[1], values[0])
    return starts, free[0] | free[1]


def _notes(old: MotionRecording, new: MotionRecording) -> list[str]:
    """Temperature and voltage in both recordings, where they were recorded."""
    notes = []
    for signal, unit in (("temperature", "degrees Celsius"), ("voltage", "V")):
        means = []
        for recording in (old, new):
            recorded = [getattr(run, signal) for run in recording.runs if getattr(run, signal) is not None]
            means += [float(np.mean(np.concatenate([each.ravel() for each in recorded])))] if recorded else []
        if len(means) == 2:
            notes.append(f"{signal}: {means[0]:.3g} {unit} in {old.name}, {means[1]:.3g} in {new.name}")
    return notes


@dataclass(frozen=True, eq=False)
class _PairFit:
    """Coordinates in the old recording and their changes, (parameters,) each; covariance of (free, changing)."""

    old: Array
    change: Array
    covariance: Array


def _fit_pair(
    pair: Pair,
    start: tuple[Array, Array],
    free: NDArray[np.bool_],
    changing: Sequence[int],
    evaluations: int,
) -> _PairFit:
    """One servo for both recordings, in which some numbers change. start: coordinates and changes."""
    first_old, first_change = start
    fitted, moved = np.flatnonzero(free), np.array(changing, dtype=np.intp)
    low, high = to_coordinates(LOWEST), to_coordinates(HIGHEST)

    def split(part: Array) -> tuple[Array, Array]:
        old, difference = first_old.copy(), np.zeros(len(first_old))
        old[fitted], difference[moved] = part[: len(fitted)], part[len(fitted) :]
        return old, difference

    def values(part: Array) -> tuple[Array, Array]:
        old, difference = split(part)
        return from_coordinates(np.clip(old, low, high)), from_coordinates(np.clip(old + difference, low, high))

    def errors(part: Array) -> Array:
        return np.concatenate([joint_errors(each, value)[0] for each, value in zip(pair, values(part), strict=True)])

    def slopes(part: Array) -> Array:
        blocks = [jacobian(each, value, free) for each, value in zip(pair, values(part), strict=True)]
        columns = np.searchsorted(fitted, moved)
        beside = np.concatenate([np.zeros((len(blocks[0]), len(moved))), blocks[1][:, columns]])
        return np.concatenate([np.concatenate(blocks), beside], axis=1)

    scale = coordinate_scales(pair[0], from_coordinates(first_old))
    first, sizes = (
        np.concatenate([first_old[fitted], first_change[moved]]),
        np.concatenate([scale[fitted], scale[moved]]),
    )
    found = least_squares(errors, first, jac=slopes, x_scale=sizes, max_nfev=evaluations, ftol=1e-5)
    return _PairFit(*split(found.x), _covariance(pair, slopes(found.x), errors(found.x)))


def _covariance(pair: Pair, slopes: Array, errors: Array) -> Array:
    """Sandwich with each window of both recordings as a block (see estimate.py)."""
    window = np.concatenate([pair[0].window, pair[0].count + pair[1].window])
    scores = np.stack([np.bincount(window, column * errors) for column in slopes.T], axis=1)
    inverse = np.linalg.pinv(slopes.T @ slopes, hermitian=True)
    return np.asarray(inverse @ (scores.T @ scores) @ inverse * len(scores) / max(len(scores) - 1, 1))


@dataclass(frozen=True, eq=False)
class _Model:
    """A fit, which numbers it has, (parameters,), the places of those that change, and evaluations of a fit."""

    fit: _PairFit
    free: NDArray[np.bool_]
    changing: tuple[int, ...]
    evaluations: int


def _run_errors(pair: Pair, model: _Model) -> tuple[Array, Array]:
    """Standard errors of the changes from the scatter between runs, and degrees of freedom, (changing,) each.

    What the law leaves out is alike in all windows of one motion, and differs between motions. So each run is a block:
    the model is fitted without each of the G runs of a recording in turn (jackknife; Tukey 1958),

        variance = sum over recordings of (G - 1) / G sum_k (change_k - mean)^2

    with degrees of freedom after Welch 1947. Recordings of fewer than MIN_RUNS runs tell nothing: zeros.
    """
    changing = list(model.changing)
    variances, freedoms = [], []
    for recording, windows in enumerate(pair):
        runs = np.unique(windows.run)
        if len(runs) < MIN_RUNS or not changing:
            return np.zeros(len(changing)), np.ones(len(changing))
        moves = []
        for run in runs:
            parts = [pair[0], pair[1]]
            parts[recording] = windows.select(np.flatnonzero(windows.run != run))
            start = (model.fit.old, model.fit.change)
            fitted = _fit_pair((parts[0], parts[1]), start, model.free, changing, model.evaluations)
            moves.append(fitted.change[changing])
        variances.append((len(runs) - 1) * np.var(moves, axis=0))
        freedoms.append(len(runs) - 1)
    whole = variances[0] + variances[1]
    weights = variances[0] ** 2 / freedoms[0] + variances[1] ** 2 / freedoms[1]
    return np.sqrt(whole), np.maximum(whole**2 / np.maximum(weights, 1e-300), 1.0)


def _other_half_errors(pair: Pair, model: _Model) -> Array:
    """Squared error of each window of both recordings by numbers that were fitted on the other half."""
    squares = [np.zeros(each.count) for each in pair]
    for first in (0, 1):
        train = tuple(each.select(np.arange(first, each.count, 2)) for each in pair)
        start = (model.fit.old, model.fit.change)
        learned = _fit_pair((train[0], train[1]), start, model.free, model.changing, model.evaluations)
        for number, each in enumerate(pair):
            rows = np.arange(1 - first, each.count, 2)
            judged = each.select(rows)
            value = from_coordinates(learned.old + number * learned.change)
            with np.errstate(over="ignore"):  # a replay that runs away is as bad as can be
                squares[number][rows] = np.bincount(judged.window, joint_errors(judged, value)[0] ** 2, len(rows))
    return np.concatenate(squares)


def _compare_joint(
    pair: Pair, starts: Sequence[Array], free: NDArray[np.bool_], place_of: tuple[int, int], tuning: MotionTuning
) -> list[ServoChange]:
    """All fitted numbers of one joint, changed or not. free: numbers that the model has. place_of: joint, tests in all.

    All numbers differ at first. The one whose two values are missed least is tied, until each of the others is missed.
    Where each was tied while others stood in for it, the one that differs most surely where all do has changed.
    """
    joint, looks = place_of
    first, last = (to_coordinates(start) for start in starts)
    numbers = np.flatnonzero(free).tolist()
    every = _fit_pair(pair, (first, last - first), free, numbers, tuning.refit_evaluations)
    model = _Model(every, free, tuple(numbers), tuning.refit_evaluations)
    judged = apart = _other_half_errors(pair, model)
    gains: dict[int, tuple[float, float, float]] = {}
    samples = len(pair[0].position) + len(pair[1].position)
    while model.changing:
        tied = {number: _tie(pair, model, number) for number in model.changing}
        errors = {number: _other_half_errors(pair, each) for number, each in tied.items()}
        chances = {number: chance_of_gain(each - judged) * looks for number, each in errors.items()}
        rms = {
            number: (float(np.sqrt(each.sum() / samples)), float(np.sqrt(judged.sum() / samples)))
            for number, each in errors.items()
        }
        gains = {number: (min(chances[number], 1.0), *rms[number]) for number in tied}
        needless = [
            number
            for number in tied
            if (errors[number] - judged).sum() < tuning.min_gain * errors[number].sum()
            or chances[number] > tuning.max_p_value
        ]
        if not needless:
            break
        best = min(needless, key=lambda number: float(errors[number].sum()))
        model, judged = tied[best], errors[best]
    models = (model, _Model(every, free, tuple(numbers), tuning.refit_evaluations))
    judged_models = [(each, *_run_errors(pair, each)) for each in models]
    found, test = {number: gains[number] for number in model.changing}, (looks, tuning.max_p_value)
    changes = [_change(pair, number, joint, judged_models[number not in found], found, test) for number in numbers]
    surest = min(changes, key=lambda each: each.p_value)
    if found or surest.p_value > tuning.max_p_value:
        return changes
    before, after = (float(np.sqrt(each.sum() / samples)) for each in (judged, apart))
    alone = replace(surest, changed=True, before=before, after=after)
    return [alone if each is surest else each for each in changes]


def _tie(pair: Pair, model: "_Model", number: int) -> "_Model":
    """The model in which one number more is the same in both recordings."""
    changing = tuple(each for each in model.changing if each != number)
    start, change = model.fit.old.copy(), model.fit.change.copy()
    start[number] += change[number] / 2
    change[number] = 0.0
    fit = _fit_pair(pair, (start, change), model.free, changing, model.evaluations)
    return _Model(fit, model.free, changing, model.evaluations)


def _change(
    pair: Pair,
    number: int,
    joint: int,
    judged: tuple[_Model, Array, Array],
    gains: dict[int, tuple[float, float, float]],
    test: tuple[int, float],
) -> ServoChange:
    """One number: its change where it was found, else none, with the interval of the fit in which all change.

    judged: that model, its errors between runs, and their degrees of freedom. gains: of the numbers that were found.
    test: number of tests in all, and their level. The interval is the wider one of those of windows and of runs. By it,
    too, a change has to be sure among all that were found (Bonferroni).
    """
    looks, level = test
    (model, run_errors, run_freedoms), changed = judged, number in gains
    source, position, count = model.fit, model.changing.index(number), int(model.free.sum())
    windows_error = float(np.sqrt(source.covariance[count + position, count + position]))
    windows_freedom = float(max(pair[0].count + pair[1].count - count - len(model.changing), 1))
    candidates = ((windows_error, windows_freedom), (float(run_errors[position]), float(run_freedoms[position])))
    error, freedom = max(candidates, key=lambda each: each[0] * float(student.ppf((1 + CONFIDENCE) / 2, each[1])))
    half = float(student.ppf((1 + CONFIDENCE) / 2, freedom)) * error
    low, high = LOWEST[number], HIGHEST[number]
    old = float(np.clip(from_coordinates(source.old)[number], low, high))
    move = float(source.change[number])
    seen = (float(student.isf(level / looks, freedom)) + POWER_QUANTILE) * error
    tail = 2 * float(student.sf(abs(move) / max(error, 1e-300), freedom))
    p_value = gains[number][0] if changed else min(tail * looks, 1.0)
    if LOGARITHMIC[number]:
        ends = tuple(float(np.exp(np.clip(move + side * half, -50, 50))) for side in (0, -1, 1))
        interval = (old * (ends[1] - 1), old * (ends[2] - 1))
        new, ratio, detectable = old * ends[0], (ends[0], ends[1], ends[2]), old * float(np.expm1(min(seen, 50)))
    else:
        interval, new, ratio, detectable = (move - half, move + half), old + move, None, seen
    return ServoChange(
        parameter=PARAMETERS[number],
        joint=joint,
        old=old,
        new=new,
        difference_interval=interval,
        ratio=ratio,
        p_value=p_value,
        changed=changed and tail * len(gains) < 1 - CONFIDENCE,
        detectable=detectable,
        before=gains[number][1] if changed else None,
        after=gains[number][2] if changed else None,
    )
