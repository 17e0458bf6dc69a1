"""The units of each signal and the gains of the torque: as given, else as file and names tell, else a question."""

from collections.abc import Mapping

from armlab.common.errors import InputError
from armlab.common.settings import suggest_name
from armlab.recordings.channels import MAX_GAIN
from armlab.recordings.imports.columns import Log
from armlab.recordings.imports.gears import Gear
from armlab.recordings.imports.proposals import propose_unit
from armlab.recordings.imports.questions import Question
from armlab.recordings.imports.recognition import Known, time_unit, unit_by_name
from armlab.recordings.imports.sources import Source
from armlab.recordings.units import DRIVE_UNITS, SENSOR_SIGNALS, SIGNAL_QUANTITIES

UNIT_ALIASES = {
    "sec": "s",
    "seconds": "s",
    "°": "deg",
    "degrees": "deg",
    "degree": "deg",
    "°/s": "deg/s",
    "Nm": "N.m",
    "N*m": "N.m",
    "N m": "N.m",
    "N·m": "N.m",
    "µs": "us",
    "°C": "degC",
    "C": "degC",
}


def choose_units(
    log: Log, columns: Mapping[str, tuple[str, ...]], gear: Gear | None
) -> tuple[dict[str, Known], tuple[Question, ...]]:
    """Units of each signal as given, else as the file or the names tell; a question for each that is missing.

    One unit for all columns of a signal, or one a column where they differ. gear: a motor turns where its joint slides.
    """
    given = dict(_parse_unit_option(text) for text in log.options["units"])
    source = log.source
    units: dict[str, Known] = {}
    questions: list[Question] = []
    for signal, names in columns.items():
        known = [_parse_unit(signal, source.units[name]) if name in source.units else None for name in names]
        own = Known((given[signal],), "given with --unit") if signal in given else None
        one = own or (None if all(known) else _unit_by_name(source, signal, names))
        if one is None and source.same_units.get(signal) in columns and not any(known):
            same = source.same_units[signal]
            if same in units:
                units[signal] = Known(units[same].value, f"that of {same} in this format")
            continue
        if one is not None:
            if gear is None or not gear.is_before(signal):
                _check_unit(signal, one.value[0], log)
            units[signal] = one
        elif all(known):
            listed = tuple(unit for unit in known if unit)
            units[signal] = Known(listed[:1] if len(set(listed)) == 1 else listed, source.reason)
        else:
            values = source.table.columns(names, signal)
            proposal = propose_unit(signal, names, values, log.sliding)
            text = f"unit of {signal.replace('_', ' ')}: one of {', '.join(SIGNAL_QUANTITIES[signal].units)}"
            questions.append(Question("units", _missing_unit(signal, proposal), text, proposal, signal))
    return units, tuple(questions)


def _check_unit(signal: str, unit: str, log: Log) -> None:
    """Raises InputError for a length where all joints turn, and for an angle where all slide."""
    kinds = {joint.kind for joint in log.arm.joints if joint.name in log.joints} if log.arm else set()
    if signal in ("time", *SENSOR_SIGNALS) or unit in DRIVE_UNITS or len(kinds) != 1:
        return
    quantity = SIGNAL_QUANTITIES[signal]
    right = quantity.si[1 if kinds == {"prismatic"} else 0]
    if quantity.units[unit].quantity != right:
        known = ", ".join(name for name, each in quantity.units.items() if each.quantity == right)
        raise InputError(f"--unit {signal}={unit} does not fit joints that are {kinds.pop()}: give one of {known}")


def _unit_by_name(source: Source, signal: str, names: tuple[str, ...]) -> Known | None:
    if signal == "time":
        return time_unit(names[0], source.table.columns(names, signal)[:, 0])
    unit = unit_by_name(names, source.table.names)
    return unit if unit is not None and unit.value[0] in SIGNAL_QUANTITIES[signal].units else None


def _missing_unit(signal: str, proposal: str) -> str:
    known = ", ".join(SIGNAL_QUANTITIES[signal].units)
    other = "; a torque in A or V needs --gains, too" if signal == "torque" else ""
    return f"no unit is known for {signal}: give --unit {signal}=UNIT ({known}), perhaps {proposal}{other}"


def _parse_unit_option(text: str) -> tuple[str, str]:
    signal, sign, name = text.partition("=")
    if not sign or signal not in SIGNAL_QUANTITIES:
        raise InputError(f"--unit {text} should be SIGNAL=UNIT: {suggest_name(signal, list(SIGNAL_QUANTITIES))}")
    unit = _parse_unit(signal, name)
    if unit is None:
        raise InputError(
            f"unknown unit '{name}' of {signal}: {suggest_name(name, list(SIGNAL_QUANTITIES[signal].units))}"
        )
    return signal, unit


def _parse_unit(signal: str, name: str) -> str | None:
    """The unit as `recording.yaml` writes it; None for one that a signal does not have."""
    unit = UNIT_ALIASES.get(name.strip(), name.strip())
    return unit if unit in SIGNAL_QUANTITIES[signal].units else None


def choose_gains(
    given: str | None, columns: Mapping[str, tuple[str, ...]], units: Mapping[str, str | tuple[str, ...]]
) -> tuple[tuple[float, ...] | None, tuple[Question, ...]]:
    """The gains of the torque as given; a question where it is in A or V and they are missing."""
    gains = _parse_gains(given)
    names, unit = columns.get("torque", ()), units.get("torque", ())
    if gains is not None and names and len(gains) != len(names):
        raise InputError(f"--gains holds {len(gains)} numbers for {len(names)} columns of torque")
    listed = (unit,) if isinstance(unit, str) else unit
    if not any(each in DRIVE_UNITS for each in listed):
        if gains is not None and listed:
            raise InputError(
                f"--gains are N.m per A or V, and the torque is in {listed[0]}: leave them out, or give --unit torque=A"
            )
        return gains, ()
    if gains is not None:
        return gains, ()
    missing = f"give --gains, gains of {', '.join(names)}, N.m per A or V, with commas between them"
    text = f"gains of the joints, N.m per A or V: {len(names)} numbers with commas between them"
    return None, (Question("gains", f"the torque is measured in A or V: {missing}", text),)


def _parse_gains(text: str | None) -> tuple[float, ...] | None:
    if text is None:
        return None
    try:
        gains = tuple(float(part) for part in text.split(","))
    except ValueError:
        gains = ()
    if not gains or not all(0 < abs(gain) <= MAX_GAIN for gain in gains):
        raise InputError(
            f"--gains {text} should be numbers from -{MAX_GAIN:g} to {MAX_GAIN:g} with commas between them, not zero"
        )
    return gains
