"""The page about the landscapes: features of each problem, and which of them go with an algorithm's standing."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.statistics import spearman_correlations
from bench.printed import display_name
from bench.studies.landscape.basins import SAME_MOTION, SAME_VALUE, SHARPNESS
from bench.studies.landscape.features import Effort
from bench.studies.landscape.standing import (
    BETTER,
    CANNOT_TELL,
    FEATURES,
    PERMUTATIONS,
    POWER,
    SIGNIFICANCE,
    smallest_correlation,
)

PICTURE_STEM = "landscape"
_METHOD = """\
Problems that differ in their frame alone are one landscape. Fitness is log10 of what a search minimises, penalties
included.

- *Feasible share*: of {points:,} uniform points of the box, at the samples.
- *Fitness-distance correlation*: of {distances:,} uniform points, with the distance to the best point (Jones and
  Forrest 1995).
- *Autocorrelation*: of neighbours on {walks} walks of {steps} steps, normal with {step:g} of half of the box in each
  coordinate (Weinberger 1990). *Information content*: the largest entropy of changes of slope on such a walk (Muñoz,
  Kirley and Halgamuge 2015, eq. 5).
- *Descents*: with exact derivatives, on the smooth criterion of sharpness {sharpness:g}, each from the best of 50
  random points as the row `sqp` draws them, until {gradients:,} points with derivatives are spent, at least
  {descents}. Ends are one *basin* if their motions differ by less than {same_motion:.0%} of their swing and their
  values by less than {same_value:.0%}, up to what leaves the condition number as it is: the direction of time, the
  mean of a joint about the vertical, mirrored joints (all tried on the arm), another beginning of a periodic series.
  *Meet*: chance that two descents end in one basin (Simpson 1949), which does not depend on how many there were.
- *Spread*: standard deviation of log10 of the ends. *Value against distance*: of the ends, to the best of
  them, where four or more ended within the limits.
