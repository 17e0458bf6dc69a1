"""Every mistake alone on top of a reading; those with a number are scanned, and the best of them refined."""

from collections.abc import Callable, Iterable
from functools import partial

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from armlab.common.arrays import Array
from armlab.recordings.reading import mistakes as table
from armlab.recordings.reading.judge import ReadingJudge, Trial
from armlab.recordings.reading.mistakes import joint_names
from armlab.recordings.reading.reading import Reading


def search_singles(judge: ReadingJudge, start: Trial) -> list[Trial]:
    """Every mistake alone on top of a reading, refined, and springs of its joints beside them, the best first."""
    reading = start.reading
    absurd = judge.fitter.implausible(reading)
    quiet = judge.usual_joints(start)
    found = [
        judge.trial(each)
        for each in _exact(judge, reading)
        if not table.contradicted_by(each.mistakes[-1]) & quiet
        and judge.is_size_plausible(reading, each)
        and judge.fitter.implausible(each) <= absurd
    ]
    found += _zeros(judge, start)
    found += _gravities(judge, start)
    found += _delays(judge, start)
    found += _clocks(judge, start)
    found += _gears(judge, start)
    found += [judge.trial(each) for each in table.springs(reading)]
    return sorted(found, key=partial(_rank, judge))


def _rank(judge: ReadingJudge, trial: Trial) -> float:
    return trial.loss + judge.improbability(trial.reading)


def _exact(judge: ReadingJudge, reading: Reading) -> Iterable[Reading]:
    yield from table.signs(reading)
    yield from table.exchanges(reading, joint_names(reading.arm))
    yield from table.couplings(reading)
    for each in table.units(reading):
        if not (judge.clock_is_right and each.clock != reading.clock):
            yield each
    yield table.without_gravity(reading)
    yield from table.with_gravity_of_links(reading)
    yield from table.robot_file_meanings(reading, judge.recording)
    if reading.inertial is not None:
        yield from _torque_factors(judge, reading)


def _torque_factors(judge: ReadingJudge, reading: Reading) -> Iterable[Reading]:
    """Factors between the torque and that of the links as given, of all joints and of each; a usual unit near them."""
    own = judge.fitter.torque_gains(reading)
    everywhere = [(None, float(np.median(own)))] if reading.joints > 1 else []
    limit = judge.tuning.min_unit_factor
    for joint, factor in (*everywhere, *enumerate(own.tolist())):
        if factor > limit or 0 < factor < 1 / limit:
            near = min(table.TORQUE_UNITS, key=lambda each: abs(np.log(each / factor)))
            is_unit = abs(np.log(near / factor)) < np.log(limit)
            yield table.unit_error(reading, joint, table.TORQUE, near if is_unit else factor)


def _refine(make: Callable[[float], Reading], judge: ReadingJudge, around: float, reach: float) -> Trial:
    """The best reading of a number within a reach of a start."""
    outcome = minimize_scalar(
        lambda value: judge.trial(make(float(value))).loss,
        bounds=(around - reach, around + reach),
        method="bounded",
        options={"maxiter": judge.tuning.refine_steps, "xatol": 1e-3 * reach},
    )
    return judge.trial(make(float(outcome.x)))


def _zeros(judge: ReadingJudge, start: Trial) -> list[Trial]:
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
        refined = _refine(make, judge, best, float(table.ZERO_STEPS[1] - table.ZERO_STEPS[0]))
        angle = np.rad2deg(refined.reading.mistakes[-1].value("offset"))
        quarter = (0, *table.QUARTERS)[round(angle / 90) % 4]
        if abs(angle) >= judge.tuning.min_zero_deg and not _is_quarter(judge, scanned.get(quarter), refined, angle):
            out.append(refined)
    return out


def _half_turn(angle: float) -> float:
    """The same angle between -180 and 180 degrees."""
    return (angle + 180) % 360 - 180


def _is_quarter(judge: ReadingJudge, turned: Trial | None, refined: Trial, angle: float) -> bool:
    """Whether a zero is a multiple of 90 degrees: off from it by no more than physics, or the data do not tell."""
    if turned is None:
        return False
    off = abs(_half_turn(angle - np.rad2deg(turned.reading.mistakes[-1].value("offset"))))
    return off < judge.tuning.min_zero_deg or judge.fits_alike(turned, refined)


def _gravities(judge: ReadingJudge, start: Trial) -> list[Trial]:
    """Directions of gravity: the best of some, refined over both angles."""
    size = table.size_of_gravity(start.reading)
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
    if tilt < judge.tuning.min_tilt_deg or _is_level(judge, coarse, refined):
        return coarse
    return [*coarse, refined]


def _is_level(judge: ReadingJudge, coarse: list[Trial], refined: Trial) -> bool:
    """Whether the data do not tell gravity from an axis of the base: floors, walls and ceilings are level."""
    level = (each for each in coarse if np.count_nonzero(each.reading.arm.gravity) == 1)
    return any(judge.fits_alike(each, refined) for each in level)


def angle_between(first: Array, second: Array) -> float:
    """Angle of two vectors, degrees."""
    size = float(np.linalg.norm(first) * np.linalg.norm(second))
    return float(np.rad2deg(np.arccos(np.clip(first @ second / size, -1, 1)))) if size > 0 else 180.0


def _delays(judge: ReadingJudge, start: Trial) -> list[Trial]:
    """Shifts of torque, of all joints and of one."""
    margin, least = judge.fitter.channels.margin_s, judge.tuning.min_delay_s
    if margin <= least:
        return []
    shifts = np.geomspace(least, margin, judge.tuning.delay_steps)
    out = []
    others = [joint for joint in range(start.reading.joints) if joint + 1 not in judge.usual_joints(start)]
    for joint in (None, *(others if start.reading.joints > 1 else ())):

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


def _clocks(judge: ReadingJudge, start: Trial) -> list[Trial]:
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
    return [refined]


def _gears(judge: ReadingJudge, start: Trial) -> list[Trial]:
    """Ratios of gears, of joints that travel much further than joints of arms do, or much less."""
    out = []
    motion = judge.fitter.columns(start.reading).motion
    travel = np.ptp(motion.position, axis=0)
    for joint, own in enumerate(start.reading.arm.joints):
        little, far = judge.tuning.travels
        if own.kind != "revolute" or little <= travel[joint] <= far:
            continue
        outwards = travel[joint] > far

        def make(logarithm: float, sign: float, joint: int = joint) -> Reading:
            return table.gear_ratio(start.reading, joint, sign * float(np.exp(logarithm)))

        grid = np.log(table.GEAR_RATIOS) * (1 if outwards else -1)
        scanned = {(value, sign): judge.trial(make(value, sign)) for value in grid for sign in (1.0, -1.0)}
        value, sign = min(scanned, key=lambda each: scanned[each].loss)
        out.append(_refine(partial(make, sign=sign), judge, float(value), abs(float(grid[1] - grid[0]))))
    return out
