"""Units that are probably too small (or too large) for their numbers, though an arm could show them: warnings.

What no arm could show is refused (`impossible.py`). An arm may move by one degree in all; that nobody has recorded an
arm so is why it is doubtful.
"""

from collections.abc import Sequence

import numpy as np

from armlab.common.arrays import Array
from armlab.recordings.imports.gears import Gear
from armlab.recordings.imports.numbers import POSITION_SIGNALS, Numbers, Units, torque_peaks, units_per_joint
from armlab.recordings.possible import OUTLIER_SHARE, has_usual_position, position_range
from armlab.recordings.units import DRIVE_UNITS, SIGNAL_QUANTITIES
from problem.arm import Arm
from problem.motion import Motion
from problem.regressor import rigid_body_torque

SMALL_RANGE = {"revolute": 0.1, "prismatic": 0.01}  # rad, m: a motion whose joints all keep within says nothing
MIN_UNIT_FACTOR = 20.0  # between a unit and the one that fits: less may be the motion itself
SMALL_CURRENT_A = 0.02  # the largest of all joints: the smallest servos take more at rest
SMALL_TORQUE_SHARE = 1e-3  # of the torque limit, at every joint that has one
GRAVITY_RATIOS = (0.05, 100.0)  # of the largest torque to the largest that gravity needs, at every joint that carries
CARRYING_SHARE = 0.1  # of the largest gravity torque: a joint with less carries little
MIN_RATIO = 1e-12  # a joint whose torque is zero counts as one with so little
FITTING_RATIOS = (0.2, 20.0)  # of the same ratio in a unit that fits
MIN_LEVER_M = 1e-3  # of all links' weight at a turning joint: less is rounding of the file, and loads nothing
POSES = 300  # at which gravity is computed


def doubtful_units(
    numbers: Sequence[Numbers], arm: Arm | None, units: Units, gains: Sequence[float] | None, gear: Gear | None
) -> tuple[str, ...]:
    """A sentence for each signal whose unit is probably another one.

    units, gains: of all signals that were recorded; the unit of each can be right, as far as physics says.
    """
    if not numbers:
        return ()
    found = [_doubt_position(numbers, signal, units, gear) for signal in POSITION_SIGNALS if signal in units]
    if "torque" in units:
        found.append(_doubt_torque(numbers, arm, units, gains, gear))
    return tuple(text for text in found if text is not None)


def _doubt_position(numbers: Sequence[Numbers], signal: str, units: Units, gear: Gear | None) -> str | None:
    """A motion that is too small where another unit makes it a usual one."""
    if any(signal not in each.signals for each in numbers):
        return None
    joints, known = numbers[0].joints, SIGNAL_QUANTITIES[signal].units
    names = units_per_joint(units[signal], joints)
    ranges = [position_range(each.signals[signal]) for each in numbers]
    low, high = np.min([each[0] for each in ranges], axis=0), np.max([each[1] for each in ranges], axis=0)
    small = np.array([SMALL_RANGE[joint.kind] for joint in joints])
    factors = np.array([known[name].factor for name in names])
    if np.any(factors * (high - low) >= small) or len(set(names)) > 1 or not np.any(high > low):
        return None
    widest = int(np.argmax(factors * (high - low) / small))
    moves = f"no joint moves by more than {high[widest] - low[widest]:.3g} {names[widest]} ({joints[widest].name})"
    words = signal.replace("_", " ")
    if gear is not None and gear.is_before(signal):
        return f"{words}: {moves}, behind the gears: is it measured at the joints? Then leave --gear-ratio out"
    for name, unit in known.items():
        usual = [
            has_usual_position(joint, unit.factor * least, unit.factor * most)
            for joint, least, most in zip(joints, low, high, strict=True)
        ]
        is_larger = unit.quantity == known[names[0]].quantity and unit.factor >= MIN_UNIT_FACTOR * factors[0]
        if is_larger and all(usual) and np.any(unit.factor * (high - low) >= small):
            return f"{words}: {moves}; in {name} the motion would be a usual one: --unit {signal}={name}?"
    return None


