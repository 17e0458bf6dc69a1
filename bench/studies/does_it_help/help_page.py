"""The figures and the page of the study; every number comes from its tables."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from armlab.common.markdown import markdown_table
from bench.figures import BITMAP, line_style, render_panels
from bench.studies.does_it_help.judgement import (
    CRITERIA,
    ERRORS,
    JURY_SIZE,
    RESAMPLES,
    SUBSETS,
    correlation_ceiling,
    split_subsets,
)
from bench.studies.does_it_help.noisy_identification import (
    COULOMB_FRICTION,
    ENCODER_COUNTS,
    FILTER_CUTOFF_HZ,
    NOISE_KINDS,
    RATE_HZ,
    TORQUE_NOISE,
    TORQUE_SHARE,
)

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
DRAWN_NOISE_KINDS = ("torque", "proportional", "encoder", "friction")  # "both" lies on "torque"
SHORT_CRITERION_NAMES = {
    "cond": "cond",
    "cond_unit_columns": "cond,\nunit col.",
    "d_optimality": "D",
    "e_optimality": "E",
}
ERROR_NAMES = {
    "prediction": "predicted torque",
    "parameters": "parameters, by the torque\nthat they give",
    "parameters_si": "parameters, SI units",
}


def draw_errors(frame: pd.DataFrame) -> dict[str, bytes]:
    """Error of the predicted torque against each criterion, one point a trajectory; PNG bytes."""

    def draw(axes: Sequence[Axes]) -> None:
        for axis, (criterion, name) in zip(axes, CRITERION_NAMES.items(), strict=True):
            promised = -1 / frame[criterion] if criterion == "e_optimality" else frame[criterion]
            for kind in DRAWN_NOISE_KINDS:
                drawn, error = line_style(list(NOISE_KINDS).index(kind)), frame[f"{kind}_prediction"]
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

    return render_panels(len(CRITERION_NAMES), draw, BITMAP)


def draw_correlations(table: pd.DataFrame, subset: str) -> dict[str, bytes]:
    """Rank correlations of one subset by error, criterion and noise, with their intervals; SVG bytes."""
    chosen = table[table["subset"] == subset]

    def draw(axes: Sequence[Axes]) -> None:
        for axis, error in zip(axes, ERRORS, strict=True):
            for index, kind in enumerate(NOISE_KINDS):
                rows = chosen[(chosen["error"] == error) & (chosen["noise"] == kind)].set_index("criterion")
                rows = rows.loc[list(CRITERIA)]
                drawn = line_style(index)
                spans = [rows["correlation"] - rows["low"], rows["high"] - rows["correlation"]]
                axis.errorbar(
                    np.arange(len(CRITERIA)) + 0.14 * (index - 2),
                    rows["correlation"],
                    yerr=np.maximum(spans, 0.0),
                    fmt=drawn.marker,
                    color=drawn.color,
                    markersize=4,
                    capsize=2,
                    label=KIND_NAMES[kind],
                )
            axis.set_xticks(range(len(CRITERIA)), [SHORT_CRITERION_NAMES.get(name, "eq. 44") for name in CRITERIA])
            axis.set_title(ERROR_NAMES[error], fontsize=9)
            axis.axhline(0.0, color="0.4", linewidth=0.8)
        axes[0].set_ylabel(f"Spearman's correlation with the error (-),\n{SUBSETS[subset]}, 95 % intervals")

    return render_panels(len(ERRORS), draw)


_SETTING_TEXT = """\
{count} feasible trajectories of the problem `joint-fourier` (three joints of the IRB 120, 10 s): {sources}.
From each, the {base} base parameters are identified {repetitions} times by ordinary least squares under each
kind of noise: one period at {rate:g} Hz, positions filtered at {cutoff:g} Hz and differentiated, torque and
columns through the same filter. Torque noise: {torque:g} N m; in proportion: {share:.0%} of the torque; encoder:
{counts} counts a turn of the joint, zero at random; friction: {friction:g} N m of Coulomb friction in each joint that
the model lacks.

Errors, as root mean squares over the repetitions. *Predicted torque*: on {others} independent random
trajectories, in N m; this is what a controller or a simulation gets. *Parameters, by the torque that they
give*: each deviation times the torque of its column on those trajectories, averaged over the parameters; a
relative error would divide by true values of which some are zero. *Parameters, SI units*: the plain length of
the deviation, in which kg, kg m and kg m2 count alike.

