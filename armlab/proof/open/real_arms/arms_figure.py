"""The picture of the table: a panel an arm, a row for each baseline and run, a mark for each model."""

from collections.abc import Sequence
from typing import Any

from armlab.common.report import palette
from armlab.proof.open.real_arms.one_arm import ArmStudy, ModelLine, ModelName

# Okabe and Ito 2008, with a shape each: told apart by everyone, in grey too
MODEL_STYLES: dict[ModelName, tuple[str, str, str]] = {
    "rigid_given": (palette.GREY, "x", "rigid as given"),
    "rigid_refitted": (palette.BLACK, "|", "rigid refitted"),
    "plain_friction": (palette.ORANGE, "^", "plain friction"),
    "identify": (palette.SKY, "s", "identify"),
    "named": (palette.GREEN, "D", "diagnose, named physics alone"),
    "diagnose": (palette.BLUE, "o", "diagnose"),
}
MARK_SIZES = {"|": 10, "D": 9, "o": 4.5}  # points: the whole model shows on top of its names, which it often equals
BEST_KNOWN_STYLE = (palette.VERMILION, "*", "best known")
ROW_INCHES, PANEL_INCHES = 0.32, 0.5  # inches of a row, and of a panel's heading and margins
PICTURE_NAME = "arms.svg"


def draw_studies(studies: Sequence[ArmStudy]) -> Any:
    """Percent of filtered torque, on a logarithmic axis that all panels share."""
    from matplotlib.figure import Figure

    rows = [len(each.lines) for each in studies]
    height = 1.3 + ROW_INCHES * sum(rows) + PANEL_INCHES * len(rows)
    figure = Figure(figsize=(9.5, height), layout="constrained")
    ratios = [ROW_INCHES * count + 0.1 for count in rows]
    panels = figure.subplots(len(rows), 1, sharex=True, squeeze=False, height_ratios=ratios)[:, 0]
    for panel, each in zip(panels, studies, strict=True):
        _draw_panel(panel, each)
    ticks = [1, 2, 5, 10, 20, 50, 100]
    panels[-1].set_xscale("log")
    panels[-1].set_xticks(ticks, [str(each) for each in ticks])
    panels[-1].set_xticks([], minor=True)
    panels[-1].set_xlabel("error on runs that validate, percent of the filtered torque")
    styles = (*MODEL_STYLES.values(), BEST_KNOWN_STYLE)
    handles = [panels[0].plot([], [], mark, color=colour, label=text)[0] for colour, mark, text in styles]
    figure.legend(handles=handles, loc="outside upper center", ncols=4, frameon=False, fontsize=8)
    return figure


def _draw_panel(panel: Any, study: ArmStudy) -> None:
    for row, line in enumerate(study.lines):
        for name, (colour, mark, _) in MODEL_STYLES.items():
            if name in line.errors:
                size = MARK_SIZES.get(mark, 6.5)
                panel.plot(line.errors[name].filtered, row, mark, color=colour, markersize=size, markeredgewidth=1.5)
        if line.best_known is not None:
            colour, mark, _ = BEST_KNOWN_STYLE
            panel.plot(line.best_known, row, mark, color=colour, markersize=9, zorder=3)
    panel.set_yticks(range(len(study.lines)), [_row_name(each) for each in study.lines], fontsize=8)
    panel.set_ylim(len(study.lines) - 0.4, -0.6)
    panel.grid(axis="both", color="0.92")
    panel.set_axisbelow(True)
    panel.set_title(study.name, loc="left", fontsize=9)


def _row_name(line: ModelLine) -> str:
    return f"{line.baseline}, {line.run.removesuffix('.csv')}"
