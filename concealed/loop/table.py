"""What the closed loop showed: shares with intervals, for each kind of second motion, as table and picture."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.stats import binomtest

from concealed.loop.case import KINDS
from concealed.loop.run import LoopSettings
from concealed.score.measures import wilson

ENDS = ("right", "wrong", "open")
TOLD = {"right": "decided rightly", "wrong": "decided wrongly", "open": "still open"}
NAMES = {"designed": "designed motion", "random": "random motion", "condition": "smallest condition number"}
READABLE = 0.04  # smaller shares carry no number
COLORS = {"right": "#0072B2", "wrong": "#D55E00", "open": "#C9CED4"}  # told apart with any colour vision


def rows(found: Sequence[dict[str, Any]]) -> pd.DataFrame:
    """One row a case and kind of second motion; cases in which a simulation ran away are left out whole."""
    whole = [each for each in found if each["ends"] and set(each["ends"].values()) <= set(ENDS)]
    return pd.DataFrame(
        [
            {
                "case": each["name"], "start": each["start"], "tier": each["tier"], "hidden": each["pair"][0],
                "beside": each["pair"][1], "multiple": each["multiple"], "motion": kind, "end": each["ends"][kind],
                "suspected": " ".join(f"{name}@{joint or 'robot'}" for name, joint in each["suspected"]),
            }
            for each in whole for kind in KINDS
        ],
        columns=["case", "start", "tier", "hidden", "beside", "multiple", "motion", "end", "suspected"],
    )  # fmt: skip


@dataclass(frozen=True)
class Share:
    """How often a kind of second motion ended in one way. hits: of `cases`."""

    hits: int
    cases: int

    @property
    def value(self) -> float:
        """The share, zero without cases."""
        return self.hits / max(self.cases, 1)

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's interval at 95 %."""
        return wilson(self.hits, self.cases)

    def __str__(self) -> str:
        """`71 % (56-83)`."""
        low, high = self.interval
        return f"{100 * self.value:.0f} % ({100 * low:.0f}-{100 * high:.0f})" if self.cases else "-"


Shares = dict[tuple[str, str], Share]


def shares(table: pd.DataFrame, start: str | None = None) -> Shares:
    """By kind of motion and end, of the cases that began in one way, or of all."""
    part = table if start is None else table[table["start"] == start]
    out: Shares = {}
    for kind in KINDS:
        own = part[part["motion"] == kind]["end"].tolist()
        out |= {(kind, end): Share(own.count(end), len(own)) for end in ENDS}
    return out


def text(settings: LoopSettings, found: Sequence[dict[str, Any]], sealed: str) -> str:
    """The page: what was done, the shares, the comparison pair by pair, and what was passed over."""
    table = rows(found)
    lines = [
        "# The closed loop: does the designed motion decide?",
        "",
        f"Seed {settings.seed}, {len(table) // len(KINDS)} ambiguous cases of {len(found)}, manifest SHA-256 {sealed}.",
        "Each case: a poor first recording with one hidden effect, a second motion within the same limits, both",
        "diagnosed together. *told*: the first verdict lists the hidden effect among rivals. *mistaken*: it names",
        "another one alone that the recording does not tell from it. Shares with 95 % Wilson intervals.",
        "",
    ]
    for title, start in (("all", None), ("told", "told"), ("mistaken", "mistaken")):
        counted = shares(table, start)
        lines += [f"## {title}: {counted[KINDS[0], ENDS[0]].cases} cases", "", *_grid(counted), ""]
    lines += ["## Case by case against the others", "", *(_against(table, other) for other in KINDS[1:]), ""]
    failed = sum(len(each.get("failed", {})) for each in found)
    lines += [f"Second motions or verdicts that failed, counted as open: {failed}.", ""]
    lines += ["## Draws that were passed over, because nothing was in doubt", "", *_passed(found), ""]
    return "\n".join(lines)


def _grid(counted: Shares) -> list[str]:
    head = ["| second motion | " + " | ".join(TOLD[end] for end in ENDS) + " |", "|---|---|---|---|"]
    cells = {kind: " | ".join(str(counted[kind, end]) for end in ENDS) for kind in KINDS}
    return head + [f"| {NAMES[kind]} | {cells[kind]} |" for kind in KINDS]


def _against(table: pd.DataFrame, other: str) -> str:
    wide = table.pivot(index="case", columns="motion", values="end") == "right"
    if wide.empty:
        return f"- {NAMES[other]}: no cases"
    ours, theirs = (int((wide[a] & ~wide[b]).sum()) for a, b in (("designed", other), (other, "designed")))
    p_value = binomtest(ours, ours + theirs).pvalue if ours + theirs else 1.0
    return (
        f"- {NAMES[other]}: only the designed motion decided rightly in {ours} cases, only the other one in {theirs} "
        f"(sign test p = {p_value:.2g})"
    )


def _passed(found: Sequence[dict[str, Any]]) -> list[str]:
    counts = Counter(each["start"] for case in found for each in case["passed"])
    return [f"- {what}: {number}" for what, number in counts.most_common()] or ["- none"]


def picture(counted: Shares) -> bytes:
    """PNG: one bar a kind of second motion, split into right, open and wrong; above it the interval of right."""
    with matplotlib.rc_context({"font.size": 10, "legend.frameon": False}):
        figure = Figure(figsize=(8.5, 2.8), layout="constrained")
        axis = figure.subplots()
        for place, kind in enumerate(reversed(KINDS)):
            _bar(axis, place, {end: counted[kind, end] for end in ("right", "open", "wrong")})
        axis.set(yticks=range(len(KINDS)), yticklabels=[NAMES[kind] for kind in reversed(KINDS)], xlim=(0, 1))
        cases = counted[KINDS[0], ENDS[0]].cases
        axis.set(xlabel="share of cases", title=f"{cases} ambiguous recordings, one second motion each way")
        axis.spines[["top", "right"]].set_visible(False)
        figure.legend(loc="outside lower center", ncols=3)
        buffer = BytesIO()
        figure.savefig(buffer, format="png", dpi=130, metadata={"Software": None})
    return buffer.getvalue()


def _bar(axis: Axes, place: int, ends: dict[str, Share]) -> None:
    left = 0.0
    for end, share in ends.items():
        label = TOLD[end] if place == 0 else None
        axis.barh(place, share.value, left=left, color=COLORS[end], label=label, height=0.6)
        if share.value > READABLE:
            ink = "black" if end == "open" else "white"
            axis.text(left + share.value / 2, place, f"{100 * share.value:.0f} %", ha="center", va="center", color=ink)
        left += share.value
    axis.plot(ends["right"].interval, [place + 0.36] * 2, color="black", linewidth=1.2)


def write(settings: LoopSettings, found: Sequence[dict[str, Any]], sealed: str, folder: Path) -> list[Path]:
    """Writes loop.md, loop.csv and loop.png, and returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    table = rows(found)
    paths = [folder / name for name in ("loop.md", "loop.csv", "loop.png")]
    paths[0].write_text(text(settings, found, sealed), encoding="utf-8")
    table.to_csv(paths[1], index=False, lineterminator="\n")
    if len(table):
        paths[2].write_bytes(picture(shares(table)))
    return [path for path in paths if path.is_file()]
