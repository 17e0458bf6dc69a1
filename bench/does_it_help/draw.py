"""The two figures: errors against criteria, and the rank correlations with their intervals."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from bench.does_it_help.correlation import SUBSETS
from bench.does_it_help.identification import KINDS
from bench.does_it_help.judgement import CRITERIA, ERRORS
from bench.figure import look, render

KIND_NAMES = {
    "torque": "torque noise",
    "proportional": "torque noise in proportion to the torque",
    "encoder": "encoder noise",
    "both": "encoder and torque noise",
    "friction": "both, and friction that the model lacks",
}
CRITERION_NAMES = {
    "cond": "condition number (-)",
    "d_optimality": "D-optimality: -2 mean(log sigma) (-)",
    "e_optimality": "E-optimality: 1 / sigma_min (SI)",
    "eq44": "eq. 44 (-)",
}
DRAWN_KINDS = ("torque", "proportional", "encoder", "friction")  # "both" lies on "torque"
SHORT_NAMES = {"cond": "cond", "cond_unit_columns": "cond,\nunit col.", "d_optimality": "D", "e_optimality": "E"}
ERROR_NAMES = {
    "prediction": "predicted torque",
    "parameters": "parameters, by the torque\nthat they give",
    "parameters_si": "parameters, SI units",
}


def draw_errors(frame: pd.DataFrame) -> dict[str, bytes]:
    """Error of the predicted torque against each criterion, one point a trajectory; PNG and SVG bytes."""

    def draw(axes: Sequence[Axes]) -> None:
        for axis, (criterion, name) in zip(axes, CRITERION_NAMES.items(), strict=True):
            promised = -1 / frame[criterion] if criterion == "e_optimality" else frame[criterion]
            for kind in DRAWN_KINDS:
                drawn, error = look(list(KINDS).index(kind)), frame[f"{kind}_prediction"]
                style: dict[str, Any] = {
                    "linestyle": "",
                    "markeredgewidth": 0,
                    "color": drawn.color,
                    "marker": drawn.marker,
                }
                axis.plot(promised, error, markersize=3, alpha=0.5, **style)
                axis.plot(
                    [], [], markersize=7, label=KIND_NAMES[kind], **style
                )  # the points are too small for a legend
            axis.set(xlabel=name, yscale="log", xscale="linear" if criterion == "d_optimality" else "log")
        axes[0].set_ylabel("error of the predicted torque,\nroot mean square (N m)")

    return render(len(CRITERION_NAMES), draw)


def draw_correlations(table: pd.DataFrame, subset: str) -> dict[str, bytes]:
    """Rank correlations of one subset by error, criterion and noise, with their intervals; PNG and SVG bytes."""
    chosen = table[table["subset"] == subset]

    def draw(axes: Sequence[Axes]) -> None:
        for axis, error in zip(axes, ERRORS, strict=True):
            for index, kind in enumerate(KINDS):
                rows = chosen[(chosen["error"] == error) & (chosen["noise"] == kind)].set_index("criterion")
                rows = rows.loc[list(CRITERIA)]
                drawn = look(index)
                spans = [rows["correlation"] - rows["low"], rows["high"] - rows["correlation"]]
                axis.errorbar(
                    np.arange(len(CRITERIA)) + 0.14 * (index - 2), rows["correlation"], yerr=np.maximum(spans, 0.0),
                    fmt=drawn.marker, color=drawn.color, markersize=4, capsize=2, label=KIND_NAMES[kind],
                )  # fmt: skip
            axis.set_xticks(range(len(CRITERIA)), [SHORT_NAMES.get(name, "eq. 44") for name in CRITERIA])
            axis.set_title(ERROR_NAMES[error], fontsize=9)
            axis.axhline(0.0, color="0.4", linewidth=0.8)
        axes[0].set_ylabel(f"Spearman's correlation with the error (-),\n{SUBSETS[subset]}, 95 % intervals")

    return render(len(ERRORS), draw)
