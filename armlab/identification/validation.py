"""How far a model's torque is from the recorded one: joint by joint, filtered and as recorded."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from armlab.common.arrays import Array
from armlab.common.report.wording import format_number
from armlab.identification.torque_model import TorqueModel
from armlab.recordings.differentiate import Signals
from armlab.recordings.plain_least_squares import PlainModel
from problem.arm import Arm
from problem.regressor import measured_rows

MIN_TORQUE = 1e-9  # N m (N), root mean square: less is a signal without power, whose share says nothing


@dataclass(frozen=True)
class JointError:
    """Errors of one joint, counted from 1: N m (N), percent of the torque, of the rated torque.

    None for a percentage of a torque without power, and of one that is not known. percent_plain: what plain least
    squares leaves, percent of the torque; None where it was not asked.
    """

    joint: int
    rms: float
    percent: float | None
    percent_rated: float | None
    percent_plain: float | None = None


@dataclass(frozen=True)
class RunError:
    """Errors on one run: ||tau - tau_hat|| / ||tau|| over all joints in percent, and joint by joint.

    cutoff_hz: of the low-pass of both torques; None without one. recorded_percent: against the torque as recorded.
    """

    run: str
    role: str
    relative_percent: float | None
    cutoff_hz: float | None
    recorded_percent: float | None
    joints: tuple[JointError, ...]


def run_error(
    model: TorqueModel, signals: Signals, plain: PlainModel | None = None, arm: Arm | None = None
) -> RunError:
    """The errors of a model on a run, with those of plain least squares beside them where it is given.

    arm: of the recording, that of the model if left out; joints that it does not measure have no error.
    """
    arm = model.arm if arm is None else arm
    left = measured_rows(arm, signals.torque - model.filtered_torque(signals))
    plain_left = None if plain is None else signals.torque - signals.filter(plain.predict(signals.run))
    rows = signals.filter.rows
    recorded = signals.run.torque[rows]
    raw = measured_rows(arm, recorded - model.torque(signals.motion, signals.run)[rows])
    joints = tuple(_joint_error(model, joint, left[:, joint], signals.torque[:, joint]) for joint in arm.measured)
    if plain_left is not None:
        shares = (relative_percent(plain_left[:, joint], signals.torque[:, joint]) for joint in arm.measured)
        joints = tuple(replace(own, percent_plain=share) for own, share in zip(joints, shares, strict=True))
    return RunError(
        run=signals.run.name,
        role=signals.run.role,
        relative_percent=relative_percent(left, signals.torque),
        cutoff_hz=signals.filter.cutoff_hz,
        recorded_percent=relative_percent(raw, recorded),
        joints=joints,
    )


def relative_percent(error: Array, torque: Array) -> float | None:
    """||error|| / ||torque||, in percent; None of a torque without power."""
    size = float(np.linalg.norm(torque))
    return float(100 * np.linalg.norm(error) / size) if size > MIN_TORQUE * np.sqrt(torque.size) else None


def format_percent(percent: float | None) -> str:
    """`1.23 %`, a dash for a percentage of nothing."""
    return "-" if percent is None else f"{percent:.2f} %"


def _joint_error(model: TorqueModel, joint: int, left: Array, torque: Array) -> JointError:
    rms = float(np.sqrt(np.mean(left**2)))
    rated = model.arm.joints[joint].limits.torque
    return JointError(joint + 1, rms, relative_percent(left, torque), 100 * rms / rated if np.isfinite(rated) else None)


def error_table(errors: tuple[RunError, ...]) -> str:
    """A table in plain text; its first line says which torque the joints' errors are of.

    Plain least squares has a column where it was asked.
    """
    beside = any(joint.percent_plain is not None for each in errors for joint in each.joints)
    plain_heading = "  plain %" if beside else ""
    lines = [
        f"errors of torque {filter_of_errors(errors)}:",
        f"run                   role      joint   rms N m  % of torque{plain_heading}  % of rated",
    ]
    for each in errors:
        for joint in each.joints:
            percent, plain, rated = map(_share, (joint.percent, joint.percent_plain, joint.percent_rated))
            start = f"{each.run:<21} {each.role:<9} {joint.joint:5d} {joint.rms:9.4g} {percent:>12}"
            lines.append(f"{start}{f' {plain:>8}' if beside else ''} {rated:>11}")
        lines.append(total_error_line(each))
    return "\n".join(lines)


def _share(percent: float | None) -> str:
    return "-" if percent is None else f"{percent:.2f}"


def total_error_line(error: RunError) -> str:
    """The error of a run over all joints, in a line."""
    whole, recorded = format_percent(error.relative_percent), format_percent(error.recorded_percent)
    return f"{error.run}: {whole} in all, {recorded} of torque as recorded"


def filter_of_errors(errors: tuple[RunError, ...]) -> str:
    """Which torque the errors of runs are of, joint by joint and in all: see `filter_in_words`."""
    return filter_in_words([each.cutoff_hz for each in errors if each.cutoff_hz is not None])


def filter_in_words(cutoffs_hz: Sequence[float]) -> str:
    """Of a torque: `filtered below 8 Hz`, by several low-passes `filtered below 6 to 8 Hz`, else `as recorded`."""
    ends = list(dict.fromkeys(format_number(each) for each in (min(cutoffs_hz), max(cutoffs_hz)))) if cutoffs_hz else []
    return f"filtered below {' to '.join(ends)} Hz" if ends else "as recorded"
