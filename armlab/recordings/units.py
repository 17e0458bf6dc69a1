"""The signals of a recording and their units: here the numbers of a file become SI numbers."""

from collections.abc import Mapping, Sequence
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
VOLTAGE_UNITS = {"V": Unit("V", 1.0), "mV": Unit("V", 1e-3)}
DRIVE_UNITS = {"A": Unit("A", 1.0), "mA": Unit("A", 1e-3), **VOLTAGE_UNITS}
TEMPERATURE_UNITS = {"degC": Unit("degC", 1.0), "K": Unit("degC", 1.0, -273.15)}


@dataclass(frozen=True)
class Quantity:
    """What a signal measures. units: those that a file may name. si: the SI unit of a joint that turns or slides."""

    units: Mapping[str, Unit]
    si: tuple[str, str]


POSITION = Quantity(POSITION_UNITS, ("rad", "m"))
VELOCITY = Quantity(VELOCITY_UNITS, ("rad/s", "m/s"))
TORQUE = Quantity(TORQUE_UNITS, ("N.m", "N"))
SIGNAL_QUANTITIES: Mapping[str, Quantity] = {
    "time": Quantity(TIME_UNITS, ("s", "s")),
    "position": POSITION,
    "velocity": VELOCITY,
    "torque": Quantity({**TORQUE_UNITS, **DRIVE_UNITS}, TORQUE.si),
    "current": Quantity(DRIVE_UNITS, ("A", "A")),
    "temperature": Quantity(TEMPERATURE_UNITS, ("degC", "degC")),
    "voltage": Quantity(VOLTAGE_UNITS, ("V", "V")),
    "link_position": POSITION,
    "reference_position": POSITION,
    "reference_velocity": VELOCITY,
    "simulated_torque": TORQUE,
    "simulated_position": POSITION,
}
SENSOR_SIGNALS = ("temperature", "voltage")  # one channel a sensor, not one a joint


def resolve_units(signal: str, names: str | Sequence[str], channels: int, where: str) -> tuple[Unit, ...]:
    """One unit a channel of a signal like `position`.

    names: one for all channels, or one a channel.
    Raises InputError for an unknown unit and for a wrong number of units.
    """
    known = SIGNAL_QUANTITIES[signal].units
    listed = [names] * channels if isinstance(names, str) else list(names)
    if len(listed) != channels:
        raise InputError(f"units.{signal} in {where} should hold one unit or {channels}, not {len(listed)}")
    for name in listed:
        if name not in known:
            hint = suggest_name(name, list(known))
            raise InputError(f"unknown unit '{name}' of {signal} in {where}: {hint}")
    return tuple(known[name] for name in listed)
