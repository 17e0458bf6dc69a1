"""The probability that one run decides: the analysis of both runs, many times, with sizes and noise drawn anew."""

from dataclasses import dataclass

import numpy as np

from armlab.diagnosis.claims import MAX_DEFICIT
from diagnosis.next.deciding import gained, held_out_need, rest
from diagnosis.next.moments import solved
from diagnosis.next.posterior import coefficients
from diagnosis.next.prepare import Prepared
from diagnosis.next.question import Question
from recordings.run import Array

DRAWS = 400


@dataclass(frozen=True)
class Chances:
    """Shares of simulated runs. right: one name is left, the right one. wrong: one name, another. open: several."""

    right: float
    wrong: float
    open: float


def chances(prepared: Prepared, question: Question, new: Array, rows: float, rng: np.random.Generator) -> Chances:
    """What becomes of a question after a run with moments `new` (columns, columns).

    Each rival is right as often as it fits the first recording beside the others. rows: of both recordings, all joints.
    """
    weights = np.array([each.weight for each in question.rivals])
    found = [given_right(prepared, question, right, new, rows, rng) for right in range(len(weights))]
    shares = np.array([[each.right, each.wrong, each.open] for each in found])
    return Chances(*(weights @ shares / weights.sum()).tolist())


def given_right(
    prepared: Prepared, question: Question, right: int, new: Array, rows: float, rng: np.random.Generator
) -> Chances:
    """What becomes of it where one rival is the right one, with shapes and sizes that fit the first recording."""
    gram = prepared.together(new)
    values = _values(prepared, question, right, rng)
    noise = _root(new) @ rng.normal(size=values.shape)
    vectors = prepared.before.vector[:, None] + new @ values + noise
    explained = [_explained(question, each, gram, vectors, rows) for each in range(len(question.rivals))]
    return decided(question, explained, right, rows)


def decided(question: Question, explained: list[Array], right: int, rows: float) -> Chances:
    """How draws end under the rule of the diagnosis. explained: for each rival log likelihoods, (laws, draws)."""
    laws = [each.laws for each in question.rivals]
    prices = [np.array([[law.price(rows)] for law in each]) for each in laws]
    scores = np.array([np.max(found - price, axis=0) for found, price in zip(explained, prices, strict=True)])
    best, ordered = np.argmax(scores, axis=0), np.sort(scores, axis=0)
    clear = ordered[-1] - ordered[-2] > MAX_DEFICIT
    whole = np.array([np.max(found, axis=0) for found in explained])
    for one, special in enumerate(laws):
        for other, usual in enumerate(laws):
            least = held_out_need(special[0], usual[0], rows)
            clear &= (best != one) | (other == one) | (whole[one] - whole[other] > least)
    return Chances(*(float(np.mean(each)) for each in (clear & (best == right), clear & (best != right), ~clear)))


def _values(prepared: Prepared, question: Question, right: int, rng: np.random.Generator) -> Array:
    """Coefficients of all columns as the first recording leaves them where one rival is right, (columns, draws)."""
    rival = question.rivals[right]
    out = []
    shares = np.array([len(sizes) for _, sizes in rival.possible], dtype=np.float64)
    for (law, sizes), share in zip(rival.possible, shares / shares.sum(), strict=True):
        count = max(round(DRAWS * share), 1)
        drawn = np.zeros((len(prepared.layout.prior), count))
        drawn[law.columns] = sizes[rng.integers(len(sizes), size=count)].T
        if prepared.first is not None:
            chosen, found = coefficients(prepared.known, question.found, law.columns, law.candidate, count, rng)
            if found.shape[1]:
                drawn = np.zeros((len(drawn), found.shape[1]))
                drawn[chosen] = found
        out.append(drawn)
    return np.concatenate(out, axis=1)


def _explained(question: Question, number: int, gram: Array, vectors: Array, rows: float) -> Array:
    """Log likelihood of each of a rival's laws, (laws, draws), less the price of a usual term that helps."""
    out = []
    for law in question.rivals[number].laws:
        chosen = np.append(question.found, law.columns)
        values = solved(gram, chosen, vectors)
        left = vectors - gram[:, chosen] @ values
        more = gained(left, rest(gram, chosen), question.extras, rows)
        out.append(0.5 * np.sum(values * vectors[chosen], axis=0) + more)
    return np.array(out)


def _root(gram: Array) -> Array:
    values, axes = np.linalg.eigh(gram)
    return np.asarray(axes * np.sqrt(np.maximum(values, 0)))
