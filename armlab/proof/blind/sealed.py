"""Sealed sets: cases are drawn, made, sealed, answered blindly and judged, by one machine for every tier.

The observation and the truth of a case are hashed when they are made. A manifest with the SHA-256 of every file seals
the set, and its own SHA-256 is printed before the first diagnosis. Each diagnosis runs through the command line, on a
copy of one observation in a temporary folder without answers. Every file is compared with the manifest before any truth
is read. An interrupted set continues in its folder.
"""

import hashlib
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Generic, Protocol, TypeVar

from joblib import Parallel, delayed

from armlab.common.errors import InputError
from armlab.common.settings import read_json
from armlab.proof.blind.folders import claim_folder
from armlab.proof.blind.formats import Manifest, read_model, write_model
from armlab.proof.blind.log_page import LOG_FILE, write_log_page
from armlab.proof.blind.plan import DEVELOPMENT_SEEDS
from armlab.proof.blind.score.cases import FAILURE_FILE, TIME_FILE

OBSERVATION, TRUTH_FILE = "observation", "truth.json"  # in a draft: what a diagnosis sees, and the answer
OBSERVATIONS, TRUTH, VERDICTS = "observations", "truth", "verdicts"  # folders of a set, with one entry a case
DRAFTS, DIGESTS = "drafts", "digests"
MANIFEST_FILE, FINISHED_MARK = "manifest.json", "finished"
TIMEOUT_S = 900.0
SOURCE_ROOT = Path(__file__).resolve().parents[3]
JUDGED_LOG = SOURCE_ROOT / "results" / "proof" / LOG_FILE  # of all judged runs


class SeededSettings(Protocol):
    """What tells sets of a tier apart, a dataclass: at least the seed."""

    @property
    def seed(self) -> int:
        """Seeds 1000-1999 are for development."""


class Named(Protocol):
    """A plan of a case: it can be sent to another process."""

    @property
    def name(self) -> str:
        """A random name, which says nothing about the case."""


Chosen = TypeVar("Chosen", bound=SeededSettings)
Plan = TypeVar("Plan", bound=Named)
ManifestModel = TypeVar("ManifestModel", bound=Manifest)


@dataclass(frozen=True)
class Score:
    """What a tier says of a judged set: its lines, the number of cases that count, and for the log the measures by
    tier, each with id, value, low, high and number.
    """

    lines: Sequence[str]
    cases: int
    measures: dict[str, list[dict[str, Any]]]