Criteria are taken so that smaller should be better: the condition number (SI, later columns kept), the same
with columns scaled to unit length, D-optimality -2 mean(log sigma), E-optimality -sigma_min, and eq. 44 with
both weights 0.01."""
_CORRELATIONS_READING = """\
Spearman's correlation of criterion and error, 1 if the criterion sorts the trajectories as their errors do;
in brackets 95 % bootstrap intervals ({resamples} resamples of whole groups: the trajectories of one search are
alike). The *better half* are the trajectories with the smaller condition numbers, among which an optimiser
chooses. *Ceiling*: about what a perfect criterion would reach, since {repetitions} repetitions do not fix an
error exactly: sqrt(2 r / (1 + r)), with r the correlation between the errors over the first and over the second
half of the repetitions (Spearman and Brown 1910)."""


def study_page(frame: pd.DataFrame, table: pd.DataFrame, apart: pd.DataFrame, base: int, repetitions: int) -> str:
    """The study as a Markdown page, from the trajectories, their correlations, and the best known for unit columns."""
    counts = frame["source"].value_counts(sort=False)
    setting = _SETTING_TEXT.format(
        count=len(frame),
        sources=", ".join(f"{n} {name}" for name, n in counts.items()),
        base=base,
        repetitions=repetitions,
        rate=RATE_HZ,
        cutoff=FILTER_CUTOFF_HZ,
        torque=TORQUE_NOISE,
        share=TORQUE_SHARE,
        counts=ENCODER_COUNTS,
        friction=COULOMB_FRICTION,
        others=JURY_SIZE,
    )
    parts = ["# Does a small condition number help?", _answer_text(frame, table), "## What was done", setting]
    parts += ["## Rank correlations", _CORRELATIONS_READING.format(resamples=RESAMPLES, repetitions=repetitions)]
    for subset, rows in split_subsets(frame).items():
        for error in ERRORS:
            title = ERROR_NAMES[error].replace("\n", " ")
            parts += [f"**{title}, {SUBSETS[subset]}**", _correlation_table(rows, table, subset, error)]
    parts += ["## The best known", _best_known_section(frame, apart)]
    return "\n\n".join(parts) + "\n"


def _answer_text(frame: pd.DataFrame, table: pd.DataFrame) -> str:
    lines = []
    for subset in SUBSETS:
        rows = table[(table["error"] == "prediction") & (table["subset"] == subset)]
        square = rows.pivot(index="noise", columns="criterion", values="correlation")
        wins = square.idxmax(axis="columns").value_counts()
        named = ", ".join(f"{name} ({count} of {len(square)} kinds of noise)" for name, count in wins.items())
        lines.append(
            f"Over {SUBSETS[subset]} the condition number sorts the error of the predicted torque with a rank "
            f"correlation of {square['cond'].min():.2f} to {square['cond'].max():.2f}, by the kind of noise; sorted "
            f"best by: {named}."
        )
    return "\n\n".join([*lines, _spread_text(frame)])


def _spread_text(frame: pd.DataFrame) -> str:
    """How far the errors differ in the better half."""
    half = split_subsets(frame)["better_half"]
    error = half["both_prediction"]
    return (
        f"In the better half the condition number runs from {half['cond'].min():.3g} to {half['cond'].max():.3g}, the "
        f"error under encoder and torque noise from {error.min():.3g} to {error.max():.3g} N m; over all "
        f"trajectories from {frame['cond'].min():.3g} to {frame['cond'].max():.3g}, and from "
        f"{frame['both_prediction'].min():.3g} to {frame['both_prediction'].max():.3g} N m."
    )


def _correlation_table(frame: pd.DataFrame, table: pd.DataFrame, subset: str, error: str) -> str:
    rows = table[(table["subset"] == subset) & (table["error"] == error)]
    told = {
        (row.noise, row.criterion): f"{row.correlation:.2f} ({row.low:.2f} to {row.high:.2f})"
        for row in rows.itertuples()
    }
    head = ["noise", *CRITERIA, "ceiling"]
    lines = [
        [KIND_NAMES[kind], *(told[kind, name] for name in CRITERIA), f"{correlation_ceiling(frame, kind, error):.2f}"]
        for kind in NOISE_KINDS
    ]
    return markdown_table(head, lines)


def _best_known_section(frame: pd.DataFrame, apart: pd.DataFrame) -> str:
    chosen = pd.concat([frame[frame["source"] == "best known"], apart])
    errors = [f"{kind}_prediction" for kind in NOISE_KINDS]
    head = ["record", "cond", "cond, unit columns", *(f"{KIND_NAMES[kind]}: error (N m)" for kind in NOISE_KINDS)]
    columns = ["cond", "cond_unit_columns", *errors]
    lines = [[row["group"], *(f"{row[name]:.3g}" for name in columns)] for _, row in chosen.iterrows()]
    note = (
        "Scaling the columns takes their size out of the criterion: it does not see how large the motion is, and "
        "so not how far noise is below it. Records for unit columns are in no correlation and no figure."
    )
    return markdown_table(head, lines) + "\n\n" + note
