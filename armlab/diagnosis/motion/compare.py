"""What changed between recordings of motion only: one servo for all, in which each number may change.

Each recording has its own numbers at first. The number whose values are missed least on the other half of the windows
is tied, and so on, until each number that is left is missed: by a share of the squared error that matters and in enough
windows not to be chance. So a gain that was raised is one change, not a new set of all numbers.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import date
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import t as student

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.diagnosis.changes.numbers import CONFIDENCE, Movement, as_wide_as_runs, half_width_factor
from armlab.diagnosis.changes.trends import Trend, find_trends, recording_dates
from armlab.diagnosis.motion.choose import ChosenServo, chance_of_gain, choose_servo
from armlab.diagnosis.motion.diagnose_motion import NO_SERVO, reason_unusable
from armlab.diagnosis.motion.estimate import (
    LOGARITHMIC,
    coordinate_scales,
    from_coordinates,
    jacobian,
    rms_of,
    thin_windows,
    to_coordinates,
    with_damping_inside,
)
from armlab.diagnosis.motion.held_out import command_error
from armlab.diagnosis.motion.joint_replay import joint_errors
from armlab.diagnosis.motion.motion_result import tells_of_a_servo
from armlab.diagnosis.motion.motion_tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.servo import HIGHEST, LOWEST, PARAMETERS, ServoParameter, place
from armlab.diagnosis.motion.servo_simulation import read_servo_simulation
from armlab.diagnosis.motion.windows import Windows, make_windows
from armlab.recordings.motion import MotionRecording
from problem.arm import Arm

MIN_RUNS = 3  # of each recording, for a scatter between runs
POWER_QUANTILE = 1.2816  # of 90 % power, for the smallest change that would have been seen


@dataclass(frozen=True, eq=False)
class FittedLevels:
    """One number in all recordings, as coordinates of the fit (logarithms of gain and limit).

    number: its place. coordinates: (recordings,). by_windows: their covariance, windows as blocks, with its degrees of
    freedom. by_runs: their covariance by the runs of each recording, (recordings, recordings, recordings), and the
    degrees of freedom of each; zeros where the runs are too few.
    """

    number: int
    coordinates: Array
    by_windows: Array
    windows_freedom: float
    by_runs: Array
    run_freedoms: Array

    @property
    def values(self) -> Array:
        """SI units, (recordings,)."""
        return np.asarray(np.exp(self.coordinates) if LOGARITHMIC[self.number] else self.coordinates)

    def error_of(self, weights: Array) -> tuple[float, float]:
        """Standard error of a weighted sum of the coordinates, and its degrees of freedom.

        The one of windows or of runs whose interval is wider. Degrees of freedom of runs after Welch 1947.
        """
        parts = np.einsum("rij,i,j->r", self.by_runs, weights, weights)
        whole, spread = float(parts.sum()), float((parts**2 / self.run_freedoms).sum())
        of_windows = float(np.sqrt(np.maximum(weights @ self.by_windows @ weights, 0.0))), self.windows_freedom
        of_runs = float(np.sqrt(whole)), max(whole**2 / max(spread, 1e-300), 1.0)
        return max(of_windows, of_runs, key=lambda each: each[0] * half_width_factor(each[1]))

    def between(self, first: int, last: int) -> "LevelDifference":
        """The last less the first of two recordings, from 0."""
        weights = np.zeros(len(self.coordinates))
        weights[last] += 1.0
        weights[first] -= 1.0
        error, freedom = self.error_of(weights)
        return LevelDifference(float(self.coordinates[last] - self.coordinates[first]), error, freedom)

    def chance_of_same(self) -> float:
        """That the two recordings that differ most surely do not differ, corrected for all twos."""
        twos = list(combinations(range(len(self.coordinates)), 2))
        return len(twos) * min(self.between(*each).chance for each in twos)

    def movement(self, joint: int) -> Movement:
        """The values over the recordings, with their covariance about their mean."""
        count, parameter, values = len(self.coordinates), PARAMETERS[self.number], self.values
        slopes = np.diag(values if LOGARITHMIC[self.number] else np.ones(count))
        centre = (np.eye(count) - 1 / count) @ slopes
        covariance = as_wide_as_runs(
            centre @ self.by_windows @ centre.T, np.diag(centre @ self.by_runs.sum(axis=0) @ centre.T)
        )
        errors = [self.error_of(each) for each in slopes]
        half = np.array([error * half_width_factor(freedom) for error, freedom in errors])
        place_of = parameter.effect, joint, (joint,)
        return Movement(*place_of, parameter.name, parameter.unit, values, covariance, half)


@dataclass(frozen=True)
class LevelDifference:
    """Of a number between two recordings, in its coordinate. move: with its standard error and degrees of freedom."""

    move: float
    error: float
    freedom: float

    @property
    def ends(self) -> tuple[float, float, float]:
        """The difference and its 95 % interval."""
        half = half_width_factor(self.freedom) * self.error
        return self.move, self.move - half, self.move + half

    @property
    def factor(self) -> tuple[float, float, float]:
        """The ratio and its 95 % interval, of a number that is fitted as a logarithm."""
        value, low, high = (float(np.exp(np.clip(each, -50, 50))) for each in self.ends)
        return value, low, high

    @property
    def chance(self) -> float:
        """Of a difference as large as this where there is none."""
        return 2 * float(student.sf(abs(self.move) / max(self.error, 1e-300), self.freedom))


@dataclass(frozen=True, eq=False)
class ServoChange:
    """One number in all recordings. joint: from 1. p_value: of no change, corrected.

    before, after: error on the other half of the windows without and with the change, rad; None where it was not found.
    detectable: the smallest change from the first to the last recording that would have been seen.
    """

    parameter: ServoParameter
    joint: int
    levels: FittedLevels
    p_value: float
    changed: bool
    detectable: float
    before: float | None = None
    after: float | None = None

    @property
    def old(self) -> float:
        """In the first recording, SI units."""
        return float(self.levels.values[0])

    @property
    def new(self) -> float:
        """In the last recording, SI units."""
        return self.old + self.difference

    @property
    def ratio(self) -> tuple[float, float, float] | None:
        """Last over first with its interval, of a number that is fitted as a logarithm."""
        return self.levels.between(0, -1).factor if LOGARITHMIC[self.levels.number] else None

    @property
    def is_told(self) -> bool:
        """Whether the motions tell a change of this number that a servo can have."""
        return bool(self.detectable < HIGHEST[self.levels.number] - LOWEST[self.levels.number])

    @property
    def difference(self) -> float:
        """Last less first, SI units."""
        return self._differences[0]

    @property
    def difference_interval(self) -> tuple[float, float]:
        """Its 95 % interval."""
        return self._differences[1:]

    @property
    def _differences(self) -> tuple[float, float, float]:
        if self.ratio is None:
            return self.levels.between(0, -1).ends
        value, low, high = (self.old * (each - 1) for each in self.ratio)
        return value, low, high


@dataclass(frozen=True, eq=False)
class MotionComparison:
    """What changed. arm: of the last recording. reason: of an inconclusive one.

    notes: temperature and voltage in all recordings. trends: of more than two recordings, each number that changed;
    dates: of the recordings.
    """

    names: tuple[str, ...]
    arm: Arm
    reason: str
    changes: tuple[ServoChange, ...]
    notes: tuple[str, ...] = ()
    trends: tuple[Trend, ...] = ()
    dates: tuple[date | None, ...] = ()

    @property
    def changed(self) -> tuple[ServoChange, ...]:
        """The numbers that changed."""
        return tuple(each for each in self.changes if each.changed)


def compare_motion(
    old: MotionRecording,
    new: MotionRecording,
    *more: MotionRecording,
    dates: Sequence[date] = (),
    progress: Callable[[str], None] = lambda message: None,
    tuning: MotionTuning = DEFAULT,
) -> MotionComparison:
    """What changed from one recording to later ones of the same robot; all runs of all take part.

    dates: of the recordings; those of their files if left out. Raises InputError where the recordings have other
    joints, or dates are not as many.
    """
    recordings = (old, new, *more)
    for other in recordings[1:]:
        if [joint.name for joint in old.recorded_arm.joints] != [joint.name for joint in other.recorded_arm.joints]:
            raise InputError(f"{old.name} and {other.name} have different joints: compare recordings of one robot")
    known_dates = recording_dates(recordings, dates)
    none = MotionComparison(tuple(each.name for each in recordings), recordings[-1].arm, "", (), dates=known_dates)
    for recording in recordings:
        reason = reason_unusable(recording)
        if reason is not None:
            return replace(none, reason=f"{recording.name}: {reason}")
    simulations = [read_servo_simulation(recording) for recording in recordings]
    windows = [
        make_windows(each.runs, simulation, tuning) for each, simulation in zip(recordings, simulations, strict=True)
    ]
    looks = len(PARAMETERS) * len(old.joints)
    changes: list[ServoChange] = []
    follows = np.zeros((len(recordings), len(old.joints)), dtype=bool)
    for row, own in enumerate(zip(*windows, strict=True)):
        progress(f"comparing joint {row + 1} of {len(old.joints)}")
        same_law = replace(tuning, needed_limits=(), integral_rates=())  # none that one recording alone starts from
        fits = [
            choose_servo(each, simulation.nominal.values[row], looks, same_law)
            for each, simulation in zip(own, simulations, strict=True)
        ]
        follows[:, row] = [_follows_command(each, fit, tuning) for each, fit in zip(own, fits, strict=True)]
        sound = [
            each.select(np.setdiff1d(np.arange(each.count), fit.odd)).with_integral(fit.fit.integral)
            for each, fit in zip(own, fits, strict=True)
        ]
        thinned = [thin_windows(each, tuning.max_judged_windows) for each in sound]
        starts, free = common_start(fits)
        changes += _compare_joint(thinned, starts, free, (simulations[-1].number_of(row), looks), tuning)
    lost = next((each for each, own in zip(recordings, follows, strict=True) if not own.any()), None)
    if lost is not None:
        return replace(none, reason=f"{lost.name}: {NO_SERVO}")
    movements = [each.levels.movement(each.joint) for each in changes if each.changed and more]
    return replace(
        none,
        changes=tuple(changes),
        notes=tuple(_notes(recordings)),
        trends=find_trends(movements, known_dates),
    )


def _follows_command(windows: Windows, chosen: ChosenServo, tuning: MotionTuning) -> bool:
    """Whether a fitted servo tells more of a joint than the command alone, or the mean of the position."""
    without = min(rms_of(command_error(windows)), float(np.std(windows.position)))
    return tells_of_a_servo(chosen.fit.rms, without, chosen.fit.noise, tuning)


def common_start(fits: Sequence[ChosenServo]) -> tuple[Array, NDArray[np.bool_]]:
    """Numbers of all recordings, (recordings, parameters), from which their fit starts, and which are free in it.

    Where one of them has its damping in the drive, all have what is beyond the joint's own in that one. A number that a
    recording's own fit did not free starts from the first one that did.
    """
    kd, damping = place("kd"), place("damping")
    values, free = np.array([each.fit.values for each in fits]), np.array([each.free for each in fits])
    inside = np.flatnonzero(free[:, kd])
    if len(inside):
        values = np.array([with_damping_inside(each, values[inside[0]]) for each in values])
        free[:, [kd, damping]] = True, False
    source = np.argmax(free, axis=0)
    starts = np.where(free, values, values[source, np.arange(values.shape[1])])
    return starts, np.asarray(free.any(axis=0))


def _notes(recordings: Sequence[MotionRecording]) -> list[str]:
    """Temperature and voltage in all recordings, where they were recorded."""
    notes = []
    for signal, unit in (("temperature", "degrees Celsius"), ("voltage", "V")):
        means = []
        for recording in recordings:
            recorded = [getattr(run, signal) for run in recording.runs if getattr(run, signal) is not None]
            means += [float(np.mean(np.concatenate([each.ravel() for each in recorded])))] if recorded else []
        if len(means) == len(recordings):
            first, *others = (f"{mean:.3g}" for mean in means)
            later = [f"{mean} in {each.name}" for mean, each in zip(others, recordings[1:], strict=True)]
            notes.append(f"{signal}: {first} {unit} in {recordings[0].name}, {', '.join(later)}")
    return notes


@dataclass(frozen=True, eq=False)
class SharedFit:
    """One servo for all recordings, in which some numbers change.

    levels: coordinates in each recording, (recordings, parameters). free: which numbers it has, (parameters,).
    changing: places of those that have a coordinate in each recording. covariance: of the tied coordinates, then of the
    changing ones, (recordings, changing).
    """

    levels: Array
    free: NDArray[np.bool_]
    changing: tuple[int, ...]
    covariance: Array

    def fit_again(self, windows: Sequence[Windows], tuning: MotionTuning) -> "SharedFit":
        """The same fit on other windows, from its numbers."""
        return fit_shared(windows, self.levels, self.free, self.changing, tuning)


def fit_shared(
    windows: Sequence[Windows],
    start: Array,
    free: NDArray[np.bool_],
    changing: tuple[int, ...],
    tuning: MotionTuning,
) -> SharedFit:
    """The fit of all recordings, within the bounds of each number. start: coordinates in each, as in `SharedFit`."""
    moved = np.array(changing, dtype=np.intp)
    tied, shape = np.setdiff1d(np.flatnonzero(free), moved), (len(windows), len(moved))

    def lay_out(every: Array) -> Array:
        return np.concatenate([every[0, tied], every[:, moved].ravel()])

    def levels_of(part: Array) -> Array:
        levels = start.copy()
        levels[:, tied], levels[:, moved] = part[: len(tied)], part[len(tied) :].reshape(shape)
        return levels

    def errors(part: Array) -> Array:
        pairs = zip(windows, from_coordinates(levels_of(part)), strict=True)
        return np.concatenate([joint_errors(each, value)[0] for each, value in pairs])

    def slopes(part: Array) -> Array:
        rows = []
        for number, (each, value) in enumerate(zip(windows, from_coordinates(levels_of(part)), strict=True)):
            own = np.zeros((len(each.position), len(start[0])))
            own[:, free] = jacobian(each, value, free)
            levels = np.zeros((len(own), *shape))
            levels[:, number] = own[:, moved]
            rows.append(np.concatenate([own[:, tied], levels.reshape(len(own), -1)], axis=1))
        return np.concatenate(rows)

    low, high, scale = (
        lay_out(np.tile(each, (len(windows), 1)))
        for each in (
            to_coordinates(LOWEST),
            to_coordinates(HIGHEST),
            coordinate_scales(windows[0], from_coordinates(start[0])),
        )
    )
    margin = 1e-9 * (high - low)
    begin = np.clip(lay_out(start), low + margin, high - margin)
    found = least_squares(
        errors, begin, jac=slopes, bounds=(low, high), x_scale=scale, max_nfev=tuning.refit_evaluations, ftol=1e-5
    )
    covariance = _covariance(windows, slopes(found.x), errors(found.x))
    return SharedFit(levels_of(found.x), free, changing, covariance)


def _covariance(windows: Sequence[Windows], slopes: Array, errors: Array) -> Array:
    """Sandwich with each window of all recordings as a block (see estimate.py)."""
    before = np.cumsum([0, *(each.count for each in windows)])
    window = np.concatenate([count + each.window for count, each in zip(before[:-1], windows, strict=True)])
    scores = np.stack([np.bincount(window, column * errors) for column in slopes.T], axis=1)
    inverse = np.linalg.pinv(slopes.T @ slopes, hermitian=True)
    return np.asarray(inverse @ (scores.T @ scores) @ inverse * len(scores) / max(len(scores) - 1, 1))


def _levels_by_runs(windows: Sequence[Windows], model: SharedFit, tuning: MotionTuning) -> tuple[Array, Array]:
    """Covariances of the levels by the runs of each recording, (recordings, changing, recordings, recordings), and
    degrees of freedom, (recordings,).

    What the law leaves out is alike in all windows of one motion, and differs between motions. So each run is a block:
    the model is fitted without each of the G runs of a recording in turn (jackknife; Tukey 1958),

        covariance = (G - 1) / G sum_k (levels_k - mean) (levels_k - mean)^T

    Where a recording has fewer than MIN_RUNS runs they tell nothing: zeros.
    """
    changing, count = list(model.changing), len(windows)
    covariances, freedoms = np.zeros((count, len(changing), count, count)), np.ones(count)
    runs = [np.unique(each.run) for each in windows]
    if min(map(len, runs)) < MIN_RUNS or not changing:
        return covariances, freedoms
    for recording, own in enumerate(windows):
        levels = []
        for run in runs[recording]:
            parts = list(windows)
            parts[recording] = own.select(np.flatnonzero(own.run != run))
            levels.append(model.fit_again(parts, tuning).levels[:, changing])
        moves = np.array(levels) - np.mean(levels, axis=0)
        freedoms[recording] = len(moves) - 1
        covariances[recording] = freedoms[recording] / len(moves) * np.einsum("kin,kjn->nij", moves, moves)
    return covariances, freedoms


def _other_half_errors(windows: Sequence[Windows], model: SharedFit, tuning: MotionTuning) -> Array:
    """Squared error of each window of all recordings by numbers that were fitted on the other half."""
    squares = [np.zeros(each.count) for each in windows]
    for first in (0, 1):
        learned = model.fit_again([each.select(np.arange(first, each.count, 2)) for each in windows], tuning)
        for own, each, value in zip(squares, windows, from_coordinates(learned.levels), strict=True):
            rows = np.arange(1 - first, each.count, 2)
            judged = each.select(rows)
            with np.errstate(over="ignore"):  # a replay that runs away is as bad as can be
                own[rows] = np.bincount(judged.window, joint_errors(judged, value)[0] ** 2, len(rows))
    return np.concatenate(squares)


def _compare_joint(
    windows: Sequence[Windows], starts: Array, free: NDArray[np.bool_], place_of: tuple[int, int], tuning: MotionTuning
) -> list[ServoChange]:
    """All fitted numbers of one joint, changed or not. free: numbers that the model has. place_of: joint, tests in all.

    All numbers differ at first. The one whose values are missed least is tied, until each of the others is missed.
    Where each was tied while others stood in for it, the one that differs most surely where all do has changed.
    """
    joint, looks = place_of
    numbers = tuple(np.flatnonzero(free).tolist())
    every = model = fit_shared(windows, to_coordinates(starts), free, numbers, tuning)
    judged = apart = _other_half_errors(windows, model, tuning)
    gains: dict[int, tuple[float, float, float]] = {}
    samples = sum(len(each.position) for each in windows)
    while model.changing:
        tied = {number: _tie(windows, model, number, tuning) for number in model.changing}
        errors = {number: _other_half_errors(windows, each, tuning) for number, each in tied.items()}
        chances = {
            number: _chance_of_need(windows, each, judged, tuning.min_gain) * looks for number, each in errors.items()
        }
        rms = {
            number: (float(np.sqrt(each.sum() / samples)), float(np.sqrt(judged.sum() / samples)))
            for number, each in errors.items()
        }
        gains = {number: (min(chances[number], 1.0), *rms[number]) for number in tied}
        needless = [number for number in tied if chances[number] > tuning.max_p_value]
        if not needless:
            break
        best = min(needless, key=lambda number: float(errors[number].sum()))
        model, judged = tied[best], errors[best]
    known = _levels_of(windows, every, tuning) | _levels_of(windows, model, tuning)
    found, test = {number: gains[number] for number in model.changing}, (looks, tuning.max_p_value)
    changes = [_change(known[number], joint, found, test) for number in numbers]
    surest = min(changes, key=lambda each: each.p_value)
    if found or surest.p_value > tuning.max_p_value:
        return changes
    before, after = (float(np.sqrt(each.sum() / samples)) for each in (judged, apart))
    alone = replace(surest, changed=True, before=before, after=after)
    return [alone if each is surest else each for each in changes]


def _chance_of_need(windows: Sequence[Windows], tied: Array, apart: Array, least_share: float) -> float:
    """Of errors so much larger where a number is tied, in the two recordings that tell it best, corrected for all twos.

    tied, apart: squared errors of all windows. 1 where no two recordings miss the number by the least share of theirs.
    """
    owner = np.repeat(np.arange(len(windows)), [each.count for each in windows])
    twos = [np.isin(owner, two) for two in combinations(range(len(windows)), 2)]
    missed = [rows for rows in twos if (tied - apart)[rows].sum() >= least_share * tied[rows].sum()]
    return min([1.0, *(len(twos) * chance_of_gain((tied - apart)[rows]) for rows in missed)])


def _tie(windows: Sequence[Windows], model: SharedFit, number: int, tuning: MotionTuning) -> SharedFit:
    """The model in which one number more is the same in all recordings."""
    start = model.levels.copy()
    start[:, number] = start[:, number].mean()
    return fit_shared(windows, start, model.free, tuple(each for each in model.changing if each != number), tuning)


def _levels_of(windows: Sequence[Windows], model: SharedFit, tuning: MotionTuning) -> dict[int, FittedLevels]:
    """The numbers that change in a model, by their places."""
    count, changing, size = len(windows), len(model.changing), len(model.covariance)
    by_runs, run_freedoms = _levels_by_runs(windows, model, tuning)
    freedom = float(max(sum(each.count for each in windows) - size, 1))
    known = {}
    for position, number in enumerate(model.changing):
        own = size - count * changing + changing * np.arange(count) + position
        by_windows = model.covariance[np.ix_(own, own)]
        levels = model.levels[:, number]
        known[number] = FittedLevels(number, levels, by_windows, freedom, by_runs[:, position], run_freedoms)
    return known


def _change(
    levels: FittedLevels, joint: int, gains: dict[int, tuple[float, float, float]], test: tuple[int, float]
) -> ServoChange:
    """One number: its change where it was found, else none, with the interval of the fit in which all change.

    gains: of the numbers that were found. test: number of tests in all, and their level. By the interval, too, a change
    has to be sure among all that were found (Bonferroni).
    """
    (looks, level), number, whole = test, levels.number, levels.between(0, -1)
    changed, tail = number in gains, levels.chance_of_same()
    twos = len(levels.coordinates) * (len(levels.coordinates) - 1) / 2
    seen = (float(student.isf(level / looks / twos, whole.freedom)) + POWER_QUANTILE) * whole.error
    return ServoChange(
        parameter=PARAMETERS[number],
        joint=joint,
        levels=levels,
        p_value=gains[number][0] if changed else min(tail * looks, 1.0),
        changed=changed and tail * len(gains) < 1 - CONFIDENCE,
        detectable=float(levels.values[0] * np.expm1(min(seen, 50))) if LOGARITHMIC[number] else seen,
        before=gains[number][1] if changed else None,
        after=gains[number][2] if changed else None,
    )