@dataclass(frozen=True)
class SealedTier(Generic[Chosen, Plan]):
    """How the sets of one tier are drawn, made, asked and judged.

    name: in the log. draw: the plans of a set. make: writes `OBSERVATION` and `TRUTH_FILE` of a plan into a draft
    folder (`truth.*` are answers, too). question: arguments of the command that answers a plan, whose observation is in
    a folder. judge: reads `TRUTH` and `VERDICTS` below the first folder, that of the set, and writes its score into the
    second. manifest: its model; a key of it that the settings have is filled in. done: what is said of answered cases.
    """

    name: str
    draw: Callable[[Chosen], Iterable[Plan]]
    make: Callable[[Plan, Path], None]
    question: Callable[[Plan, Path], list[str]]
    judge: Callable[[Chosen, Path, Path], Score]
    manifest: type[Manifest] = Manifest
    done: str = "diagnosed"

    def prove(
        self,
        settings: Chosen,
        work: Path,
        results: Path,
        jobs: int,
        commit: str | None = None,
        log: Path = JUDGED_LOG,
    ) -> Iterator[str]:
        """Makes, seals, asks, checks, judges and logs a set; yields the lines that report it.

        commit: of a judged set, which is logged once, with any score. InputError for a folder of another set, and
        where a file of the set is no longer the one that was sealed.
        """
        plans = list(self.draw(settings))
        yield from _report_progress("made", self.conceal(settings, work, jobs), len(plans))

        sealed = self.seal(settings, work)
        yield f"{self.name}: manifest SHA-256 {sealed}"

        yield from _report_progress(self.done, self.ask(plans, work, jobs), len(plans))

        read_checked_manifest(work, self.manifest, sealed)
        score = self.judge(settings, work, results)
        yield from score.lines

        if commit is not None and not (work / FINISHED_MARK).is_file():
            append_to_log(log, commit, self.name, settings.seed, sealed, score)
            (work / FINISHED_MARK).touch()

    def conceal(self, settings: Chosen, folder: Path, jobs: int) -> Iterator[str]:
        """Makes the missing cases of a set that is not sealed yet; yields the name of each.

        InputError for a folder of another set.
        """
        claim_folder(settings, folder, (OBSERVATIONS, TRUTH, DIGESTS))
        missing = [plan for plan in self.draw(settings) if not is_made(folder, plan.name)]
        tasks = (delayed(_make_case)(self.make, plan, folder) for plan in missing)
        yield from Parallel(n_jobs=jobs, return_as="generator_unordered")(tasks)
        shutil.rmtree(folder / DRAFTS, ignore_errors=True)

    def seal(self, settings: Chosen, folder: Path) -> str:
        """The SHA-256 of the manifest of a complete set; the manifest is written unless it is there."""
        path = folder / MANIFEST_FILE
        if not path.is_file():
            names = sorted(plan.name for plan in self.draw(settings))
            digests: dict[str, str] = {}
            for name in names:
                digests |= read_json(_digest_file(folder, name))
            facts = {key: value for key, value in vars(settings).items() if key in self.manifest.model_fields}
            content = {**facts, "schema": "manifest/1", "cases": tuple(names), "files": dict(sorted(digests.items()))}
            write_model(self.manifest(**content), path)
        return file_digest(path)

    def ask(self, plans: Sequence[Plan], folder: Path, jobs: int) -> Iterator[str]:
        """Answers the cases that have no verdict yet, each in a process of its own; yields the name of each."""
        missing = [plan for plan in plans if not is_answered(folder / VERDICTS / plan.name)]
        tasks = (delayed(self._ask_case)(plan, folder) for plan in missing)
        yield from Parallel(n_jobs=jobs, backend="threading", return_as="generator_unordered")(tasks)

    def _ask_case(self, plan: Plan, folder: Path) -> str:
        with TemporaryDirectory() as desk:
            copy = shutil.copytree(folder / OBSERVATIONS / plan.name, Path(desk) / plan.name)
            answer(self.question(plan, copy), folder / VERDICTS / plan.name)
        return plan.name


def _make_case(make: Callable[[Plan, Path], None], plan: Plan, folder: Path) -> str:
    """Makes one case in a draft folder. Its digests are written last and mark it as complete."""
    draft, observation = folder / DRAFTS / plan.name, folder / OBSERVATIONS / plan.name
    for left in (draft, observation):  # of an interruption
        shutil.rmtree(left, ignore_errors=True)
    draft.mkdir(parents=True)
    make(plan, draft)
    (draft / OBSERVATION).replace(observation)
    answers = [path.replace(folder / TRUTH / f"{plan.name}{path.suffix}") for path in draft.glob("truth.*")]
    note = draft / "digests.json"
    note.write_text(json.dumps(_digests(folder, (observation, *answers))) + "\n", encoding="utf-8")
    note.replace(_digest_file(folder, plan.name))
    shutil.rmtree(draft)
    return plan.name


def is_made(folder: Path, case: str) -> bool:
    """Whether a case of the set in a folder is complete, as all of a sealed set are."""
    return (folder / MANIFEST_FILE).is_file() or _digest_file(folder, case).is_file()


def _digest_file(folder: Path, case: str) -> Path:
    return folder / DIGESTS / f"{case}.json"


def seal_files(folder: Path) -> dict[str, str]:
    """The SHA-256 of every observation and answer below a folder, by path from it."""
    return _digests(folder, (folder / OBSERVATIONS, folder / TRUTH))


def _digests(folder: Path, parts: Iterable[Path]) -> dict[str, str]:
    found = (path for part in parts for path in ((part,) if part.is_file() else part.rglob("*")) if path.is_file())
    return dict(sorted((path.relative_to(folder).as_posix(), file_digest(path)) for path in found))


