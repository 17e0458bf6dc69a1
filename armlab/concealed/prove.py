"""The blind proof: conceal, seal, diagnose each case in a process of its own, score, and log the result.

The diagnosis is run through the command line only. It gets a copy of one recording folder, in a temporary folder that
holds no answers.
"""

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from joblib import Parallel, delayed

from armlab.common.errors import InputError
from armlab.concealed.formats import SetKind
from armlab.concealed.log_page import LOG_FILE, write_log_page
from armlab.concealed.plan import DEVELOPMENT_SEEDS
from armlab.concealed.score.cases import FAILURE_FILE, TIME_FILE
from armlab.concealed.score.scoring import format_lines, score_set
from armlab.concealed.sets import SetSettings, conceal_cases, seal_set

QUICK_NAME, QUICK_SEED, QUICK_CASES = "quick", 1900, 24
TIMEOUT_S = 900.0
FINISHED_MARK = "finished"


@dataclass(frozen=True)
class Proof:
    """The sets of one proof, and its name. commit: of the source tree, None for a proof that is not judged."""

    sets: dict[str, SetSettings]
    name: str
    commit: str | None = None


def choose_proof(quick: bool, development: int | None, cases: int, nulls: int) -> Proof:
    """The quick proof, one on a development seed, or the judged one."""
    if quick:
        return make_quick_proof()
    return make_judged_proof(cases, nulls) if development is None else make_development_proof(development, cases, nulls)


def make_quick_proof() -> Proof:
    """A small development set, always the same, to check the whole chain."""
    return Proof({"quick": SetSettings(QUICK_CASES, QUICK_SEED, development=True)}, QUICK_NAME)


def make_development_proof(seed: int, cases: int, nulls: int) -> Proof:
    """Sets for development, which are not logged; InputError for a seed that is not for development."""
    if seed not in DEVELOPMENT_SEEDS:
        raise InputError(
            f"seed {seed} should be one for development, {DEVELOPMENT_SEEDS[0]} to {DEVELOPMENT_SEEDS[-1]}"
        )
    sets = {kind: SetSettings(count, seed, kind=kind, development=True) for count, kind in _set_sizes(cases, nulls)}
    return Proof({name: each for name, each in sets.items() if each.cases}, f"development-{seed}")


def make_judged_proof(cases: int, nulls: int) -> Proof:
    """Sets whose seed follows from the commit, so that nobody could tune on them before the commit existed."""
    commit = code_commit()
    seed = judged_seed(commit)
    sets = {kind: SetSettings(count, seed, kind=kind) for count, kind in _set_sizes(cases, nulls)}
    return Proof({name: each for name, each in sets.items() if each.cases}, commit, commit)


def _set_sizes(cases: int, nulls: int) -> tuple[tuple[int, SetKind], ...]:
    return (cases, "mixed"), (nulls, "nulls")


CODE = ("armlab", "problem", "algorithms", "bench", "requirements", "pyproject.toml", "setup.py")


def code_commit() -> str:
    """The last commit that changed the code; InputError where this is no git checkout.

    Results and pages that are committed later do not change it, so that a proof may go on tier by tier.
    """
    return _run_git("log", "-1", "--format=%H", "--", *CODE)


def judged_seed(commit: str) -> int:
    """A seed from the hash of a commit; never a development seed."""
    return DEVELOPMENT_SEEDS.stop + int(commit[:12], 16)


def prove(proof: Proof, work: Path, results: Path, jobs: int) -> Iterator[str]:
    """Conceals, seals, diagnoses, scores and logs each set of a proof; yields the lines that report it.

    work: folder of the sets and verdicts. An interrupted proof continues there. results: folder of the scores, one
    folder a set, and of the log. A judged set is added to the log once, with any score.
    Raises InputError if `work` holds another proof.
    """
    _remove_finished_development(proof, work)
    for name, settings in proof.sets.items():
        folder, verdicts, finished = work / name / "set", work / name / "verdicts", work / name / FINISHED_MARK
        yield f"{name}: {settings.cases} cases, seed {settings.seed}"

        yield from report_progress("concealed", conceal_cases(settings, folder, jobs), settings.cases)

        cases, sealed = seal_set(settings, folder)
        yield f"{name}: manifest SHA-256 {sealed}"

        yield from report_progress("diagnosed", diagnose_all(folder, verdicts, cases, jobs), len(cases))

        score = score_set(folder, verdicts, sealed, results / name)
        yield from format_lines(score)

        if proof.commit is not None and not finished.is_file():
            append_to_log(results / LOG_FILE, proof.commit, name, score)
        finished.touch()
    (work / FINISHED_MARK).touch()


def _remove_finished_development(proof: Proof, work: Path) -> None:
    """A finished proof that is not judged starts again from nothing; a judged one keeps its verdicts."""
    if proof.commit is None and (work / FINISHED_MARK).is_file():
        shutil.rmtree(work)


def diagnose_all(folder: Path, verdicts: Path, cases: Sequence[str], jobs: int) -> Iterator[str]:
    """Diagnoses the cases of a set that have no verdict yet, each in its own process; yields the name of each."""
    missing = [case for case in cases if not is_answered(verdicts / case)]
    work = (delayed(_diagnose_case)(folder / "observations" / case, verdicts / case) for case in missing)
    yield from Parallel(n_jobs=jobs, backend="threading", return_as="generator_unordered")(work)


def _diagnose_case(observation: Path, out: Path) -> str:
    with TemporaryDirectory() as desk:
        copy = shutil.copytree(observation, Path(desk) / observation.name)
        answer(["diagnose", str(copy)], out)
    return observation.name


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
    command = [sys.executable, "-m", "armlab.cli.main", *arguments]
    about: dict[str, Any] = {"env": _one_thread_environment(), "cwd": _source_root(), "timeout": TIMEOUT_S}
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, **about)
    except subprocess.TimeoutExpired:
        return f"no verdict after {TIMEOUT_S:g} s\n"
    return done.stderr if done.returncode else None


def _one_thread_environment() -> dict[str, str]:
    return {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


def _source_root() -> Path:
    return Path(__file__).resolve().parents[2]


def append_to_log(path: Path, commit: str, name: str, score: dict[str, Any]) -> None:
    """Adds a line to the log of judged runs (commit, seed, seal, each measure by its id), and writes its page."""
    entry = {
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
        "commit": commit,
        "changed_files": bool(_run_git("status", "--porcelain", "--untracked-files=no", ".", ":!results")),
        "set": name,
        **{key: score[key] for key in ("seed", "cases", "manifest")},
        "score": {
            tier: {each["id"]: [each["value"], each["low"], each["high"], each["number"]] for each in measures}
            for tier, measures in score["tiers"].items()
        },
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(entry) + "\n")
    write_log_page(path)


def report_progress(what: str, done: Iterator[str], total: int) -> Iterator[str]:
    """Runs an iterator and yields a line after each tenth of the total."""
    every = max(total // 10, 1)
    for number, _ in enumerate(done, 1):
        if number % every == 0:
            yield f"  {what} {number} of {total}"


def _run_git(*arguments: str) -> str:
    try:
        done = subprocess.run(["git", *arguments], cwd=_source_root(), capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        raise InputError("the judged seed follows from the commit, and this is no git checkout: use --quick") from None
    return done.stdout.strip()
