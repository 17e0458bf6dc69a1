"""Plain least squares on a recording: the yardstick that every model has to beat.

    tau = (base parameters of the arm) + a qdd + c tanh(qd / (0.01 top speed)) + b qd + d

with a rotor inertia, Coulomb and viscous friction and an offset at each joint, all fitted. It uses the kinematics of
the arm, never its links, and no law of the library of effects, so that those who judge can measure by it, too.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import DataError
from armlab.recordings.cutoff import MAX_CUTOFF_SHARE, ROWS_PER_CUTOFF, choose_cutoff
from armlab.recordings.differentiate import resample_evenly
from armlab.recordings.filters import Butterworth
from armlab.recordings.load import load_recording
from armlab.recordings.motion import MotionRecording, is_motion_only, load_motion_recording
from armlab.recordings.recording import MotionRun, Run
from problem.arm import Arm
from problem.base_parameters import independent_columns
from problem.motion import Motion
from problem.regressor import observation_matrix

COULOMB_WIDTH = 0.01  # of the top speed: where tanh has taken the place of the jump of a sign
MIN_EXCITATION = 1e-6  # of the largest eigenvalue of the scaled normal matrix: directions below it stay zero
WEIGHT_ROUNDS = 3
ROUNDING = 1e-14  # of the squared torque: a residual below it is one of the sums
COMPARED_HZ = 5.0  # low-pass of recordings that are compared: above the motions of arms, below most of their rest
BLOCKS = 30  # of time, of a recording, whose scatter says how sure a parameter is
BOOTSTRAP_DRAWS = 200
TRIMMED_PERIODS = 2  # of the cut-off, at each end
IDENTIFYING_SHARE = 0.6  # of each run, where no run validates
SEEN_ERRORS = 8.0  # standard errors of a change: a comparison that says "same" beyond them misses a change
DEPENDENCE_TOLERANCE = 1e-7  # of a column's length: below it the rounded angles of a robot file make the difference
PROBE_STATES = 200  # random states that show which columns depend on others
LINK_ORDER = (
    1,
    2,
    3,
    0,
    4,
    7,
    5,
    8,
    9,
    6,
)  # of a link's parameters: first moments, mass, inertias
JOINT_COLUMNS = ("rotor_inertia", "coulomb", "viscous", "offset")  # at each joint, after those of the links


@dataclass(frozen=True)
class TrimmedButterworth(Butterworth):
    """The filter of this module: it leaves out two periods at both ends however short the run is."""

    @property
    def trim(self) -> int:
        """Rows at each end that the end of the recording disturbs."""
        return int(np.ceil(TRIMMED_PERIODS * self.rate_hz / self.cutoff_hz))

    @classmethod
    def possible(cls, even: Run, cutoff_hz: float, step: int = 1) -> "TrimmedButterworth":
        """The filter of a run with this cut-off, or the highest that its rate carries."""
        return cls(even.rate_hz, min(cutoff_hz, MAX_CUTOFF_SHARE * even.rate_hz), even.samples, step)


@dataclass(frozen=True, eq=False)
class PlainRows:
    """A run as least squares sees it.

    run: even in time, unfiltered. low_pass: what the torque passed, with the rows that are kept. motion, torque:
    (kept, joints), filtered; rad (m), N m (N).
    """

    run: Run
    low_pass: TrimmedButterworth
    motion: Motion
    torque: Array

    @property
    def time(self) -> Array:
        """Stamps of the kept rows, (kept,), s."""
        return self.run.time[self.low_pass.rows]

    def where(self, chosen: NDArray[np.bool_]) -> "PlainRows":
        """Some of the kept rows, (kept,), for a fit; their stamps are those of all."""
        parts = (self.motion.position, self.motion.velocity, self.motion.acceleration)
        return replace(self, motion=Motion(*(part[chosen] for part in parts)), torque=self.torque[chosen])


@dataclass(frozen=True, eq=False)
class HeldOutRows:
    """A run that was held out. residual: (kept, joints), what least squares leaves of `rows.torque`, N m (N)."""

    rows: PlainRows
    residual: Array


@dataclass(frozen=True, eq=False)
class PlainFit:
    """What plain least squares finds, and what it leaves on the runs that are held out.

    joints: places in the arm, from 0, of the joints with torque. names, values: (columns,), base parameters and then
    JOINT_COLUMNS at each joint, in SI units; what depends on others has no column. top_speed: (joints,), rad/s (m/s).
    """

    joints: tuple[int, ...]
    cutoff_hz: float
    top_speed: Array
    names: tuple[str, ...]
    values: Array
    held_out: tuple[HeldOutRows, ...]

    @property
    def residual(self) -> Array:
        """What is left on all held-out rows, (rows, joints), N m (N)."""
        return np.concatenate([each.residual for each in self.held_out])

    @property
    def torque(self) -> Array:
        """The filtered torque of the held-out rows, (rows, joints), N m (N)."""
        return np.concatenate([each.rows.torque for each in self.held_out])

    @property
    def rms(self) -> Array:
        """The held-out error of each joint, (joints,), N m (N)."""
        return np.asarray(np.sqrt(np.mean(self.residual**2, axis=0)))

    @property
    def percent(self) -> Array:
        """The held-out error of each joint in percent of its torque, (joints,); NaN for a joint without torque."""
        size = np.sqrt(np.mean(self.torque**2, axis=0))
        return np.asarray(100 * np.divide(self.rms, size, out=np.full(len(size), np.nan), where=size > 0))

    def value(self, name: str, joint: int) -> float:
        """One of JOINT_COLUMNS at a joint, from 1, SI units; 0 for a rotor that no motion tells from its link."""
        return float(dict(zip(self.names, self.values, strict=True)).get(f"{name}{joint}", 0.0))


@dataclass(frozen=True, eq=False)
class PlainModel:
    """Plain least squares on runs that identify. joints, values: as of `PlainFit`."""

    layout: "PlainLayout"
    cutoff_hz: float
    values: Array

    def predict(self, run: Run) -> Array:
        """Torque at every sample of a run that is even in time, (samples, joints), N m (N)."""
        motion = smooth_motion(run, TrimmedButterworth.possible(run, self.cutoff_hz))
        return np.asarray(self.layout.matrix(motion) @ self.values)


def fit_plain_rows(arm: Arm, rows: Sequence[PlainRows], cutoff_hz: float) -> PlainModel:
    """The model of an arm of which all joints move. Raises ValueError where no rows are left."""
    prepared = [each for each in rows if len(each.torque)]
    if not prepared:
        raise DataError(f"no run is longer than {2 * TRIMMED_PERIODS} periods of {cutoff_hz:g} Hz")
    top_speed = np.max([np.abs(each.motion.velocity).max(axis=0) for each in prepared], axis=0)
    layout = PlainLayout(arm, tuple(range(len(arm))), top_speed)
    return PlainModel(layout, cutoff_hz, layout.equations(prepared).solve()[0])


def fit_plain_recording(folder: Path, cutoff_hz: float | None = None) -> PlainFit:
    """Plain least squares on a recording folder, of motion only, too.

    cutoff_hz: what the positions of the runs that identify suggest if left out. Raises InputError for a folder that
    cannot be read, ValueError where no rows are left.
    """
    if is_motion_only(folder):
        moving = load_motion_recording(folder)
        return fit_plain(moving.arm, runs_of_motion(moving), cutoff_hz, moving.joints)
    recording = load_recording(folder)
    return fit_plain(recording.arm, recording.runs, cutoff_hz)


def fit_plain(
    arm: Arm, runs: Sequence[Run], cutoff_hz: float | None = None, joints: tuple[int, ...] | None = None
) -> PlainFit:
    """Fits the runs that identify and judges on those that validate (none: on the last 40 % of each run).

    joints: places in the arm, from 0, of the joints of the runs; all if left out. The others are held at zero.
    Raises ValueError where no rows are left.
    """
    joints = tuple(range(len(arm))) if joints is None else joints
    parts = split_runs(runs)
    cutoff = cutoff_hz or suggested_cutoff_hz([each for each in parts if each.role == "identify"])
    prepared = [each for run in parts for each in [prepare_rows(run, cutoff)] if len(each.torque)]
    fitted = [each for each in prepared if each.run.role == "identify"]
    held_out = [each for each in prepared if each.run.role == "validate"]
    if not fitted or not held_out:
        missing = "identifies" if not fitted else "validates"
        raise DataError(f"no run that {missing} is longer than {2 * TRIMMED_PERIODS} periods of {cutoff:g} Hz")
    top_speed = np.max([np.abs(each.motion.velocity).max(axis=0) for each in prepared], axis=0)
    layout = PlainLayout(arm, joints, top_speed)
    values, _ = layout.equations(fitted).solve()
    left = [HeldOutRows(each, each.torque - layout.matrix(each.motion) @ values) for each in held_out]
    return PlainFit(joints, cutoff, top_speed, layout.names, values, tuple(left))


@dataclass(frozen=True, eq=False)
class PlainChanges:
    """What plain least squares finds in two recordings, each fitted alone on all its runs.

    names, old, new: (columns,), as in `PlainFit`. errors: (columns,), standard errors of new less old, by blocks
    of time that are drawn anew (Kuensch 1989).
    """

    names: tuple[str, ...]
    old: Array
    new: Array
    errors: Array

    @property
    def in_errors(self) -> Array:
        """The changes in standard errors, (columns,); 0 where the motion tells nothing of a column."""
        return np.divide(self.new - self.old, self.errors, out=np.zeros(len(self.old)), where=self.errors > 0)

    @property
    def largest(self) -> float:
        """The largest change of a parameter, in standard errors."""
        return float(np.abs(self.in_errors).max(initial=0.0))

    @property
    def name(self) -> str:
        """The parameter that changes most."""
        return self.names[int(np.argmax(np.abs(self.in_errors)))]


def compare_plain_folders(old: Path, new: Path, cutoff_hz: float = COMPARED_HZ) -> PlainChanges:
    """What differs between two recording folders of one arm, of motion only, too.

    Raises InputError for a folder that cannot be read, DataError where no run is long enough.
    """
    if is_motion_only(old):
        before, after = (load_motion_recording(each) for each in (old, new))
        runs = runs_of_motion(before), runs_of_motion(after)
        return compare_plain(before.arm, *runs, cutoff_hz, before.joints)
    first, second = (load_recording(each) for each in (old, new))
    return compare_plain(first.arm, first.runs, second.runs, cutoff_hz)


def compare_plain(
    arm: Arm,
    old: Sequence[Run],
    new: Sequence[Run],
    cutoff_hz: float = COMPARED_HZ,
    joints: tuple[int, ...] | None = None,
) -> PlainChanges:
    """What differs between the runs of two recordings of an arm.

    joints: as in `fit_plain`. Raises DataError where a recording has no run that is long enough.
    """
    joints = tuple(range(len(arm))) if joints is None else joints
    both = [
        [each for run in runs for each in [prepare_rows(run, cutoff_hz)] if len(each.torque)] for runs in (old, new)
    ]
    if not all(both):
        raise DataError(f"a recording has no run longer than {2 * TRIMMED_PERIODS} periods of {cutoff_hz:g} Hz")
    top_speed = np.max([np.abs(each.motion.velocity).max(axis=0) for rows in both for each in rows], axis=0)
    layout = PlainLayout(arm, joints, top_speed)
    fits = [_fit_with_error(layout, rows) for rows in both]
    return PlainChanges(layout.names, fits[0][0], fits[1][0], np.hypot(fits[0][1], fits[1][1]))


def _fit_with_error(layout: "PlainLayout", rows: Sequence[PlainRows]) -> tuple[Array, Array]:
    """Parameters of a recording and their standard errors, (columns,) each."""
    parts, count = [], max(BLOCKS // len(rows), 1)
    for each in rows:
        matrix = layout.matrix(each.motion)
        for block in np.array_split(np.arange(len(matrix)), count):
            parts.append(NormalEquations.of(matrix[block], each.torque[block]))
    values, weights = sum_equations(parts).solve()
    draws = np.random.default_rng(0).integers(len(parts), size=(BOOTSTRAP_DRAWS, len(parts)))
    grams, rights = (np.array(each) for each in zip(*(part.weighted(weights) for part in parts), strict=True))
    drawn = [_solve_excited(grams[each].sum(axis=0), rights[each].sum(axis=0)) for each in draws]
    return values, np.std(drawn, axis=0)


@dataclass(frozen=True, eq=False)
class PlainLayout:
    """The columns of an arm. joints: places of those with torque; top_speed: (joints,), theirs."""

    arm: Arm
    joints: tuple[int, ...]
    top_speed: Array

    @cached_property
    def columns(self) -> NDArray[np.intp]:
        """Places of independent columns among `_all`: of the links rather than of rotors, of the last link first."""
        states = np.random.default_rng(0).uniform(-2, 2, (3, PROBE_STATES, len(self.joints)))
        probe = self._all(Motion(*states), np.ones(len(self.joints))).reshape(PROBE_STATES * len(self.joints), -1)
        lengths = np.linalg.norm(probe, axis=0)
        effective = lengths > DEPENDENCE_TOLERANCE * lengths.max()
        links, own = 10 * len(self.arm), len(self.joints)
        order = [*range(links + own, probe.shape[1])]
        order += [10 * link + place for link in reversed(range(len(self.arm))) for place in LINK_ORDER]
        order += range(links, links + own)
        chosen = [column for column in order if effective[column]]
        return independent_columns(probe / np.where(effective, lengths, 1.0), chosen, DEPENDENCE_TOLERANCE)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the columns, like `mcx2` and `coulomb2`."""
        own = [f"{name}{joint + 1}" for name in JOINT_COLUMNS for joint in self.joints]
        every = [*self.arm.parameter_names, *own]
        return tuple(every[column] for column in self.columns)

    def matrix(self, motion: Motion) -> Array:
        """The columns in a motion of the joints with torque, (samples, joints, columns), N m (N) per unit."""
        width = COULOMB_WIDTH * np.where(self.top_speed > 0, self.top_speed, 1.0)
        return self._all(motion, width)[:, :, self.columns]

    def equations(self, rows: Sequence[PlainRows]) -> "NormalEquations":
        """Of all rows of some runs."""
        return sum_equations([NormalEquations.of(self.matrix(each.motion), each.torque) for each in rows])

    def _all(self, motion: Motion, coulomb_width: Array) -> Array:
        """Columns of all links, then JOINT_COLUMNS. coulomb_width: (joints,), rad/s (m/s)."""
        chosen = list(self.joints)
        whole = np.zeros((3, motion.samples, len(self.arm)))
        whole[:, :, chosen] = motion.position, motion.velocity, motion.acceleration
        links = observation_matrix(self.arm, Motion(*whole)).reshape(motion.samples, len(self.arm), -1)[:, chosen]
        speed = motion.velocity
        laws = (motion.acceleration, np.tanh(speed / coulomb_width), speed, np.ones(speed.shape))
        own = np.diag([float(joint not in self.arm.unmeasured) for joint in chosen])
        return np.concatenate([links, *(law[:, :, None] * own for law in laws)], axis=2)


