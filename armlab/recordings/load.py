"""From a recording folder to a `Recording`: read, repaired where safe, in SI units on the joint side."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from armlab.common.errors import InputError
from armlab.recordings.channels import (
    channel_units,
    check_rate,
    make_raw_run,
    make_transmission,
    restore_gravity,
    take_timing_back,
    to_joint_side,
)
from armlab.recordings.clock import cut_at_jumps, cut_into_clocks, keep_long_parts, part_equal_stamps, require_samples
from armlab.recordings.dead_joints import leave_dead_joints_out
from armlab.recordings.encoders import read_direction_bit, unwrap_encoders
from armlab.recordings.reading.signs import compare_joint_names
from armlab.recordings.recording import AnyRun, Finding, Recording, Run, Transmission
from armlab.recordings.recording_file import FILE_NAME, RecordingFile, RunEntry, read_recording_file
from armlab.recordings.repair import (
    drop_bad_rows,
    drop_copied_rows,
    drop_rows_beyond_limits,
    drop_zero_rows,
    fill_optional_signals,
    leave_out,
)
from armlab.recordings.stamps import drop_repeated_rows, repair_stamps
from armlab.recordings.table import read_table
from armlab.recordings.units import Unit
from problem.arm import Arm, Joint
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
    arm = replace(arm, unmeasured=_stated_without_torque(file, arm, folder))
    if file.restore_gravity and arm.links is None:
        raise InputError(f"restore_gravity in {folder / FILE_NAME}: the robot states no links whose gravity is known")
    transmission = make_transmission(file, arm, folder)
    simulation = folder / file.simulation if file.simulation else None
    if simulation and not simulation.is_file():
        raise InputError(f"no file {simulation}, which `simulation` in {folder / FILE_NAME} names")
    names = _compare_names(file, arm)
    empty = Recording(folder, file.robot, arm, (), transmission, simulation, file.sample_rate_hz, names)
    return replace(empty, recorded=file.recorded), file


def _stated_without_torque(file: RecordingFile, arm: Arm, folder: Path) -> frozenset[int]:
    """The joints, from 0, of which the file says that they have no torque."""
    stated, where = file.without_torque, f"without_torque in {folder / FILE_NAME}"
    beyond = [each for each in stated if each > len(arm)]
    if beyond:
        raise InputError(f"{where} names joint {beyond[0]}, but the robot has {len(arm)} joints")
    if len(set(stated)) == len(arm):
        raise InputError(f"{where} names all joints: a joint with torque is needed")
    return frozenset(each - 1 for each in stated)


def _compare_names(file: RecordingFile, arm: Arm) -> tuple[Finding, ...]:
    """Warnings where columns bear the names of other joints; a transmission may mix them."""
    out: tuple[Finding, ...] = ()
    if file.transmission.position is None:
        out += compare_joint_names(file.columns.position, arm, "position")
    if file.transmission.torque is None:
        out += compare_joint_names(file.columns.torque or file.columns.current or (), arm, "torque")
    return out


def load_runs(recording: Recording, file: RecordingFile, entry: RunEntry) -> tuple[Run, ...]:
    """The runs of one file: several where its clock starts anew or its signals jump at a gap."""
    units = channel_units(file, recording.arm, recording.folder)
    table = read_table(recording.folder / entry.file)
    run = make_raw_run(table, file, entry, units)
    places = RepairPlaces(table.row_numbers, file, entry, units, recording.arm.joints, recording.transmission)
    del table  # of a large log, its numbers are as much memory as the run
    where = str(recording.folder / FILE_NAME)
    timed = (take_timing_back(part, file.timing, where) for part in repair_run(run, places))
    return tuple(restore_gravity(part, recording.arm) if file.restore_gravity else part for part in timed)


@dataclass(frozen=True, eq=False)
class RepairPlaces:
    """Where a run comes from, for its repairs: numbers of its rows in the file, units of its channels, its joints."""

    row_numbers: NDArray[np.intp]
    file: RecordingFile
    entry: RunEntry
    units: dict[str, tuple[Unit, ...]]
    joints: tuple[Joint, ...]
    transmission: Transmission


def repair_run(raw: AnyRun, places: RepairPlaces) -> tuple[AnyRun, ...]:
    """The run repaired and on the joint side; several where its clock starts anew or its signals jump at a gap."""
    columns = places.file.columns
    names = columns.signals() | {"torque": columns.torque or columns.current or ()}
    measured = drop_bad_rows(raw, places.row_numbers, names)
    chosen = leave_out(measured, places.entry.exclude)
    filled = drop_zero_rows(chosen)
    single = drop_copied_rows(filled)
    rows = single.samples + raw.samples - measured.samples + chosen.samples - filled.samples
    sound = drop_rows_beyond_limits(single, places.joints, places.transmission)
    clocks = (  # rows of zeros show again where rows were in no order
        part_equal_stamps(read_direction_bit(fill_optional_signals(drop_zero_rows(clock))))
        for clock in cut_into_clocks(sound)
    )
    exclude = places.entry.exclude
    parts = keep_long_parts(tuple(part for clock in clocks for part in cut_at_jumps(clock, exclude)), rows)
    angles = {name: tuple(unit.quantity == "rad" for unit in channels) for name, channels in places.units.items()}
    even = require_samples(tuple(repair_stamps(drop_repeated_rows(part)) for part in parts))
    joints = (to_joint_side(unwrap_encoders(part, angles), places.transmission) for part in even)
    return tuple(check_rate(part, places.file.sample_rate_hz) for part in joints)


def with_runs(recording: Recording, runs: Sequence[Run]) -> Recording:
    """The recording with its runs, dead joints left out; notes where runs differ in rate, or where none validates."""
    recording = leave_dead_joints_out(replace(recording, runs=tuple(runs)))
    findings = list(recording.findings)
    rates = {run.name: run.rate_hz for run in runs}
    if rates and max(rates.values()) > 1.02 * min(rates.values()):
        listed = ", ".join(f"{name} {rate:.5g} Hz" for name, rate in rates.items())
        text = f"runs have different rates ({listed}); each is filtered at its own rate"
        findings.append(Finding("different_rates", "note", text))
    if not any(run.role == "validate" for run in runs):
        text = "no run has the role validate: a diagnosis holds out blocks of time of the runs that identify"
        findings.append(Finding("no_validation", "note", text))
    return replace(recording, findings=tuple(findings))
