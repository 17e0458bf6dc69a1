"""Units that cannot be right: the numbers of a file, read in them, would be what no arm could do."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.recordings.imports.columns import Log
from armlab.recordings.imports.proposals import propose_unit
from armlab.recordings.imports.questions import Question
from armlab.recordings.imports.recognition import RATES_HZ
from armlab.recordings.imports.sources import Source
from armlab.recordings.possible import (
    OUTLIER_SHARE,
    TURN,
    can_have_position,
    can_have_speed,
    can_have_step,
    can_have_torque,
    is_creeping,
    position_range,
    usual_speeds,
)
from armlab.recordings.units import DRIVE_UNITS, SIGNAL_QUANTITIES, TIME_UNITS
from problem.arm import Joint

Units = Mapping[str, str | tuple[str, ...]]
IsPossible = Callable[[int, float], bool]  # for a joint's place and the factor of a unit
POSITION_SIGNALS = ("position", "reference_position")


@dataclass(frozen=True, eq=False)
class Numbers:
    """Rows of a file whose stamps and positions are finite, in the units of the file.

    joints: that the columns belong to. signals: (rows, joints) by name, without the time. step, short_step: of the time
    from row to row, the longer and the shorter of mean and median: neither gaps nor rows that come together decide.
    """

    joints: tuple[Joint, ...]
    signals: Mapping[str, Array]
    step: float
    short_step: float


@dataclass(frozen=True)
class Impossible:
    """A signal whose unit cannot be right, the sentence that says why, and a unit that can be, if there is one."""

    signal: str
    text: str
    right: str | None


def ask_impossible_units(
    log: Log,
    sources: Mapping[str, Source],
    columns: Mapping[str, tuple[str, ...]],
    units: Units,
    gains: Sequence[float] | None,
) -> tuple[Question, ...]:
    """A question for each signal whose numbers cannot be in its unit, with a unit that can be as the proposal.

    units, gains: those that are known; nothing is judged before robot, time and position are.
    Raises InputError where no unit can be right.
    """
    owners = {joint.name: joint for joint in log.arm.joints} if log.arm else {}
    joints = tuple(owners[name] for name in log.joints if name in owners)
    if not joints or not {"time", "position"} <= set(units) or len(columns["position"]) != len(joints):
        return ()
    found: dict[str, Impossible] = {}
    for path, source in sources.items():
        numbers = _read_numbers(source, columns, joints)
        for each in _judge(numbers, units, gains) if numbers is not None else ():
            where = f"{path}: " if len(sources) > 1 else ""
            found.setdefault(each.signal, replace(each, text=where + each.text))
    for signal, same in log.source.same_units.items():
        if signal in found and same in found and units[signal] == units[same]:
            del found[signal]  # the answer to the other one is for both
    return tuple(_ask(each) for each in found.values())


def _ask(found: Impossible) -> Question:
    if found.right is None:
        raise InputError(f"{found.text}: no unit makes that possible; other columns, or numbers of the motors?")
    known = ", ".join(SIGNAL_QUANTITIES[found.signal].units)
    text = f"{found.text}\nunit of {found.signal.replace('_', ' ')}: one of {known}"
    return Question("units", f"{found.text}: --unit {found.signal}={found.right}?", text, found.right, found.signal)


def _read_numbers(source: Source, columns: Mapping[str, tuple[str, ...]], joints: tuple[Joint, ...]) -> Numbers | None:
    """The rows to judge; None where the stamps do not rise."""
    wanted = [name for name in (*POSITION_SIGNALS, "torque") if len(columns.get(name, ())) == len(joints)]
    signals = {name: source.table.columns(columns[name], name) for name in wanted}
    time = source.table.columns(columns["time"], "time")[:, 0]
    whole = np.isfinite(time) & np.all([np.isfinite(values).all(axis=1) for values in signals.values()], axis=0)
    time, signals = time[whole], {name: values[whole] for name, values in signals.items()}
    rises = np.diff(time)
    if not np.any(rises > 0):
        return None
    median = float(np.median(rises[rises > 0]))
    first, last = np.quantile(time, (OUTLIER_SHARE, 1 - OUTLIER_SHARE))
    mean = float(last - first) / ((1 - 2 * OUTLIER_SHARE) * len(rises)) or median
    return Numbers(joints, signals, max(median, mean), min(median, mean))


def _judge(numbers: Numbers, units: Units, gains: Sequence[float] | None) -> list[Impossible]:
    """The signals of a file whose units cannot be right."""
    clock = str(units["time"])
    known = [signal for signal in POSITION_SIGNALS if signal in numbers.signals and signal in units]
    found = [_judge_position(numbers, signal, units[signal], clock) for signal in known]
    if found[0] is None:
        found.append(_judge_motion(numbers, units["position"], clock))
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

    names = _per_joint(unit, numbers.joints)
    wrong = _first_wrong(signal, names, is_possible)
    if wrong is None:
        return None
    joint, name = numbers.joints[wrong], names[wrong]
    extreme, (least, most) = float(max(low[wrong], high[wrong], key=abs)), joint.limits.position
    size, si = abs(quantity.units[name].factor * extreme), quantity.si[joint.kind == "prismatic"]
    reached = f"{size / TURN:.3g} turns" if si == "rad" else f"{size:.3g} m"
    text = (
        f"{signal.replace('_', ' ')} of joint {joint.name} reaches {extreme:.4g}, as {name} that is {reached}, "
        f"its limits are {least:.3g} and {most:.3g} {si}"
    )
    return Impossible(signal, text, _fitting_unit(numbers, signal, name, is_possible))


def _judge_motion(numbers: Numbers, unit: str | tuple[str, ...], clock: str) -> Impossible | None:
    """A clock that no drive has, or speeds that no arm has: the clock is wrong if its rate is unusual, too."""
    names, values = _per_joint(unit, numbers.joints), numbers.signals["position"]
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


def _judge_torque(numbers: Numbers, unit: str | tuple[str, ...], gains: Sequence[float] | None) -> Impossible | None:
    """Torques that are too far beyond the limits; those of drives once their gains are known."""
    names, quantity = _per_joint(unit, numbers.joints), SIGNAL_QUANTITIES["torque"]
    if gains is None and any(name in DRIVE_UNITS for name in names):
        return None
    peaks = np.nanquantile(np.abs(numbers.signals["torque"]), 1 - OUTLIER_SHARE, axis=0)
    scales = np.abs(gains or (1.0,) * len(names))

    def is_possible(place: int, factor: float) -> bool:
        own = names[place]
        drive = quantity.units[own].quantity if own in DRIVE_UNITS else None
        return can_have_torque(
            numbers.joints[place], factor * scales[place] * peaks[place], factor * peaks[place], drive
        )

    wrong = _first_wrong("torque", names, is_possible)
    if wrong is None:
        return None
    joint, name = numbers.joints[wrong], names[wrong]
    size, si = quantity.units[name].factor * scales[wrong] * peaks[wrong], quantity.si[joint.kind == "prismatic"]
    gain = f" with a gain of {scales[wrong]:.3g}" if name in DRIVE_UNITS else ""
    limit = f"its limit is {joint.limits.torque:.3g}" if np.isfinite(joint.limits.torque) else "more than any arm has"
    text = f"torque of joint {joint.name} reaches {peaks[wrong]:.4g}, as {name}{gain} that is {size:.3g} {si}, {limit}"
    return Impossible("torque", text, _fitting_unit(numbers, "torque", name, is_possible))


def _per_joint(unit: str | tuple[str, ...], joints: tuple[Joint, ...]) -> tuple[str, ...]:
    return (unit,) * len(joints) if isinstance(unit, str) else unit


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
