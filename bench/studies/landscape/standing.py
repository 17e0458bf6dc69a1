"""Which features go with an algorithm's standing: rank correlations over the problems, with what they can tell.

A standing is an algorithm's rank on a problem, 1 for the least median; where most ends are infeasible, the larger share
of feasible ones is better. Problems that differ in their frame alone are one observation. Correlations are looked for
in one suite and checked in another one, which took no part.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import ndtri
from scipy.stats import rankdata

from armlab.common.arrays import Array
from armlab.common.statistics import adjust_by_holm, standard_ranks
from armlab.common.streams import named_generator
from bench.statistics.ends import INTERVAL_LEVEL, resamples

FEATURES = {
    "dimension": "dimension",
    "feasible_share": "feasible share",
    "distance_correlation": "fitness-distance correlation",
    "walk_correlation": "autocorrelation of a walk",
    "information": "information content",
    "meeting_share": "chance that two descents meet",
    "end_spread": "spread of the ends",
    "valley_correlation": "ends: value against distance",
    "condition": "conditioning at the best",
}
PERMUTATIONS = 9_999
SIGNIFICANCE = 0.05
POWER = 0.8
LEAST_PROBLEMS = 5  # for a correlation
BETTER, WORSE, CANNOT_TELL = "better where it is large", "worse where it is large", "cannot tell"


def standings(results: pd.DataFrame) -> pd.DataFrame:
    """Rank of each algorithm (columns) on each problem (rows); results: a summary table as `armlab run` writes it."""
    infeasible = ~np.isfinite(results["median"])
    losses = results["median"].where(~infeasible, np.finfo(float).max * (1 - results["feasible_share"] / 2))
    table = results.assign(loss=losses).pivot(index="problem", columns="algorithm", values="loss")
    return table[list(results["algorithm"].unique())].rank(axis=1).loc[list(results["problem"].unique())]


def by_landscape(table: pd.DataFrame, features: pd.DataFrame) -> pd.DataFrame:
    """Rows of problems averaged over those that differ in their frame alone; features: as `feature_table` makes it."""
    return table.groupby(features.set_index("problem")["landscape"].reindex(table.index), sort=False).mean()


def correlation_table(features: pd.DataFrame, found_in: pd.DataFrame, checked_in: pd.DataFrame) -> pd.DataFrame:
    """A row for each feature and algorithm.

    features: as `feature_table` makes it. found_in, checked_in: ranks as `standings` returns them. Columns: feature,
    algorithm, problems, correlation, low, high (percentile bootstrap over problems), p (permutations of the problems),
    p_holm (over all rows), within_arms, p_within, p_within_holm (ranks less the mean of all problems with as many
    joints), checked_problems, checked_correlation, checked_p, smallest_alone, smallest_holm (the correlations that are
    detected with a power of 0.8 as the only comparison, and at Holm's first step), verdict, confirmed.
    """
    first, second = by_landscape(found_in, features), by_landscape(checked_in, features)
    values = features.drop_duplicates("landscape").set_index("landscape")
    rows = [row for name in FEATURES for row in _feature_rows(name, values, first, second)]
    table = pd.DataFrame(rows)
    for raw, adjusted in (("p", "p_holm"), ("p_within", "p_within_holm")):
        there = table[raw].notna().to_numpy()
        column = np.full(len(table), np.nan)
        column[there] = adjust_by_holm(table.loc[there, raw].to_numpy())
        table[adjusted] = column
    comparisons = int(table["p"].notna().sum())
    table["smallest_alone"] = [smallest_correlation(n, SIGNIFICANCE) for n in table["problems"]]
    table["smallest_holm"] = [smallest_correlation(n, SIGNIFICANCE / comparisons) for n in table["problems"]]
    table["verdict"] = [verdict(row) for row in table.to_dict("records")]
    table["confirmed"] = [is_confirmed(row) for row in table.to_dict("records")]
    return table


def smallest_correlation(problems: int, level: float) -> float:
    """The rank correlation that a two-sided test at a level detects with a power of 0.8.

    The transform artanh(rho) has a variance of 1.06 / (n - 3) (Fieller, Hartley and Pearson 1957). NaN for n < 4.
    """
    if problems < 4:
        return float("nan")
    return float(np.tanh((ndtri(1 - level / 2) + ndtri(POWER)) * np.sqrt(1.06 / (problems - 3))))


def verdict(row: Mapping[Any, Any]) -> str:
    """What a row of the table says; needs a small p after Holm's correction and an interval without zero."""
    if not (row["p_holm"] < SIGNIFICANCE and row["low"] * row["high"] > 0):
        return CANNOT_TELL
    return WORSE if row["correlation"] > 0 else BETTER


def is_confirmed(row: Mapping[Any, Any]) -> bool:
    """Whether the other suite has a correlation of the same sign, with a small p of its own."""
    same_sign = row["correlation"] * row["checked_correlation"] > 0
    return bool(row["verdict"] != CANNOT_TELL and same_sign and row["checked_p"] < SIGNIFICANCE)


def _feature_rows(
    name: str, values: pd.DataFrame, first: pd.DataFrame, second: pd.DataFrame
) -> list[dict[str, object]]:
    here = values.loc[first.index].dropna(subset=name)
    there = values.loc[second.index].dropna(subset=name)
    one, ranks = here[[name]].to_numpy(float), first.loc[here.index].to_numpy()
    found = _correlate(one, ranks, name, "found")
    low, high = _bootstrap(one, ranks)
    groups = here["joints"].to_numpy()
    within, p_within = _correlate_within(one, ranks, groups, name)
    common = [algorithm for algorithm in first.columns if algorithm in second.columns]
    checked = _correlate(there[[name]].to_numpy(float), second.loc[there.index, common].to_numpy(), name, "checked")
    checks = dict(zip(common, zip(*checked, strict=True), strict=True))
    rows: list[dict[str, object]] = []
    for k, algorithm in enumerate(first.columns):
        checked_value, checked_p = checks.get(algorithm, (np.nan, np.nan))
        rows.append(
            {
                "feature": name,
                "algorithm": algorithm,
                "problems": len(here),
                "correlation": found[0][k],
                "low": low[k],
                "high": high[k],
                "p": found[1][k],
                "within_arms": within[k],
                "p_within": p_within[k],
                "checked_problems": len(there) if algorithm in checks else 0,
                "checked_correlation": checked_value,
                "checked_p": checked_p,
            }
        )
    return rows


def _correlate(one: Array, ranks: Array, *names: str) -> tuple[Array, Array]:
    """Correlations of a feature (n, 1) with ranks (n, algorithms), and their p of permutations."""
    if len(one) < LEAST_PROBLEMS:
        return np.full(ranks.shape[1], np.nan), np.full(ranks.shape[1], np.nan)
    return _permute(standard_ranks(one), standard_ranks(ranks), np.zeros(len(one)), *names)


def _correlate_within(one: Array, ranks: Array, groups: Array, name: str) -> tuple[Array, Array]:
    """The same of ranks less the mean of their group; permuted within the groups."""
    if len(one) < LEAST_PROBLEMS:
        return np.full(ranks.shape[1], np.nan), np.full(ranks.shape[1], np.nan)
    return _permute(_without_group_means(one, groups), _without_group_means(ranks, groups), groups, name, "within")


def _permute(one: Array, other: Array, groups: Array, *names: str) -> tuple[Array, Array]:
    """Sums of products of columns (n, 1) and (n, k), and the share of permutations within groups that is as large."""
    value = (one.T @ other)[0]
    orders = _shuffle(groups, named_generator("landscape", "permutations", *names))
    as_large = (np.abs(one[:, 0][orders] @ other) >= np.abs(value) - 1e-12).sum(axis=0)
    return value, np.where(np.isnan(value), np.nan, (1 + as_large) / (1 + PERMUTATIONS))


def _shuffle(groups: Array, rng: np.random.Generator) -> NDArray[np.intp]:
    """PERMUTATIONS orders (permutations, n) that move nothing out of its group."""
    orders = np.tile(np.arange(len(groups)), (PERMUTATIONS, 1))
    for group in np.unique(groups):
        members = np.flatnonzero(groups == group)
        orders[:, members] = rng.permuted(orders[:, members], axis=1)
    return orders


def _without_group_means(values: Array, groups: Array) -> Array:
    """Ranks of columns (n, k) less the mean of their group, of unit length; NaN where nothing is left."""
    ranks = pd.DataFrame(values).rank()
    left = np.asarray(ranks - ranks.groupby(groups).transform("mean"))
    lengths = np.linalg.norm(left, axis=0)
    return np.asarray(left / np.where(lengths > 1e-9, lengths, np.nan))


def _bootstrap(one: Array, ranks: Array) -> tuple[Array, Array]:
    """Ends (algorithms,) of the percentile bootstrap; resamples in which a column is constant are left out."""
    picks = resamples(len(one), "landscape")
    first, second = (_standard_rows(rankdata(values[picks], axis=1)) for values in (one, ranks))
    drawn = np.einsum("rni,rnj->rj", first, second)
    tail, ends = (1 - INTERVAL_LEVEL) / 2, np.full((2, ranks.shape[1]), np.nan)
    there = ~np.isnan(drawn).all(axis=0)
    ends[:, there] = np.nanquantile(drawn[:, there], [tail, 1 - tail], axis=0)
    return ends[0], ends[1]


def _standard_rows(values: Array) -> Array:
    """Columns (resamples, n, k), centred and of unit length; NaN for one that is constant."""
    centred = values - values.mean(axis=1, keepdims=True)
    lengths = np.linalg.norm(centred, axis=1, keepdims=True)
    return np.asarray(centred / np.where(lengths > 0, lengths, np.nan))