def runs_of_motion(recording: MotionRecording) -> tuple[Run, ...]:
    """Runs of motion only with kp (reference - position) for torque; kp is 1 where it is not known."""
    known = recording.controller.kp if recording.controller is not None else (None,) * len(recording.joints)
    gains = np.array([1.0 if each is None else each for each in known])
    return tuple(_with_torque(run, gains) for run in recording.runs)


def _with_torque(run: MotionRun, gains: Array) -> Run:
    if run.reference_position is None:
        raise DataError(f"{run.name} has no reference_position")
    torque = gains * (run.reference_position - run.position)
    given = {name: value for name, value in vars(run).items() if name != "torque"}
    return Run(**given, torque=torque)


def split_runs(runs: Sequence[Run]) -> list[Run]:
    """The runs; where none validates, the first 60 % of each as one that identifies, the rest as one that validates."""
    if any(run.role == "validate" for run in runs):
        return list(runs)
    return [part for run in runs for part in _split(run)]


def _split(run: Run) -> tuple[Run, Run]:
    first = int(IDENTIFYING_SHARE * run.samples)
    return run.rows(slice(None, first)), replace(run.rows(slice(first, None)), role="validate")


def suggested_cutoff_hz(runs: Sequence[Run]) -> float:
    """The largest cut-off that the positions of runs suggest, Hz; ValueError without a run."""
    if not runs:
        raise DataError("no run identifies")
    even = [resample_evenly(run) for run in runs]
    return max(choose_cutoff(run.position, run.rate_hz).cutoff_hz for run in even)


