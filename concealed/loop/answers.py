"""The answers of a closed loop, written down and sealed before the first diagnosis: what every draw hides."""

import json
from pathlib import Path
from typing import Any

from concealed.loop.draw import draw
from concealed.manifest import digest
from problem.errors import InputError

NAME = "answers.json"


def seal_answers(folder: Path, seed: int, cases: int, attempts: int) -> str:
    """Writes what each draw of each case hides, and returns the SHA-256 of the file.

    Raises InputError where the folder holds other answers.
    """
    path = folder / NAME
    rows = [_answer(seed, case, attempt) for case in range(cases) for attempt in range(attempts)]
    content = json.dumps({"schema": "answers/1", "seed": seed, "draws": rows}, indent=0) + "\n"
    if path.is_file() and path.read_text(encoding="utf-8") != content:
        raise InputError(f"{path} holds other answers than this seed and number of cases: choose another folder")
    path.write_text(content, encoding="utf-8")
    return digest(path)


def check_answers(folder: Path, expected: str, found: list[dict[str, Any]]) -> None:
    """InputError where the sealed answers were changed, or a result's hidden effect is not the one that was sealed."""
    path = folder / NAME
    if digest(path) != expected:
        raise InputError(f"{path} was changed after it was sealed: the closed loop cannot be judged")
    sealed = {(each["case"], each["attempt"]): each for each in json.loads(path.read_text(encoding="utf-8"))["draws"]}
    for each in found:
        if each["ends"] and sealed[each["case"], each["attempt"]]["hidden"] != each["hidden"]:
            raise InputError(f"case {each['case']} of {folder} hides another effect than the one that was sealed")


def _answer(seed: int, case: int, attempt: int) -> dict[str, Any]:
    drawn = draw(seed, case, attempt)
    hidden = [drawn.effect.effect, drawn.effect.place]
    return {"case": case, "attempt": attempt, "hidden": hidden, "pair": list(drawn.pair),
            "tier": drawn.plan.tier, "target": drawn.target}  # fmt: skip
