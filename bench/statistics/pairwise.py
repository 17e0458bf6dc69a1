"""Pairwise comparison of algorithms: Wilcoxon's signed-rank test, effect sizes (A12) with intervals, Holm's
correction.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.stats import wilcoxon

from armlab.common.arrays import Array
from armlab.common.statistics import adjust_by_holm
from bench.statistics.ends import is_feasible, percentile_interval, resamples

_NUMBERS_PER_PIECE = 1_000_000  # numbers of a piece of work


@dataclass(frozen=True)
class Duel:
    """A comparison of a subject with a rival over paired repetitions.

    superiority: probability that an end of the subject is better than one of the rival, ties counting half (A12, Vargha
    and Delaney 2000), with a 95 % bootstrap interval. p: two-sided Wilcoxon signed-rank test on log10 of the ends,
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
    over all of them.
    """
    losses = log_losses(frame)
    p = adjust_by_holm(np.array([signed_rank_p(losses[subject], losses[rival]) for subject, rival in pairs]))
    return [
        Duel(subject, rival, *superiority(losses[subject], losses[rival]), float(adjusted))
        for (subject, rival), adjusted in zip(pairs, p, strict=True)
    ]


def duels_against_all(frame: pd.DataFrame, subject: str) -> list[Duel]:
    """The subject against every other algorithm of the frame."""
    return duels(frame, [(subject, str(rival)) for rival in frame["algorithm"].unique() if rival != subject])


def log_losses(frame: pd.DataFrame) -> dict[str, Array]:
    """By algorithm, log10 of its ends in the order of the repetitions; an end of 0 counts as the least number.

    An infeasible end gets a loss above every feasible one of the frame, so that it has the worst rank; two infeasible
    ends are equal.
    """
    values, violations = frame["value"].to_numpy(), frame["violation"].to_numpy()
    feasible = is_feasible(values, violations)
    logs = np.log10(np.maximum(values, np.finfo(float).tiny)[feasible])
    worst = logs.max() + np.ptp(logs) + 1.0 if feasible.any() else 1.0
    loss = pd.Series(worst, index=frame.index)
    loss[feasible] = logs
    ordered = frame.assign(loss=loss).sort_values("repetition", kind="stable")
    return {str(label): rows["loss"].to_numpy() for label, rows in ordered.groupby("algorithm", sort=False)}


def signed_rank_p(subject: Array, rival: Array) -> float:
    """Two-sided p-value of Wilcoxon's signed-rank test with Pratt's treatment of equal pairs; 1 if all are equal.

    Exact up to 50 pairs without ties, because the normal approximation cannot give the small p-values that Holm's
    correction needs with few pairs.
    """
    difference = subject - rival
    if not difference.any():
        return 1.0
    return float(wilcoxon(difference, zero_method="pratt").pvalue)


def superiority(subject: Array, rival: Array) -> tuple[float, float, float]:
    """A12 of losses (n,) with a 95 % percentile interval; repetitions are resampled in pairs."""
    n = len(subject)
    counts = np.stack([np.bincount(row, minlength=n) for row in resamples(n)]).astype(float)
    pieces = np.array_split(counts, -(-counts.size // _NUMBERS_PER_PIECE))
    resampled = np.concatenate([_weighted_superiority(subject, rival, piece) for piece in pieces])
    return float(_weighted_superiority(subject, rival, np.ones((1, n)))[0]), *percentile_interval(resampled)


def _weighted_superiority(subject: Array, rival: Array, counts: Array) -> Array:
    """A12 (m,) where each repetition counts as often as the rows of counts (m, n) say; sums of halves, so exact."""
    n = len(subject)
    order = np.argsort(rival)
    below = np.searchsorted(rival[order], subject, side="left")
    up_to = np.searchsorted(rival[order], subject, side="right")
    passed = np.pad(counts[:, order].cumsum(axis=1), ((0, 0), (1, 0)))
    won = n - (passed[:, up_to] + passed[:, below]) / 2
    return np.asarray((counts * won).sum(axis=1) / n**2)


def superiority_unpaired(subject: Array, rival: Array) -> tuple[float, float, float]:
    """A12 of independent losses (n,) and (m,), with a 95 % percentile interval."""
    wins = _win_matrix(subject, rival)
    drawn = zip(resamples(len(subject)), resamples(len(rival), "rival"), strict=True)
    resampled = np.array([wins[np.ix_(rows, columns)].mean() for rows, columns in drawn])
    return float(wins.mean()), *percentile_interval(resampled)


def _win_matrix(subject: Array, rival: Array) -> Array:
    """1 where an end of the subject (rows) is better than one of the rival (columns), 1/2 where equal."""
    return np.asarray((np.sign(rival[None, :] - subject[:, None]) + 1) / 2)
