"""The picture: error against condition number, window by window, and the rank correlations of every criterion."""

from collections.abc import Sequence
from io import BytesIO
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from armlab.common.arrays import Array
from armlab.common.report import palette
from armlab.proof.open.conditioning.answer import MEAN
from armlab.proof.open.conditioning.arm import WINDOW_BLOCKS, ConditioningStudy
from armlab.proof.open.conditioning.windows import BLOCKS

SHOWN_CRITERIA = {
    "fitted_cond_si": "cond",
    "fitted_cond_unit": "cond,\nunit columns",
    "fitted_d_optimality_si": "D",
    "fitted_d_optimality_unit": "D,\nunit columns",
    "fitted_e_optimality_si": "E",
    "fitted_e_optimality_unit": "E,\nunit columns",
    "v_optimality": "V",
}
# Okabe and Ito 2008, with a shape each: told apart by everyone, in grey too
ARM_STYLES = tuple(zip(palette.SERIES, ("o", "s", "^", "D", "v"), strict=False))
MEAN_STYLE = (palette.BLACK, "P")
REAL_COLOUR, SIMULATED_COLOUR = palette.BLUE, palette.ORANGE
SIZE_INCHES = (11.0, 11.0)
FIRST_POWER = 1e5  # the least tick that is written as a power of ten


def conditioning_image(studies: Sequence[ConditioningStudy], table: pd.DataFrame) -> bytes:
    """PNG bytes of the picture, whose points are so many that an SVG would be larger; the same for the same numbers."""
    out = BytesIO()
    with matplotlib.rc_context({"font.size": 9}):
        draw_conditioning(studies, table).savefig(out, format="png", dpi=130, metadata={"Software": None})
    return out.getvalue()


def draw_conditioning(studies: Sequence[ConditioningStudy], table: pd.DataFrame) -> Figure:
    """Above a panel an arm, below a panel a length of the windows."""
    figure = Figure(figsize=SIZE_INCHES, layout="constrained")
    halves: Any = figure.subfigures(2, 1, height_ratios=(1, 2.6))
    above, below = halves
    scatter = above.subplots(1, len(studies), squeeze=False)[0]
    for axis, study in zip(scatter, studies, strict=True):
        _draw_windows(axis, study)
    scatter[0].set_ylabel("error of the predicted torque\non runs that validate (%)")
    handles, labels = scatter[0].get_legend_handles_labels()
    above.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False)
    panels = below.subplots(len(WINDOW_BLOCKS), 1, sharex=True, squeeze=False)[:, 0]
    names = [*(study.name for study in studies), MEAN]
    for axis, blocks in zip(panels, WINDOW_BLOCKS, strict=True):
        _draw_correlations(axis, table[table["blocks"] == blocks], names)
        axis.set_ylabel(f"rank correlation (-),\nwindows of {blocks} of {BLOCKS} blocks")
    panels[-1].set_xticks(range(len(SHOWN_CRITERIA)), list(SHOWN_CRITERIA.values()))
    handles, labels = panels[0].get_legend_handles_labels()
    below.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    return figure


def _draw_windows(axis: Axes, study: ConditioningStudy) -> None:
    """Every window of the greatest length; real errors, and those of the first simulation."""
    length = study.lengths[-1]
    cond = length.criteria["fitted_cond_si"].to_numpy()
    style: dict[str, Any] = {"linestyle": "", "markersize": 2.2, "markeredgewidth": 0, "alpha": 0.55}
    simulated = length.simulated[:, 0]
    for name, errors, marker, colour in (
        ("recorded torque", length.errors, "o", REAL_COLOUR),
        ("simulated torque (one draw)", simulated, "^", SIMULATED_COLOUR),
    ):
        axis.plot(cond, errors, marker=marker, color=colour, **style)
        axis.plot([], [], marker, color=colour, label=name)  # the points are too small for a legend
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_xlabel("condition number (-), SI")
    axis.set_title(f"{study.name}\nwindows of {length.window_s:.2g} s", fontsize=9)
    _label_ticks(axis.xaxis, cond)
    _label_ticks(axis.yaxis, np.concatenate([length.errors, simulated]))
    axis.grid(color="0.92")
    axis.set_axisbelow(True)


def _label_ticks(axis: Any, values: Array) -> None:
    """Ticks that a person reads, also where the values are within one power of ten."""
    decades = float(np.log10(np.max(values) / np.min(values)))
    if decades < 2:
        axis.set_major_locator(LogLocator(subs=(1, 2, 5) if decades > 0.6 else (1, 1.5, 2, 3, 5, 7)))
    axis.set_major_formatter(FuncFormatter(_tick_text))
    axis.set_minor_formatter(NullFormatter())


def _tick_text(value: float, place: int | None = None) -> str:
    return f"{value:g}" if value < FIRST_POWER else f"{value:.2g}".replace("e+0", "e")


def _draw_correlations(axis: Axes, table: pd.DataFrame, names: Sequence[str]) -> None:
    """A mark with its interval for each arm; behind it a bar from the least to the greatest of the simulations."""
    styles = [*(ARM_STYLES[index % len(ARM_STYLES)] for index in range(len(names) - 1)), MEAN_STYLE]
    axis.bar([0], [0], color="0.8", label="simulated torque, 95 % of the draws")
    for index, (name, (colour, mark)) in enumerate(zip(names, styles, strict=True)):
        rows = table[table["arm"] == name].set_index("criterion").loc[list(SHOWN_CRITERIA)]
        places = np.arange(len(SHOWN_CRITERIA)) + 0.13 * (index - (len(names) - 1) / 2)
        heights = rows["simulated_high"] - rows["simulated_low"]
        axis.bar(places, heights, bottom=rows["simulated_low"], width=0.09, color="0.8")
        spans = [rows["correlation"] - rows["low"], rows["high"] - rows["correlation"]]
        drawn: dict[str, Any] = {"fmt": mark, "color": colour, "markersize": 5, "capsize": 2, "elinewidth": 1}
        axis.errorbar(places, rows["correlation"], yerr=np.maximum(spans, 0.0), label=name, **drawn)
    axis.axhline(0.0, color="0.3", linewidth=0.8)
    axis.set_ylim(-1.05, 1.05)
    axis.grid(axis="y", color="0.92")
    axis.set_axisbelow(True)
