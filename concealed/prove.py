"""The blind proof: conceal, seal, diagnose each case in a process of its own, score, and keep the result in a log.

The diagnosis is reached through the command line alone and is given a copy of one recording folder, in a place from
which no path leads to the answers.
"""

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from joblib import Parallel, delayed

from concealed.manifest import NAME, digest
from concealed.plan import DEVELOPMENT_SEEDS
from concealed.score.command import lines, score
from concealed.score.reading import FAILED
from concealed.sets import Kind, SetSettings, conceal
from problem.errors import InputError

QUICK, QUICK_SEED, QUICK_CASES = "quick", 1900, 24
TIMEOUT_S = 900.0
LOG = "log.jsonl"
FINISHED = "finished"


@dataclass(frozen=True)
class Proof:
    """The sets of one proof, and its name. commit: of the source tree, None for one that is not judged."""

    sets: dict[str, SetSettings]
    name: str
    commit: str | None = None


def chosen_proof(quick: bool, development: int | None, cases: int, nulls: int) -> Proof:
    """The quick proof, one on a development seed, or the judged one."""
    if quick:
        return quick_proof()
    return judged_proof(cases, nulls) if development is None else development_proof(development, cases, nulls)


def quick_proof() -> Proof:
    """A small development set, always the same: to see that everything works together."""
    return Proof({"quick": SetSettings(QUICK_CASES, QUICK_SEED, development=True)}, QUICK)


def development_proof(seed: int, cases: int, nulls: int) -> Proof:
    """Sets to learn from, kept out of the log; InputError for a seed that is not for development."""
    if seed not in DEVELOPMENT_SEEDS:
        raise InputError(
            f"seed {seed} should be one for development, {DEVELOPMENT_SEEDS[0]} to {DEVELOPMENT_SEEDS[-1]}"
        )
    sets = {kind: SetSettings(count, seed, kind=kind, development=True) for count, kind in _sizes(cases, nulls)}
    return Proof({name: each for name, each in sets.items() if each.cases}, f"development-{seed}")


def judged_proof(cases: int, nulls: int) -> Proof:
    """Sets whose seed follows from the commit: nobody can have tuned on them before it was made."""
    commit = _git("rev-parse", "HEAD")
    seed = judged_seed(commit)
    sets = {kind: SetSettings(count, seed, kind=kind) for count, kind in _sizes(cases, nulls)}
    return Proof({name: each for name, each in sets.items() if each.cases}, commit, commit)


def _sizes(cases: int, nulls: int) -> tuple[tuple[int, Kind], ...]:
    return (cases, "mixed"), (nulls, "nulls")


def judged_seed(commit: str) -> int:
    """A seed from a commit's hash; never one of those for development."""
    return DEVELOPMENT_SEEDS.stop + int(commit[:12], 16)


def prove(proof: Proof, work: Path, results: Path, jobs: int) -> Iterator[str]:
    """Does what is missing of a proof and tells how far it is; scores go to `results`, a folder a set.

    work: sets and verdicts, kept so that a proof that was interrupted goes on; one that is not judged and was finished
    starts anew, a judged one is only scored again. A judged proof is added to `results`/log.jsonl, once. Raises
    InputError for a working folder of another proof.
    """
    if proof.commit is None and (work / FINISHED).is_file():
        shutil.rmtree(work)
    for name, settings in proof.sets.items():
        folder, verdicts = work / name / "set", work / name / "verdicts"
        yield f"{name}: {settings.cases} cases, seed {settings.seed}"
        yield from _progress("concealed", conceal(settings, folder, jobs), settings.cases)
        sealed = digest(folder / NAME)
        yield f"{name}: manifest SHA-256 {sealed}"
        cases = json.loads((folder / NAME).read_text(encoding="utf-8"))["cases"]
        yield from _progress("diagnosed", diagnose_all(folder, verdicts, cases, jobs), len(cases))
        found = score(folder, verdicts, sealed, results / name)
        yield from lines(found)
        if proof.commit is not None and not (work / name / FINISHED).is_file():
            _log(results / LOG, proof.commit, name, found)
        (work / name / FINISHED).touch()
    (work / FINISHED).touch()


def diagnose_all(folder: Path, verdicts: Path, cases: list[str], jobs: int) -> Iterator[str]:
    """Diagnoses the cases that have no verdict yet, each in its own process; tells their names as they are done."""
    missing = [case for case in cases if not any((verdicts / case / name).is_file() for name in ("time.json", FAILED))]
    work = (delayed(_diagnose)(folder / "observations" / case, verdicts / case) for case in missing)
    yield from Parallel(n_jobs=jobs, backend="threading", return_as="generator_unordered")(work)


def _diagnose(observation: Path, out: Path) -> str:
    """One diagnosis; the time is written last and says that the verdict is whole."""
    out.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory() as desk:
        copy = shutil.copytree(observation, Path(desk) / observation.name)
        start = time.monotonic()
        command = [sys.executable, "-m", "bench.cli", "diagnose", str(copy), "--out", str(out.resolve())]
        complaint = _complaint(command)
        seconds = time.monotonic() - start
    if complaint is not None:
        (out / FAILED).write_text(complaint, encoding="utf-8")
    else:
        (out / "time.json").write_text(json.dumps({"seconds": round(seconds, 2)}) + "\n", encoding="utf-8")
    return observation.name


def _complaint(command: list[str]) -> str | None:
    """Runs a command; what it said if it failed, None if it did not."""
    about: dict[str, Any] = {"env": _one_thread(), "cwd": _root(), "timeout": TIMEOUT_S}
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, **about)
    except subprocess.TimeoutExpired:
        return f"no verdict after {TIMEOUT_S:g} s\n"
    return done.stderr if done.returncode else None


def _one_thread() -> dict[str, str]:
    return {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


def _root() -> Path:
    return Path(__file__).resolve().parent.parent


def _progress(what: str, done: Iterator[str], total: int) -> Iterator[str]:
    """A line every tenth of the way."""
    every = max(total // 10, 1)
    for number, _ in enumerate(done, 1):
        if number % every == 0:
            yield f"  {what} {number} of {total}"


def _log(path: Path, commit: str, name: str, found: dict[str, Any]) -> None:
    """Adds a judged run, good or bad, once."""
    entry = {
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
        "commit": commit,
        "changed_files": bool(_git("status", "--porcelain", "--untracked-files=no", ".", ":!results")),  # of the code
        "set": name,
        **{key: found[key] for key in ("seed", "cases", "manifest")},
        "score": {
            tier: {each["name"]: [each["value"], each["low"], each["high"], each["number"]] for each in measures}
            for tier, measures in found["tiers"].items()
        },
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(entry) + "\n")


def _git(*arguments: str) -> str:
    try:
        done = subprocess.run(["git", *arguments], cwd=_root(), capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        raise InputError("the judged seed follows from the commit, and this is no git checkout: use --quick") from None
    return done.stdout.strip()
