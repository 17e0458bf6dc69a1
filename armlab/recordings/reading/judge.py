"""The judge of readings: held-out losses of two views, and when a mistake may be named.

A reading counts by the sum over joints of the mean logarithm of its held-out errors, with links near those of the
simulation, and with links that the data decide.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from armlab.common.arrays import Array
from armlab.recordings.reading.fit import Fitter
from armlab.recordings.reading.mistakes import POSITION, TORQUE
from armlab.recordings.reading.reading import Reading
from armlab.recordings.reading.tuning import ReadingTuning
from armlab.recordings.recording import Recording, Run
from problem.regressor import rigid_body_torque


@dataclass(frozen=True, eq=False)
class Trial:
    """A reading with its held-out losses (blocks, joints): near the simulation's links (None without), free."""

    reading: Reading
    near: Array | None
    free: Array

    @property
    def loss(self) -> float:
        """Sum over joints of the mean loss, of the stricter view."""
        return float(np.mean(np.sum(self.free if self.near is None else self.near, axis=1)))

    @property
    def free_loss(self) -> float:
        """The same with free links."""
        return float(np.mean(np.sum(self.free, axis=1)))


@dataclass(frozen=True, eq=False)
class Judge:
    """Scores readings of one recording. looks: counts them."""

    fitter: Fitter
    recording: Recording
    looks: list[int] = field(default_factory=lambda: [0])

    def errors(self, reading: Reading, near: bool) -> tuple[Array, Array]:
        """Held-out errors of the joints (joints,) over their torque's scatter, and in N m (N).

        near: with links near those of the simulation, where there is one; else with free links.
        """
        width = self.tuning.free_width if reading.inertial is not None else self.tuning.unknown_width
        if near and reading.inertial is not None:
            width = self.tuning.near_width
        errors = self.fitter.scores(reading, (width,))[0].errors()
        return errors, errors * np.std(self.fitter.channels.read_torque(reading), axis=0)

    @cached_property
    def clock_is_right(self) -> bool:
        """Whether recorded velocities are the slopes of the positions: then time is right."""
        return all(_confirms_clock(run, self.tuning.min_slope_likeness) for run in self.recording.runs)

    @property
    def tuning(self) -> ReadingTuning:
        """The numbers of this stage."""
        return self.fitter.tuning

    def trial(self, reading: Reading, physical: bool = False) -> Trial:
        """The losses of a reading."""
        self.looks[0] += 1
        tuning = self.tuning
        known = reading.inertial is not None
        widths = (tuning.near_width, tuning.free_width) if known else (tuning.unknown_width,)
        beyond = self.fitter.beyond_limits(reading) * tuning.limit_loss / reading.joints
        beyond = beyond + self.fitter.too_fast(reading) * tuning.speed_loss / reading.joints
        scores = self.fitter.scores(reading, widths, physical)
        losses = [each.losses(tuning.smallest_error) + beyond for each in scores]
        return Trial(reading, losses[0] if known else None, losses[-1])

    def is_size_plausible(self, parent: Reading, reading: Reading) -> bool:
        """Whether a last mistake that scales makes sizes more alike, as a wrong unit does.

        Of torques and links: else the links may vanish, or grow, until friction alone explains the torque. Of the
        positions of one joint: else a joint that hardly moves explains what no reading does.
        """
        mistake = reading.mistakes[-1]
        if mistake.effect == "unit_error" and mistake.form == POSITION:
            return mistake.joint is None or self._is_travel_more_alike(parent, reading, mistake.joint - 1)
        links = mistake.effect == "link_data_error" and mistake.form != "centre_sign"
        scales = links or (mistake.effect == "unit_error" and mistake.form == TORQUE)
        if not scales:
            return True
        if reading.inertial is not None:
            return bool(self._size_mismatch(reading) < self._size_mismatch(parent))
        if mistake.joint is None or reading.joints == 1:
            return False
        sizes = np.log(np.maximum(np.std(self.fitter.channels.read_torque(parent), axis=0), SMALLEST))
        own, others = sizes[mistake.joint - 1], float(np.median(np.delete(sizes, mistake.joint - 1)))
        return bool(abs(own - np.log(mistake.value("factor")) - others) < abs(own - others))

    def _is_travel_more_alike(self, parent: Reading, reading: Reading, joint: int) -> bool:
        """Whether a joint (from 0) travels more as far as the other joints of its kind do, where there are any."""
        kinds = [each.kind for each in reading.arm.joints]
        others = [place for place, kind in enumerate(kinds) if kind == kinds[joint] and place != joint]
        if not others:
            return True
        before, after = (
            np.log(np.maximum(np.ptp(self.fitter.columns(each).motion.position, axis=0), SMALLEST))
            for each in (parent, reading)
        )
        usual = float(np.median(before[others]))
        return bool(abs(after[joint] - usual) < abs(before[joint] - usual))

    def _size_mismatch(self, reading: Reading) -> float:
        """Sum over joints of the logarithms between the scatter of the torque and that of the links as given."""
        columns = self.fitter.columns(reading)
        rigid = rigid_body_torque(reading.arm, columns.motion, reading.inertial)
        given = np.std(rigid + columns.stated, axis=0)
        sizes = np.std(self.fitter.channels.read_torque(reading), axis=0)
        loaded = (given > 0) & (sizes > 0)
        return float(np.sum(np.abs(np.log(sizes[loaded] / given[loaded]))))


