"""What each guard of the diagnosis is worth: the same concealed cases again with one guard off at a time."""

import json
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from concealed.manifest import NAME, digest
from concealed.prove import FINISHED, development_proof, diagnose_all
from concealed.score.command import score
from concealed.sets import conceal

ALL_ON = "all guards on"
SHOWN = (
    "false claims on nulls",
    "false claims on decoys",
    "wrong names among claims",
    "right name or class of four, above 3 limits",
    "unknown on effects outside, above 3 limits",
    "seconds a case (median)",
)


@dataclass(frozen=True)
class Ablation:
    """A development set and the guards that are switched off in turn, as `armlab diagnose --without` names them."""

    seed: int
    cases: int
    nulls: int
    guards: tuple[str, ...]


def ablate(settings: Ablation, work: Path, results: Path, jobs: int) -> Iterator[str]:
    """Does what is missing, tells how far it is, and writes guards.md and guards.json into `results`.

    What was interrupted goes on; what was finished is diagnosed anew.
    """
    if (work / FINISHED).is_file():
        shutil.rmtree(work)
    proof = development_proof(settings.seed, settings.cases, settings.nulls)
    found: dict[str, dict[str, Any]] = {}
    for guard in (ALL_ON, *settings.guards):
        found[guard] = {}
        for name, each in proof.sets.items():
            folder, verdicts = work / name, work / "verdicts" / guard.replace(" ", "_") / name
            list(conceal(each, folder, jobs))
            cases = json.loads((folder / NAME).read_text(encoding="utf-8"))["cases"]
            options = () if guard == ALL_ON else ("--without", guard)
            list(diagnose_all(folder, verdicts, cases, jobs, options))
            found[guard][name] = score(folder, verdicts, digest(folder / NAME), verdicts / "score")["tiers"]
        yield f"{guard}: diagnosed {settings.cases + settings.nulls} cases"
    results.mkdir(parents=True, exist_ok=True)
    (results / "guards.json").write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    (results / "guards.md").write_text(page(settings, found), encoding="utf-8")
    (work / FINISHED).touch()
    yield f"wrote {results / 'guards.md'}"


def page(settings: Ablation, found: dict[str, dict[str, Any]]) -> str:
    """A table a tier: a row for each guard that was off."""
    tiers = sorted({tier for sets in found.values() for each in sets.values() for tier in each})
    about = f"{settings.cases} cases and {settings.nulls} with nothing hidden, of development seed {settings.seed}."
    parts = ["# What each guard is worth", f"{about} Share, and how often it was counted."]
    for tier in tiers:
        rows = [_row(guard, found[guard], tier) for guard in found]
        head = f"| guard off | {' | '.join(SHOWN)} |\n|---|{'---|' * len(SHOWN)}"
        parts += [f"## {tier} tier", "\n".join([head, *rows])]
    return "\n\n".join(parts) + "\n"


def _row(guard: str, sets: dict[str, Any], tier: str) -> str:
    name = ALL_ON if guard == ALL_ON else guard.replace("_", " ")
    return f"| {name} | {' | '.join(_cell(what, sets, tier) for what in SHOWN)} |"


def _cell(what: str, sets: dict[str, Any], tier: str) -> str:
    """The measure in the set that counted it most often: nulls in the set of nulls, names in the mixed one."""
    counted: Sequence[dict[str, Any]] = [
        each for found in sets.values() for each in found.get(tier, []) if each["name"] == what
    ]
    best = max(counted, key=lambda each: int(each["number"]), default=None)
    return "-" if best is None or best["value"] is None else f"{best['value']:.3g} of {best['number']}"
