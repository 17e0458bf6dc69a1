"""From files of other formats to a recording folder: the last step of an import, and what it says about itself."""

import os
import shutil
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from armlab.common.documents import Document
from armlab.common.errors import InputError
from armlab.recordings.dead_joints import NO_TORQUE
from armlab.recordings.identifiable import has_no_torque, reason_dead, reason_not_identifiable
from armlab.recordings.imports.families import describe_unused, list_columns
from armlab.recordings.imports.gears import Gear
from armlab.recordings.imports.packed import PACKED_SUFFIXES
from armlab.recordings.imports.plan import ImportPlan, plan_import
from armlab.recordings.imports.questions import Options
from armlab.recordings.imports.rates import UnsureTimes, require_times
from armlab.recordings.imports.robots import ImportedRobot
from armlab.recordings.imports.sources import Source
from armlab.recordings.load import load_recording
from armlab.recordings.motion import is_motion_only, load_motion_recording
from armlab.recordings.recording import MotionRun, Role
from armlab.recordings.recording_file import Draft, DraftRun, Keys, write_recording
from armlab.recordings.table import has_parquet

MAX_CSV_NUMBERS = 5_000_000  # of a run; a larger one is written as Parquet, a hundredth of the time and half the size


@dataclass(frozen=True, eq=False)
class ImportedRecording:
    """A recording that was written. plan: without the content of the files.

    lines: how each file was read, what each signal was taken from, what was repaired, and what to do next. document:
    the same for programs.
    """

    folder: Path
    plan: ImportPlan
    lines: tuple[str, ...]
    document: Document


def import_files(files: Sequence[Path], out: Path, options: Options) -> ImportedRecording:
    """Writes the recording, and tells how each file was read and what each signal was taken from.

    options: robot, tip, lock, the columns of each signal, units, gains, gear_ratio, motor_side, joints, validate,
    separator, decimal, topic and command_topic; None if not given. Raises InputError for a wrong option, and for all
    missing ones together.
    """
    return write_plan(plan_import(files, {**options, "out": out}))


def write_plan(plan: ImportPlan) -> ImportedRecording:
    """Writes the recording of a plan.

    Raises InputError, with all of them, where questions are open, and where no command could use what was recorded.
    """
    if plan.questions or plan.robot is None:
        contexts = dict.fromkeys(question.context for question in plan.questions if question.context)
        raise InputError("; ".join((*(question.missing for question in plan.questions), *contexts)))
    draft = _draft_of(plan, plan.robot)
    folder = Path(plan.options["out"])
    was_there = folder.is_dir()
    copies = plan.robot.copies(folder)
    whole = folder / plan.robot.whole_name if plan.robot.whole_name in copies else None
    described, document = describe_plan(plan), _describe_runs(plan, draft)
    findings = (each for source in plan.sources.values() for each in source.table.findings)
    half_step_s = min((each.half_step_s for each in findings if isinstance(each, UnsureTimes)), default=None)
    write_recording(draft, folder, copies)
    plan = replace(plan, sources={})  # with the runs of the draft, as much memory as what is read now
    del draft
    try:
        repairs, useless = _read_written(folder, half_step_s)
    except InputError as error:
        _remove_written(folder, was_there)
        raise InputError(f"nothing is written: {str(error).replace(f'{folder}{os.sep}', '')}") from None
    plan = replace(plan, doubts=(*plan.doubts, *useless))
    lines = (
        *(f"{name}: {text}" for name, text in (*described, *(("doubtful", text) for text in useless))),
        *(f"{file}: repaired: {text}" for file, text in repairs),
        *([f"{whole}: the whole robot, for `armlab model export`"] if whole else []),
        f"{folder}: written; `armlab recording check {folder}` examines it",
    )
    said = {
        "recording": folder,
        "whole_robot": whole,
        **document,
        "doubts": plan.doubts,
        "repairs": [{"file": file, "text": text} for file, text in repairs],
    }
    return ImportedRecording(folder, plan, lines, said)


def _draft_of(plan: ImportPlan, robot: ImportedRobot) -> Draft:
    """What is to be written."""
    validate = {str(path) for path in plan.options["validate"]}
    wanted = tuple(name for names in plan.columns.values() for name in names)
    runs = []
    for path, source in plan.sources.items():
        role: Role = "validate" if path in validate else "identify"
        suffix = ".parquet" if len(source.table.values) * len(wanted) > MAX_CSV_NUMBERS and has_parquet() else ".csv"
        name = f"{_run_file(path, plan.sources)}{suffix}"
        runs.append(DraftRun(name, role, source.table.names, source.table.values))
    columns: Keys = {signal: names[0] if signal == "time" else names for signal, names in plan.columns.items()}
    others = {
        **({"gains": list(plan.gains)} if plan.gains else {}),
        **({"transmission": plan.gear.transmission("torque" in columns)} if plan.gear else {}),
        **({"joints": list(plan.joints)} if plan.joints else {}),
        **({"controller": plan.controller} if plan.controller else {}),
    }
    note = tuple(f"{run.file}: imported from {Path(path).name}" for path, run in zip(plan.sources, runs, strict=True))
    return Draft(robot.name, columns, dict(plan.units), tuple(runs), others, note)


