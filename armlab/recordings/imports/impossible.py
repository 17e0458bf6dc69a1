"""Units that cannot be right: the numbers of a file, read in them, would be what no arm could do."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.recordings.imports.doubtful import SMALL_RANGE
from armlab.recordings.imports.numbers import POSITION_SIGNALS, Numbers, Units, torque_peaks, units_per_joint
from armlab.recordings.imports.proposals import propose_unit
from armlab.recordings.imports.questions import Question
from armlab.recordings.imports.recognition import RATES_HZ
from armlab.recordings.possible import (
    TURN,
    can_have_position,
    can_have_speed,
    can_have_step,
    can_have_torque,
    is_creeping,
    position_range,
    usual_speeds,
    velocity_scales,
)
from armlab.recordings.units import DRIVE_UNITS, SIGNAL_QUANTITIES, TIME_UNITS

SLOPE_TOLERANCE = 0.1  # relative: of a velocity that a drive filters
IsPossible = Callable[[int, float], bool]  # for a joint's place and the factor of a unit


@dataclass(frozen=True)
class Impossible:
    """A signal whose unit cannot be right, the sentence that says why, and a unit that can be, if there is one.

    may_lack_gear: whether the numbers may be those of motors, of which no gear ratio is known.
    """

    signal: str
    text: str
    right: str | None
    may_lack_gear: bool = False


def ask_impossible_units(
    numbers: Sequence[Numbers], units: Units, gains: Sequence[float] | None, same_units: Mapping[str, str]
) -> tuple[Question, ...]:
    """A question for each signal whose numbers cannot be in its unit, with a unit that can be as the proposal.

    units, gains: those that are known. same_units: signals of a format that have the unit of another one.
    Raises InputError where no unit can be right.
    """
    found: dict[str, Impossible] = {}
    for each in numbers:
        for wrong in _judge(each, units, gains):
            where = f"{each.file}: " if len(numbers) > 1 else ""
            found.setdefault(wrong.signal, replace(wrong, text=where + wrong.text))
    for signal, same in same_units.items():
        if signal in found and same in found and units[signal] == units[same]:
            del found[signal]  # the answer to the other one is for both
    return tuple(_ask(each) for each in found.values())


def _ask(found: Impossible) -> Question:
    gear = ", or angles of the motors, which need --gear-ratio" if found.may_lack_gear else ""
    if found.right is None:
        raise InputError(f"{found.text}: no unit makes that possible; other columns{gear}?")
    known = ", ".join(SIGNAL_QUANTITIES[found.signal].units)
    text = f"{found.text}{gear}\nunit of {found.signal.replace('_', ' ')}: one of {known}"
    missing = f"{found.text}: --unit {found.signal}={found.right}{gear}?"
    return Question("units", missing, text, found.right, found.signal)


def _judge(numbers: Numbers, units: Units, gains: Sequence[float] | None) -> list[Impossible]:
    """The signals of a file whose units cannot be right."""
    clock = str(units["time"])
    known = [signal for signal in POSITION_SIGNALS if signal in numbers.signals and signal in units]
    found = [_judge_position(numbers, signal, units[signal], clock) for signal in known]
    if found[0] is None:
        found.append(_judge_motion(numbers, units["position"], clock))
    if all(each is None for each in found):
        found.append(_judge_velocity(numbers, units))
    if "torque" in numbers.signals and "torque" in units:
        found.append(_judge_torque(numbers, units["torque"], gains))
    return [each for each in found if each is not None]


def _judge_position(numbers: Numbers, signal: str, unit: str | tuple[str, ...], clock: str) -> Impossible | None:
    """Positions that are too far beyond the limits."""
    values, quantity = numbers.signals[signal], SIGNAL_QUANTITIES[signal]
    low, high = position_range(values)
    speeds = usual_speeds(values, numbers.step * TIME_UNITS[clock].factor)

    def is_possible(place: int, factor: float) -> bool:
        return can_have_position(
            numbers.joints[place], factor * low[place], factor * high[place], factor * speeds[place]
        )

    names = units_per_joint(unit, numbers.joints)
    wrong = _first_wrong(signal, names, is_possible)
    if wrong is None:
        return None
    joint, name = numbers.joints[wrong], names[wrong]
    extreme, (least, most) = float(max(low[wrong], high[wrong], key=abs)), joint.limits.position
    size, si = abs(quantity.units[name].factor * extreme), quantity.si[joint.kind == "prismatic"]
    reached = f"{size / TURN:.3g} turns" if si == "rad" else f"{size:.3g} m"
    text = (
        f"{signal.replace('_', ' ')} of joint {joint.name} reaches {extreme:.4g}{_behind(numbers, signal, wrong)}, "
        f"as {name} that is {reached}, its limits are {least:.3g} and {most:.3g} {si}"
    )
    right = _fitting_unit(numbers, signal, name, is_possible)
    return Impossible(signal, text, right, may_lack_gear=signal == "position" and numbers.ratios[signal][wrong] == 1.0)


def _behind(numbers: Numbers, signal: str, place: int) -> str:
    """` behind a gear of 100` where a ratio is given."""
    ratio = numbers.ratios[signal][place]
    return "" if ratio == 1.0 else f" behind a gear of {ratio:g}"


def _judge_motion(numbers: Numbers, unit: str | tuple[str, ...], clock: str) -> Impossible | None:
    """A clock that no drive has, or speeds that no arm has: the clock is wrong if its rate is unusual, too."""
    names, values = units_per_joint(unit, numbers.joints), numbers.signals["position"]
    factors = np.array([SIGNAL_QUANTITIES["position"].units[name].factor for name in names])
    speeds = usual_speeds(values, numbers.step)  # per unit of the clock

    def is_possible_clock(second: float) -> bool:
        counted = can_have_step(numbers.step * second)
        moved = all(map(can_have_speed, numbers.joints, factors * speeds / second))
        return counted and moved and not is_creeping(factors * values, numbers.short_step * second)

    def is_possible(place: int, factor: float) -> bool:
        return can_have_speed(numbers.joints[place], factor * speeds[place] / TIME_UNITS[clock].factor)

    second = TIME_UNITS[clock].factor
    if is_possible_clock(second):
        return None
    place = int(np.argmax(factors * speeds))
    joint, own = numbers.joints[place], factors[place] * speeds[place] / second
    si = SIGNAL_QUANTITIES["velocity"].si[joint.kind == "prismatic"]
    moves = f"joint {joint.name} moves at {own:.3g} {si} with position in {names[place]} and time in {clock}"
    if _has_usual_rate(numbers, second):
        return Impossible("position", moves, _fitting_unit(numbers, "position", names[place], is_possible))
    rates = sorted(TIME_UNITS, key=lambda each: not _has_usual_rate(numbers, TIME_UNITS[each].factor))
    right = next((each for each in rates if is_possible_clock(TIME_UNITS[each].factor)), None)
    text = f"the rows are {numbers.step * second:.3g} s apart with time in {clock}, and {moves}"
    return Impossible("time", text, right)


def _judge_velocity(numbers: Numbers, units: Units) -> Impossible | None:
    """Velocities that are another multiple of the slope of the positions than one, where other units make it one."""
    if "velocity" not in numbers.signals or "velocity" not in units:
        return None
    joints, clock = numbers.joints, str(units["time"])
    scales = velocity_scales(numbers.time, numbers.signals["position"], numbers.signals["velocity"])
    if np.all(np.isnan(scales)):
        return None
    own = {signal: units_per_joint(units[signal], joints) for signal in ("position", "velocity")}
    known = {signal: SIGNAL_QUANTITIES[signal].units for signal in own}
    factors = {signal: np.array([known[signal][name].factor for name in names]) for signal, names in own.items()}
    ratios = scales * factors["velocity"] * TIME_UNITS[clock].factor / factors["position"]
    place = int(np.nanargmax(np.abs(np.log(np.abs(ratios)))))
    if _is_slope(ratios):
        return None
    right = {
        signal: next(
            (
                name
                for name, unit in known[signal].items()
                if unit.quantity == known[signal][own[signal][0]].quantity
                and _is_slope(ratios * (unit.factor / factors[signal]) ** (1 if signal == "velocity" else -1))
            ),
            None,
        )
        for signal in own
    }
    low, high = position_range(numbers.signals["position"])
    is_small = np.all(factors["position"] * (high - low) < [SMALL_RANGE[joint.kind] for joint in joints])
    signal = "position" if right["position"] and (is_small or not right["velocity"]) else "velocity"
    if right[signal] is None:
        return None
    text = (
        f"velocity of joint {joints[place].name} in {own['velocity'][place]} is {ratios[place]:.4g} times the slope of "
        f"its position in {own['position'][place]} with time in {clock}"
    )
    return Impossible(signal, text, right[signal])


def _is_slope(ratios: Array) -> bool:
    """Whether the velocity of every joint that tells it is the slope of its position."""
    return bool(np.all(np.abs(ratios[np.isfinite(ratios)] - 1) < SLOPE_TOLERANCE))


def _judge_torque(numbers: Numbers, unit: str | tuple[str, ...], gains: Sequence[float] | None) -> Impossible | None:
    """Torques that are too far beyond the limits; those of drives once their gains are known."""
    names, quantity = units_per_joint(unit, numbers.joints), SIGNAL_QUANTITIES["torque"]
    if gains is None and any(name in DRIVE_UNITS for name in names):
        return None
    peaks = torque_peaks(numbers)
    scales, ratios = np.abs(gains or (1.0,) * len(names)), np.abs(numbers.ratios["torque"])

    def is_possible(place: int, factor: float) -> bool:
        own = names[place]
        drive = quantity.units[own].quantity if own in DRIVE_UNITS else None
        return can_have_torque(
            numbers.joints[place],
            factor * scales[place] * peaks[place],
            factor * peaks[place] / float(ratios[place]),
            drive,
        )

    wrong = _first_wrong("torque", names, is_possible)
    if wrong is None:
        return None
    joint, name = numbers.joints[wrong], names[wrong]
    size, si = quantity.units[name].factor * scales[wrong] * peaks[wrong], quantity.si[joint.kind == "prismatic"]
    gain = f" with a gain of {scales[wrong]:.3g}" if name in DRIVE_UNITS else ""
    limit = f"its limit is {joint.limits.torque:.3g}" if np.isfinite(joint.limits.torque) else "more than any arm has"
    text = (
        f"torque of joint {joint.name} reaches {peaks[wrong]:.4g}{_behind(numbers, 'torque', wrong)}, "
        f"as {name}{gain} that is {size:.3g} {si}, {limit}"
    )
    return Impossible("torque", text, _fitting_unit(numbers, "torque", name, is_possible))


def _has_usual_rate(numbers: Numbers, second: float) -> bool:
    return RATES_HZ[0] <= 1 / (numbers.step * second) <= RATES_HZ[1]


def _first_wrong(signal: str, names: Sequence[str], is_possible: IsPossible) -> int | None:
    units = SIGNAL_QUANTITIES[signal].units
    return next((place for place, name in enumerate(names) if not is_possible(place, units[name].factor)), None)


def _fitting_unit(numbers: Numbers, signal: str, wrong: str, is_possible: IsPossible) -> str | None:
    """A unit of the same quantity that all joints can have, the usual one first; None where joints turn and slide."""
    kinds, units = {joint.kind for joint in numbers.joints}, SIGNAL_QUANTITIES[signal].units
    usual = propose_unit(signal, (), numbers.signals[signal], kinds == {"prismatic"})
    alike = [name for name, each in units.items() if each.quantity == units[wrong].quantity and name != wrong]
    for name in sorted(alike, key=lambda each: each != usual):
        if len(kinds) == 1 and _first_wrong(signal, (name,) * len(numbers.joints), is_possible) is None:
            return name
    return None
