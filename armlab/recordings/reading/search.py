"""The search for the mistakes of a recording: each alone, then beside the best ones, judged on held-out blocks.

A reading counts by the sum over joints of the mean logarithm of its held-out errors, with links near those of the
simulation, and with links that the data decide. A mistake is accepted only where the errors fall far, on most blocks
alike, and beyond what links and laws of the joint's own position could explain.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from armlab.common.arrays import Array
from armlab.recordings.reading import mistakes as table
from armlab.recordings.reading.fit import Fitter
from armlab.recordings.reading.mistakes import joint_names
from armlab.recordings.reading.reading import Mistake, Reading
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
        scores = self.fitter.scores(reading, widths, physical)
        losses = [each.losses(tuning.smallest_error) + beyond for each in scores]
        return Trial(reading, losses[0] if known else None, losses[-1])

    def is_size_plausible(self, parent: Reading, reading: Reading) -> bool:
        """Whether a last mistake that scales torques or links makes their sizes more alike, as a wrong unit does.

        Else the links may vanish, or grow, until friction alone explains the torque.
        """
        mistake = reading.mistakes[-1]
        links = mistake.effect == "link_data_error" and mistake.form != "centre_sign"
        scales = links or (mistake.effect == "unit_error" and mistake.form == table.TORQUE)
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
        motion = self.fitter.columns(reading).motion
        given = np.std(rigid_body_torque(reading.arm, motion, reading.inertial), axis=0)
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


def search_singles(judge: Judge, start: Trial) -> list[Trial]:
    """Every mistake alone on top of a reading, refined, the best first."""
    reading = start.reading
    absurd = judge.fitter.implausible(reading)
    found = [
        judge.trial(each)
        for each in _exact(judge, reading)
        if judge.is_size_plausible(reading, each) and judge.fitter.implausible(each) <= absurd
    ]
    found += _zeros(judge, start)
    found += _gravities(judge, start)
    found += _delays(judge, start)
    found += _clocks(judge, start)
    found += _gears(judge, start)
    return sorted(found, key=lambda each: each.loss + judge.tuning.rare_loss * table.is_rare(each.reading.mistakes[-1]))


def _exact(judge: Judge, reading: Reading) -> Iterable[Reading]:
    yield from table.signs(reading)
    yield from table.exchanges(reading, joint_names(reading.arm))
    for each in table.units(reading):
        if not (judge.clock_is_right and each.clock != reading.clock):
            yield each
    yield table.without_gravity(reading)
    yield from table.robot_file_meanings(reading, judge.recording)
    if reading.inertial is not None:
        yield from _torque_factors(judge, reading)


def _torque_factors(judge: Judge, reading: Reading) -> Iterable[Reading]:
    """Factors between the torque and that of the links as given, where they are far from one."""
    score = judge.fitter.torque_gains(reading)
    own = np.array([gain for gain, _ in score])
    sure = np.array([share for _, share in score]) > judge.tuning.min_gain_share
    if reading.joints > 1 and sure.any():
        yield from _torque_factor(judge, reading, None, float(np.median(own[sure])))
    for joint in np.flatnonzero(sure):
        yield from _torque_factor(judge, reading, int(joint), float(own[joint]))


def _torque_factor(judge: Judge, reading: Reading, joint: int | None, factor: float) -> Iterable[Reading]:
    limit = judge.tuning.min_unit_factor
    if factor > limit or 0 < factor < 1 / limit:
        near = min(table.TORQUE_UNITS, key=lambda each: abs(np.log(each / factor)))
        known = abs(np.log(near / factor)) < judge.tuning.unit_tolerance
        yield table.unit_error(reading, joint, table.TORQUE, near if known else factor)


def _refine(make: Callable[[float], Reading], judge: Judge, around: float, reach: float) -> Trial:
    """The best reading of a number within a reach of a start."""
    outcome = minimize_scalar(
        lambda value: judge.trial(make(float(value))).loss,
        bounds=(around - reach, around + reach),
        method="bounded",
        options={"maxiter": judge.tuning.refine_steps, "xatol": 1e-3 * reach},
    )
    return judge.trial(make(float(outcome.x)))


def _zeros(judge: Judge, start: Trial) -> list[Trial]:
    """Zeros of each joint that turns: scanned, the best refined, a quarter of a turn where that is as good."""
    out = []
    for joint, own in enumerate(start.reading.arm.joints):
        if own.kind != "revolute":
            continue

        def make(angle: float, joint: int = joint) -> Reading:
            return table.encoder_offset(start.reading, joint, float(np.deg2rad(angle)))

        scanned = {angle: judge.trial(make(angle)) for angle in table.ZERO_STEPS if angle}
        out += [scanned[angle] for angle in table.QUARTERS]
        best = min(scanned, key=lambda angle: scanned[angle].loss)
        if scanned[best].loss > start.loss - judge.tuning.min_refined_gain and best in table.QUARTERS:
            continue
        refined = _refine(make, judge, best, 30.0)
        angle = np.rad2deg(refined.reading.mistakes[-1].value("offset"))
        quarter = round(angle / 90) * 90
        if abs(angle) >= judge.tuning.min_zero_deg and not _is_quarter(judge, scanned.get(quarter), refined, angle):
            out.append(refined)
    return out


def _is_quarter(judge: Judge, turned: Trial | None, refined: Trial, angle: float) -> bool:
    """Whether a zero is a multiple of 90 degrees: near it, or the data do not tell it from one not far away."""
    if turned is None:
        return False
    off = abs(angle - np.rad2deg(turned.reading.mistakes[-1].value("offset")))
    if off < judge.tuning.quarter_tolerance_deg:
        return True
    gain = Gain.between(turned, refined)
    doubtful = gain.near < judge.tuning.min_quarter_gain or gain.near_sigmas < judge.tuning.min_sigmas
    return off < judge.tuning.quarter_reach_deg and doubtful


def _gravities(judge: Judge, start: Trial) -> list[Trial]:
    """Directions of gravity: the best of some, refined over both angles."""
    size = float(np.linalg.norm(start.reading.arm.gravity))
    if size == 0:
        return []
    coarse = [judge.trial(each) for each in table.gravity_directions(start.reading)]
    best = min(coarse, key=lambda each: each.loss)
    if best.loss > start.loss - judge.tuning.min_refined_gain:
        return [best]
    centre = np.array(best.reading.arm.gravity) / size
    side = np.linalg.svd(centre[None])[2][1:]

    def make(tilt: Array) -> Reading:
        direction = centre + tilt @ side
        return table.base_tilt(start.reading, size * direction / np.linalg.norm(direction))

    steps = {"maxfev": 6 * judge.tuning.refine_steps, "initial_simplex": np.array([[0, 0], [0.4, 0], [0, 0.4]])}
    outcome = minimize(lambda tilt: judge.trial(make(tilt)).loss, np.zeros(2), method="Nelder-Mead", options=steps)
    refined = judge.trial(make(outcome.x))
    tilt = angle_between(np.array(refined.reading.arm.gravity), np.array(start.reading.arm.gravity))
    return [best, *([refined] if tilt >= judge.tuning.min_tilt_deg else [])]


def angle_between(first: Array, second: Array) -> float:
    """Angle of two vectors, degrees."""
    size = float(np.linalg.norm(first) * np.linalg.norm(second))
    return float(np.rad2deg(np.arccos(np.clip(first @ second / size, -1, 1)))) if size > 0 else 180.0


def _delays(judge: Judge, start: Trial) -> list[Trial]:
    """Shifts of torque, of all joints and of one."""
    margin, least = judge.fitter.channels.margin_s, judge.tuning.min_delay_s
    if margin <= least:
        return []
    shifts = np.geomspace(least, margin, judge.tuning.delay_steps)
    out = []
    for joint in (None, *(range(start.reading.joints) if start.reading.joints > 1 else ())):

        def make(seconds: float, joint: int | None = joint) -> Reading:
            return table.late_torque(start.reading, joint, seconds)

        scanned = {shift: judge.trial(make(float(shift))) for shift in (*shifts, *-shifts)}
        best = min(scanned, key=lambda shift: scanned[shift].loss)
        if scanned[best].loss > start.loss - judge.tuning.min_refined_gain:
            continue
        reach = abs(best) * (shifts[1] / shifts[0] - 1)
        refined = _refine(make, judge, float(np.clip(best, reach - margin, margin - reach)), float(reach))
        if abs(refined.reading.mistakes[-1].value("seconds")) >= least:
            out.append(refined)
    return out


def _clocks(judge: Judge, start: Trial) -> list[Trial]:
    """Clocks that run too fast or too slow."""
    if judge.clock_is_right:
        return []
    scale = np.log(judge.tuning.max_clock_factor)

    def make(logarithm: float) -> Reading:
        return table.clock_error(start.reading, float(np.exp(logarithm)))

    grid = scale * np.linspace(-1, 1, judge.tuning.clock_steps)
    scanned = {value: judge.trial(make(value)) for value in grid}
    best = min(scanned, key=lambda value: scanned[value].loss)
    if scanned[best].loss > start.loss - judge.tuning.min_refined_gain:
        return []
    refined = _refine(make, judge, float(best), float(grid[1] - grid[0]))
    factor = refined.reading.mistakes[-1].value("factor")
    return [refined] if abs(np.log(factor)) >= np.log(judge.tuning.min_clock_factor) else []


def _gears(judge: Judge, start: Trial) -> list[Trial]:
    """Ratios of gears, of joints that travel further than an arm can or hardly at all."""
    out = []
    motion = judge.fitter.columns(start.reading).motion
    travel = np.ptp(motion.position, axis=0)
    for joint, own in enumerate(start.reading.arm.joints):
        far, little = judge.tuning.far_travel, judge.tuning.little_travel
        if own.kind != "revolute" or little <= travel[joint] <= far:
            continue
        outwards = travel[joint] > far

        def make(logarithm: float, sign: float, joint: int = joint) -> Reading:
            return table.gear_ratio(start.reading, joint, sign * float(np.exp(logarithm)))

        grid = np.log(table.GEAR_RATIOS) * (1 if outwards else -1)
        pairs = [(value, sign) for value in grid for sign in (1.0, -1.0)]
        plausible = [each for each in pairs if joint not in judge.fitter.implausible(make(*each))]
        if not plausible:
            continue
        scanned = {each: judge.trial(make(*each)) for each in plausible}
        value, sign = min(scanned, key=lambda each: scanned[each].loss)
        out.append(_refine(partial(make, sign=sign), judge, float(value), abs(float(grid[1] - grid[0]))))
    return out


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


@dataclass(frozen=True, eq=False)
class Found:
    """What a search found. start: as it is read; best: read rightly, with its mistakes. without: read with all of them
    but one. rivals: of each mistake, other mistakes in its place that fit alike. undecided: joints (from 1) whose zeros
    the data do not tell by quarters of a turn. tried: the best readings that were not accepted.
    """

    start: Trial
    best: Trial
    without: tuple[Trial, ...] = ()
    rivals: tuple[tuple[Trial, ...], ...] = ()
    undecided: tuple[int, ...] = ()
    tried: tuple[Trial, ...] = ()
    looks: int = 0


def find_mistakes(judge: Judge, start: Trial) -> Found:
    """The mistakes of a reading, at most as many as the tuning allows."""
    tuning = judge.tuning
    least = reading_floor(start, tuning)
    if start.loss - least < tuning.min_gain:
        return Found(start, start, looks=judge.looks[0])
    singles = search_singles(judge, start)
    best, beside = _extend(judge, start, start, singles)
    if best is start or _is_bad(best, tuning):
        limit = start.loss - tuning.min_refined_gain
        if best is not start:
            limit = min(limit, singles[0].loss + tuning.near_best)
        for first in _distinct(singles, tuning.beam):
            if first.loss > limit or first.reading.mistakes == best.reading.mistakes[:1]:
                continue
            other, more = _extend(judge, start, first, search_singles(judge, first))
            if other is not first and other.loss < best.loss - tuning.min_gain and is_accepted(judge, start, other):
                best, beside = other, more
    if best is start:
        return Found(start, start, tried=tuple(singles[: tuning.beam]), looks=judge.looks[0])
    best = _merge_same(judge, start, best)
    for _ in range(tuning.max_mistakes):
        without = _without_each(judge, start, best)
        lists = [singles] if len(without) == 1 else [search_singles(judge, each) for each in without]
        better = _better_in_place(judge, without, lists, best)
        if better is None:
            break
        best = better
    rivals = tuple(_rivals(judge, without[place], best, place, each) for place, each in enumerate(lists))
    return Found(start, best, without, rivals, _undecided(beside, best, tuning), looks=judge.looks[0])


def reading_floor(trial: Trial, tuning: ReadingTuning) -> float:
    """The least loss that any reading can have."""
    return math.log(tuning.smallest_error) * trial.reading.joints


def _is_bad(trial: Trial, tuning: ReadingTuning) -> bool:
    return float(np.max(np.mean(trial.free, axis=0))) > math.log(tuning.good_error)


def _extend(judge: Judge, start: Trial, trial: Trial, singles: list[Trial]) -> tuple[Trial, list[Trial]]:
    """Takes the best accepted mistake, one after the other; the last list of single mistakes beside it."""
    while len(trial.reading.mistakes) < judge.tuning.max_mistakes:
        accepted = next((each for each in singles if is_accepted(judge, trial, each)), None)
        if accepted is None:
            break
        trial = accepted
        singles = search_singles(judge, trial)
    return trial, singles


def _distinct(singles: list[Trial], count: int) -> list[Trial]:
    """The best ones, each effect once at a place and in a form."""
    out: dict[tuple[str, str], Trial] = {}
    for each in singles:
        own = each.reading.mistakes[-1]
        out.setdefault((own.label, own.form), each)
    return list(out.values())[:count]


def _without_each(judge: Judge, start: Trial, best: Trial) -> tuple[Trial, ...]:
    """The readings that leave out one mistake of the best one, in their order."""
    own = best.reading.mistakes
    if len(own) == 1:
        return (start,)
    others = [[each for each in own if each is not mistake] for mistake in own]
    return tuple(judge.trial(rebuild(judge, start.reading, each)) for each in others)


def _merge_same(judge: Judge, start: Trial, best: Trial) -> Trial:
    """The reading with one mistake where it has two of one kind at one place: the first was only a part."""
    labels = [each.label for each in best.reading.mistakes]
    twice = next((label for label in labels if labels.count(label) > 1), None)
    if twice is None:
        return best
    others = [each for each in best.reading.mistakes if each.label != twice]
    singles = search_singles(judge, judge.trial(rebuild(judge, start.reading, others)))
    merged = next((each for each in singles if each.reading.mistakes[-1].label == twice), None)
    return best if merged is None or merged.loss > best.loss + judge.tuning.rival_gain else merged


def _better_in_place(judge: Judge, without: tuple[Trial, ...], lists: list[list[Trial]], best: Trial) -> Trial | None:
    """A reading that is better with another mistake in the place of one; a first step may have been a wrong one."""
    for parent, singles in zip(without, lists, strict=True):
        other = next((each for each in singles[: judge.tuning.beam] if is_accepted(judge, parent, each)), None)
        if other is not None and other.loss < best.loss - judge.tuning.rival_gain:
            return other
    return None


def _rivals(judge: Judge, without: Trial, best: Trial, place: int, singles: list[Trial]) -> tuple[Trial, ...]:
    """Readings with another mistake at one place that fit as well as the best one. singles: beside the other ones."""
    tuning = judge.tuning
    own = best.reading.mistakes[place]
    out: dict[str, Trial] = {}
    for each in singles:
        mistake = each.reading.mistakes[-1]
        gain = Gain.between(each, best)
        alike = gain.near < tuning.rival_gain or gain.near_sigmas < tuning.rival_sigmas
        if gain.near > tuning.max_rival_gain or not alike or mistake.label in (own.label, *out):
            continue
        if is_accepted(judge, without, each):
            out[mistake.label] = each
    return tuple(out.values())


def _undecided(singles: list[Trial], best: Trial, tuning: ReadingTuning) -> tuple[int, ...]:
    """Joints whose zero may as well be a multiple of 90 degrees off."""
    out = set()
    for each in singles:
        mistake = each.reading.mistakes[-1]
        if mistake.effect != "encoder_offset" or Gain.between(each, best).near >= tuning.rival_gain:
            continue
        if abs(abs(mistake.value("offset")) % (np.pi / 2)) < 1e-9:
            out.add(mistake.joint or 0)
    return tuple(sorted(out))


def rebuild(judge: Judge, reading: Reading, mistakes: Iterable[Mistake]) -> Reading:
    """The reading with mistakes taken back one after the other."""
    for mistake in mistakes:
        reading = table.take_back(reading, mistake, judge.recording)
    return reading
