"""A table's columns as signals in SI units, still on the raw side of the transmission."""

from pathlib import Path

import numpy as np

from problem.arm import Arm
from problem.errors import InputError
from problem.settings import nearest
from recordings.recording_file import FILE_NAME, RecordingFile, RunEntry
from recordings.run import Finding, Run
from recordings.table import Table
from recordings.units import KNOWN, SI_UNITS, Unit, units_of


def raw_run(table: Table, file: RecordingFile, entry: RunEntry, units: dict[str, tuple[Unit, ...]]) -> Run:
    """The run of a table; values may still be NaN, stamps in any order."""
    signals = {}
    for name, columns in file.columns.signals().items():
        factors = np.array([unit.factor for unit in units[name]])
        shifts = np.array([unit.shift for unit in units[name]])
        with np.errstate(over="ignore"):
            values = table.columns(columns, name) * factors + shifts
        signals["torque" if name == "current" else name] = values
    time = signals.pop("time")[:, 0]
    return Run(entry.file, entry.role, time, findings=(*table.findings, *assumed_units(file)), **signals)


def channel_units(file: RecordingFile, arm: Arm, folder: Path) -> dict[str, tuple[Unit, ...]]:
    """Units of every signal's channels, checked against the joints that they belong to.

    A signal without a unit is in SI units. Raises InputError for an unknown unit, a length where the joint
    turns, and A or V without gains.
    """
    where = str(folder / FILE_NAME)
    signals = file.columns.signals()
    for name in file.units:
        if name not in KNOWN:
            raise InputError(f"units.{name} in {where}: unknown signal: {nearest(name, list(KNOWN))}")
    units = {}
    for name, columns in signals.items():
        names = file.units.get(name) or _si(name, arm, len(columns))
        units[name] = units_of(name, names, len(columns), where)
        _check_joints(name, units[name], file, arm, where)
    return units


def assumed_units(file: RecordingFile) -> tuple[Finding, ...]:
    """A note for each signal whose unit the file does not name."""
    unnamed = [name for name in file.columns.signals() if name not in file.units]
    return tuple(Finding("assumed_unit", "note", f"no unit is given for {name}: taken as SI") for name in unnamed)


def _si(name: str, arm: Arm, channels: int) -> str | tuple[str, ...]:
    """SI units of a signal: those of its joints where there is one channel a joint."""
    turning, sliding = SI_UNITS[name]
    if len(arm) != channels or name == "temperature":
        return turning
    return tuple(turning if joint.kind == "revolute" else sliding for joint in arm.joints)


def _check_joints(name: str, units: tuple[Unit, ...], file: RecordingFile, arm: Arm, where: str) -> None:
    drive = name in ("torque", "current")
    if drive and any(unit.quantity in ("A", "V") for unit in units):
        if file.gains is None:
            raise InputError(f"units.{name} in {where} is A or V: `gains` (N.m per A or V) are missing")
        return
    if name in ("time", "temperature") or (drive and file.transmission.torque) or _mixed(name, file):
        return
    if len(units) != len(arm):
        raise InputError(f"columns.{name} in {where} names {len(units)} columns, but the robot has {len(arm)} joints")
    for unit, joint in zip(units, arm.joints, strict=True):
        if _is_linear(unit) != (joint.kind == "prismatic"):
            right = "m and N" if joint.kind == "prismatic" else "rad and N.m"
            raise InputError(
                f"units.{name} in {where}: {joint.name} is {joint.kind}, so {right} fit, not {unit.quantity}"
            )


def _mixed(name: str, file: RecordingFile) -> bool:
    return file.transmission.position is not None and name in ("position", "velocity", "reference_position")


def _is_linear(unit: Unit) -> bool:
    return unit.quantity in ("m", "m/s", "N")
