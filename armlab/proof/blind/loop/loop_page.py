"""The page and the picture of the closed loop: shares, motion against motion, pair by pair, and forecasts."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from itertools import product
from pathlib import Path
from typing import Any

import matplotlib
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from armlab.common.files import write_texts
from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.report import palette
from armlab.proof.blind.loop.case import MOTION_KINDS
from armlab.proof.blind.loop.counts import (
    ENDS,
    ChanceBin,
    LoopShare,
    Shares,
    brier_scores,
    compare_motions,
    count_shares,
    make_table,
    mean_chances,
    reliability_bins,
)
from armlab.proof.blind.loop.run import LoopSettings

END_TITLES = {"right": "decided rightly", "wrong": "decided wrongly", "open": "still open"}
MOTION_TITLES = {"designed": "designed motion", "random": "random motion", "condition": "smallest condition number"}
HOW_TO_READ = """\
A case has a poor first recording with one hidden effect and a second motion within the same limits. Both are
diagnosed together. *Told*: the first verdict lists the hidden effect among rivals. *Mistaken*: it names
another effect alone, which the recording does not separate from the hidden one. Shares have 95 % Wilson
intervals."""
MIN_LABELLED_SHARE = 0.04  # smaller shares carry no number
END_COLORS = {"right": palette.GOOD, "wrong": palette.BAD, "open": palette.OPEN}


def draw_picture(counted: Shares, bins: Sequence[ChanceBin]) -> bytes:
    """PNG. Left: a bar for each kind of second motion, split by its ends, with the interval of right above it. Right:
    expected chances of a right end against what came."""
    with matplotlib.rc_context({"font.size": 10, "legend.frameon": False}):
        figure = Figure(figsize=(11.5, 3.4), layout="constrained")
        ends, foreseen = figure.subplots(1, 2, width_ratios=(2.6, 1))
        for place, kind in enumerate(reversed(MOTION_KINDS)):
            _draw_bar(ends, place, {end: counted[kind, end] for end in ("right", "open", "wrong")})
        ends.set(
            yticks=range(len(MOTION_KINDS)),
            yticklabels=[MOTION_TITLES[kind] for kind in reversed(MOTION_KINDS)],
            xlim=(0, 1),
        )
        cases = counted[MOTION_KINDS[0], ENDS[0]].cases
        ends.set(xlabel="share of cases", title=f"{cases} ambiguous recordings, one second motion each way")
        ends.spines[["top", "right"]].set_visible(False)
        _draw_reliability(foreseen, bins)
        figure.legend(*ends.get_legend_handles_labels(), loc="outside lower center", ncols=3)
        buffer = BytesIO()
        figure.savefig(buffer, format="png", dpi=130, metadata={"Software": None})
    return buffer.getvalue()


def _draw_bar(axis: Axes, place: int, ends: dict[str, LoopShare]) -> None:
    left = 0.0
    for end, share in ends.items():
        label = END_TITLES[end] if place == 0 else None
        axis.barh(place, share.value, left=left, color=END_COLORS[end], label=label, height=0.6)
        if share.value > MIN_LABELLED_SHARE:
            ink = "black" if end == "open" else "white"
            axis.text(left + share.value / 2, place, f"{100 * share.value:.0f} %", ha="center", va="center", color=ink)
        left += share.value
    axis.plot(ends["right"].interval, [place + 0.36] * 2, color="black", linewidth=1.2)


def _draw_reliability(axis: Axes, bins: Sequence[ChanceBin]) -> None:
    axis.plot([0, 1], [0, 1], color="0.6", linestyle="dashed", linewidth=1)
    for each in bins:
        axis.plot([each.expected] * 2, each.observed.interval, color=END_COLORS["right"], linewidth=1.2)
        axis.plot(each.expected, each.observed.value, "o", color=END_COLORS["right"], markersize=5)
        axis.annotate(
            f"{each.observed.cases}",
            (each.expected, each.observed.value),
            (5, -3),
            textcoords="offset points",
            fontsize=8,
        )
    axis.set(xlim=(0, 1.02), ylim=(0, 1.02), xlabel="forecast: decided rightly", ylabel="came true")
    axis.set(title="was it foreseen? (motions)")
    axis.spines[["top", "right"]].set_visible(False)


@dataclass(frozen=True)
class Seals:
    """SHA-256 of the answers, printed before the first diagnosis, and of the manifest of all recordings at the end."""

    answers: str
    manifest: str


def render_page(settings: LoopSettings, found: Sequence[dict[str, Any]], seal: Seals) -> str:
    """The page of a closed loop in Markdown."""
    table = make_table(found)
    parts = [f"{_about(settings, found, table, seal)}\n{HOW_TO_READ}"]
    for title, start in (("all", None), ("told", "told"), ("mistaken", "mistaken")):
        counted = count_shares(table, start)
        parts += [f"## {title}: {counted[MOTION_KINDS[0], ENDS[0]].cases} cases", _share_table(counted)]
    parts += ["## The designed motion against the others, case by case", _comparison_table(table)]
    parts += ["## Pair by pair", _pair_table(table), "## Was it foreseen?", *_forecast_parts(table)]
    failed = sum(len(each.get("failed", {})) for each in found)
    parts += [f"Second motions or verdicts that failed, counted as open: {failed}."]
    parts += ["## Draws that were left out because nothing was in doubt", _passed_over_list(found)]
    return markdown_page("The closed loop: does the designed motion decide?", *parts)


def _about(settings: LoopSettings, found: Sequence[dict[str, Any]], table: pd.DataFrame, seal: Seals) -> str:
    return (
        f"Seed {settings.seed}, {len(table) // len(MOTION_KINDS)} ambiguous cases of {len(found)}.\n"
        f"SHA-256 of the answers, printed before the first diagnosis: {seal.answers};\n"
        f"of the manifest of all recordings, at the end: {seal.manifest}."
    )


def _share_table(counted: Shares) -> str:
    rows = [(MOTION_TITLES[kind], *(counted[kind, end] for end in ENDS)) for kind in MOTION_KINDS]
    return markdown_table(("second motion", *(END_TITLES[end] for end in ENDS)), rows)


def _comparison_table(table: pd.DataFrame) -> str:
    """Exact McNemar tests; the two comparisons are not corrected for each other."""
    rows = []
    for other, end in product(MOTION_KINDS[1:], ("right", "wrong")):
        told = compare_motions(table, other, end)
        rows.append((MOTION_TITLES[other], END_TITLES[end], told.ours, told.theirs, f"{told.p_value:.2g}"))
    headings = ("other motion", "end", "only the designed one", "only the other one", "p (exact McNemar)")
    return markdown_table(headings, rows)


def _pair_table(table: pd.DataFrame) -> str:
    rows = []
    for (hidden, beside), part in table.groupby(["hidden", "beside"]):
        ends = {kind: Counter(part[part["motion"] == kind]["end"]) for kind in MOTION_KINDS}
        cells = (", ".join(str(ends[kind][end]) for end in ENDS) for kind in MOTION_KINDS)
        rows.append((hidden, beside, len(part) // len(MOTION_KINDS), *cells))
    motions = (f"{MOTION_TITLES[kind]}: right, wrong, open" for kind in MOTION_KINDS)
    return markdown_table(("hidden", "beside", "cases", *motions), rows)


def _forecast_parts(table: pd.DataFrame) -> Iterator[str]:
    """The chance of a right end that `armlab next` expects before the motion is recorded, all kinds of motion."""
    if table["expected right"].isna().all():
        yield "Nothing was expected of any motion."
        return
    rows = [
        (f"{each.low:.1f} to {each.high:.1f}", each.observed.cases, f"{100 * each.expected:.0f} %", each.observed)
        for each in reliability_bins(table)
    ]
    yield markdown_table(("expected chance of a right end", "motions", "mean expected", "came (95 %)"), rows)
    told = (
        f"{END_TITLES[end]} {100 * a:.0f} % expected, {100 * b:.0f} % came"
        for end, (a, b) in mean_chances(table).items()
    )
    score, constant = brier_scores(table)
    yield (
        f"On average: {'; '.join(told)}.\n"
        f"Brier score {score:.3f} (a constant forecast of the observed share: {constant:.3f})."
    )


def _passed_over_list(found: Sequence[dict[str, Any]]) -> str:
    counts = Counter(each["start"] for case in found for each in case["passed"])
    return "\n".join(f"- {what}: {number}" for what, number in counts.most_common()) or "- none"


def write_page(settings: LoopSettings, found: Sequence[dict[str, Any]], seal: Seals, folder: Path) -> list[Path]:
    """Writes loop.md, loop.csv and loop.png (where there is a case) or none of them, and returns their paths."""
    table = make_table(found)
    csv = table.to_csv(index=False, lineterminator="\n", float_format="%.4g")
    texts: dict[str, str | bytes] = {"loop.md": render_page(settings, found, seal), "loop.csv": csv}
    if len(table):
        texts["loop.png"] = draw_picture(count_shares(table), reliability_bins(table))
    return list(write_texts(texts, folder))