SMALLEST = 1e-300


def _confirms_clock(run: Run, likeness: float) -> bool:
    if run.velocity is None:
        return False
    slope = np.gradient(run.position, run.time, axis=0)
    product, power = np.sum(slope * run.velocity, axis=0), np.sum(slope**2, axis=0)
    gain = product / np.where(power > 0, power, 1.0)
    alike = product / np.sqrt(np.maximum(power * np.sum(run.velocity**2, axis=0), 1e-300))
    moving = power > 0
    return bool(np.all(alike[moving] > likeness) and np.all(np.abs(gain[moving] - 1) < 1 - likeness))


@dataclass(frozen=True, eq=False)
class Gain:
    """How far held-out losses fall from one trial to another: nats over all joints, and how many standard errors."""

    near: float
    near_sigmas: float
    free: float
    free_sigmas: float

    @classmethod
    def between(cls, before: Trial, after: Trial) -> "Gain":
        """From one trial to another of the same blocks."""
        free = _mean_and_sigmas(before.free - after.free)
        if before.near is None or after.near is None:
            return cls(*free, *free)
        return cls(*_mean_and_sigmas(before.near - after.near), *free)


def _mean_and_sigmas(fall: Array) -> tuple[float, float]:
    """Mean over the blocks (blocks, joints), and its ratio to the standard error."""
    blocks = np.sum(fall, axis=1)
    error = float(np.std(blocks, ddof=1)) / np.sqrt(len(blocks))
    mean = float(np.mean(blocks))
    return mean, mean / max(error, 1e-9)


def is_accepted(judge: Judge, before: Trial, after: Trial) -> bool:
    """Whether the errors fall so far and so surely that a mistake may be named.

    By geometry: no links explain what was recorded as well. By the links of the simulation: near them the reading is
    about as good as any links make it, and as it stands it is much worse. Without a simulation links that bodies can
    have decide where free ones leave it open.
    """
    gain, tuning = Gain.between(before, after), judge.tuning
    if gain.near < tuning.min_gain:
        return False
    if gain.near_sigmas < tuning.min_sigmas:
        if before.near is not None:
            return False
        bodies = Gain.between(judge.trial(before.reading, True), judge.trial(after.reading, True))
        return bodies.free > tuning.min_gain and bodies.free_sigmas > tuning.min_body_sigmas
    if gain.free >= tuning.min_free_gain and gain.free_sigmas >= tuning.min_sigmas:
        return True
    if before.near is None or gain.near < tuning.min_link_gain or gain.free < -tuning.max_free_loss:
        return False
    best = min(before.free_loss, after.free_loss)
    return after.loss - best < tuning.max_open_gap * (before.loss - best)