- *Conditioning*: largest over least curvature of the Lagrangian at the best point (of the ends, or where the best known
  trajectory leads), along directions that no limit closes and that are not flat."""


def landscape_page(features: pd.DataFrame, correlations: pd.DataFrame, effort: Effort) -> str:
    """The whole page; every number comes from the tables. features: as `feature_table` makes it."""
    landscapes = features.drop_duplicates("landscape")
    return markdown_page(
        "Landscapes of the suites",
        *_answer(correlations),
        f"![Rank correlations, and ends of the descents]({PICTURE_STEM}.svg)",
        "## Features and standing",
        _correlation_text(correlations),
        correlation_cells(correlations),
        "## Features of each landscape",
        *_basin_text(landscapes),
        _feature_cells(landscapes),
        "## Features among themselves",
        "Rank correlation with the dimension, over all landscapes: features that go together cannot be told apart as "
        "causes.",
        _dimension_cells(landscapes),
        "## What was measured",
        _method_text(effort),
    )


def _answer(correlations: pd.DataFrame) -> Iterator[str]:
    found = correlations[correlations["verdict"] != CANNOT_TELL]
    pairs = int(correlations["p"].notna().sum())
    again = (
        f" {int(found['confirmed'].sum())} of these are found again on the held-out suite, "
        f"{int((found['p_within_holm'] < SIGNIFICANCE).sum())} among arms with as many joints."
        if len(found)
        else ""
    )
    yield (
        f"**Which features make an algorithm win?** {len(found) or 'None'} of {pairs} pairs of a feature and an "
        f"algorithm {'show' if len(found) > 1 else 'shows'} a rank correlation with the standing on the first suite (p "
        f"below {SIGNIFICANCE:g} after Holm's correction over all pairs, and an interval without zero).{again} "
        f"{'For the others t' if len(found) else 'T'}hese problems cannot tell: with "
        f"{int(correlations['problems'].max())} landscapes a correlation of "
        f"{correlations['smallest_alone'].min():.2f} is seen with a power of {POWER:g} as the only comparison, of "
        f"{correlations['smallest_holm'].min():.2f} at Holm's first step. The "
        f"{int(correlations['checked_problems'].max())} held-out ones alone see "
        f"{smallest_correlation(int(correlations['checked_problems'].max()), SIGNIFICANCE):.2f}."
    )
    there = correlations.dropna(subset="correlation").to_dict("records")
    strongest = max(there, key=lambda row: abs(float(row["correlation"])))
    yield (
        f"The largest correlation is that of {display_name(str(strongest['algorithm']))} with "
        f"{FEATURES[str(strongest['feature'])]}: {strongest['correlation']:.2f} ({strongest['low']:.2f} to "
        f"{strongest['high']:.2f}), p {strongest['p']:.2g} alone and {strongest['p_holm']:.2g} after Holm; "
        f"{_decimals(strongest['checked_correlation'])} on the held-out suite."
    )
    for name, rows in found[found["confirmed"]].groupby("algorithm", sort=False):
        told = ", ".join(
            f"{FEATURES[row['feature']]} ({'better' if row['verdict'] == BETTER else 'worse'} where it is large, "
            f"{row['correlation']:.2f} [{row['low']:.2f}, {row['high']:.2f}], "
            f"held out {row['checked_correlation']:.2f})"
            for row in rows.to_dict("records")
        )
        yield f"- {display_name(str(name))}: {told}"


def _correlation_text(correlations: pd.DataFrame) -> str:
    return (
        "Rank correlation of a feature with the standing of an algorithm on the first suite; 1 is the best rank, so a "
        "negative number says that the algorithm does better where the feature is large. In brackets a bootstrap "
        f"interval over landscapes (95 %) and p of {PERMUTATIONS:,} permutations after Holm's correction. In bold: "
        "told by these problems; `*`: found again on the held-out suite; `+`: also among arms with as many joints. "
        "Standings are ranks, so the rows of a feature depend on each other."
    )


def correlation_cells(correlations: pd.DataFrame) -> str:
    """A row an algorithm, a column a feature."""
    rows = []
    for name, found in correlations.groupby("algorithm", sort=False):
        cells = found.set_index("feature").to_dict("index")
        rows.append([display_name(str(name)), *(_correlation_cell(cells[feature]) for feature in FEATURES)])
    return markdown_table(["algorithm", *FEATURES.values()], rows)


def _correlation_cell(row: Mapping[Any, Any]) -> str:
    if pd.isna(row["correlation"]):
        return "-"
    text = "{correlation:.2f} ({low:.2f} to {high:.2f}), {p_holm:.2g}".format(**row)
    if row["verdict"] == CANNOT_TELL:
        return text
    within = "+" if row["p_within_holm"] < SIGNIFICANCE else ""
    return f"**{text}**{'*' if row['confirmed'] else ''}{within}"


def _basin_text(landscapes: pd.DataFrame) -> Iterator[str]:
    alone = landscapes[landscapes["basins"] == (landscapes["descents"] * landscapes["feasible_ends"]).round()]
    yield (
        f"On {len(alone)} of {len(landscapes)} landscapes no two descents ended in the same basin. The mean chance "
        f"that two meet is {landscapes['meeting_share'].mean():.1%}; with half of the tolerances it is "
        f"{landscapes['meeting_half'].mean():.1%}, with twice them {landscapes['meeting_double'].mean():.1%}. "
        f"{int(landscapes['descents'].sum())} descents in all, {landscapes['gradients'].sum():,} points with "
        "derivatives."
    )
    unfinished = landscapes.loc[landscapes["negative"] > 0, "landscape"]
    if len(unfinished):
        yield (
            "A negative curvature at the best point says that it is no minimum of the smooth criterion: descents stop "
            f"early there, and their ends are more than the basins: {', '.join(unfinished)}."
        )
    if landscapes["from_record"].any():
        names = ", ".join(landscapes.loc[landscapes["from_record"], "landscape"])
        yield f"The best known trajectory led to a better point than these descents on: {names}."


def _feature_cells(landscapes: pd.DataFrame) -> str:
    headings = ["landscape", "dimension", "feasible", "distance", "walk", "information", "descents", "feasible ends"]
    headings += ["basins", "meet", "spread", "value against distance", "best", "conditioning", "free (flat, negative)"]
    rows = [
        (
            row["landscape"],
            row["dimension"],
            f"{row['feasible_share']:.2%}",
            f"{row['distance_correlation']:.2f}",
            f"{row['walk_correlation']:.3f}",
            f"{row['information']:.3f}",
            row["descents"],
            f"{row['feasible_ends']:.0%}",
            row["basins"],
            f"{row['meeting_share']:.1%}",
            _decimals(row["end_spread"], 3),
            _decimals(row["valley_correlation"]),
            f"{row['best']:.4g}",
            f"{row['condition']:.2g}",
            f"{row['free']} ({row['flat']}, {row['negative']})",
        )
        for row in landscapes.to_dict("records")
    ]
    return markdown_table(headings, rows, range(1, len(headings)))


def _dimension_cells(landscapes: pd.DataFrame) -> str:
    cells = []
    for feature in FEATURES:
        there = landscapes.dropna(subset=feature)
        columns = (there[[name]].to_numpy(float) for name in ("dimension", feature))
        value = float(spearman_correlations(*columns)[0, 0]) if len(there) > 2 else np.nan
        cells.append(_decimals(value))
    return markdown_table(list(FEATURES.values()), [cells])


def _decimals(value: float, places: int = 2) -> str:
    """The number, or a dash where there is none."""
    return "-" if np.isnan(value) else f"{value:.{places}f}"


def _method_text(effort: Effort) -> str:
    return _METHOD.format(
        points=effort.sampling.points,
        distances=effort.sampling.distances,
        walks=effort.sampling.walks,
        steps=effort.sampling.steps,
        step=effort.sampling.step,
        sharpness=SHARPNESS,
        gradients=effort.gradients,
        descents=effort.descents,
        same_motion=SAME_MOTION,
        same_value=SAME_VALUE,
    )
