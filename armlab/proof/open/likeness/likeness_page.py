"""The page of a likeness: the log of looks, both distributions, and a figure of them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.report import palette
from armlab.common.report.palette import svg_text
from armlab.proof.open.likeness.features import FEATURES
from armlab.proof.open.likeness.look import BOUND, QUANTILES, Likeness, LikenessLook

PAGE_FILE, FIGURE_FILE = "likeness.md", "likeness.svg"
COLUMNS = 3  # of the figure


def likeness_texts(sides: dict[str, Likeness], looks: Sequence[LikenessLook]) -> dict[str, str]:
    """The page and its figure by file name. sides: comparisons with the same real arms, by their simulated tier."""
    return {PAGE_FILE: _page(sides, looks), FIGURE_FILE: svg_text(_figure(sides), FIGURE_FILE)}


def _page(sides: dict[str, Likeness], looks: Sequence[LikenessLook]) -> str:
    anyone = next(iter(sides.values()))
    real = sum(arm.real for arm in anyone.arms)
    rows = [(name, *_area_cells(each)) for name, each in sides.items()]
    last = list(sides)[-1]
    reasons = [f"- {each}" for each in dict.fromkeys(reason for each in sides.values() for reason in each.left_out)]
    return markdown_page(
        "How alike simulated and real recordings are",
        f"A random forest is trained on the features of all joints but those of one of the {real} real arms and of a "
        "part of the simulated ones, and scores what was left out. The area under the curve is the chance that a real "
        "arm scores higher than a simulated one: 0.5 means that nothing tells them apart, 1 that everything does. "
        "Intervals are of 95 %, over arms. Features and classifier were fixed before the first look. The third figure "
        f"leaves out {' and '.join(BOUND)}, whose ranges the affordable set binds.",
        markdown_table(("simulated tier", "cases", "area", "interval", f"area without {', '.join(BOUND)}"), rows),
        "## All looks, oldest first",
        "Each look at real recordings while the maker was made; a change of the maker followed each but the last of "
        "its commit. Looks at other seeds of one commit show how much chance is in an area.",
        markdown_table(
            ("maker", "tier", "seed", "cases", "area", "interval", f"without {', '.join(BOUND)}", "most used"),
            [_look_cells(look) for look in looks],
        ),
        f"## What tells most: {last}",
        markdown_table(("feature", "meaning", "importance", "area alone"), _feature_rows(sides[last])),
        "## Both distributions",
        f"![Distributions]({FIGURE_FILE})",
        "Quantiles over joints, each arm with the same weight.",
        markdown_table(("feature", "side", *(f"{each:.0%}" for each in QUANTILES)), _quantile_rows(sides)),
        *(["## Left out", "\n".join(reasons)] if reasons else []),
    )


def _area_cells(likeness: Likeness) -> tuple[str, ...]:
    own, free = likeness.separation, likeness.free
    number = sum(not arm.real for arm in likeness.arms)
    interval = f"{own.low:.2f} to {own.high:.2f}"
    return str(number), f"{own.area:.2f}", interval, f"{free.area:.2f} ({free.low:.2f} to {free.high:.2f})"


def _look_cells(look: LikenessLook) -> tuple[str, ...]:
    area, interval = f"{look.area:.2f}", f"{look.low:.2f} to {look.high:.2f}"
    used, maker = ", ".join(look.strongest), look.maker[:7] + look.maker[40:]  # behind a commit, what was not kept
    return maker, look.tier, str(look.seed), str(look.cases), area, interval, f"{look.free_area:.2f}", used


def _feature_rows(likeness: Likeness) -> list[tuple[str, ...]]:
    own, names = likeness.separation, list(FEATURES)
    order = np.argsort(-own.importance)
    return [(names[at], FEATURES[names[at]], f"{own.importance[at]:.2f}", f"{own.alone[at]:.2f}") for at in order]


def _quantile_rows(sides: dict[str, Likeness]) -> list[tuple[str, ...]]:
    anyone = next(iter(sides.values()))
    tables = {"real": anyone.quantiles(True)} | {name: each.quantiles(False) for name, each in sides.items()}
    return [
        (name, side, *(f"{value:.3g}" for value in table[place]))
        for place, name in enumerate(FEATURES)
        for side, table in tables.items()
    ]


def _figure(sides: dict[str, Likeness]) -> Any:
    """A panel a feature: from the 10 % to the 90 % quantile of each side, thick between the quartiles."""
    from matplotlib.figure import Figure

    anyone = next(iter(sides.values()))
    tables = [("real", anyone.quantiles(True))] + [(name, each.quantiles(False)) for name, each in sides.items()]
    colours = (palette.BLACK, palette.SKY, palette.VERMILION)
    rows = -(-len(FEATURES) // COLUMNS)
    figure = Figure(figsize=(9.5, 1.1 * rows), layout="constrained")
    panels = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
    for place, (panel, name) in enumerate(zip(panels, FEATURES, strict=False)):
        for row, ((side, table), colour) in enumerate(zip(tables, colours, strict=False)):
            ends, quartiles, middle = table[place, [0, 4]], table[place, [1, 3]], table[place, 2]
            panel.plot(ends, [row, row], color=colour, linewidth=1)
            panel.plot(quartiles, [row, row], color=colour, linewidth=5, solid_capstyle="butt", label=side)
            panel.plot(middle, row, "|", color="white", markersize=9, markeredgewidth=1.5)
        panel.set_yticks(range(len(tables)), [side for side, _ in tables], fontsize=7)
        panel.set_ylim(len(tables) - 0.4, -0.6)
        panel.tick_params(axis="x", labelsize=7)
        panel.set_title(name, loc="left", fontsize=8)
    for panel in panels[len(FEATURES) :]:
        panel.set_visible(False)
    return figure
