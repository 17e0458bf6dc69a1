"""`armlab diagnose`: from a recording folder to a verdict in files and lines."""

import resource
import shlex
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import get_args

from armlab.diagnosis.diagnose import diagnose
from armlab.diagnosis.settings import Baseline, Settings, guards_without
from armlab.diagnosis.verdict_files import (
    PREDICTED_FOLDER,
    check_output_folder,
    predicted_texts,
    verdict_texts,
    write_texts,
)
from diagnosis.report.terminal import terminal_lines
from diagnosis.report.write import FIGURES, report_texts
from problem.errors import InputError
from recordings.load import load_recording


def diagnose_recording(
    folder: Path,
    out: Path,
    baseline: str | None,
    seed: int,
    without: tuple[str, ...] = (),
    progress: Callable[[str], None] = lambda message: None,
) -> Iterator[str]:
    """Diagnoses, writes verdict.json, report.html, model.yaml and figures into `out`, all or none; tells it in lines.

    without: guards that are switched off. progress: is told what is being done. Raises InputError, in one line, for a
    recording that cannot be used, and for a guard that there is not.
    """
    chosen: Baseline | None = next((each for each in get_args(Baseline) if each == baseline), None)
    recording = load_recording(folder)
    check_output_folder(out, recording)
    try:
        found = diagnose(recording, chosen, seed, Settings(guards=guards_without(without)), progress)
    except ValueError as error:
        raise InputError(f"{folder}: {error}") from None
    progress("writing the report")
    options = [*(["--baseline", baseline] if baseline else []), *(["--seed", str(seed)] if seed else [])]
    options += [word for guard in without for word in ("--without", guard)]
    command = shlex.join(["armlab", "diagnose", str(folder), "--out", str(out), *options])
    texts = verdict_texts(found, out) | report_texts(found, command) | predicted_texts(found)
    write_texts(texts, out)
    yield from terminal_lines(found)
    pictures = sum(name.startswith(FIGURES) for name in texts)
    files = ", ".join(name for name in texts if not name.startswith((FIGURES, PREDICTED_FOLDER)))
    more = f", {pictures} pictures in {FIGURES}" if pictures else ""
    more += (
        f", predicted torque in {PREDICTED_FOLDER}" if any(name.startswith(PREDICTED_FOLDER) for name in texts) else ""
    )
    yield f"wrote {out}: {files}{more}"
    if found.seconds:
        yield f"diagnosed in {found.seconds:.1f} s once read; {_peak_memory():.2f} GB of memory at most"


def _peak_memory() -> float:
    """Of this process, GB."""
    unit = 1 if sys.platform == "darwin" else 1024  # bytes in what the system counts in
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e9