def _describe_runs(plan: ImportPlan, draft: Draft) -> Document:
    """For programs: how each file was read, what each signal was taken from, and why."""
    runs = zip(draft.runs, plan.sources.items(), strict=True)
    return {
        "robot": draft.robot,
        "runs": [
            {
                "file": run.file,
                "role": run.role,
                "rows": len(source.table.values),
                "from": path,
                "read_as": source.note,
                "findings": [each.text for each in source.table.findings],
                "empty_columns": source.table.empty,
            }
            for run, (path, source) in runs
        ],
        "columns": plan.columns,
        "units": plan.units,
        "unused_columns": plan.unused,
        "reasons": {"columns": plan.column_reasons, "units": plan.unit_reasons},
    }


def _repairs_of(runs: Sequence[MotionRun]) -> tuple[tuple[str, str], ...]:
    """What was repaired, once a file."""
    return tuple(dict.fromkeys((run.file, finding.text) for run in runs for finding in run.repairs))


def _read_written(folder: Path, half_step_s: float | None) -> tuple[tuple[tuple[str, str], ...], tuple[str, ...]]:
    """What reading repairs; joints that are left out, and why nothing can be identified from what was written.

    half_step_s: by which signals may be apart in time, where the torques have to tell.
    Raises InputError for what no command could use, a torque that no joint has among it.
    """
    if is_motion_only(folder):
        return _repairs_of(load_motion_recording(folder).runs), ()
    recording = load_recording(folder)
    runs = recording.with_role("identify") or recording.runs
    if has_no_torque(runs):
        raise InputError(f"{runs[0].file}: {reason_dead(runs, recording.arm)}")
    if half_step_s is not None:
        require_times(runs, recording.arm, half_step_s)
    reason = reason_not_identifiable(recording) if recording.with_role("identify") else None
    left_out = tuple(each.text for each in recording.findings if each.kind == NO_TORQUE)
    return _repairs_of(recording.runs), left_out if reason is None else (*left_out, reason)


def _remove_written(folder: Path, was_there: bool) -> None:
    """Removes all that was written, and the folder if it is new: it may be the one that the user works in."""
    if not was_there:
        shutil.rmtree(folder)
        return
    for path in folder.iterdir():
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink()


def describe_plan(plan: ImportPlan) -> list[tuple[str, str]]:
    """How each file was read, what each signal was taken from and why, one row a signal, and what is doubtful.

    Names and texts.
    """
    rows = [(path, _describe_source(source)) for path, source in plan.sources.items()]
    if plan.robot:
        rows.append(("robot", "; ".join(filter(None, (plan.robot.source, plan.robot.locked)))))
    for signal, names in plan.columns.items():
        rows.append((signal, _describe_signal(plan, signal, names)))
    if plan.gear:
        rows.append(("gear ratio", _describe_gear(plan.gear, "torque" in plan.columns)))
    if plan.joints:
        rows.append(("joints", f"{', '.join(plan.joints)}; the others of the robot are held at zero"))
    if plan.controller:
        rows.append(("controller", f"{plan.options['controller']} (given with --controller)"))
    if plan.unused:
        rows.append(("not used", describe_unused(plan.unused, plan.joint_names)))
    return [*rows, *(("doubtful", text) for text in plan.doubts)]


def _describe_signal(plan: ImportPlan, signal: str, names: Sequence[str]) -> str:
    """`q1_rad ... q6_rad [rad] (usual names; unit from _rad)`."""
    column, unit = plan.column_reasons[signal], plan.unit_reasons.get(signal)
    why = column if unit is None or unit in column else f"{column}; unit {unit}"
    return f"{list_columns(names)} [{_describe_unit(plan, signal)}] ({why})"


def _describe_gear(gear: Gear, has_torque: bool) -> str:
    """Which signals were divided or multiplied by which ratios."""
    ratios = ", ".join(f"{ratio:g}" for ratio in gear.ratios)
    what = ["positions divided"] * gear.position + ["torques multiplied"] * (gear.torque and has_torque)
    return f"{' and '.join(what)} by {ratios}"


def _describe_unit(plan: ImportPlan, signal: str) -> str:
    unit = plan.units.get(signal, "unit?")
    return unit if isinstance(unit, str) else ", ".join(unit)


def _describe_source(source: Source) -> str:
    found = "".join(f"; {finding.text}" for finding in source.table.findings)
    empty = f"; no signal, without any number: {list_columns(source.table.empty)}" if source.table.empty else ""
    return f"{len(source.table.values)} rows ({source.note}){found}{empty}"


def _run_file(path: str, paths: Iterable[str]) -> str:
    """The name of a run without ending: that of its file, with its folder's where two files have one name."""
    own = _bare_name(path)
    alike = sum(_bare_name(each) == own for each in paths)
    place = list(paths).index(path) + 1
    return own if alike == 1 else f"{Path(path).resolve().parent.name}-{own}-{place}"


def _bare_name(path: str) -> str:
    """The name of a log without its endings, `log` of `log.csv.gz`."""
    whole = Path(path)
    return Path(whole.stem).stem if whole.suffix.lower() in PACKED_SUFFIXES else whole.stem
