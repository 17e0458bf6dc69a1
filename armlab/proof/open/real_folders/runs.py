"""Each folder diagnosed by the command line in a process of its own; what is done stays, so that a run goes on."""

import hashlib
import json
import shutil
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from joblib import Parallel, delayed

from armlab.common.files import write_whole
from armlab.common.processes import measure_run
from armlab.common.settings import read_json
from armlab.proof.open.real_folders.recording_folders import RecordingFolder
from armlab.proof.open.stored import REPOSITORY

CODE_FOLDERS = ("armlab", "problem", "algorithms")
NO_CODE_OF_A_DIAGNOSIS = ("concealed", "schemas", "real_arms", "real_concealed", "real_folders", "relations")
CODE_SUFFIXES = (".py", ".c", ".yaml", ".json")
OUTCOME_FILE, VERDICT_FOLDER = "outcome.json", "verdict"
KEY_DIGITS = 16  # of the digest in the name of a folder
COMMAND = (sys.executable, "-m", "armlab.cli.main")
STOPPED = 130  # exit status of a command that Ctrl-C ends


@dataclass(frozen=True)
class FolderOutcome:
    """What a diagnosis took. processor_seconds: of all its threads. failure: the error in one line, None for none."""

    seconds: float
    processor_seconds: float
    memory_mb: float
    failure: str | None = None


@dataclass(frozen=True)
class FolderRun:
    """A folder that is diagnosed, and where: in a folder whose name holds the digest of all that it follows from."""

    folder: RecordingFolder
    work: Path

    @property
    def verdict_folder(self) -> Path:
        """Where the command line writes."""
        return self.work / VERDICT_FOLDER

    @property
    def verdict_file(self) -> Path:
        """The verdict or the comparison."""
        return self.verdict_folder / self.folder.verdict_name

    def outcome(self) -> FolderOutcome | None:
        """What it took; None where it is not done."""
        path = self.work / OUTCOME_FILE
        return FolderOutcome(**read_json(path)) if path.is_file() else None


def plan_runs(folders: Sequence[RecordingFolder], work: Path) -> tuple[FolderRun, ...]:
    """Where each folder is diagnosed: another place as soon as code, recording or arguments are other ones."""
    code = diagnosis_digest()
    return tuple(FolderRun(each, work / each.name / _key(code, each)) for each in folders)


def _key(code: str, folder: RecordingFolder) -> str:
    whole = f"{code} {folder.digest()} {' '.join(folder.arguments())}"
    return hashlib.sha256(whole.encode()).hexdigest()[:KEY_DIGITS]


def diagnosis_digest() -> str:
    """SHA-256 of the code that a diagnosis follows from; what judges it does not count."""
    out = hashlib.sha256()
    for folder in CODE_FOLDERS:
        for path in sorted((REPOSITORY / folder).rglob("*")):
            place = path.relative_to(REPOSITORY)
            if path.suffix in CODE_SUFFIXES and not set(place.parts) & set(NO_CODE_OF_A_DIAGNOSIS):
                out.update(place.as_posix().encode() + path.read_bytes())
    return out.hexdigest()


def run_missing(runs: Sequence[FolderRun], jobs: int) -> Iterator[str]:
    """Diagnoses what is not done, the largest recordings first; a line as each is done, with the time left."""
    missing = sorted((each for each in runs if each.outcome() is None), key=lambda each: -each.folder.size)
    if len(missing) < len(runs):
        yield f"{len(runs) - len(missing)} of {len(runs)} folders are done already"
    if missing:
        yield f"{len(missing)} to diagnose, {jobs} at a time, the largest first"
    start = time.monotonic()
    done = Parallel(n_jobs=jobs, backend="threading", return_as="generator_unordered")(
        delayed(_run)(each) for each in missing
    )
    for number, (run, outcome) in enumerate(done, 1):
        left_s = (time.monotonic() - start) / number * (len(missing) - number)
        said = "refused" if outcome.failure else "diagnosed"
        left = f"; about {left_s / 60:.0f} min left" if number < len(missing) else ""
        yield f"{said} {number} of {len(missing)}: {run.folder.name}, {outcome.seconds:.0f} s{left}"


def _run(run: FolderRun) -> tuple[FolderRun, FolderOutcome]:
    """The command line in a process of its own, with one thread for linear algebra."""
    shutil.rmtree(run.work, ignore_errors=True)
    run.work.mkdir(parents=True)
    command = [*COMMAND, *run.folder.arguments(), "--out", str(run.verdict_folder.resolve())]
    measured = measure_run(command, REPOSITORY)
    outcome = FolderOutcome(
        seconds=round(measured.seconds, 2),
        processor_seconds=round(measured.processor_seconds, 2),
        memory_mb=round(measured.memory_bytes / (1 << 20), 1),
        failure=_failure(measured.status, measured.complaint),
    )
    if measured.status >= 0 and measured.status != STOPPED:  # who was stopped or killed is asked again
        write_whole(run.work / OUTCOME_FILE, json.dumps(asdict(outcome), indent=1) + "\n")
    return run, outcome


def _failure(status: int, complaint: str) -> str | None:
    if status == 0:
        return None
    return complaint.splitlines()[-1] if complaint else f"ended with status {status}"
