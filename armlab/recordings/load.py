"""From a recording folder to a `Recording`: read, repaired where safe, in SI units on the joint side."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from armlab.common.errors import InputError
from armlab.recordings.channels import (
    channel_units,
    check_rate,
    make_raw_run,
    make_transmission,
    take_timing_back,
    to_joint_side,
)
from armlab.recordings.reading.signs import compare_joint_names
from armlab.recordings.recording import AnyRun, Finding, Recording, Run, Transmission
from armlab.recordings.recording_file import FILE_NAME, RecordingFile, RunEntry, read_recording_file
from armlab.recordings.repair import (
    drop_bad_rows,
    drop_duplicate_rows,
    fill_optional_signals,
    leave_out,
    read_direction_bit,
    sort_rows,
    split_at_gaps,
    unwrap_encoders,
)
from armlab.recordings.stamps import drop_repeated_rows, repair_stamps
from armlab.recordings.table import read_table
from armlab.recordings.units import Unit
from problem.arm import Arm
from problem.robot_file import load_arm


def load_recording(folder: str | Path) -> Recording:
    """The recording in a folder, in SI units on the joint side; each run holds findings about its repairs.

    Raises InputError, in one line, for what is missing, wrong, or not safe to repair.
    """
    empty, file = open_recording(Path(folder))
    runs = [run for entry in file.runs for run in load_runs(empty, file, entry)]
    return with_runs(empty, runs)


def open_recording(folder: Path) -> tuple[Recording, RecordingFile]:
    """The recording without its runs, and the file that lists them.

    Raises InputError where the file is wrong, and for a recording of motion only.
    """
    file = read_recording_file(folder)
    if not file.has_torque:
        raise InputError(
            f"{folder / FILE_NAME}: columns has neither torque nor current with `gains`, which this command needs; "
            "`armlab diagnose` and `armlab recording check` take a recording of motion only"
        )
    if file.joints is not None:
        raise InputError(f"joints in {folder / FILE_NAME}: only a recording of motion only may name joints")
    arm = load_arm(file.robot, folder)
    if file.gravity is not None:
        arm = replace(arm, gravity=file.gravity)
    transmission = make_transmission(file, arm, folder)
    simulation = folder / file.simulation if file.simulation else None
    if simulation and not simulation.is_file():
        raise InputError(f"no file {simulation}, which `simulation` in {folder / FILE_NAME} names")
    names = _compare_names(file, arm)
    empty = Recording(folder, file.robot, arm, (), transmission, simulation, file.sample_rate_hz, names)
    return replace(empty, recorded=file.recorded), file


def _compare_names(file: RecordingFile, arm: Arm) -> tuple[Finding, ...]:
    """Warnings where columns bear the names of other joints; a transmission may mix them."""
    out: tuple[Finding, ...] = ()
    if file.transmission.position is None:
        out += compare_joint_names(file.columns.position, arm, "position")
    if file.transmission.torque is None:
        out += compare_joint_names(file.columns.torque or file.columns.current or (), arm, "torque")
    return out


def load_runs(recording: Recording, file: RecordingFile, entry: RunEntry) -> tuple[Run, ...]:
    """The runs of one file: several if its clock steps back or pauses."""
    units = channel_units(file, recording.arm, recording.folder)
    table = read_table(recording.folder / entry.file)
    names = file.columns.signals()
    names["torque"] = file.columns.torque or file.columns.current or ()
    run = drop_bad_rows(make_raw_run(table, file, entry, units), table.row_numbers, names)
    parts = repair_run(run, recording.transmission, file, entry, units)
    return tuple(take_timing_back(part, file.timing, str(recording.folder / FILE_NAME)) for part in parts)


def repair_run(
    run: AnyRun,
    transmission: Transmission,
    file: RecordingFile,
    entry: RunEntry,
    units: dict[str, tuple[Unit, ...]],
) -> tuple[AnyRun, ...]:
    """The run without bad rows, repaired and on the joint side; several if its clock steps back or pauses."""
    run = leave_out(fill_optional_signals(drop_duplicate_rows(sort_rows(run))), entry.exclude)
    angles = {name: tuple(unit.quantity == "rad" for unit in channels) for name, channels in units.items()}
    sound = (
        unwrap_encoders(repair_stamps(drop_repeated_rows(part)), angles)
        for part in split_at_gaps(read_direction_bit(run))
    )
    joints = (to_joint_side(part, transmission) for part in sound)
    return tuple(check_rate(part, file.sample_rate_hz) for part in joints)


def with_runs(recording: Recording, runs: Sequence[Run]) -> Recording:
    """The recording with its runs; notes where they differ in rate, or where none validates."""
    findings = list(recording.findings)
    rates = {run.name: run.rate_hz for run in runs}
    if rates and max(rates.values()) > 1.02 * min(rates.values()):
        listed = ", ".join(f"{name} {rate:.5g} Hz" for name, rate in rates.items())
        text = f"runs have different rates ({listed}); each is filtered at its own rate"
        findings.append(Finding("different_rates", "note", text))
    if not any(run.role == "validate" for run in runs):
        text = "no run has the role validate: blocks of time are held out of the runs that identify"
        findings.append(Finding("no_validation", "note", text))
    return replace(recording, runs=tuple(runs), findings=tuple(findings))
