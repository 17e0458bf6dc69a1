"""The page of the closed loop: shares, motion against motion, pair by pair, what was foreseen, what was passed over."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from concealed.loop.case import KINDS
from concealed.loop.picture import NAMES, TOLD, picture
from concealed.loop.reliability import brier, on_average, reliability
from concealed.loop.run import LoopSettings
from concealed.loop.table import ENDS, Shares, rows, shares, versus


@dataclass(frozen=True)
class Seal:
    """SHA-256 of the answers, printed before the first diagnosis, and of the manifest of all recordings at the end."""

    answers: str
    manifest: str


def text(settings: LoopSettings, found: Sequence[dict[str, Any]], seal: Seal) -> str:
    """The page."""
    table = rows(found)
    lines = [
        "# The closed loop: does the designed motion decide?",
        "",
        f"Seed {settings.seed}, {len(table) // len(KINDS)} ambiguous cases of {len(found)}.",
        f"SHA-256 of the answers, told before the first diagnosis: {seal.answers};",
        f"of the manifest of all recordings, at the end: {seal.manifest}.",
        "Each case: a poor first recording with one hidden effect, a second motion within the same limits, both",
        "diagnosed together. *told*: the first verdict lists the hidden effect among rivals. *mistaken*: it names",
        "another one alone that the recording does not tell from it. Shares with 95 % Wilson intervals.",
        "",
    ]
    for title, start in (("all", None), ("told", "told"), ("mistaken", "mistaken")):
        counted = shares(table, start)
        lines += [f"## {title}: {counted[KINDS[0], ENDS[0]].cases} cases", "", *_grid(counted), ""]
    lines += ["## The designed motion against the others, case by case", "", *_against(table), ""]
    lines += ["## Pair by pair", "", *_pairs(table), ""]
    lines += ["## Was it foreseen?", "", *_foreseen(table), ""]
    failed = sum(len(each.get("failed", {})) for each in found)
    lines += [f"Second motions or verdicts that failed, counted as open: {failed}.", ""]
    lines += ["## Draws that were passed over, because nothing was in doubt", "", *_passed(found), ""]
    return "\n".join(lines)


def _grid(counted: Shares) -> list[str]:
    head = ["| second motion | " + " | ".join(TOLD[end] for end in ENDS) + " |", "|---|---|---|---|"]
    cells = {kind: " | ".join(str(counted[kind, end]) for end in ENDS) for kind in KINDS}
    return head + [f"| {NAMES[kind]} | {cells[kind]} |" for kind in KINDS]


def _against(table: pd.DataFrame) -> Iterator[str]:
    """Exact McNemar tests; the two comparisons are not corrected for each other."""
    yield "| other motion | end | only the designed one | only the other one | p (exact McNemar) |"
    yield "|---|---|---|---|---|"
    for other in KINDS[1:]:
        for end in ("right", "wrong"):
            told = versus(table, other, end)
            yield f"| {NAMES[other]} | {TOLD[end]} | {told.ours} | {told.theirs} | {told.p_value:.2g} |"


def _pairs(table: pd.DataFrame) -> Iterator[str]:
    yield "| hidden | beside | cases | " + " | ".join(f"{NAMES[kind]}: right, wrong, open" for kind in KINDS) + " |"
    yield "|---|---|---|" + "---|" * len(KINDS)
    for (hidden, beside), part in table.groupby(["hidden", "beside"]):
        ends = {kind: Counter(part[part["motion"] == kind]["end"]) for kind in KINDS}
        cells = " | ".join(", ".join(str(ends[kind][end]) for end in ENDS) for kind in KINDS)
        yield f"| {hidden} | {beside} | {len(part) // len(KINDS)} | {cells} |"


def _foreseen(table: pd.DataFrame) -> Iterator[str]:
    """The chance of a right end that `armlab next` tells before the motion is recorded, all kinds of motion."""
    if table["expected right"].isna().all():
        yield "Nothing was expected of any motion."
        return
    yield "| expected chance of a right end | motions | mean expected | came (95 %) |"
    yield "|---|---|---|---|"
    for each in reliability(table):
        yield f"| {each.low:.1f} to {each.high:.1f} | {each.came.cases} | {100 * each.expected:.0f} % | {each.came} |"
    yield ""
    told = (f"{TOLD[end]} {100 * a:.0f} % expected, {100 * b:.0f} % came" for end, (a, b) in on_average(table).items())
    yield "On average: " + "; ".join(told) + "."
    score, constant = brier(table)
    yield f"Brier score {score:.3f} (always telling the share that came: {constant:.3f})."


def _passed(found: Sequence[dict[str, Any]]) -> list[str]:
    counts = Counter(each["start"] for case in found for each in case["passed"])
    return [f"- {what}: {number}" for what, number in counts.most_common()] or ["- none"]


def write(settings: LoopSettings, found: Sequence[dict[str, Any]], seal: Seal, folder: Path) -> list[Path]:
    """Writes loop.md, loop.csv and loop.png, and returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    table = rows(found)
    paths = [folder / name for name in ("loop.md", "loop.csv", "loop.png")]
    paths[0].write_text(text(settings, found, seal), encoding="utf-8")
    table.to_csv(paths[1], index=False, lineterminator="\n", float_format="%.4g")
    if len(table):
        paths[2].write_bytes(picture(shares(table), reliability(table)))
    return [path for path in paths if path.is_file()]
