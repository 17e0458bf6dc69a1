"""How often no name of a setup finding is right, against how often the findings say so.

A finding of lapse l states probabilities of names that add up to 1 - l. With f the part of this sum that is of
the names that count as the claimed one, and r the odds of a lapse over those that are stated,

    P(right) = f / (1 + r l / (1 - l)),

and r is the one that makes what is right, and what is not, likeliest.

The odds of the diagnosis are proportional to one tuning number (`reading.lapse_odds`); r times this number is the
likeliest one.
"""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize_scalar

from armlab.proof.blind.score.measures import log_scores
from armlab.proof.blind.score.stated import StatedClaim

RANGE = (1e-2, 1e2)  # of r


def likeliest_odds_ratio(claims: Sequence[StatedClaim]) -> float | None:
    """r of the claims that state a lapse; None where there are none."""
    stated = [
        (each.probability, each.all_names, each.right)
        for each in claims
        if each.probability is not None and each.all_names is not None and 0 < each.all_names < 1
    ]
    if not stated:
        return None
    chances, sums, hits = np.array(stated, dtype=np.float64).T
    share, odds = chances / sums, 1 / sums - 1

    def loss(logarithm: float) -> float:
        return float(np.sum(log_scores(share / (1 + np.exp(logarithm) * odds), hits)))

    return float(np.exp(minimize_scalar(loss, bounds=np.log(RANGE), method="bounded").x))
