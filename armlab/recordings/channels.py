"""From the columns of a table to joint signals: SI units, gains, gear ratios, couplings between motors, and offsets."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.settings import suggest_name
from armlab.recordings.possible import FASTEST_HZ, SLOWEST_HZ
from armlab.recordings.recording import AnyRun, Finding, MotionRun, Run, Transmission
from armlab.recordings.recording_file import FILE_NAME, RecordingFile, RunEntry, TimingEntry
from armlab.recordings.table import Table
from armlab.recordings.units import SENSOR_SIGNALS, SIGNAL_QUANTITIES, TIME_UNITS, Unit, resolve_units
from problem.arm import Arm
from problem.motion import Motion
from problem.regressor import rigid_body_torque

MAX_GAIN = 1e6  # N.m per A or V: no drive has more
DRIVE_SIGNALS = ("torque", "current")
MOTOR_SIDE_SIGNALS = ("position", "velocity", "reference_position", "reference_velocity")


def make_raw_run(table: Table, file: RecordingFile, entry: RunEntry, units: dict[str, tuple[Unit, ...]]) -> Run:
    """The run of a table; values may still be NaN, stamps in any order."""
    signals, notes = _read_signals(table, file, entry, units)
    time = signals.pop("time")[:, 0]
    torque = signals.pop("torque" if file.columns.torque else "current")
    if file.transmission.torque is None:  # else a channel belongs to several joints
        torque[:, [joint - 1 for joint in file.without_torque]] = 0.0
    findings = (*table.findings, *notes, *report_assumed_units(file))
    run = Run(entry.file, entry.role, time, signals.pop("position"), torque, findings=findings)
    return run.with_signals(time, signals)


def make_raw_motion_run(
    table: Table, file: RecordingFile, entry: RunEntry, units: dict[str, tuple[Unit, ...]]
) -> MotionRun:
    """The run of a table without torque; values may still be NaN, stamps in any order."""
    signals, notes = _read_signals(table, file, entry, units)
    time, position = signals.pop("time")[:, 0], signals.pop("position")
    findings = (*table.findings, *notes, *report_assumed_units(file))
    return MotionRun(entry.file, entry.role, time, position, findings=findings).with_signals(time, signals)


def _read_signals(
    table: Table, file: RecordingFile, entry: RunEntry, units: dict[str, tuple[Unit, ...]]
) -> tuple[dict[str, Array], tuple[Finding, ...]]:
    """All signals of a table in SI units, (rows, channels) each, and what is said of its stamps."""
    signals, notes = dict[str, Array](), tuple[Finding, ...]()
    for name, columns in file.columns.signals().items():
        factors = np.array([unit.factor for unit in units[name]])
        shifts = np.array([unit.shift for unit in units[name]])
        with np.errstate(over="ignore"):
            values = table.columns(columns, name)
            values *= factors
            values += shifts
        if name == "time":
            time, notes = _from_first_stamp(values[:, 0], entry.file)
            values = time[:, None]
        signals[name] = values
    return signals, notes


MAX_EPOCH_S = 1e10  # the year 2286
MIN_EPOCH_S = 1e8  # three years: larger stamps count from another start than that of the recording


def _from_first_stamp(time: Array, file: str) -> tuple[Array, tuple[Finding, ...]]:
    """Stamps, s, from the first one where they count from 1970, and a note that says so.

    Raises InputError for stamps that single precision cannot tell apart.
    """
    known = np.unique(time[np.isfinite(time)])
    bound = float(np.finfo(np.float32).max) / 2  # the spacing of the largest number overflows
    largest = np.float32(min(np.abs(known).max(initial=0.0), bound))
    spacing, finest = float(np.spacing(largest)), np.diff(known).min(initial=np.inf)
    is_coarse = spacing > 1 / SLOWEST_HZ if len(known) == 1 else spacing >= finest
    if len(time) > 1 and len(known) <= len(time) / 2 and is_coarse and np.all(np.mod(known, spacing) == 0):
        raise InputError(
            f"{file}: the time stands still, {len(time) - len(known)} of {len(time)} rows have the stamp of another "
            f"one: single precision counts in steps of {spacing:g} s there; write stamps in double precision, or count "
            "from the first one"
        )
    usual = float(np.median(time[np.isfinite(time)])) if np.isfinite(time).any() else 0.0
    if not MIN_EPOCH_S < usual < MAX_EPOCH_S:
        return time, ()
    first = float(time[np.abs(time - usual) < MIN_EPOCH_S][0])
    day = datetime.fromtimestamp(first, UTC).isoformat(sep=" ", timespec="seconds").removesuffix("+00:00")
    text = f"stamps count from 1970; taken from the first one, {day} UTC"
    return time - first, (Finding("epoch_stamps", "note", text),)


def channel_units(file: RecordingFile, arm: Arm, folder: Path) -> dict[str, tuple[Unit, ...]]:
    """Units of every signal's channels, checked against the joints that they belong to.

    A signal without a unit is in SI units. Raises InputError for an unknown unit, a length where the joint
    turns, and A or V without gains.
    """
    where = str(folder / FILE_NAME)
    signals = file.columns.signals()
    for name in file.units:
        if name not in SIGNAL_QUANTITIES:
            raise InputError(f"units.{name} in {where}: unknown signal: {suggest_name(name, list(SIGNAL_QUANTITIES))}")
    units = {}
    for name, columns in signals.items():
        names = file.units.get(name) or _si_units(name, arm, len(columns))
        units[name] = resolve_units(name, names, len(columns), where)
        _check_joints(name, units[name], file, arm, where)
    return units


def report_assumed_units(file: RecordingFile) -> tuple[Finding, ...]:
    """A note for each signal whose unit the file does not name."""
    unnamed = [name for name in file.columns.signals() if name not in file.units]
    return tuple(Finding("assumed_unit", "note", f"no unit is given for {name}: taken as SI") for name in unnamed)


def _si_units(name: str, arm: Arm, channels: int) -> str | tuple[str, ...]:
    """SI units of a signal: those of its joints where there is one channel a joint."""
    turning, sliding = SIGNAL_QUANTITIES[name].si
    if len(arm) != channels or name in SENSOR_SIGNALS:
        return turning
    return tuple(turning if joint.kind == "revolute" else sliding for joint in arm.joints)


def _check_joints(name: str, units: tuple[Unit, ...], file: RecordingFile, arm: Arm, where: str) -> None:
    if not file.has_torque and name in DRIVE_SIGNALS:
        return
    if name in DRIVE_SIGNALS and any(unit.quantity in ("A", "V") for unit in units):
        if file.gains is None:
            raise InputError(f"units.{name} in {where} is A or V: `gains` (N.m per A or V) are missing")
        return
    if name in ("time", *SENSOR_SIGNALS) or _is_mixed_by_transmission(name, file):
        return
    if len(units) != len(arm):
        raise InputError(f"columns.{name} in {where} names {len(units)} columns, but the robot has {len(arm)} joints")
    for unit, joint in zip(units, arm.joints, strict=True):
        if _is_linear(unit) != (joint.kind == "prismatic"):
            right = "m and N" if joint.kind == "prismatic" else "rad and N.m"
            raise InputError(
                f"units.{name} in {where}: {joint.name} is {joint.kind}, so {right} fit, not {unit.quantity}"
            )


def _is_mixed_by_transmission(name: str, file: RecordingFile) -> bool:
    """Whether a matrix makes joint signals of the channels, so that a channel belongs to no joint of its own."""
    matrix = file.transmission.torque if name in DRIVE_SIGNALS else file.transmission.position
    return matrix is not None and name in (*DRIVE_SIGNALS, *MOTOR_SIDE_SIGNALS)


def _is_linear(unit: Unit) -> bool:
    return unit.quantity in ("m", "m/s", "N")


def make_transmission(file: RecordingFile, arm: Arm, folder: Path) -> Transmission:
    """The transmission of a recording file, the identity where it names none.

    Raises InputError where shapes do not fit the arm and the columns.
    """
    where = folder / FILE_NAME
    channels = len(file.columns.position)
    torques = len(file.columns.torque or file.columns.current or ()) if file.has_torque else len(arm)
    given = file.transmission
    position = _make_matrix(given.position, len(arm), channels, "position", where)
    torque = _make_matrix(given.torque, len(arm), torques, "torque", where)
    offset = _make_vector(given.offset, 0.0, len(arm), f"transmission.offset in {where}")
    gains = _make_vector(file.gains, 1.0, torques, f"gains in {where}")
    if not np.all((np.abs(gains) > 0) & (np.abs(gains) <= MAX_GAIN)):
        raise InputError(f"gains in {where} should be numbers from -{MAX_GAIN:g} to {MAX_GAIN:g} that are not zero")
    return Transmission(position, offset, torque, gains)


def _make_matrix(
    rows: tuple[tuple[float, ...], ...] | None, joints: int, channels: int, signal: str, where: Path
) -> Array:
    if rows is None:
        if channels != joints:
            raise InputError(
                f"columns.{signal} in {where} names {channels} columns, but the robot has {joints} joints: "
                f"another robot, or is transmission.{signal} missing?"
            )
        return np.eye(joints)
    if len(rows) != joints or any(len(row) != channels for row in rows):
        raise InputError(f"transmission.{signal} in {where} should be {joints} rows of {channels} numbers")
    return np.array(rows, dtype=np.float64)


def _make_vector(values: tuple[float, ...] | None, default: float, length: int, what: str) -> Array:
    if values is None:
        return np.full(length, default)
    if len(values) != length:
        raise InputError(f"{what} should hold {length} numbers, not {len(values)}")
    return np.array(values, dtype=np.float64)


def to_joint_side(run: AnyRun, transmission: Transmission) -> AnyRun:
    """The run with motor signals carried over to the joints.

    Positions, velocities and references go through the position matrix. link_position and the simulated signals are on
    the joint side already.
    """
    to_joints = transmission.position.T
    signals = {"position": run.position @ to_joints}
    signals["position"] += transmission.offset
    if isinstance(run, Run):
        torque = run.torque if np.all(transmission.gains == 1) else run.torque * transmission.gains
        signals["torque"] = torque @ transmission.torque.T
    if run.velocity is not None:
        signals["velocity"] = run.velocity @ to_joints
    if run.reference_position is not None:
        signals["reference_position"] = run.reference_position @ to_joints + transmission.offset
    if run.reference_velocity is not None:
        signals["reference_velocity"] = run.reference_velocity @ to_joints
    return run.with_signals(run.time, signals)


def take_timing_back(run: Run, timing: TimingEntry | None, where: str) -> Run:
    """The run in true time, its torque as early as its motion; InputError for a wrong number of delays."""
    if timing is None:
        return run
    try:
        delays = timing.delays(run.joints)
    except ValueError as error:
        raise InputError(f"{where}: {error}") from None
    return read_late(run.with_signals(run.time / timing.clock_factor, {}), np.array(delays))


def read_late(run: Run, delay: Array) -> Run:
    """The run with torques that are read so much later, (joints,), s, by linear interpolation; its ends are left out.

    Raises InputError where nothing is left.
    """
    if not np.any(delay):
        return run
    first, last = run.time[0] - min(float(delay.min()), 0.0), run.time[-1] - max(float(delay.max()), 0.0)
    kept = (run.time >= first) & (run.time <= last)
    if kept.sum() < 2:
        raise InputError(f"{run.file}: torque that is {np.abs(delay).max():.3g} s late leaves nothing of the run")
    shifted = [np.interp(run.time + late, run.time, own) for late, own in zip(delay, run.torque.T, strict=True)]
    return replace(run, torque=np.column_stack(shifted)).rows(kept)


def restore_gravity(run: Run, arm: Arm) -> Run:
    """The run with the gravity of the arm's links, which the drive took from the torque."""
    return replace(run, torque=run.torque + gravity_torque(arm, run.position))


