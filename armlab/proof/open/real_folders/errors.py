"""Held-out errors of `diagnose`, `identify` and plain least squares, on the same rows behind the same low-pass."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.identification.identifier_choice import choose_identifier
from armlab.identification.model_file import read_model
from armlab.identification.torque_model import TorqueModel
from armlab.recordings.cutoff_trial import choose_cutoff_hz
from armlab.recordings.load import load_recording
from armlab.recordings.motion import is_motion_only
from armlab.recordings.plain_least_squares import (
    PlainFit,
    PlainRows,
    compare_plain_folders,
    fit_plain_recording,
    prepare_rows,
    split_runs,
)
from armlab.recordings.reading.corrected import CORRECTED_FOLDER
from armlab.recordings.recording import Recording

JudgedModel = Literal["diagnose", "identify"]
MODELS: tuple[JudgedModel, ...] = ("diagnose", "identify")
BLOCKS, MIN_BLOCKS = 30, 4  # of held-out time; with fewer there is no interval
ROWS_OF_BLOCK = 8  # at least: two periods of the cut-off, over which the filter ties errors together
DRAWS = 2000


@dataclass(frozen=True)
class Ratio:
    """Error over that of plain least squares, with its 95 % interval; None where there are too few blocks."""

    value: float
    interval: tuple[float, float] | None


@dataclass(frozen=True)
class JointErrors:
    """torque: rms of the filtered torque, N m (N). percent: of it, what plain least squares and each model leave."""

    joint: int
    torque: float
    plain: float
    percent: dict[JudgedModel, float]
    ratio: dict[JudgedModel, Ratio]


@dataclass(frozen=True)
class FolderErrors:
    """Errors by joint. notes: why a model has none, in one line each.

    plain_change: of a pair, the largest change that plain least squares sees, standard errors.
    """

    cutoff_hz: float | None = None
    joints: tuple[JointErrors, ...] = ()
    notes: tuple[str, ...] = ()
    plain_change: float | None = None


def measure_change(old: Path, new: Path) -> FolderErrors:
    """What plain least squares sees between the recordings of a pair; what cannot be computed is a note."""
    try:
        change = compare_plain_folders(old, new)
    except (InputError, ValueError) as error:
        return FolderErrors(notes=(f"plain least squares: {error}",))
    said = f"plain least squares: {change.name} changes by {change.largest:.1f} standard errors"
    return FolderErrors(notes=(said,), plain_change=change.largest)


def measure_errors(folder: Path, verdict_folder: Path, cutoff_hz: float | None) -> FolderErrors:
    """The errors of a recording folder, whose diagnosis stands in `verdict_folder`.

    cutoff_hz: what the positions of the runs that identify suggest if left out. What cannot be computed is a note.
    """
    try:
        plain = fit_plain_recording(folder, cutoff_hz)
        if is_motion_only(folder):
            note = "motion only: plain least squares of kp (command - position); the others predict motion, not torque"
            return FolderErrors(plain.cutoff_hz, _joint_errors(plain, {}), (note,))
        recording = load_recording(folder)
    except (InputError, ValueError) as error:
        return FolderErrors(notes=(f"plain least squares: {error}",))
    left, notes = dict[JudgedModel, Array](), list[str]()
    measures: dict[JudgedModel, Callable[[], Array]] = {
        "diagnose": lambda: _left_by_diagnosis(recording, verdict_folder, plain),
        "identify": lambda: _left_by_identification(recording, plain),
    }
    for name, measure in measures.items():
        try:
            left[name] = measure()
        except (InputError, ValueError) as error:
            notes.append(f"{name}: {error}")
    if (verdict_folder / CORRECTED_FOLDER).is_dir() and "diagnose" in left:
        notes.append("diagnose: judged on the recording as it reads it")
    return FolderErrors(plain.cutoff_hz, _joint_errors(plain, left), tuple(notes))


def _left_by_identification(recording: Recording, plain: PlainFit) -> Array:
    """Residual of the usual identification, (rows, joints), as a share of each joint's torque."""
    runs = [run for run in split_runs(recording.runs) if run.role == "identify"]
    chosen = choose_identifier(recording.arm, runs, choose_cutoff_hz(recording.arm, runs), recording.arm.name)
    model = chosen.identifier.fit(runs).model_
    return _share_left(model, [each.rows for each in plain.held_out])


