"""Pairwise comparison of algorithms over paired repetitions: Wilcoxon's signed-rank test with Holm's correction, and
the effect size (A12) with its interval.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.stats import wilcoxon

from armlab.common.arrays import Array
from armlab.common.statistics import adjust_by_holm
from bench.statistics.ends import is_feasible
from bench.statistics.superiority import superiority

ZERO = float(np.finfo(float).tiny)  # an end of 0 counts as the least positive number, which the logarithm needs


@dataclass(frozen=True)
class Duel:
    """A comparison of a subject with a rival over paired repetitions.

    superiority: probability that an end of the subject is better than one of the rival, ties counting half (A12, Vargha
    and Delaney 2000), with its 95 % interval. p: two-sided Wilcoxon signed-rank test on log10 of the ends,
    after Holm's correction over the duels of one call.
    """

    subject: str
    rival: str
    superiority: float
    low: float
    high: float
    p: float

    def winner(self, rate: float = 0.05) -> str | None:
        """The better one if the test rejects equality at that rate, else None."""
        if self.p > rate:
            return None
        return self.subject if self.superiority > 0.5 else self.rival


def duel_row(duel: Duel) -> dict[str, str | float]:
    """A duel as a row of a table; winner: empty where no difference is significant at 5 %."""
    return {
        "subject": duel.subject,
        "rival": duel.rival,
        "superiority": duel.superiority,
        "low": duel.low,
        "high": duel.high,
        "p_holm": duel.p,
        "winner": duel.winner() or "",
    }


def duels(frame: pd.DataFrame, pairs: Sequence[tuple[str, str]]) -> list[Duel]:
    """Duels of (subject, rival) labels in a tidy frame of one problem, swarm size and budget, with Holm's correction
    over all of them. A repetition that one of the two lacks is left out.
    """
    losses = log_losses(frame)
    paired = [paired_losses(losses, *pair) for pair in pairs]
    p = adjust_by_holm(np.array([signed_rank_p(*both) for both in paired]))
    return [
        Duel(*pair, *superiority(*both), float(adjusted)) for pair, both, adjusted in zip(pairs, paired, p, strict=True)
    ]


def duels_against_all(frame: pd.DataFrame, subject: str) -> list[Duel]:
    """The subject against every other algorithm of the frame."""
    return duels(frame, [(subject, str(rival)) for rival in frame["algorithm"].unique() if rival != subject])


def log_losses(frame: pd.DataFrame) -> pd.DataFrame:
    """log10 of the ends, one row a repetition and one column an algorithm; NaN where a trial is missing.

    An end of 0 counts as `ZERO`. An infeasible end, and a trial that failed, gets a loss above every feasible one of
    the frame, so that it has the worst rank; two of them are equal.
    """
    values, violations = frame["value"].to_numpy(), frame["violation"].to_numpy()
    feasible = is_feasible(values, violations)
    logs = np.log10(np.maximum(values, ZERO)[feasible])
    worst = logs.max() + np.ptp(logs) + 1.0 if feasible.any() else 1.0
    loss = pd.Series(worst, index=frame.index)
    loss[feasible] = logs
    table = frame.assign(loss=loss).pivot(index="repetition", columns="algorithm", values="loss")
    return table[frame["algorithm"].unique()].rename_axis(columns=None)


def paired_losses(losses: pd.DataFrame, subject: str, rival: str) -> tuple[Array, Array]:
    """The losses of two algorithms in the repetitions that both have, (n,) each."""
    both = losses[[subject, rival]].dropna()
    return both[subject].to_numpy(), both[rival].to_numpy()


def signed_rank_p(subject: Array, rival: Array) -> float:
    """Two-sided p-value of Wilcoxon's signed-rank test with Pratt's treatment of equal pairs; 1 if all are equal.

    Exact up to 50 pairs without ties, because the normal approximation cannot give the small p-values that Holm's
    correction needs with few pairs.
    """
    difference = subject - rival
    if not difference.any():
        return 1.0
    return float(wilcoxon(difference, zero_method="pratt").pvalue)
