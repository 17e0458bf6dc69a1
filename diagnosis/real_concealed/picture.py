"""One picture of all cases: how strong what is concealed is, and whether it was named."""

from collections.abc import Sequence
from io import StringIO
from typing import Any

import numpy as np

from diagnosis.real_concealed.judge import Answer, Verdict
from diagnosis.real_concealed.study import Study

# Okabe and Ito 2008, with a shape each: told apart by everyone, in grey too
STYLES: dict[Answer, tuple[str, str, str]] = {
    "named": ("#0072B2", "o", "named at its place"),
    "identical": ("#56B4E9", "s", "named as what no motion separates from it"),
    "law": ("#009E73", "v", "another law named"),
    "class": ("#E69F00", "D", "among the rivals of a finding"),
    "cancelled": ("#999999", "P", "cancels what the control names"),
    "elsewhere": ("#CC79A7", "^", "named at another place"),
    "missed": ("#000000", "x", "missed"),
}
ROW = 0.24  # inches


def svg(studies: Sequence[Study]) -> str:
    """The picture as text, the same in every run."""
    import matplotlib

    out = StringIO()
    with matplotlib.rc_context({"svg.hashsalt": "concealed", "svg.fonttype": "none"}):
        drawn(studies).savefig(out, format="svg", metadata={"Date": None})
    return out.getvalue()


def drawn(studies: Sequence[Study]) -> Any:
    """The picture: a panel a recording, a row a case."""
    from matplotlib.figure import Figure

    rows = [len(each.verdicts) for each in studies]
    figure = Figure(figsize=(9.5, 1.6 + ROW * (sum(rows) + 2 * len(rows))), layout="constrained")
    panels = figure.subplots(len(rows), 1, sharex=True, squeeze=False, height_ratios=[count + 1 for count in rows])[
        :, 0
    ]
    for panel, each in zip(panels, studies, strict=True):
        _panel(panel, each)
    panels[-1].set_xlabel("strength: RMS of the concealed torque over the error of the reference model")
    handles = [panels[0].plot([], [], mark, color=colour, label=text)[0] for colour, mark, text in STYLES.values()]
    figure.legend(handles=handles, loc="outside upper center", ncols=3, frameon=False, fontsize=8)
    return figure


def _panel(panel: Any, found: Study) -> None:
    verdicts = found.verdicts
    for row, verdict in enumerate(verdicts):
        counts = _counts(verdict)
        for place, (answer, count) in enumerate(counts):
            colour, mark, _ = STYLES[answer]
            at = verdict.strength * 1.13**place
            panel.plot(at, row, mark, color=colour, markersize=6.5, markeredgewidth=2 if mark == "x" else 1)
            if len(verdict.judged) > 1:
                panel.annotate(str(count), (at, row), (0, 5), textcoords="offset points", fontsize=6, ha="center")
        words = [] if verdict.gap is None else [f"gap {verdict.gap:.2f}"]
        words += [f"{len(verdict.others)} others"] if verdict.others else []
        panel.annotate(", ".join(words), (1.01, row), xycoords=("axes fraction", "data"), fontsize=7, va="center")
    panel.set_yticks(range(len(verdicts)), [each.case.name for each in verdicts], fontsize=7.5)
    panel.set(xscale="log", xlim=(0.2, 30), ylim=(len(verdicts) - 0.3, -0.7))
    panel.set_xticks([0.3, 1, 3, 10, 30], ["0.3", "1", "3", "10", "30"])
    panel.set_xticks([], minor=True)
    panel.axvline(1, color="0.6", linestyle=":", linewidth=1, zorder=0)
    panel.grid(axis="y", color="0.92")
    panel.set_axisbelow(True)
    panel.set_title(found.name, loc="left", fontsize=9)


def _counts(verdict: Verdict) -> list[tuple[Answer, int]]:
    said = np.array([each.answer for each in verdict.judged])
    return [(answer, int(np.sum(said == answer))) for answer in STYLES if np.any(said == answer)]