def file_digest(path: Path) -> str:
    """SHA-256 of a file, hexadecimal."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def read_checked_manifest(
    folder: Path, model: type[ManifestModel], expected: str | None = None
) -> tuple[ManifestModel, str]:
    """A manifest and its SHA-256, after every file was compared with it.

    expected: the SHA-256 that was printed. Raises InputError for the first file that was changed, is missing, or came
    later.
    """
    path = folder / MANIFEST_FILE
    if not path.is_file():
        raise InputError(f"no {MANIFEST_FILE} in {folder}: this is not a finished concealed set")
    own = file_digest(path)
    if expected is not None and own != expected:
        raise InputError(f"{path} has the SHA-256 {own}, not {expected}: it is not the manifest that was sealed")
    manifest, found = read_model(model, path), seal_files(folder)
    for name in sorted(manifest.files.keys() | found.keys()):
        if manifest.files.get(name) != found.get(name):
            what = "was added" if name not in manifest.files else "was changed" if name in found else "is missing"
            raise InputError(f"{folder / name} {what} after {MANIFEST_FILE} was sealed: the set cannot be scored")
    return manifest, own


def is_answered(out: Path) -> bool:
    """Whether a folder holds a complete verdict, or says why there is none."""
    return (out / TIME_FILE).is_file() or (out / FAILURE_FILE).is_file()


def answer(arguments: Sequence[str], out: Path) -> None:
    """Runs a command of armlab that writes its verdict to `out`; the time, written last, marks it as complete."""
    out.mkdir(parents=True, exist_ok=True)
    start = time.monotonic()
    complaint = _run_command([*arguments, "--out", str(out.resolve())])
    seconds = time.monotonic() - start
    if complaint is not None:
        (out / FAILURE_FILE).write_text(complaint, encoding="utf-8")
    else:
        (out / TIME_FILE).write_text(json.dumps({"seconds": round(seconds, 2)}) + "\n", encoding="utf-8")


def _run_command(arguments: list[str]) -> str | None:
    """Runs armlab in a process of its own: the error output where it failed, None where it succeeded."""
    try:
        done = subprocess.run(
            command_of(arguments),
            capture_output=True,
            text=True,
            check=False,
            env=one_thread_environment(),
            cwd=SOURCE_ROOT,
            timeout=TIMEOUT_S,
        )
    except subprocess.TimeoutExpired:
        return f"no verdict after {TIMEOUT_S:g} s\n"
    return done.stderr if done.returncode else None


def command_of(arguments: Sequence[str]) -> list[str]:
    """A command of armlab for a process of its own."""
    return [sys.executable, "-m", "armlab.cli.main", *arguments]


def one_thread_environment() -> dict[str, str]:
    """The environment of such a process."""
    return {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


def _report_progress(what: str, done: Iterator[str], total: int) -> Iterator[str]:
    """Runs an iterator and yields a line after each tenth of the total."""
    every = max(total // 10, 1)
    for number, _ in enumerate(done, 1):
        if number % every == 0:
            yield f"  {what} {number} of {total}"


CODE = ("armlab", "problem", "algorithms", "bench", "requirements", "pyproject.toml", "setup.py")


def code_commit() -> str:
    """The last commit that changed the code; InputError where this is no git checkout.

    Results and pages that are committed later do not change it, so that a proof may go on tier by tier.
    """
    return _run_git("log", "-1", "--format=%H", "--", *CODE)


def judged_seed(commit: str) -> int:
    """A seed from the hash of a commit; never a development seed."""
    return DEVELOPMENT_SEEDS.stop + int(commit[:12], 16)


def append_to_log(path: Path, commit: str, name: str, seed: int, sealed: str, score: Score) -> None:
    """Adds a line to the log of judged runs (commit, seed, seal, each measure by its id), and writes its page."""
    entry = {
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
        "commit": commit,
        "changed_files": bool(_run_git("status", "--porcelain", "--untracked-files=no", ".", ":!results")),
        "set": name,
        "seed": seed,
        "cases": score.cases,
        "manifest": sealed,
        "score": {
            tier: {each["id"]: [each["value"], each["low"], each["high"], each["number"]] for each in measures}
            for tier, measures in score.measures.items()
        },
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(entry) + "\n")
    write_log_page(path)


def _run_git(*arguments: str) -> str:
    try:
        done = subprocess.run(["git", *arguments], cwd=SOURCE_ROOT, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        raise InputError("the judged seed follows from the commit, and this is no git checkout: use --quick") from None
    return done.stdout.strip()
