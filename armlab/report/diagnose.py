"""The diagnosis of a recording as a verdict, and what changed between recordings, for scripts and notebooks."""

import shlex
from collections.abc import Sequence
from datetime import date
from pathlib import Path

from armlab.common.errors import DataError, InputError
from armlab.common.files import write_texts
from armlab.diagnosis.changes import comparison as changes
from armlab.diagnosis.motion.diagnose_motion import diagnose_motion
from armlab.diagnosis.settings import Baseline, Settings
from armlab.diagnosis.torque import diagnose as engine
from armlab.recordings.given import GivenRecording, recording_of, torque_recording_of
from armlab.recordings.motion import MotionRecording
from armlab.report.motion.motion_verdict import make_motion_verdict, motion_texts
from armlab.report.verdict import Verdict, verdict_of
from armlab.report.verdict_files import check_can_be_written, make_verdict


def diagnose(
    recording: GivenRecording,
    baseline: Baseline | None = None,
    seed: int = 0,
    settings: Settings | None = None,
    as_read: bool = False,
    out: str | Path | None = None,
) -> Verdict:
    """Where the simulation and the recording differ, and what physics is missing.

    recording: or the path of its folder. baseline: what is compared; the simulation where there is one if left out.
    seed: of the surrogates' random waves. as_read: the recording and the robot file are not doubted. A recording of
    motion only has none of these. out: folder for the files that `armlab diagnose` writes, report.html among them.
    Raises InputError, in one line, for a recording that cannot be used.

        verdict = armlab.diagnose("my-recording")
        print(verdict.summary)
    """
    known = recording_of(recording)
    if out is not None:
        check_can_be_written(Path(out))
    if isinstance(known, MotionRecording):
        if baseline is not None or settings is not None or as_read:
            raise InputError(f"{known.name} is of motion only: leave out baseline, settings and as_read")
        servos = diagnose_motion(known)
        if out is not None:
            from armlab.report.motion.motion_page import motion_page  # matplotlib is loaded by those who draw

            page = motion_page(servos, _command(known.folder, out))
            write_texts({**motion_texts(servos, Path(out)), "report.html": page}, Path(out))
        return verdict_of(make_motion_verdict(servos), servos, None)
    try:
        found = engine.diagnose(known, baseline, seed, settings, as_read=as_read)
    except DataError as error:
        raise InputError(f"{known.folder}: {error}") from None
    if out is not None:
        from armlab.report.torque.write import folder_texts

        options = ["--baseline", baseline] * (baseline is not None) + ["--seed", str(seed)] * bool(seed)
        command = _command(known.folder, out, *map(str, options), *["--as-read"] * as_read) if settings is None else ""
        write_texts(folder_texts(found, Path(out), settings or Settings(), command), Path(out))
    return verdict_of(make_verdict(found), found, None)


def _command(folder: Path, out: str | Path, *options: str) -> str:
    """The command that makes the same files, for the page."""
    return shlex.join(["armlab", "diagnose", str(folder), "--out", str(out), *options])


def compare(
    old: GivenRecording,
    new: GivenRecording,
    *more: GivenRecording,
    baseline: Baseline | None = None,
    seed: int = 0,
    dates: Sequence[date] = (),
) -> changes.Comparison:
    """What changed from the first recording of a robot to the later ones.

    old, new, more: recordings with torque, or the paths of their folders. dates: of the recordings; those of their
    files if left out. Raises InputError where the recordings are not of one robot, or dates are not as many.
    """
    first, second, *others = map(torque_recording_of, (old, new, *more))
    return changes.compare(first, second, *others, baseline=baseline, seed=seed, dates=dates)