def _left_by_diagnosis(recording: Recording, verdict_folder: Path, plain: PlainFit) -> Array:
    """Residual of the model of a diagnosis, (rows, joints), as a share of each joint's torque."""
    if not recording.with_role("validate"):
        raise InputError("no run validates, so that it has seen every run")
    if not (verdict_folder / "model.yaml").is_file():
        raise InputError("it found no model")
    model = read_model(verdict_folder / "model.yaml")
    corrected = verdict_folder / CORRECTED_FOLDER
    if not corrected.is_dir():
        return _share_left(model, [each.rows for each in plain.held_out])
    rows = [prepare_rows(run, plain.cutoff_hz) for run in load_recording(corrected).with_role("validate")]
    return _share_left(model, [each for each in rows if len(each.torque)])


def _share_left(model: TorqueModel, rows: list[PlainRows]) -> Array:
    """What a model leaves behind the low-pass, over the rms of each joint's filtered torque, (rows, joints)."""
    left = np.concatenate([each.low_pass(each.run.torque - model.predict(each.run)) for each in rows])
    return left / _rms(np.concatenate([each.torque for each in rows]))


def _rms(values: Array) -> Array:
    """(rows, joints) to (joints,); 1 for a joint that is zero throughout."""
    size = np.sqrt(np.mean(values**2, axis=0))
    return np.asarray(np.where(size > 0, size, 1.0))


def _joint_errors(plain: PlainFit, left: dict[JudgedModel, Array]) -> tuple[JointErrors, ...]:
    size = _rms(plain.torque)
    share = plain.residual / size
    blocks = _block_numbers([len(each.residual) for each in plain.held_out])
    return tuple(
        JointErrors(
            joint=joint + 1,
            torque=float(size[index]),
            plain=float(100 * np.sqrt(np.mean(share[:, index] ** 2))),
            percent={name: float(100 * np.sqrt(np.mean(each[:, index] ** 2))) for name, each in left.items()},
            ratio={name: error_ratio(each[:, index], share[:, index], blocks) for name, each in left.items()},
        )
        for index, joint in enumerate(plain.joints)
    )


def _block_numbers(lengths: list[int]) -> NDArray[np.intp]:
    """The block of each row, (rows,): about BLOCKS stretches of equal length, none over the end of a run."""
    length = max(-(-sum(lengths) // BLOCKS), ROWS_OF_BLOCK)
    numbers, first = list[NDArray[np.intp]](), 0
    for rows in lengths:
        count = max(rows // length, 1)
        numbers.append(first + np.arange(rows) * count // rows)
        first += count
    return np.concatenate(numbers)


def error_ratio(model: Array, plain: Array, blocks: NDArray[np.intp]) -> Ratio:
    """RMS of a model's residual over that of plain least squares; interval by a bootstrap of the same blocks of both.

    model, plain: (rows,); blocks: (rows,), the block of each row of both. Without paired rows there is no interval.
    """
    value = float(np.sqrt(np.mean(model**2) / np.mean(plain**2)))
    if len(model) != len(plain) or blocks.max() + 1 < MIN_BLOCKS:
        return Ratio(value, None)
    sums = np.stack([np.bincount(blocks, each**2) for each in (model, plain)])
    drawn = np.random.default_rng(0).integers(sums.shape[1], size=(DRAWS, sums.shape[1]))
    above, below = sums[:, drawn].sum(axis=2)
    low, high = np.quantile(np.sqrt(above / below), (0.025, 0.975))
    return Ratio(value, (float(low), float(high)))
