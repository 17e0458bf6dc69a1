"""The probability that one run decides: the analysis of both runs, many times, with noise drawn anew."""

from dataclasses import dataclass

import numpy as np

from diagnosis.engine.rivals import AS_GOOD
from diagnosis.next.moments import Index, solved
from diagnosis.next.prepare import Prepared
from diagnosis.next.question import Question
from recordings.run import Array

DRAWS = 400
SURE = 1e-6  # of the largest eigenvalue: directions that are known less well are left as they are


@dataclass(frozen=True)
class Chances:
    """Shares of simulated runs. right: one name is left, the right one. wrong: one name, another. open: several."""

    right: float
    wrong: float
    open: float


def chances(prepared: Prepared, question: Question, new: Array, rows: int, rng: np.random.Generator) -> Chances:
    """What becomes of a question after a run with moments `new` (columns, columns), each rival right equally often.

    rows: kept rows of the new run, all joints. Sizes are drawn as uncertain as the first recording leaves them.
    """
    gram = prepared.together(new)
    counts = np.zeros(3)
    for right in range(len(question.rivals)):
        vectors = prepared.before.vector[:, None] + _drawn(prepared, question, right, new, rng)
        every = range(len(question.rivals))
        scores = np.array([_score(question, each, gram, vectors, prepared.rows + rows) for each in every])
        counts += _decided(scores, right)
    return Chances(*(counts / counts.sum()).tolist())


def _drawn(prepared: Prepared, question: Question, right: int, new: Array, rng: np.random.Generator) -> Array:
    """Products of the new run's columns and torque, (columns, draws), where one rival is right."""
    rival = question.rivals[right]
    chosen = np.append(question.free, rival.laws[0].columns)
    noise = _root(new) @ rng.normal(size=(len(new), DRAWS))
    values = np.zeros((len(new), DRAWS))
    values[rival.laws[0].columns] = rival.values[:, None]
    if prepared.first is not None:
        values[chosen] = _posterior(prepared, chosen, rng)
    return np.asarray(new @ values + noise)


def _posterior(prepared: Prepared, chosen: Index, rng: np.random.Generator) -> Array:
    """Coefficients as the first recording leaves them, (chosen, draws)."""
    gram = prepared.before.gram + prepared.layout.prior
    mean = solved(gram, chosen, prepared.before.vector)
    part = gram[np.ix_(chosen, chosen)]
    lengths = np.sqrt(np.maximum(np.diag(part), 1e-300))
    values, axes = np.linalg.eigh(part / np.outer(lengths, lengths))
    spread = np.where(values > SURE * values[-1], 1 / np.sqrt(np.maximum(values, 1e-300)), 0.0)
    return np.asarray(mean[:, None] + (axes * spread) @ rng.normal(size=(len(chosen), DRAWS)) / lengths[:, None])


def _score(question: Question, number: int, gram: Array, vectors: Array, rows: int) -> Array:
    """Log likelihood of the best of a rival's laws less its price, (draws,)."""
    out = []
    for law in question.rivals[number].laws:
        chosen = np.append(question.free, law.columns)
        values = solved(gram, chosen, vectors)
        out.append(0.5 * np.sum(values * vectors[chosen], axis=0) - law.price(rows))
    return np.asarray(np.max(out, axis=0))


def _decided(scores: Array, right: int) -> Array:
    """How many draws (rivals, draws) end right, wrong, open."""
    best = np.argmax(scores, axis=0)
    lead = np.sort(scores, axis=0)
    clear = lead[-1] - lead[-2] > AS_GOOD
    return np.array(
        [np.sum(clear & (best == right)), np.sum(clear & (best != right)), np.sum(~clear)], dtype=np.float64
    )


def _root(gram: Array) -> Array:
    values, axes = np.linalg.eigh(gram)
    return np.asarray(axes * np.sqrt(np.maximum(values, 0)))
