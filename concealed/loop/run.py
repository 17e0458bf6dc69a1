"""The closed loop over many cases: resumable, in parallel, sealed at the end."""

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed

from concealed.loop.answers import check_answers, seal_answers
from concealed.loop.case import ATTEMPTS, Tools, play_case
from concealed.manifest import write_manifest
from problem.errors import InputError

SETTINGS = "settings.json"


@dataclass(frozen=True)
class LoopSettings:
    """What a set of cases is made of."""

    cases: int
    seed: int


def sealed(settings: LoopSettings, out: Path) -> str:
    """Seals the answers before anything is diagnosed, and returns their SHA-256; InputError for a folder of others."""
    _claim(settings, out)
    return seal_answers(out / "truth", settings.seed, settings.cases, ATTEMPTS)


def play_all(settings: LoopSettings, out: Path, tools: Tools, jobs: int) -> Iterator[dict[str, Any]]:
    """Plays what is missing in a folder whose answers are sealed, and tells each result as it is done."""
    missing = [number for number in range(settings.cases) if not _path(out, number).is_file()]
    work = (delayed(_played)(settings.seed, number, out, tools) for number in missing)
    yield from Parallel(n_jobs=jobs, return_as="generator_unordered")(work)


def results(settings: LoopSettings, out: Path) -> list[dict[str, Any]]:
    """All results that are there, by number."""
    paths = [_path(out, number) for number in range(settings.cases)]
    return [json.loads(path.read_text(encoding="utf-8")) for path in paths if path.is_file()]


def closed(settings: LoopSettings, out: Path, answers: str) -> str:
    """Checks the results against the sealed answers, and returns the SHA-256 of the manifest of all recordings."""
    check_answers(out / "truth", answers, results(settings, out))
    names = sorted(each["name"] for each in results(settings, out))
    return write_manifest(out, {**asdict(settings), "cases": names})


def _played(seed: int, number: int, out: Path, tools: Tools) -> dict[str, Any]:
    result = play_case(seed, number, out, tools)
    path = _path(out, number)
    draft = path.with_suffix(".draft")
    draft.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    draft.replace(path)  # says that the case is whole
    return result


def _path(out: Path, number: int) -> Path:
    return out / "cases" / f"{number:04d}.json"


def _claim(settings: LoopSettings, out: Path) -> None:
    note = out / SETTINGS
    content = json.dumps(asdict(settings)) + "\n"
    if note.is_file() and note.read_text(encoding="utf-8") != content:
        raise InputError(f"{out} holds a closed loop of other settings (see {note}): choose another folder")
    if not note.is_file() and out.exists() and any(out.iterdir()):
        raise InputError(f"{out} is there already and holds no closed loop: choose another folder")
    for part in ("cases", "observations", "truth", "verdicts"):
        (out / part).mkdir(parents=True, exist_ok=True)
    note.write_text(content, encoding="utf-8")
