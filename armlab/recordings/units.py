"""Units of the signals: the one place where the numbers of a recording become SI numbers."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

from armlab.common.errors import InputError
from armlab.common.settings import suggest_name


@dataclass(frozen=True)
class Unit:
    """SI value = factor * number + shift; `quantity` says what is measured, in SI units."""

    quantity: str
    factor: float
    shift: float = 0.0


TIME_UNITS = {"s": Unit("s", 1.0), "ms": Unit("s", 1e-3), "us": Unit("s", 1e-6), "ns": Unit("s", 1e-9)}
POSITION_UNITS = {
    "rad": Unit("rad", 1.0),
    "deg": Unit("rad", pi / 180),
    "rev": Unit("rad", 2 * pi),
    "m": Unit("m", 1.0),
    "mm": Unit("m", 1e-3),
}
VELOCITY_UNITS = {
    **{f"{name}/s": Unit(f"{unit.quantity}/s", unit.factor) for name, unit in POSITION_UNITS.items()},
    "rpm": Unit("rad/s", pi / 30),
}
TORQUE_UNITS = {"N.m": Unit("N.m", 1.0), "mN.m": Unit("N.m", 1e-3), "N": Unit("N", 1.0), "kN": Unit("N", 1e3)}
DRIVE_UNITS = {"A": Unit("A", 1.0), "mA": Unit("A", 1e-3), "V": Unit("V", 1.0), "mV": Unit("V", 1e-3)}
TEMPERATURE_UNITS = {"degC": Unit("degC", 1.0), "K": Unit("degC", 1.0, -273.15)}

UNITS_BY_SIGNAL = {
    "time": TIME_UNITS,
    "position": POSITION_UNITS,
    "velocity": VELOCITY_UNITS,
    "torque": {**TORQUE_UNITS, **DRIVE_UNITS},
    "current": DRIVE_UNITS,
    "temperature": TEMPERATURE_UNITS,
    "link_position": POSITION_UNITS,
    "reference_position": POSITION_UNITS,
    "simulated_torque": TORQUE_UNITS,
    "simulated_position": POSITION_UNITS,
}


ANGLE_OR_LENGTH, MOMENT_OR_FORCE = ("rad", "m"), ("N.m", "N")
SI_UNITS = {
    "time": ("s", "s"),
    "position": ANGLE_OR_LENGTH,
    "velocity": ("rad/s", "m/s"),
    "torque": MOMENT_OR_FORCE,
    "current": ("A", "A"),
    "temperature": ("degC", "degC"),
    "link_position": ANGLE_OR_LENGTH,
    "reference_position": ANGLE_OR_LENGTH,
    "simulated_torque": MOMENT_OR_FORCE,
    "simulated_position": ANGLE_OR_LENGTH,
}


def resolve_units(signal: str, names: str | Sequence[str], channels: int, where: str) -> tuple[Unit, ...]:
    """One unit a channel of a signal like `position`.

    names: one for all channels, or one a channel. Raises InputError for an unknown unit and a wrong number.
    """
    listed = [names] * channels if isinstance(names, str) else list(names)
    if len(listed) != channels:
        raise InputError(f"units.{signal} in {where} should hold one unit or {channels}, not {len(listed)}")
    for name in listed:
        if name not in UNITS_BY_SIGNAL[signal]:
            hint = suggest_name(name, list(UNITS_BY_SIGNAL[signal]))
            raise InputError(f"unknown unit '{name}' of {signal} in {where}: {hint}")
    return tuple(UNITS_BY_SIGNAL[signal][name] for name in listed)
