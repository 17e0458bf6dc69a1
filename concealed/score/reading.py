"""Answers and verdicts side by side."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from problem.errors import InputError

FAILED = "failed.txt"  # beside where a verdict should be: what a diagnosis that gave none complained of
STATUS = ("mismatch", "none", "inconclusive")
MISSING: dict[str, Any] = {"status": "invalid", "findings": [], "unexplained": [], "fit": []}


@dataclass(frozen=True, eq=False)
class Judged:
    """One case: its answer, its verdict (`status` invalid where there is none), and how long the diagnosis took.

    recording, clean: the recording folder, and the file with the held-out torque without noise. folder: where the
    verdict is.
    """

    truth: dict[str, Any]
    verdict: dict[str, Any]
    recording: Path
    clean: Path
    folder: Path
    seconds: float | None

    @property
    def name(self) -> str:
        """The case's name."""
        return str(self.truth["case"])

    @property
    def findings(self) -> list[dict[str, Any]]:
        """What was found, most important first."""
        return list(self.verdict["findings"])

    @property
    def says_unknown(self) -> bool:
        """True if the verdict says that something is there that it cannot name."""
        named = any(finding["effect"] == "unknown" for finding in self.findings)
        return named or bool(self.verdict["unexplained"])


def judged(folder: Path, verdicts: Path, names: list[str]) -> list[Judged]:
    """All cases of a set; a missing or invalid verdict is kept as one that found nothing."""
    out = []
    for name in names:
        answer, own = folder / "truth" / f"{name}.json", verdicts / name
        truth = json.loads(answer.read_text(encoding="utf-8"))
        recording, clean = folder / "observations" / name, answer.with_suffix(".parquet")
        out.append(Judged(truth, _verdict(own / "verdict.json"), recording, clean, own, _seconds(own)))
    if all(case.verdict["status"] == "invalid" for case in out):
        raise InputError(
            f"{verdicts} holds no valid verdict: one is expected in {verdicts / names[0] / 'verdict.json'}"
        )
    return out


def _verdict(path: Path) -> dict[str, Any]:
    try:
        verdict = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return MISSING
    return verdict if _sound(verdict) else MISSING


def _sound(verdict: Any) -> bool:
    """What the score relies on; a verdict without it counts as none at all."""
    if not isinstance(verdict, dict) or verdict.get("status") not in STATUS:
        return False
    lists = (verdict.get(key) for key in ("findings", "unexplained", "fit"))
    if not all(isinstance(each, list) and all(isinstance(item, dict) for item in each) for each in lists):
        return False
    needed = {"effect", "joint", "parameters", "rivals"}
    return all(
        needed <= finding.keys()
        and isinstance(finding["parameters"], dict)
        and isinstance(finding["rivals"], list)
        and all(isinstance(rival, dict) and "effect" in rival for rival in finding["rivals"])
        for finding in verdict["findings"]
    )


def _seconds(folder: Path) -> float | None:
    path = folder / "time.json"
    return float(json.loads(path.read_text(encoding="utf-8"))["seconds"]) if path.is_file() else None