def prepare_rows(run: Run, cutoff_hz: float) -> PlainRows:
    """Position and torque behind one low-pass, and central differences of the position; no rows of a short run."""
    even = resample_evenly(run)
    step = max(int(even.rate_hz / (ROWS_PER_CUTOFF * min(cutoff_hz, MAX_CUTOFF_SHARE * even.rate_hz))), 1)
    low_pass = TrimmedButterworth.possible(even, cutoff_hz, step)
    whole = smooth_motion(even, low_pass)
    motion = Motion(*(each[low_pass.rows] for each in (whole.position, whole.velocity, whole.acceleration)))
    return PlainRows(even, low_pass, motion, low_pass(even.torque))


def smooth_motion(even: Run, low_pass: TrimmedButterworth) -> Motion:
    """The low-passed position and its central differences, at every sample."""
    position = low_pass.smooth(even.position)
    velocity = np.gradient(position, 1 / even.rate_hz, axis=0)
    return Motion(position, velocity, np.gradient(velocity, 1 / even.rate_hz, axis=0))


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """What least squares needs of some rows, joint by joint; those of two sets of rows are added by `sum_equations`.

    gram: (joints, columns, columns), right: (joints, columns), products of the columns and the torque. power, rows:
    (joints,) and a number, squared torque in sum and its rows.
    """

    gram: Array
    right: Array
    power: Array
    rows: int

    @classmethod
    def of(cls, matrix: Array, torque: Array) -> "NormalEquations":
        """Of columns (samples, joints, columns) and a torque (samples, joints)."""
        own = [np.ascontiguousarray(matrix[:, joint]) for joint in range(matrix.shape[1])]
        gram = np.array([each.T @ each for each in own])
        right = np.array([each.T @ torque[:, joint] for joint, each in enumerate(own)])
        return cls(gram, right, np.sum(torque**2, axis=0), len(torque))

    def solve(self) -> tuple[Array, Array]:
        """Least squares with joints weighted by their own residuals, and the weights (joints,)."""
        weights = np.ones(len(self.power))
        for _ in range(WEIGHT_ROUNDS):
            values = _solve_excited(*self.weighted(weights))
            left = self.power - 2 * self.right @ values + self.gram @ values @ values
            weights = self.rows / np.maximum(left, np.maximum(ROUNDING * self.power, 1e-18))
        return values, weights

    def weighted(self, weights: Array) -> tuple[Array, Array]:
        """Of all joints together, (columns, columns) and (columns,). weights: (joints,)."""
        return np.tensordot(weights, self.gram, axes=1), weights @ self.right


def sum_equations(parts: Sequence[NormalEquations]) -> NormalEquations:
    """Of the rows of all parts together."""
    gram, right, power = (
        np.sum([getattr(each, name) for each in parts], axis=0) for name in ("gram", "right", "power")
    )
    return NormalEquations(gram, right, power, sum(each.rows for each in parts))


def _solve_excited(gram: Array, right: Array) -> Array:
    """Solution of the normal equations, columns scaled to unit length; directions hardly excited stay zero."""
    scale = np.sqrt(np.diag(gram))
    scale = np.where(scale > 0, scale, 1.0)
    sizes, directions = np.linalg.eigh(gram / np.outer(scale, scale))
    kept = directions[:, sizes > MIN_EXCITATION * sizes[-1]]
    return np.asarray((kept / sizes[sizes > MIN_EXCITATION * sizes[-1]]) @ (kept.T @ (right / scale)) / scale)
