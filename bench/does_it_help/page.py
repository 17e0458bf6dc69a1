"""The answer as a page to read; every number comes from the tables."""

import pandas as pd

from bench.does_it_help.correlation import RESAMPLES, SUBSETS, ceiling_of, subsets
from bench.does_it_help.draw import ERROR_NAMES, KIND_NAMES
from bench.does_it_help.identification import (
    COUNTS,
    CUTOFF_HZ,
    FRICTION,
    KINDS,
    RATE_HZ,
    TORQUE_NOISE,
    TORQUE_SHARE,
)
from bench.does_it_help.judgement import CRITERIA, ERRORS, OTHERS
from bench.page import markdown_table

_SETTING = """\
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
_CORRELATIONS = """\
Spearman's correlation of criterion and error, 1 if the criterion sorts the trajectories as their errors do;
in brackets 95 % bootstrap intervals ({resamples} resamples of whole groups: the trajectories of one search are
alike). The *better half* are the trajectories with the smaller condition numbers, among which an optimiser
chooses. *Ceiling*: about what a perfect criterion would reach, since {repetitions} repetitions do not fix an
error exactly: sqrt(2 r / (1 + r)), with r the correlation between the errors over the first and over the second
half of the repetitions (Spearman and Brown 1910)."""


def page(frame: pd.DataFrame, table: pd.DataFrame, apart: pd.DataFrame, base: int, repetitions: int) -> str:
    """Markdown text from the trajectories, their correlations, and the best known for unit columns."""
    counts = frame["source"].value_counts(sort=False)
    setting = _SETTING.format(
        count=len(frame), sources=", ".join(f"{n} {name}" for name, n in counts.items()), base=base,
        repetitions=repetitions, rate=RATE_HZ, cutoff=CUTOFF_HZ, torque=TORQUE_NOISE, share=TORQUE_SHARE,
        counts=COUNTS, friction=FRICTION, others=OTHERS,
    )  # fmt: skip
    parts = ["# Does a small condition number help?", _answer(frame, table), "## What was done", setting]
    parts += ["## Rank correlations", _CORRELATIONS.format(resamples=RESAMPLES, repetitions=repetitions)]
    for subset, rows in subsets(frame).items():
        for error in ERRORS:
            title = ERROR_NAMES[error].replace("\n", " ")
            parts += [f"**{title}, {SUBSETS[subset]}**", _correlation_table(rows, table, subset, error)]
    parts += ["## The best known", _best_known(frame, apart)]
    return "\n\n".join(parts) + "\n"


def _answer(frame: pd.DataFrame, table: pd.DataFrame) -> str:
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
    return "\n\n".join([*lines, _spread(frame)])


def _spread(frame: pd.DataFrame) -> str:
    """How much there is to gain in the better half."""
    half = subsets(frame)["better_half"]
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
        [KIND_NAMES[kind], *(told[kind, name] for name in CRITERIA), f"{ceiling_of(frame, kind, error):.2f}"]
        for kind in KINDS
    ]
    return markdown_table(head, lines)


def _best_known(frame: pd.DataFrame, apart: pd.DataFrame) -> str:
    chosen = pd.concat([frame[frame["source"] == "best known"], apart])
    errors = [f"{kind}_prediction" for kind in KINDS]
    head = ["record", "cond", "cond, unit columns", *(f"{KIND_NAMES[kind]}: error (N m)" for kind in KINDS)]
    columns = ["cond", "cond_unit_columns", *errors]
    lines = [[row["group"], *(f"{row[name]:.3g}" for name in columns)] for _, row in chosen.iterrows()]
    note = (
        "Scaling the columns takes their size out of the criterion: it does not see how large the motion is, and "
        "so not how far noise is below it. Records for unit columns are in no correlation and no figure."
    )
    return markdown_table(head, lines) + "\n\n" + note
