"""What a recorded joint may show: what is usual for its limits, and what no arm could do.

The second bounds are generous, since limits of a robot file may be placeholders, zeros differ, a wrist may turn on, and
a log has outliers: what is beyond them is a mistake of the unit, not of the arm.
"""

import numpy as np

from armlab.common.arrays import Array
from problem.arm import Joint

LIMIT_TOLERANCE_FACTOR = 1.05  # times a limit: calibration and rounding aside
SLOWEST_HZ = 5.0  # no drive is recorded more slowly
FASTEST_HZ = 1e6  # nor faster
MAX_STEP_S = 1e3  # from row to row: no arm is logged so rarely, not even pose by pose
TURN = 2 * np.pi  # rad
MAX_TURNS_BEYOND = 2  # turns beyond a limit of a joint with stops: the zero of its encoder is another one
MAX_LENGTH_BEYOND_M = 10.0  # the same of a joint that slides
FREE_SPEED_RATIO = 5.0  # times the velocity limit: a joint without stops that is slower may really turn so far
SPEED_RATIO, MIN_SPEED_BOUND = 10.0, {"revolute": 100.0, "prismatic": 20.0}  # times the limit; rad/s, m/s at least
MAX_CREEP = 0.01  # rad/s or m/s: a motion that is never faster, at a rate below SLOWEST_HZ, has another clock
MIN_CREEP_RANGE = 0.1  # rad or m: a joint with less stands still
TORQUE_RATIO, MIN_TORQUE_BOUND = 100.0, 1e3  # times the limit; N m or N at least
MAX_TORQUE = 1e5  # N m or N, of the largest arms, where no limit is known
MAX_DRIVE = {"A": 200.0, "V": 1e3}  # of the motors of the largest arms
DRIVE_DOUBT_FACTOR = 0.1  # times the bound of the torque, where the numbers of the drive are greater than that
OUTLIER_SHARE = 0.01  # of the rows, at each end
MOVING_SHARE = 0.1  # of the rows: a speed that is kept for so long is no wrap of an encoder
MAX_BLOCK_ROWS = 50
MIN_ROWS = 20  # for a speed
MIN_SLOPE_CORRELATION = 0.9  # of a velocity channel with the slope of its position


def can_have_step(step: float) -> bool:
    """Whether a log could have rows so far apart, s."""
    return 1 / FASTEST_HZ <= step <= MAX_STEP_S


def has_usual_position(joint: Joint, low: float, high: float) -> bool:
    """Whether positions from low to high, rad or m, keep the limits; true where one is unknown."""
    least, most = joint.limits.position
    slack = (LIMIT_TOLERANCE_FACTOR - 1) * (most - least)
    return not np.isfinite(slack) or (low >= least - slack and high <= most + slack)


def can_have_position(joint: Joint, low: float, high: float, speed: float) -> bool:
    """Whether an arm could show positions from low to high, rad or m, at a usual speed, rad/s or m/s.

    A joint whose limits leave it a whole turn may have no stops: it can turn on, but not much faster than its limit.
    """
    least, most = joint.limits.position
    turns = joint.kind == "revolute"
    slack = MAX_TURNS_BEYOND * TURN if turns else MAX_LENGTH_BEYOND_M
    if low >= least - slack and high <= most + slack:
        return True
    return turns and most - least >= TURN and speed <= FREE_SPEED_RATIO * joint.limits.velocity


def can_have_speed(joint: Joint, speed: float) -> bool:
    """Whether an arm could move a joint at a usual speed, rad/s or m/s."""
    limit = joint.limits.velocity
    return speed <= max(SPEED_RATIO * limit if np.isfinite(limit) else 0.0, MIN_SPEED_BOUND[joint.kind])


def can_have_torque(joint: Joint, torque: float, drive: float, drive_unit: str | None) -> bool:
    """Whether an arm could show a torque, N m or N. drive: the current or voltage that it was made of, A or V."""
    limit = joint.limits.torque
    bound = max(TORQUE_RATIO * limit, MIN_TORQUE_BOUND) if np.isfinite(limit) else MAX_TORQUE
    if drive_unit is not None and drive > MAX_DRIVE[drive_unit]:
        bound *= DRIVE_DOUBT_FACTOR
    return torque <= bound


def position_range(position: Array) -> tuple[Array, Array]:
    """Least and greatest position of each joint without outliers; position: (rows, joints), rows may hold NaN."""
    low, high = np.transpose([np.nanquantile(own, (OUTLIER_SHARE, 1 - OUTLIER_SHARE)) for own in position.T])
    return low, high


def usual_speeds(position: Array, step: float) -> Array:
    """Speeds that each joint exceeds in a tenth of the rows, (joints,), averaged over blocks of rows.

    position: (rows, joints), finite; step: s from row to row. Zero where the rows are too few.
    """
    rows = len(position)
    block = min(max(rows // 100, 5), MAX_BLOCK_ROWS)
    if rows < max(MIN_ROWS, 2 * block):
        return np.zeros(position.shape[1])
    moved = [np.quantile(np.abs(own[block:] - own[:-block]), 1 - MOVING_SHARE) for own in position.T]
    return np.array(moved) / (block * step)


def is_creeping(position: Array, step: float) -> bool:
    """Whether rows come more rarely than those of any drive, while the motion is slower than any that is recorded.

    position: (rows, joints), rad or m, finite; step: s from row to row.
    """
    if len(position) < MIN_ROWS or step <= 1 / SLOWEST_HZ:
        return False
    low, high = position_range(position)
    fastest = np.array([np.quantile(np.abs(np.diff(own)), 1 - OUTLIER_SHARE) for own in position.T]) / step
    return bool(np.any(high - low > MIN_CREEP_RANGE) and np.all(fastest <= MAX_CREEP))


def velocity_scales(time: Array, position: Array, velocity: Array) -> Array:
    """Recorded velocity over the slope of the position, (joints,), in their own units; NaN where the two are not alike.

    time: (rows,); position, velocity: (rows, joints), rows may hold NaN. Averages remove the steps of the encoder.
    """
    whole = np.isfinite(time) & np.isfinite(position).all(axis=1) & np.isfinite(velocity).all(axis=1)
    time, position, velocity = time[whole], position[whole], velocity[whole]
    rises = np.concatenate([[True], np.diff(time) > 0])[: len(time)]
    if rises.sum() < MIN_ROWS or np.any(np.diff(time[rises]) <= 0):
        return np.full(position.shape[1], np.nan)
    slopes = block_means(np.gradient(position[rises], time[rises], axis=0))
    pairs = zip(block_means(velocity[rises]).T, slopes.T, strict=True)
    return np.array(
        [
            float(own @ slope / (slope @ slope)) if correlation(own, slope) >= MIN_SLOPE_CORRELATION else np.nan
            for own, slope in pairs
        ]
    )


def block_means(signal: Array) -> Array:
    """Means over stretches of about a hundredth of the run; signal: (rows, channels)."""
    length = max(len(signal) // 100, 1)
    whole = len(signal) // length * length
    return np.asarray(signal[:whole].reshape(-1, length, signal.shape[1]).mean(axis=1))


def correlation(first: Array, second: Array) -> float:
    """Of two signals (rows,); zero where one of them is constant."""
    first, second = first - first.mean(), second - second.mean()
    scale = float(np.linalg.norm(first) * np.linalg.norm(second))
    return float(first @ second) / scale if scale > 0 else 0.0
