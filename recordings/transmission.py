"""From raw channels to joints: gains, gear ratios, couplings between motors, and offsets."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from problem.arm import Arm
from problem.errors import InputError
from recordings.recording import Transmission
from recordings.recording_file import FILE_NAME, RecordingFile
from recordings.run import Array, Finding, Run


def transmission_of(file: RecordingFile, arm: Arm, folder: Path) -> Transmission:
    """The transmission of a recording file, the identity where it names none.

    Raises InputError where shapes do not fit the arm and the columns.
    """
    where = folder / FILE_NAME
    channels = len(file.columns.position)
    torques = len(file.columns.torque or file.columns.current or ())
    given = file.transmission
    position = _matrix(given.position, len(arm), channels, "position", where)
    torque = _matrix(given.torque, len(arm), torques, "torque", where)
    offset = _vector(given.offset, 0.0, len(arm), f"transmission.offset in {where}")
    gains = _vector(file.gains, 1.0, torques, f"gains in {where}")
    return Transmission(position, offset, torque, gains)


def _matrix(rows: tuple[tuple[float, ...], ...] | None, joints: int, channels: int, signal: str, where: Path) -> Array:
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


def _vector(values: tuple[float, ...] | None, default: float, length: int, what: str) -> Array:
    if values is None:
        return np.full(length, default)
    if len(values) != length:
        raise InputError(f"{what} should hold {length} numbers, not {len(values)}")
    return np.array(values, dtype=np.float64)


def joint_side(run: Run, transmission: Transmission) -> Run:
    """The run with motor signals carried over to the joints.

    position, velocity and reference_position go through the position matrix; link_position and the simulated
    signals are on the joint side already.
    """
    to_joints = transmission.position.T
    signals = {
        "position": run.position @ to_joints + transmission.offset,
        "torque": run.torque * transmission.gains @ transmission.torque.T,
    }
    if run.velocity is not None:
        signals["velocity"] = run.velocity @ to_joints
    if run.reference_position is not None:
        signals["reference_position"] = run.reference_position @ to_joints + transmission.offset
    return run.with_signals(run.time, signals)


def with_rate_checked(run: Run, nominal_hz: float | None) -> Run:
    """A warning where the time column and the nominal rate differ; the time column decides."""
    if nominal_hz is None or abs(run.rate_hz / nominal_hz - 1) < 0.02:
        return run
    text = f"time column says {run.rate_hz:.6g} Hz, sample_rate_hz says {nominal_hz:g}; the time column decides"
    return replace(run, findings=(*run.findings, Finding("rate", "warning", text)))
