"""Diagnoses a recording of motion only and writes verdict, model, simulation and report into a folder."""

import shlex
from collections.abc import Callable, Sequence
from pathlib import Path

from armlab.common.documents import ResultLines
from armlab.common.files import write_texts
from armlab.common.report.printed_table import table_files
from armlab.diagnosis.motion.diagnose_motion import diagnose_motion
from armlab.diagnosis.motion.motion_result import MotionDiagnosis
from armlab.diagnosis.tuning import Tuning, change_tuning, parse_change
from armlab.recordings.motion import load_motion_recording
from armlab.report.motion.motion_page import joint_table, motion_page
from armlab.report.motion.motion_verdict import make_motion_verdict, motion_texts
from armlab.report.motion.motion_words import motion_lines
from armlab.report.signals_file import (
    SIGNALS_FILE,
    Track,
    check_signals_writer,
    recorded_track,
    signals_content,
    topic_names,
)
from armlab.report.verdict_files import check_can_be_written


def diagnose_motion_recording(
    folder: Path,
    out: Path,
    progress: Callable[[str], None] = lambda message: None,
    changes: Sequence[str] = (),
    with_signals: bool = False,
    tables: Sequence[str] = (),
    verbose: bool = False,
) -> ResultLines:
    """Diagnoses the recording in `folder`, writes all files into `out` or none, and yields lines to print.

    changes: tuning numbers like `motion.min_gain=0.05`. with_signals: whether `signals.mcap` is written. tables: forms
    in which the table of joints is written, too (`TABLE_FORMS`). verbose: whether the lines tell of every finding.
    Raises InputError, in one line, for a recording or a number that cannot be used.
    """
    tuning = Tuning()
    for change in changes:
        tuning = change_tuning(tuning, *parse_change(change))
    if with_signals:
        check_signals_writer()
    recording = load_motion_recording(folder)
    check_can_be_written(out)
    diagnosis = diagnose_motion(recording, progress, tuning.motion)
    settings = [part for change in changes for part in ("--set", change)] + ["--mcap"] * with_signals
    settings += [part for form in dict.fromkeys(tables) for part in ("--table", form)]
    command = shlex.join(["armlab", "diagnose", str(folder), "--out", str(out), *settings])
    texts: dict[str, str | bytes] = {**motion_texts(diagnosis, out), "report.html": motion_page(diagnosis, command)}
    if diagnosis.servos is not None:
        texts |= table_files("joints", joint_table(diagnosis), tables)
    moved = None
    if with_signals:
        joints = [joint.name for joint in recording.recorded_arm.joints]
        texts[SIGNALS_FILE], moved = signals_content(motion_tracks(diagnosis), joints)
    written = write_texts(texts, out)
    yield from motion_lines(diagnosis, verbose)
    yield f"wrote {out}: {', '.join(texts)}"
    if tables and diagnosis.servos is None:
        yield "no table of joints: no servo was identified"
    if moved is not None:
        yield moved
    if diagnosis.seconds:
        yield f"diagnosed in {diagnosis.seconds:.1f} s once read"
    return make_motion_verdict(diagnosis).content() | {"files": written}


def motion_tracks(diagnosis: MotionDiagnosis) -> list[Track]:
    """The topics of `signals.mcap` where a recording has no torque.

    `recorded` and `commanded`: as read, on the joint side. Of what is held out, from the same first state: `simulated`,
    the replay of the simulation as given (where its controller is known), and `corrected`, that with what was found.
    """
    runs = diagnosis.recording.runs
    names = topic_names(runs)
    tracks = []
    for run in runs:
        tracks.append(recorded_track(run, names[run.name]))
        commands = (run.reference_position, run.reference_velocity)
        tracks.append(Track(f"/{names[run.name]}/commanded", run.time, *commands))
    replays = {"simulated": diagnosis.replayed_before, "corrected": diagnosis.replayed_after}
    for signal, replayed in replays.items():
        for each in replayed:
            tracks.append(Track(f"/{names[each.run.name]}/validate/{signal}", each.run.time, each.position))
    return tracks