def gravity_torque(arm: Arm, position: Array) -> Array:
    """Torque that holds the links of an arm, (samples, joints), N m or N."""
    still = np.zeros_like(position)
    return np.asarray(rigid_body_torque(arm, Motion(position, still, still))).reshape(position.shape)


RATE_TOLERANCE = 0.02  # relative: clocks that are off by so little are one clock


def check_rate(run: AnyRun, nominal_hz: float | None) -> AnyRun:
    """A warning where the time column and the nominal rate differ, or where no drive is recorded so slowly.

    The time column decides. Raises InputError where it counts in another unit than it is said to, or where no clock
    is so fast.
    """
    if run.rate_hz > FASTEST_HZ:
        raise InputError(
            f"{run.file}: time column says {run.rate_hz:.3g} Hz, should be {FASTEST_HZ:g} at most: another unit?"
        )
    if nominal_hz is None:
        if run.rate_hz >= SLOWEST_HZ:
            return run
        text = f"time column says {run.rate_hz:.3g} Hz, slower than any drive is recorded: stamps in milliseconds?"
        return run.with_findings(Finding("rate", "warning", text))
    ratio = nominal_hz / run.rate_hz
    if abs(ratio - 1) < RATE_TOLERANCE:
        return run
    said = f"time column says {run.rate_hz:.6g} Hz, sample_rate_hz says {nominal_hz:g}"
    for name, unit in TIME_UNITS.items():
        if unit.factor != 1 and abs(ratio * unit.factor - 1) < RATE_TOLERANCE:
            raise InputError(f"{run.file}: {said}: its stamps are in {name}, give `units: {{time: {name}}}`")
    return run.with_findings(Finding("rate", "warning", f"{said}; the time column decides"))
