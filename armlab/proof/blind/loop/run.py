"""The closed loop over many cases: answers are sealed first, cases run in parallel, an interrupted loop continues."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed

from armlab.common.errors import InputError
from armlab.proof.blind.folders import claim_folder
from armlab.proof.blind.formats import Manifest, write_model
from armlab.proof.blind.loop.case import MAX_ATTEMPTS, Tools, play_case
from armlab.proof.blind.loop.recordings import draw_case
from armlab.proof.blind.sealed import MANIFEST_FILE, file_digest, seal_files

ANSWERS_FILE = "answers.json"


def seal_answers(folder: Path, seed: int, cases: int, attempts: int) -> str:
    """Writes what each draw of each case hides, and returns the SHA-256 of the file.

    Raises InputError where the folder holds other answers.
    """
    path = folder / ANSWERS_FILE
    rows = [_draw_answer(seed, case, attempt) for case in range(cases) for attempt in range(attempts)]
    content = json.dumps({"schema": "answers/1", "seed": seed, "draws": rows}, indent=0) + "\n"
    if path.is_file() and path.read_text(encoding="utf-8") != content:
        raise InputError(f"{path} holds other answers than this seed and number of cases: choose another folder")
    path.write_text(content, encoding="utf-8")
    return file_digest(path)


def check_answers(folder: Path, expected: str, found: list[dict[str, Any]]) -> None:
    """InputError where the sealed answers were changed, or a result's hidden effect is not the one that was sealed."""
    path = folder / ANSWERS_FILE
    if file_digest(path) != expected:
        raise InputError(f"{path} was changed after it was sealed: the closed loop cannot be judged")
    sealed = {(each["case"], each["attempt"]): each for each in json.loads(path.read_text(encoding="utf-8"))["draws"]}
    for each in found:
        if each["ends"] and sealed[each["case"], each["attempt"]]["hidden"] != each["hidden"]:
            raise InputError(f"case {each['case']} of {folder} hides another effect than the one that was sealed")


def _draw_answer(seed: int, case: int, attempt: int) -> dict[str, Any]:
    drawn = draw_case(seed, case, attempt)
    hidden = [drawn.effect.effect, drawn.effect.place]
    return {
        "case": case,
        "attempt": attempt,
        "hidden": hidden,
        "pair": list(drawn.pair),
        "tier": drawn.plan.tier,
        "target": drawn.target,
    }


@dataclass(frozen=True)
class LoopSettings:
    """Number of cases and seed of a closed loop."""

    cases: int
    seed: int


def seal_loop(settings: LoopSettings, out: Path) -> str:
    """Seals the answers before anything is diagnosed, and returns their SHA-256; InputError for a folder of others."""
    claim_folder(settings, out, ("cases", "observations", "truth", "verdicts"))
    return seal_answers(out / "truth", settings.seed, settings.cases, MAX_ATTEMPTS)


def play_cases(settings: LoopSettings, out: Path, tools: Tools, jobs: int) -> Iterator[dict[str, Any]]:
    """Plays the missing cases in a folder whose answers are sealed, and yields each result."""
    missing = [number for number in range(settings.cases) if not _result_path(out, number).is_file()]
    work = (delayed(_play_and_write)(settings.seed, number, out, tools) for number in missing)
    yield from Parallel(n_jobs=jobs, return_as="generator_unordered")(work)


def read_results(settings: LoopSettings, out: Path) -> list[dict[str, Any]]:
    """All results in the folder, by number."""
    paths = [_result_path(out, number) for number in range(settings.cases)]
    return [json.loads(path.read_text(encoding="utf-8")) for path in paths if path.is_file()]


def close_loop(settings: LoopSettings, out: Path, answers: str) -> str:
    """Checks the results against the sealed answers, and returns the SHA-256 of the manifest of all recordings."""
    check_answers(out / "truth", answers, read_results(settings, out))
    names = sorted(each["name"] for each in read_results(settings, out))
    manifest = Manifest(schema="manifest/1", cases=tuple(names), seed=settings.seed, files=seal_files(out))
    write_model(manifest, out / MANIFEST_FILE)
    return file_digest(out / MANIFEST_FILE)


def _play_and_write(seed: int, number: int, out: Path, tools: Tools) -> dict[str, Any]:
    result = play_case(seed, number, out, tools)
    path = _result_path(out, number)
    draft = path.with_suffix(".draft")
    draft.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    draft.replace(path)  # marks the case as complete
    return result


def _result_path(out: Path, number: int) -> Path:
    return out / "cases" / f"{number:04d}.json"
