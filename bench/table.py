"""The tables: one row an algorithm, its ends summarised; and the times, which no two runs share, apart."""

from dataclasses import asdict

import pandas as pd

from bench.frame import GROUP
from bench.statistics import Summary, summarise

COLUMNS = ["algorithm", *Summary.__dataclass_fields__, "evaluations"]


def summary_table(frame: pd.DataFrame) -> pd.DataFrame:
    """One row a problem, swarm size, budget and algorithm, in the order of the frame.

    evaluations: average over the repetitions. A tidy frame of one problem and swarm size gives COLUMNS alone.
    """
    rows = [
        {
            **dict(zip(GROUP, names, strict=True)),
            **asdict(summarise(group["value"].to_numpy(), group["violation"].to_numpy())),
            "evaluations": group["evaluations"].mean(),
        }
        for names, group in frame.groupby(GROUP, sort=False)
    ]
    return pd.DataFrame(rows)[_varying(frame) + COLUMNS]


def times_table(frame: pd.DataFrame) -> pd.DataFrame:
    """Seconds of search on one core, by the same groups: of a run on average, its deviation, and in total."""
    seconds = frame.groupby(GROUP, sort=False)["seconds"]
    table = seconds.agg(average_seconds="mean", standard_deviation="std", total_seconds="sum").reset_index()
    return table[[*_varying(frame), "algorithm", "average_seconds", "standard_deviation", "total_seconds"]]


def _varying(frame: pd.DataFrame) -> list[str]:
    return [name for name in ("problem", "swarm_size") if frame[name].nunique() > 1]


def as_csv(table: pd.DataFrame) -> str:
    """CSV text with six significant digits, which rounding differences between machines rarely reach."""
    return table.to_csv(index=False, float_format="%.6g", na_rep="nan", lineterminator="\n")
