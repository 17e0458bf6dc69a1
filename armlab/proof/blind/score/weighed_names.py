"""The names that a diagnosis weighed for its findings, and which are right: what probabilities are learnt from."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from armlab.common.errors import InputError
from armlab.proof.blind.formats import SetManifest
from armlab.proof.blind.plan import DEVELOPMENT_SEEDS
from armlab.proof.blind.score.cases import RIGHT_CATEGORIES, UNKNOWN_NAME, JudgedCase, categorize_finding, read_cases
from armlab.proof.blind.sealed import read_checked_manifest

NAMES_FILE = "names.json"  # beside a verdict


@dataclass(frozen=True)
class WeighedFinding:
    """A finding of a case. names: numbers of each name that it could have, by what they say, and of none of them.

    right: which of them are. background: whether its likeliest name is that of friction or of links that every case of
    the tier has.
    """

    case: str
    tier: str
    names: tuple[dict[str, float], ...]
    right: tuple[bool, ...]
    background: bool


def read_weighed(folder: Path, verdicts: Path) -> tuple[str, list[WeighedFinding]]:
    """What a development set is, and the names that were weighed for the findings in it.

    Raises InputError for a set that judges: nothing is learnt from it.
    """
    manifest, _ = read_checked_manifest(folder, SetManifest)
    check_development(manifest.seed, folder)
    cases = read_cases(folder, verdicts, manifest.cases)
    about = f"torque, seed {manifest.seed}, {manifest.kind}: {len(manifest.cases)} cases"
    return about, [each for case in cases for each in label_findings(case, manifest.seed)]


def check_development(seed: int, folder: Path) -> None:
    """Raises InputError unless the seed of a set is one for development."""
    if seed not in DEVELOPMENT_SEEDS:
        least, most = DEVELOPMENT_SEEDS[0], DEVELOPMENT_SEEDS[-1]
        raise InputError(f"{folder} has the seed {seed}: take a development set, seeds {least} to {most}")


def read_names(folder: Path) -> list[list[dict[str, Any]]]:
    """The names that each finding of a verdict could have; none where nothing was weighed."""
    path = folder / NAMES_FILE
    content = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {"findings": []}
    return [finding["names"] for finding in content["findings"]]


def label_findings(case: JudgedCase, seed: int) -> Iterator[WeighedFinding]:
    """The weighed findings of a case, each name right or not by its answer."""
    outside = any(effect.outside for effect in case.truth.injected)
    for names in read_names(case.folder):
        categories = [categorize_finding(case, name) for name in names]
        right = [_is_named(name) and each in RIGHT_CATEGORIES for name, each in zip(names, categories, strict=True)]
        only_structure = any("structure none" in name["numbers"] for name in names)
        none_right = not any(right) or (outside and only_structure)
        likeliest = max(range(len(names)), key=lambda at: names[at]["probability"])
        yield WeighedFinding(
            case=f"{seed} {case.name}",
            tier=case.truth.tier,
            names=tuple(name["numbers"] for name in names),
            right=tuple(own if _is_named(name) else none_right for name, own in zip(names, right, strict=True)),
            background=categories[likeliest] == "background",
        )


def _is_named(name: dict[str, Any]) -> bool:
    return bool(name["effect"] != UNKNOWN_NAME)
