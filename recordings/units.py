"""Units: the one place where a recording's numbers become SI numbers."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

from problem.errors import InputError
from problem.settings import nearest


@dataclass(frozen=True)
class Unit:
    """SI value = factor * number + shift; `quantity` says what is measured, in SI units."""

    quantity: str
    factor: float
    shift: float = 0.0


TIME = {"s": Unit("s", 1.0), "ms": Unit("s", 1e-3), "us": Unit("s", 1e-6), "ns": Unit("s", 1e-9)}
POSITION = {
    "rad": Unit("rad", 1.0),
    "deg": Unit("rad", pi / 180),
    "rev": Unit("rad", 2 * pi),
    "m": Unit("m", 1.0),
    "mm": Unit("m", 1e-3),
}
VELOCITY = {
    **{f"{name}/s": Unit(f"{unit.quantity}/s", unit.factor) for name, unit in POSITION.items()},
    "rpm": Unit("rad/s", pi / 30),
}
TORQUE = {"N.m": Unit("N.m", 1.0), "mN.m": Unit("N.m", 1e-3), "N": Unit("N", 1.0), "kN": Unit("N", 1e3)}
DRIVE = {"A": Unit("A", 1.0), "mA": Unit("A", 1e-3), "V": Unit("V", 1.0), "mV": Unit("V", 1e-3)}
TEMPERATURE = {"degC": Unit("degC", 1.0), "K": Unit("degC", 1.0, -273.15)}

KNOWN = {
    "time": TIME,
    "position": POSITION,
    "velocity": VELOCITY,
    "torque": {**TORQUE, **DRIVE},
    "current": DRIVE,
    "temperature": TEMPERATURE,
    "link_position": POSITION,
    "reference_position": POSITION,
    "simulated_torque": TORQUE,
    "simulated_position": POSITION,
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


def units_of(signal: str, names: str | Sequence[str], channels: int, where: str) -> tuple[Unit, ...]:
    """One unit a channel of a signal like `position`.

    names: one for all channels, or one a channel. Raises InputError for an unknown unit and a wrong number.
    """
    listed = [names] * channels if isinstance(names, str) else list(names)
    if len(listed) != channels:
        raise InputError(f"units.{signal} in {where} should hold one unit or {channels}, not {len(listed)}")
    for name in listed:
        if name not in KNOWN[signal]:
            hint = nearest(name, list(KNOWN[signal]))
            raise InputError(f"unknown unit '{name}' of {signal} in {where}: {hint}")
    return tuple(KNOWN[signal][name] for name in listed)
