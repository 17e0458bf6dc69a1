"""The judge of readings: held-out errors of two views, and when a mistake may be named.

Many readings are looked at; the errors of the best ones are compared joint by joint and block by block. A mistake is
the last explanation of a large error: taken back, it has to explain more than the best wrong reading of a real arm
explains by chance (`bound.json`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from armlab.common.arrays import Array
from armlab.common.probabilities import student_quantile
from armlab.recordings.cutoff import travel_bandwidth
from armlab.recordings.reading.fit import Fitter, ReadingScore
from armlab.recordings.reading.mistakes import OF_TIME, TORQUE, improbability, is_of_one_joint, position_factor
from armlab.recordings.reading.reading import LINK_DATA, Mistake, Reading
from armlab.recordings.reading.signals import thin_channels
from armlab.recordings.reading.tuning import ReadingTuning
from armlab.recordings.recording import Recording, Run
from problem.regressor import rigid_body_torque


@dataclass(frozen=True, eq=False)
class Trial:
    """A reading with logarithms of its held-out errors (joints,): near the simulation's links (None without), free.

    The free ones are fitted where they are asked for: a reading that is worse near the links needs none.
    """

    reading: Reading
    near: Array | None
    fit_free: Callable[[], Array]

    @cached_property
    def free(self) -> Array:
        """With links that the data decide."""
        return self.fit_free()

    @property
    def loss(self) -> float:
        """Sum over joints, of the stricter view."""
        return float(np.sum(self.free if self.near is None else self.near))


@dataclass(frozen=True, eq=False)
class Errors:
    """Held-out errors of a reading, over the scatter of the joints' torque; of links that bodies can have, and of any.

    errors: (joints,), rms. losses: (blocks, joints), logarithms of the errors of each block.
    """

    errors: Array
    losses: Array


@dataclass(frozen=True, eq=False)
class View:
    """How far errors fall from one reading to another. falls: (joints,), logarithms; deviations: (joints,), standard.

    total_deviation: of the sum over the joints, between blocks of time. total_sigmas: the sum over the joints in such
    deviations.
    """

    falls: Array
    deviations: Array
    total_deviation: float
    total_sigmas: float

    @classmethod
    def between(cls, before: Errors, after: Errors, smallest: float, independent: float) -> "View":
        """From one reading to another of the same blocks; errors below the smallest one count as that.

        independent: how many blocks differ from each other by chance alone.
        """
        falls = np.log(np.maximum(before.errors, smallest)) - np.log(np.maximum(after.errors, smallest))
        blocks = before.losses - after.losses
        totals = np.sum(blocks, axis=1, keepdims=True)
        total = float(_deviations(totals, independent)[0])
        return cls(falls, _deviations(blocks, independent), total, float(np.mean(totals)) / max(total, 1e-9))

    @property
    def best(self) -> int:
        """The joint (from 0) whose error falls most."""
        return int(np.argmax(self.falls))

    @property
    def gain(self) -> float:
        """Sum over the joints, nats."""
        return float(np.sum(self.falls))

    def least_gain(self, sure: float, of_one_joint: bool) -> float:
        """How far the errors of all joints together fall at least, and that of the best one if that has to tell, too.

        sure: standard deviations that are taken off. What rises counts twice.
        """
        rise = float(np.sum(np.maximum(-self.falls, 0.0)))
        total = self.gain - rise - sure * self.total_deviation
        alone = float(self.falls[self.best] - sure * self.deviations[self.best])
        return min(total, alone) if of_one_joint else total


def _deviations(blocks: Array, independent: float) -> Array:
    """Standard deviations of means over the blocks (blocks, columns), of which so many are independent."""
    return np.asarray(np.std(blocks, axis=0, ddof=1) / np.sqrt(independent))


@dataclass(frozen=True, eq=False)
class Gain:
    """How far errors fall from one reading to another, in both views; the same twice without a simulation."""

    near: View
    free: View

    @property
    def sigmas(self) -> float:
        """Standard errors by which all joints together fall, in the view where they fall less surely."""
        return min(self.near.total_sigmas, self.free.total_sigmas)


@dataclass(frozen=True, eq=False)
class ReadingJudge:
    """Scores readings of one recording.

    fitter: of the instants on which readings are looked for. judging: of those on which they are judged. looks: counts
    the readings that were looked at.
    """

    fitter: Fitter
    judging: Fitter
    recording: Recording
    looks: list[int] = field(default_factory=lambda: [0])
    _errors: dict[tuple[int, bool], tuple[Reading, Errors, Errors]] = field(default_factory=dict)
    _lagging: dict[int, tuple[Reading, Trial]] = field(default_factory=dict)

    @classmethod
    def of(cls, recording: Recording, tuning: ReadingTuning) -> "ReadingJudge | None":
        """The judge of a recording; None where it is too short or its transmission cannot be undone."""
        rows = thin_channels(recording, tuning)
        return None if rows is None else cls(Fitter(rows.search, tuning), Fitter(rows.judge, tuning), recording)

    @cached_property
    def clock_is_right(self) -> bool:
        """Whether recorded velocities are the slopes of the positions: then time is right."""
        return all(_confirms_clock(run, self.tuning.min_slope_likeness) for run in self.recording.runs)

    @property
    def tuning(self) -> ReadingTuning:
        """The numbers of this stage."""
        return self.fitter.tuning

    @cached_property
    def independent(self) -> float:
        """Stretches of time that tell something of their own: two a period of the motion, and no more than blocks."""
        periods = sum(_periods(run) for run in self.recording.runs)
        return float(np.clip(2 * periods, 2, self.judging.channels.blocks))

    @cached_property
    def sure(self) -> float:
        """Standard deviations that are taken off what a reading explains."""
        return student_quantile((1 + CONFIDENCE) / 2, self.independent - 1)

    def trial(self, reading: Reading) -> Trial:
        """The errors of a reading with links near those of the simulation, and free."""
        self.looks[0] += 1
        first, *others = self._widths(reading)
        strict = self._losses(reading, first)
        if not others:
            return Trial(reading, None, lambda: strict)
        return Trial(reading, strict, lambda: self._losses(reading, others[0]))

    def lagging(self, reading: Reading) -> Trial:
        """The reading with friction that turns over a way, of each joint the one with which it fits best.

        Such friction lags behind the motion, as torque does that is read late.
        """
        if id(reading) not in self._lagging:
            self._lagging[id(reading)] = (reading, self._fit_lag(reading))
        return self._lagging[id(reading)][1]

    def _fit_lag(self, reading: Reading) -> Trial:
        ways = (0.0, *self.tuning.friction_ways)
        tried = [self.trial(replace(reading, friction_ways=(way,) * reading.joints)) for way in ways]
        best = np.argmin([each.free if each.near is None else each.near for each in tried], axis=0)
        mixed = self.trial(replace(reading, friction_ways=tuple(ways[each] for each in best)))
        return min((*tried, mixed), key=lambda each: each.loss)

    def _losses(self, reading: Reading, width: float) -> Array:
        (score,) = self.fitter.scores(reading, (width,))
        errors = np.log(np.maximum(score.errors, self.tuning.smallest_error))
        return np.asarray(errors + score.distance / reading.joints)

    def _widths(self, reading: Reading) -> tuple[float, ...]:
        tuning = self.tuning
        return (tuning.free_width,) if reading.inertial is None else (tuning.near_width, tuning.free_width)

    def errors(self, reading: Reading, may_carry: bool = False) -> tuple[Errors, Errors]:
        """Held-out errors near the links of the simulation, and with free ones: the same twice without a simulation.

        may_carry: whether the last link may carry a load as large as a link.
        """
        key = id(reading), may_carry
        if key not in self._errors:
            widths = self._widths(reading)
            views = (self.judging.scores(reading, widths, physical, may_carry) for physical in (False, True))
            out = [self._best_fit(reading, each) for each in zip(*views, strict=True)]
            self._errors[key] = (reading, out[0], out[-1])
        return self._errors[key][1:]

    def _best_fit(self, reading: Reading, fits: Sequence[ReadingScore]) -> Errors:
        """Of each joint the fit that predicts it better: a reading that is wrong does so by both."""
        shares = [self.judging.shares(reading, each) for each in fits]
        better = np.argmin([each.errors for each in fits], axis=0)
        errors = np.min([each.errors for each in fits], axis=0)
        chosen = np.where(better, shares[1], shares[0])
        return Errors(errors, np.asarray(0.5 * np.log(chosen + self.tuning.smallest_error**2)))

    def gain(self, before: Trial, after: Trial, may_carry: bool = False) -> Gain:
        """How far errors fall from one reading to another. may_carry: the last link, as the first one has it."""
        smallest = self.tuning.smallest_error
        pairs = zip(self.errors(before.reading, may_carry), self.errors(after.reading), strict=True)
        return Gain(*(View.between(first, second, smallest, self.independent) for first, second in pairs))

    def fits_alike(self, other: Trial, best: Trial) -> bool:
        """Whether the best reading does not surely explain more than another one, nor as much as a mistake has to."""
        if other.loss - best.loss >= self.tuning.least_evidence:
            return False
        return self.gain(other, best).near.total_sigmas < self.sure

    def is_usual(self, trial: Trial) -> bool:
        """Whether no joint leaves more than joints of real arms do."""
        return all(float(each.errors.max()) <= self.tuning.usual_error for each in self.errors(trial.reading))

    def usual_joints(self, trial: Trial) -> frozenset[int]:
        """Joints (from 1) that leave so little that their torque alone is not read wrongly."""
        views = trial.free if trial.near is None else np.maximum(trial.near, trial.free)
        return frozenset((np.flatnonzero(np.exp(views) <= self.tuning.usual_error) + 1).tolist())

    def is_accepted(self, before: Trial, after: Trial, mistake: Mistake | None = None) -> bool:
        """Whether a reading explains so much more that a mistake may be named, its last one if left out."""
        mistake = mistake or after.reading.mistakes[-1]
        return self._reaches(before, after, mistake, self.tuning.least_evidence)

    def is_doubt(self, before: Trial, after: Trial) -> bool:
        """Whether a reading that may not be named explains half as much."""
        return self._reaches(before, after, after.reading.mistakes[-1], DOUBT_SHARE * self.tuning.least_evidence)

    def _reaches(self, before: Trial, after: Trial, mistake: Mistake, least: float) -> bool:
        """Whether a reading has so much evidence; where the quick fits do not show most of it, it is not judged."""
        before, after = self.compared(before, after, mistake)
        return self.may_explain(before, after, mistake, least) and self.evidence(before, after, mistake) >= least

    def compared(self, before: Trial, after: Trial, mistake: Mistake) -> tuple[Trial, Trial]:
        """The readings without and with a mistake, as they are compared.

        Torque that is late is compared beside friction that turns over a way, which may be all there is.
        """
        if mistake.effect in OF_TIME:
            return self.lagging(before.reading), self.lagging(after.reading)
        return before, after

    def improbability(self, reading: Reading, mistake: Mistake | None = None) -> float:
        """How improbable a mistake of a reading is, its last one if left out, nats a stretch of time.

        By its kind, less the log odds of how far its joints travel. Travel never counts for more than a doubt needs: a
        joint that hardly moves may simply stand.
        """
        mistake = mistake or reading.mistakes[-1]
        travel = min(self._travel_odds(reading, mistake) / self.independent, DOUBT_SHARE * self.tuning.least_evidence)
        return improbability(mistake, reading.joints) / self.independent - travel

    def _travel_odds(self, reading: Reading, mistake: Mistake) -> float:
        """Log odds of the travel of joints without and with a mistake that scales it, mean of the joints that turn."""
        factor = position_factor(mistake)
        if factor == 1.0:
            return 0.0
        own = range(reading.joints) if mistake.joint is None else (mistake.joint - 1,)
        turning = [joint for joint in own if reading.arm.joints[joint].kind == "revolute"]
        if not turning:
            return 0.0
        travel = np.ptp(self.fitter.columns(reading).motion.position[:, turning], axis=0)
        off = np.log(np.maximum(travel, SMALLEST) / self.tuning.usual_travel) / self.tuning.travel_scatter
        other = off + np.log(factor) / self.tuning.travel_scatter
        tail = TRAVEL_DEGREES
        return float(np.mean(0.5 * (tail + 1) * (np.log1p(other**2 / tail) - np.log1p(off**2 / tail))))

    def cost(self, trial: Trial) -> float:
        """The loss of a reading, and what each of its mistakes has to explain to be named, nats."""
        chance = sum(self.improbability(trial.reading, each) for each in trial.reading.mistakes)
        return trial.loss + len(trial.reading.mistakes) * self.tuning.least_evidence + chance

    def overall_error(self, trial: Trial) -> float:
        """Held-out error near the simulation's links, geometric mean over the joints, of the torque's scatter."""
        near, _ = self.errors(trial.reading)
        return float(np.exp(np.mean(np.log(np.maximum(near.errors, self.tuning.smallest_error)))))

    def may_explain(self, before: Trial, after: Trial, mistake: Mistake, least: float) -> bool:
        """Whether the quick fits show most of so much evidence (nats), and the loss falls."""
        if after.loss >= before.loss:
            return False
        falls = [before.free - after.free]
        if before.near is not None and after.near is not None:
            falls.append(before.near - after.near)
        gains = (
            [min(float(np.sum(each)), float(np.max(each))) for each in falls]
            if is_of_one_joint(mistake)
            else [float(np.sum(each)) for each in falls]
        )
        return max(gains) >= QUICK_SHARE * (least + self.improbability(after.reading, mistake))

    def is_told_by_geometry(self, before: Trial, after: Trial, mistake: Mistake) -> bool:
        """Whether no other links would explain what was recorded as well."""
        return self._evidence(self.gain(before, after).free, after.reading, mistake) >= self.tuning.least_evidence

    def evidence(self, before: Trial, after: Trial, mistake: Mistake) -> float:
        """What a reading explains beyond chance, nats, in the view that tells more.

        By geometry: free links show it. By the links of the simulation: near them the reading is about as good as any
        links make it. What is said of the data of a link, free links cannot show; of the last link it has to explain
        more than a load does.
        """
        may_carry = mistake.effect == LINK_DATA and mistake.joint == after.reading.joints
        gain = self.gain(before, after, may_carry)
        free = self._evidence(gain.free, after.reading, mistake)
        if before.near is None:
            return free
        if mistake.effect == LINK_DATA:
            free = -self.improbability(after.reading, mistake)
        floor = self.tuning.smallest_error
        (first, _), (near, best) = self.errors(before.reading, may_carry), self.errors(after.reading)
        gap, left = (
            float(np.sum(np.log(np.maximum(each.errors, floor) / np.maximum(best.errors, floor))))
            for each in (first, near)
        )
        if left >= self.tuning.max_open_gap * gap:
            return free
        return max(free, self._evidence(gain.near, after.reading, mistake))

    def _evidence(self, view: View, reading: Reading, mistake: Mistake) -> float:
        """What surely falls, less what the best of so many wrong readings explains by chance."""
        least = view.least_gain(self.sure, is_of_one_joint(mistake))
        return least - self.improbability(reading, mistake)

    def is_size_plausible(self, parent: Reading, reading: Reading) -> bool:
        """Whether a last mistake that scales torques or links makes these more alike, as a wrong unit does.

        Else the links may vanish, or grow, until friction alone explains the torque.
        """
        mistake = reading.mistakes[-1]
        links = mistake.effect == LINK_DATA and mistake.form != "centre_sign"
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

    def _size_mismatch(self, reading: Reading) -> float:
        """Sum over joints of the logarithms between the scatter of the torque and that of the links as given."""
        columns = self.fitter.columns(reading)
        rigid = rigid_body_torque(reading.arm, columns.motion, reading.inertial)
        given = np.std(rigid + columns.stated, axis=0)
        sizes = np.std(self.fitter.channels.read_torque(reading), axis=0)
        loaded = (given > 0) & (sizes > 0)
        return float(np.sum(np.abs(np.log(sizes[loaded] / given[loaded]))))


SMALLEST = 1e-300
TRAVEL_DEGREES = 4  # of freedom of Student's t: some joints hardly move
CONFIDENCE = 0.95  # of what a reading surely explains, two-sided
DOUBT_SHARE = 0.5  # of the evidence for a name: what cannot be excluded
QUICK_SHARE = 0.75  # of a fall with links that bodies can have, which links without that bound show


def _periods(run: Run) -> float:
    """How many periods the motion of the fastest joint has."""
    fastest = max(travel_bandwidth(joint[:, None], run.rate_hz) for joint in run.position.T)
    return fastest * float(run.time[-1] - run.time[0])


def _confirms_clock(run: Run, likeness: float) -> bool:
    if run.velocity is None:
        return False
    slope = np.gradient(run.position, run.time, axis=0)
    product, power = np.sum(slope * run.velocity, axis=0), np.sum(slope**2, axis=0)
    gain = product / np.where(power > 0, power, 1.0)
    alike = product / np.sqrt(np.maximum(power * np.sum(run.velocity**2, axis=0), 1e-300))
    moving = power > 0
    return bool(np.all(alike[moving] > likeness) and np.all(np.abs(gain[moving] - 1) < 1 - likeness))
