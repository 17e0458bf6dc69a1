"""Sizes as a recording leaves them: drawn from the normal posterior of a fit, only where physics allows them."""

import numpy as np

from armlab.effects.contract import Candidate
from armlab.effects.plausible import prior_scale, reason_implausible
from diagnosis.next.moments import Index, Moments, solved
from recordings.run import Array

SURE = 1e-6  # of the largest eigenvalue: directions that are known less well are left as they are
TRIES = 20  # draws for each one that is wanted


def coefficients(
    seen: Moments, free: Index, own: Index, candidate: Candidate, count: int, rng: np.random.Generator
) -> tuple[Index, Array]:
    """Places of the free columns and a law's own, and draws of their coefficients, (places, at most count).

    seen: of the recording, with what is known beforehand. No draws where physics refuses nearly all of them.
    """
    chosen = np.append(free, own)
    gram = seen.gram.copy()
    gram[own, own] += 1 / prior_scale(candidate, None) ** 2
    mean = solved(gram, chosen, seen.vector)
    part = gram[np.ix_(chosen, chosen)]
    lengths = np.sqrt(np.maximum(np.diag(part), 1e-300))
    values, axes = np.linalg.eigh(part / np.outer(lengths, lengths))
    spread = np.where(values > SURE * values[-1], 1 / np.sqrt(np.maximum(values, 1e-300)), 0.0)
    drawn = mean[:, None] + (axes * spread) @ rng.normal(size=(len(chosen), TRIES * count)) / lengths[:, None]
    allowed = [each for each in drawn.T if _possible(candidate, each[len(free) :])][:count]
    return chosen, np.array(allowed).T if allowed else np.empty((len(chosen), 0))


def _possible(candidate: Candidate, values: Array) -> bool:
    return candidate.objection(values) is None and reason_implausible(candidate, values) is None