def _doubt_torque(
    numbers: Sequence[Numbers], arm: Arm | None, units: Units, gains: Sequence[float] | None, gear: Gear | None
) -> str | None:
    """Torques that are far from what gravity needs, else far from the limits; currents that no moving arm has."""
    joints, known = numbers[0].joints, SIGNAL_QUANTITIES["torque"].units
    if any("torque" not in each.signals for each in numbers):
        return None
    names = units_per_joint(units["torque"], joints)
    factors = np.array([known[name].factor for name in names])
    raw = np.max([torque_peaks(each) for each in numbers], axis=0)
    if not np.any(raw > 0):
        return None
    measured = factors * raw / np.abs(np.array(numbers[0].ratios["torque"]))
    if set(names) == {"mA"} and np.max(measured) < SMALL_CURRENT_A:
        return f"torque: no drive takes more than {1e3 * np.max(measured):.3g} mA: --unit torque=A?"
    peaks = factors * raw * np.abs(np.array(gains if gains is not None else (1.0,) * len(names)))
    needed = _gravity_peaks(numbers, arm, units)
    if needed is None or arm is None:
        return _doubt_by_limits(numbers[0], peaks, names)
    ratios = _over_gravity(peaks, needed)
    if np.nanmax(ratios) >= GRAVITY_RATIOS[0]:
        needed = _gravity_anywhere(arm)
        ratios = _over_gravity(peaks, needed)
        if np.nanmin(ratios) <= GRAVITY_RATIOS[1]:
            return None
    place = int(np.argmax(needed))
    si = SIGNAL_QUANTITIES["torque"].si[joints[place].kind == "prismatic"]
    text = (
        f"torque of joint {joints[place].name} is {peaks[place]:.3g} {si} at most, where the links of the robot file "
        f"need {needed[place]:.3g} {si} against gravity"
    )
    middle = float(np.exp(np.nanmean(np.log(np.maximum(ratios, MIN_RATIO)))))
    return f"{text}: {_torque_advice(names, middle, is_geared=gear is not None and gear.torque)}"


def _over_gravity(peaks: Array, needed: Array) -> Array:
    """Largest torques over those that gravity needs, (joints,); NaN for joints that carry little."""
    carrying = needed >= CARRYING_SHARE * np.max(needed)
    return np.where(carrying, peaks / np.where(carrying, needed, 1.0), np.nan)


def _torque_advice(names: Sequence[str], ratio: float, is_geared: bool) -> str:
    """What may be wrong where torques are `ratio` times what gravity needs."""
    known = SIGNAL_QUANTITIES["torque"].units
    own, low, high = known[names[0]], *FITTING_RATIOS
    fitting = [
        name
        for name, unit in known.items()
        if unit.quantity == own.quantity and name not in names and low <= ratio * unit.factor / own.factor <= high
    ]
    causes = [f"another unit (--unit torque={fitting[0]})"] if fitting and len(set(names)) == 1 else []
    if any(name in DRIVE_UNITS for name in names):
        causes.append("other --gains")
    if is_geared:
        causes.append("torque of the joints (then --motor-side position)")
    elif ratio < 1:
        causes.append("torque of the motors (--gear-ratio with --motor-side torque)")
    if ratio < 1:
        causes.append("torque without gravity")
    return " or ".join(causes or ["another robot"]) + "?"


def _gravity_peaks(numbers: Sequence[Numbers], arm: Arm | None, units: Units) -> Array | None:
    """The largest torque that gravity needs at each joint in the recorded poses, (joints,).

    None where links are unknown, and where gravity loads no joint.
    """
    if arm is None or arm.links is None or len(arm) != len(numbers[0].joints):
        return None
    known = SIGNAL_QUANTITIES["position"].units
    factors = np.array([known[name].factor for name in units_per_joint(units["position"], numbers[0].joints)])
    peaks = []
    for each in numbers:
        rows = np.unique(np.linspace(0, len(each.time) - 1, POSES).astype(int))
        position = each.signals["position"][rows] * factors
        torque = rigid_body_torque(arm, Motion(position, np.zeros_like(position), np.zeros_like(position)))
        peaks.append(np.quantile(np.abs(torque), 1 - OUTLIER_SHARE, axis=0))
    needed = np.max(peaks, axis=0)
    weight = float(np.linalg.norm(arm.gravity)) * sum(link.mass for link in arm.links)
    return needed if np.all(np.isfinite(needed)) and np.max(needed) > MIN_LEVER_M * weight else None


def _gravity_anywhere(arm: Arm) -> Array:
    """The largest torque that gravity needs at each joint in poses all over its range, (joints,).

    A log near the upright pose needs little, and its torque is none the less right.
    """
    turn = np.random.default_rng(0).uniform(-np.pi, np.pi, (POSES, len(arm)))
    ends = np.array([joint.limits.position for joint in arm.joints], dtype=float)
    bounded = np.isfinite(ends).all(axis=1)
    low, high = np.where(bounded[:, None], ends, (-np.pi, np.pi)).T
    position = low + (high - low) * (turn + np.pi) / (2 * np.pi)
    still = np.zeros_like(position)
    return np.asarray(np.max(np.abs(rigid_body_torque(arm, Motion(position, still, still))), axis=0))


def _doubt_by_limits(numbers: Numbers, peaks: Array, names: Sequence[str]) -> str | None:
    limits = np.array([joint.limits.torque for joint in numbers.joints])
    finite = np.isfinite(limits) & (limits > 0)
    if not np.any(finite) or np.any(peaks[finite] >= SMALL_TORQUE_SHARE * limits[finite]):
        return None
    place = int(np.argmax(np.where(finite, peaks, -1.0)))
    si = SIGNAL_QUANTITIES["torque"].si[numbers.joints[place].kind == "prismatic"]
    return (
        f"no torque is larger than {peaks[place]:.3g} {si} (joint {numbers.joints[place].name}, its limit is "
        f"{limits[place]:.3g}): another unit than {names[place]}, or torque of the motors (--gear-ratio)?"
    )
