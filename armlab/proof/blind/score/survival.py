"""Does a name that survives tell more than its probability? Names of development cases beside whether they are right.

`armlab diagnose --survival` says of each name how often it returns in recordings that are simulated from the model
found. Here the answers are known, so that it can be counted how often names of each share are right.
"""

import shutil
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import pandas as pd

from armlab.common.files import write_texts
from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.statistics import wilson_interval
from armlab.proof.blind.formats import SetManifest
from armlab.proof.blind.score.cases import RIGHT_CATEGORIES, categorize_finding, read_cases
from armlab.proof.blind.score.weighed_names import check_development
from armlab.proof.blind.sealed import OBSERVATIONS, answer, is_answered, read_checked_manifest
from armlab.recordings.load import open_recording

SHARES = (0.0, 0.5, 0.9, 1.0)  # of the simulated recordings in which a name returns
COLUMNS = ["case", "tier", "effect", "joint", "probability", "returned", "simulated", "appeared", "left_out", "right"]
TABLE_FILE, PAGE_FILE = "survival.csv", "survival.md"


def diagnose_with_survival(folder: Path, cases: int, repetitions: int, work: Path) -> Iterator[str]:
    """Diagnoses the first cases of a development set that have no verdict in `work` yet; yields the name of each.

    Raises InputError for a set that judges, or that is no longer the one that was sealed.
    """
    for name in _names(folder, cases):
        if not is_answered(work / name):
            with TemporaryDirectory() as desk:
                copy = shutil.copytree(folder / OBSERVATIONS / name, Path(desk) / name)
                answer(["diagnose", str(copy), "--survival", str(repetitions)], work / name)
        yield name


def read_survivals(folder: Path, cases: int, work: Path) -> pd.DataFrame:
    """A row a name that was simulated anew: how often it was found with and without its effect, and if it is right.

    Raises InputError as `diagnose_with_survival` does, and where there is no verdict.
    """
    rows = [
        {
            "case": case.name,
            "tier": case.truth.tier,
            "effect": finding["effect"],
            "joint": finding["joint"],
            "probability": finding["probability"],
            **finding["survival"],
            "right": categorize_finding(case, finding) in RIGHT_CATEGORIES,
        }
        for case in read_cases(folder, work, _names(folder, cases))
        for finding in case.findings
        if finding.get("survival")
    ]
    return pd.DataFrame(rows, columns=COLUMNS)


def _names(folder: Path, cases: int) -> Sequence[str]:
    """The first cases of a set, those of small arms before others: each is diagnosed dozens of times."""
    manifest, _ = read_checked_manifest(folder, SetManifest)
    check_development(manifest.seed, folder)
    return sorted(manifest.cases, key=lambda name: _joints(folder / OBSERVATIONS / name))[:cases]


def _joints(recording: Path) -> int:
    return len(open_recording(recording)[0].arm)


def survival_rows(found: pd.DataFrame) -> list[tuple[str, ...]]:
    """How many names are right, by the share of simulated recordings in which they return, and by their probability."""
    returned = found["returned"] / found["simulated"]
    appeared = found["appeared"] / found["left_out"]
    sure = found["probability"] >= SHARES[-2]
    rows = []
    for low, high in reversed(list(pairwise(SHARES))):
        inside = (returned >= low) & ((returned < high) | (high == SHARES[-1]))
        rows.append((f"returns in {low:g} to {high:g}", found[inside]))
    rows += [("appears without its effect", found[appeared > 0]), ("never appears without it", found[appeared == 0])]
    rows += [(f"probability {SHARES[-2]:g} or more", found[sure]), ("less probable", found[~sure])]
    return [(name, *_share_right(own)) for name, own in rows]


def _share_right(names: pd.DataFrame) -> tuple[str, str]:
    right, count = int(names["right"].sum()), len(names)
    if not count:
        return "0", "–"
    low, high = wilson_interval(right, count)
    return str(count), f"{right / count:.0%} ({low:.0%} to {high:.0%})"


def write_survival(found: pd.DataFrame, about: str, out: Path) -> tuple[Path, ...]:
    """Writes the rows and a page. about: which cases, and how often each was simulated."""
    none_wrong = bool(found["right"].all())
    note = "No name of them is wrong: that names which survive are right more often is not shown."
    page = markdown_page(
        "Names that survive",
        f"{len(found)} names of {about}, each with how often it returns in recordings that are simulated from the "
        "model found (`armlab diagnose --survival`). Right is a name that is hidden, in the background, or that no "
        "motion separates from one of these; a name of a class counts by itself.",
        markdown_table(("names", "number", "right"), survival_rows(found), (1, 2)),
        *([note] if none_wrong else []),
    )
    return write_texts({TABLE_FILE: found.to_csv(index=False, lineterminator="\n"), PAGE_FILE: page}, out)
