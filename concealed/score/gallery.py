"""Pictures of cases, successes and failures alike, chosen by a rule that cannot flatter.

Of each group of outcomes and each tier the first cases in the order of the manifest are shown: names are random, so
that order knows nothing of the diagnosis. How many there are of each is said beside.
"""

from collections.abc import Sequence
from pathlib import Path
from textwrap import shorten
from typing import Any

import pandas as pd

from concealed.score.held_out import CUTOFF_HZ, held_out
from concealed.score.outcomes import GROUPS, outcomes
from concealed.score.picture import BAND, draw, shown_joint
from concealed.score.reading import Judged
from concealed.score.rows import Rows, records
from concealed.score.words import background_words, hidden_names, hidden_words, place_words, said_names, said_words

FOLDER, PAGE = "gallery", "gallery.md"
EACH = 2  # pictures a group and tier
RULE = (
    f"Of each group and tier the first {EACH} cases in the order of the manifest, whose names are random. Shown is the "
    "joint of the hidden effect or of the claim; for the whole arm, and where nothing is hidden, the joint where the "
    f"simulation as given misses most, in noise floors. All torques of the held-out run, low-passed at {CUTOFF_HZ:g} "
    f"Hz; grey is ±{BAND} rms of what the true torque itself leaves. Sizes are in detection limits, and groups of "
    "effects hold those above three. *Said* leaves out right findings of the background."
)


def chosen(table: Rows) -> pd.DataFrame:
    """The items to show: the first few different cases of each group and tier."""
    first = outcomes(table).drop_duplicates(["group", "tier", "case"])
    return first[first.groupby(["group", "tier"]).cumcount() < EACH]


def write_gallery(cases: Sequence[Judged], table: Rows, out: Path) -> None:
    """Writes gallery.md and the pictures that it shows."""
    folder = out / FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*-joint-*.png"):
        old.unlink()
    known, shown = {case.name: case for case in cases}, chosen(table)
    files = [_drawn(known[item["case"]], item, folder) for item in records(shown)]
    (out / PAGE).write_text(_page(known, table, shown.assign(file=files)), encoding="utf-8")


def tally(table: Rows) -> str:
    """How many items there are of each group and tier, as a Markdown table; a success and a failure each a row."""
    counts = outcomes(table).groupby(["group", "tier"]).size()
    tiers = sorted(set(table.cases["tier"]))
    rows = [
        f"| {about.title} | {'success' if about.success else 'failure'} | "
        + " | ".join(str(counts.get((group, tier), 0)) for tier in tiers)
        + " |"
        for group, about in GROUPS.items()
    ]
    return "\n".join([f"| outcome | | {' | '.join(tiers)} |", "|---|---|" + "---:|" * len(tiers), *rows])


def _drawn(case: Judged, item: dict[str, Any], folder: Path) -> str:
    """The file's name; a case that is shown in two groups at one joint has one picture."""
    run = held_out(case)
    joint = shown_joint(run, None if pd.isna(item["joint"]) else int(item["joint"]))
    file = f"{case.name}-joint-{joint + 1}.png"
    if not (folder / file).is_file():
        draw(run, joint, _title(case, joint), bool(case.truth["background"]), folder / file)
    return file


def _title(case: Judged, joint: int) -> str:
    """Which case, what was hidden, what was said beyond the background: a line each."""
    about = f"joint {joint + 1} of {case.truth['arm']}, {case.truth['tier']} tier, case {case.name}"
    lines = (about, f"hidden: {hidden_names(case)}", f"said: {said_names(case)}")
    return "\n".join(shorten(line, 125, placeholder=" ...") for line in lines)


def _page(cases: dict[str, Judged], table: Rows, shown: pd.DataFrame) -> str:
    everything = outcomes(table)
    parts = ["# Before and after", RULE, tally(table)]
    for success, title in ((True, "Successes"), (False, "Failures")):
        parts.append(f"## {title}")
        for group, about in GROUPS.items():
            if about.success == success:
                own, of = (frame[frame["group"] == group] for frame in (shown, everything))
                parts.append(f"### {about.title}: {_counted(own, of)}")
                parts += [_entry(cases[item["case"]], item) for item in records(own)]
    return "\n\n".join(parts) + "\n"


def _counted(own: pd.DataFrame, of: pd.DataFrame) -> str:
    tiers = sorted(set(of["tier"]))
    told = [f"{(own['tier'] == tier).sum()} of {(of['tier'] == tier).sum()} {tier}" for tier in tiers]
    return ", ".join(told) if told else "none"


def _entry(case: Judged, item: dict[str, Any]) -> str:
    beside = background_words(case)
    hidden = hidden_words(case) + (f" (beside {beside})" if beside else "")
    of = "" if pd.isna(item["limits"]) else f" - {item['effect']}, {item['limits']:.1f} limits"
    if item["group"] in ("wrong claim", "false claim"):
        place = place_words(None if pd.isna(item["joint"]) else item["joint"])
        of = f" - {item['effect']} claimed, {place}, counted as {item['answered']}"
    head = f"**{case.name}**, {case.truth['arm']}, {item['tier']} tier{of}"
    return f"{head}<br>\n*hidden:* {hidden}<br>\n*said:* {said_words(case)}\n\n![{case.name}]({FOLDER}/{item['file']})"
