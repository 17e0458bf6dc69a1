"""From arms with their windows to the table of correlations and the table of what choosing by a criterion gets."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
import pandas as pd

from armlab.common.arrays import Array
from armlab.common.statistics import adjust_by_holm, spearman_correlations
from armlab.common.streams import named_generator
from armlab.proof.open.conditioning.arm import WINDOW_BLOCKS, ArmWindows, ConditioningStudy
from armlab.proof.open.conditioning.correlation import BlockCorrelation, average, correlate, count_of_values
from armlab.proof.open.conditioning.criteria import CRITERIA

MEAN = "mean of arms"
CHOSEN_SHARE = 0.1  # of the windows, with the least value of a criterion
SIGNIFICANCE = 0.05
SIMULATED_RANGE = (0.025, 0.975)  # quantiles of the simulations
Verdict = Literal["helps", "misleads", "cannot tell"]


def correlation_table(studies: Sequence[ConditioningStudy]) -> pd.DataFrame:
    """A row for each length, arm (and the mean of arms) and criterion.

    Columns: blocks, window_s, arm, criterion, correlation, low, high, p, p_holm (over the arms of a length, for one
    criterion), simulated, simulated_low, simulated_high (median and range over the simulations), p_simulated (two-sided
    share of the simulations that are as far out, the recorded torque included), verdict.
    """
    tables = []
    for number, chosen in enumerate(WINDOW_BLOCKS):
        lengths = [study.lengths[number] for study in studies]
        found = [
            correlate(
                each.windows, each.criteria.to_numpy(), each.errors, named_generator("blocks", study.name, chosen)
            )
            for study, each in zip(studies, lengths, strict=True)
        ]
        simulated = [spearman_correlations(each.criteria.to_numpy(), each.simulated) for each in lengths]
        adjusted = _holm_over_arms([each.p for each in found])
        for study, each, real, drawn, p_holm in zip(studies, lengths, found, simulated, adjusted, strict=True):
            tables.append(_rows(study.name, each.window_s, chosen, real, drawn, p_holm))
        mean = average(found, lengths[0].windows)
        drawn_mean = _mean_over_arms(simulated)
        tables.append(_rows(MEAN, float("nan"), chosen, mean, drawn_mean, mean.p))
    return pd.concat(tables, ignore_index=True)


def verdict(low: float, high: float, p: float) -> Verdict:
    """Whether a small value of the criterion goes with a small error; needs a small p and an interval without zero.

    The permutations test that blocks have to do with both at all, which one odd block can show; the interval tells
    whether the correlation stays when any block is left out.
    """
    if p < SIGNIFICANCE and low > 0:
        return "helps"
    return "misleads" if p < SIGNIFICANCE and high < 0 else "cannot tell"


def choice_table(studies: Sequence[ConditioningStudy], criteria: Sequence[str]) -> pd.DataFrame:
    """Median errors in percent: of all windows, of the tenth that each criterion prefers, and of the best tenth.

    whole_run: the error of the fit to the whole run. Columns beside: blocks, arm.
    """
    rows = []
    for number, chosen in enumerate(WINDOW_BLOCKS):
        for study in studies:
            length = study.lengths[number]
            row = {"blocks": chosen, "arm": study.name, "all windows": float(np.median(length.errors))}
            row |= {name: median_of_preferred(length, length.criteria[name].to_numpy()) for name in criteria}
            row["best tenth"] = median_of_preferred(length, length.errors)
            rows.append(row | {"whole run": study.whole_error})
    return pd.DataFrame(rows)


def median_of_preferred(length: ArmWindows, criterion: Array) -> float:
    """Median error, percent, of the tenth of the windows with the least criterion (windows,)."""
    count = max(round(CHOSEN_SHARE * len(criterion)), 1)
    return float(np.median(length.errors[np.argsort(criterion, kind="stable")[:count]]))


def _rows(
    arm: str, window_s: float, blocks: int, real: BlockCorrelation, simulated: Array, p_holm: Array
) -> pd.DataFrame:
    low, middle, high = _quantiles(simulated)
    below = np.sum(simulated <= real.value[:, None], axis=1)
    above = np.sum(simulated >= real.value[:, None], axis=1)
    as_far = 2 * (1 + np.minimum(below, above)) / (1 + simulated.shape[1])
    frame = pd.DataFrame(
        {
            "blocks": blocks,
            "window_s": window_s,
            "arm": arm,
            "criterion": CRITERIA,
            "correlation": real.value,
            "low": real.low,
            "high": real.high,
            "p": real.p,
            "p_holm": p_holm,
            "simulated": middle,
            "simulated_low": low,
            "simulated_high": high,
            "p_simulated": np.where(np.isnan(real.value), np.nan, np.minimum(as_far, 1.0)),
        }
    )
    frame["verdict"] = [verdict(*each) for each in zip(frame["low"], frame["high"], frame["p_holm"], strict=True)]
    return frame


def _quantiles(simulated: Array) -> Array:
    return np.quantile(simulated, [SIMULATED_RANGE[0], 0.5, SIMULATED_RANGE[1]], axis=1)


def _mean_over_arms(simulated: Sequence[Array]) -> Array:
    """Mean over the arms that have a value, draw by draw: (criteria, simulations)."""
    stacked = np.array(simulated)
    return np.asarray(np.nansum(stacked, axis=0) / count_of_values(stacked))


def _holm_over_arms(p_values: Sequence[Array]) -> Array:
    """Holm's correction over the arms, criterion by criterion; an arm without a value takes no part."""
    values = np.array(p_values)
    adjusted = np.full(values.shape, np.nan)
    for column in range(values.shape[1]):
        there = ~np.isnan(values[:, column])
        adjusted[there, column] = adjust_by_holm(values[there, column])
    return adjusted
