"""Tables of a study: medians side by side, and duels with effect sizes."""

from collections.abc import Callable, Iterator, Mapping

import numpy as np
import pandas as pd

from bench.printed import display_name
from bench.statistics import is_feasible, quantile
from bench.statistics.paired import Duel, against, duels

CELL = ["problem", "swarm_size", "budget"]
Fight = Callable[[pd.DataFrame], list[Duel]]


def median_table(frame: pd.DataFrame, known: Mapping[str, float]) -> pd.DataFrame:
    """One row a problem, swarm size and budget, as far as they vary; a column an algorithm: the median of its ends.

    An infeasible end counts as infinite; where there are some, the share of the feasible ones stands in brackets.
    known: the best condition number of a problem, as far as there is a record.
    """
    varying = [name for name in CELL if frame[name].nunique() > 1]
    rows = []
    for names, group in frame.groupby(CELL, sort=False):
        cell = dict(zip(CELL, names, strict=True))
        medians = dict(_medians(group))
        value, least = min((median, label) for label, (median, _) in medians.items())
        row = {name: cell[name] for name in varying}
        row |= {display_name(label): _shown(*found) for label, found in medians.items()}
        record = known.get(str(cell["problem"]))
        row |= {"least": display_name(least) if np.isfinite(value) else "-"}
        rows.append(row | {"best known": f"{record:.3g}" if record else "-"})
    return pd.DataFrame(rows)


def _medians(group: pd.DataFrame) -> Iterator[tuple[str, tuple[float, float]]]:
    for label, rows in group.groupby("algorithm", sort=False):
        feasible = is_feasible(rows["value"].to_numpy(), rows["violation"].to_numpy())
        yield str(label), (quantile(np.where(feasible, rows["value"], np.inf), 0.5), float(feasible.mean()))


def _shown(median: float, share: float) -> str:
    return f"{median:.3g}" if share == 1 else f"{median:.3g} ({share:.0%})"


def rivals_table(frame: pd.DataFrame, subject: str) -> pd.DataFrame:
    """The subject against every other algorithm, in each problem, swarm size and budget."""
    return _duel_table(frame, lambda group: against(group, subject))


def variants_table(frame: pd.DataFrame, default: str) -> pd.DataFrame:
    """Every other entry against the default, so that A12 above 0.5 means that the change helps."""

    def fight(group: pd.DataFrame) -> list[Duel]:
        return duels(group, [(str(label), default) for label in group["algorithm"].unique() if label != default])

    return _duel_table(frame, fight)


def _duel_table(frame: pd.DataFrame, fight: Fight) -> pd.DataFrame:
    rows = [
        {
            **dict(zip(CELL, names, strict=True)),
            "subject": duel.subject,
            "rival": duel.rival,
            "superiority": duel.superiority,
            "low": duel.low,
            "high": duel.high,
            "p_holm": duel.p,
            "winner": duel.winner() or "",
        }
        for names, group in frame.groupby(CELL, sort=False)
        for duel in fight(group)
    ]
    return pd.DataFrame(rows)


def effect_table(table: pd.DataFrame) -> pd.DataFrame:
    """A variants table for the eye: one row a variant, one column a problem and budget."""
    signs = np.select([table["winner"] == table["subject"], table["winner"] == table["rival"]], [" +", " -"], "")
    rows = table.assign(
        variant=table["subject"],
        cell=[f"{row.superiority:.2f} ({row.low:.2f}-{row.high:.2f})" for row in table.itertuples()]
        + signs.astype(object),
        column=[f"{row.problem}, {row.budget}" for row in table.itertuples()],
    )
    wide = rows.pivot(index="variant", columns="column", values="cell")
    return wide.loc[rows["variant"].unique(), rows["column"].unique()].reset_index()
