"""The proof: `armlab real-concealed` conceals, diagnoses and judges random cases, and its tables are scored here.

The cases follow from the seed and the recordings alone, and the seed of a judged proof from the commit, so that nobody
has seen them before.
"""

import hashlib
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryFile

from armlab.common.errors import InputError
from armlab.concealed.folders import claim_folder
from armlab.concealed.prove import FINISHED_MARK, append_to_log
from armlab.concealed.real.page import write_score
from armlab.concealed.real.score import CASES_TABLE, RealTables, read_tables, real_measures
from armlab.concealed.sealed_set import JUDGED_LOG
from armlab.recordings.public import LOCAL_COPIES_VARIABLE, PUBLIC_RECORDINGS, is_available

REPOSITORY = Path(__file__).resolve().parents[3]
LOOKS_FOLDER = REPOSITORY / "results" / "real"  # of the log of looks at the validation runs of real recordings


@dataclass(frozen=True)
class RealSet:
    """Which recordings, how many random cases of each, and the seed; seeds 1000-1999 are for development."""

    recordings: tuple[str, ...]
    cases: int
    seed: int


def prove_real(settings: RealSet, work: Path, results: Path, jobs: int, commit: str | None = None) -> Iterator[str]:
    """Conceals, diagnoses, judges and scores; yields the lines that report it.

    Recordings that are not on this machine are left out; the tier is skipped where none is. work: folder of recordings
    and outcomes, where an interrupted proof continues. results: folder of page, tables and figures. commit: of a judged
    proof, which is logged once. InputError for a folder of another set.
    """
    found = [name for name in settings.recordings if is_available(PUBLIC_RECORDINGS[name])]
    for name in settings.recordings:
        if name not in found:
            yield f"{name} is left out: it is neither in the folder {LOCAL_COPIES_VARIABLE} nor in the cache"
    if not found:
        yield "tier real is skipped: no recording of a real arm is on this machine"
        return
    claim_folder(settings, work)
    tables = (work / "tables").resolve()
    yield from _run_command(_question(settings, found, work.resolve(), tables, jobs))
    scored = read_tables(tables)
    yield from (f"wrote {path}" for path in write_score(settings.seed, scored, results))
    for each in real_measures(scored):
        yield each.line
    if commit is not None and not (work / FINISHED_MARK).is_file():
        _log_score(settings, commit, scored, tables)


def _question(settings: RealSet, found: Sequence[str], work: Path, tables: Path, jobs: int) -> list[str]:
    """Arguments of the command that judges the cases."""
    only = [word for name in found for word in ("--only", name)]
    drawn = ["--seed", str(settings.seed), "--cases", str(settings.cases), "--jobs", str(jobs)]
    folders = ["--recordings", str(work / "recordings"), "--results", str(LOOKS_FOLDER), "--out", str(tables)]
    return ["real-concealed", *only, *drawn, *folders]


def _run_command(arguments: Sequence[str]) -> Iterator[str]:
    """The lines that a command of armlab prints, as they come; InputError with its last error where it fails."""
    command = [sys.executable, "-m", "armlab.cli.main", *arguments]
    one_thread = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    with (
        TemporaryFile("w+", encoding="utf-8") as errors,
        subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=errors, text=True, env=one_thread, cwd=REPOSITORY
        ) as running,
    ):
        try:
            for line in running.stdout or ():
                yield line.rstrip("\n")
            if running.wait():
                errors.seek(0)
                complaint = [line.strip() for line in errors if line.strip()] or ["no error output"]
                raise InputError(f"armlab {arguments[0]}: {complaint[-1]}")
        finally:
            running.kill()


def _log_score(settings: RealSet, commit: str, scored: RealTables, tables: Path) -> None:
    """Adds a judged score to the log, with the SHA-256 of the table of its cases."""
    manifest = hashlib.sha256((tables / CASES_TABLE).read_bytes()).hexdigest()
    measures = [asdict(each.measure) for each in real_measures(scored)]
    about = {"seed": settings.seed, "cases": scored.number, "manifest": manifest}
    append_to_log(JUDGED_LOG, commit, "real", {**about, "tiers": {"real": measures}})
