"""How likely a run leaves doubt, in closed form and under the rule of the diagnosis: what a design makes small."""

import numpy as np
from scipy.special import logsumexp
from scipy.stats import norm

from armlab.diagnosis.claims import MAX_DEFICIT
from armlab.diagnosis.search import SPECIAL_FRICTION
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.solver import USUAL_EFFECTS
from diagnosis.next.moments import Index, solved
from diagnosis.next.question import Law, Question, Rival
from recordings.run import Array

LEAST = 1e-9  # standard errors


def strength(questions: tuple[Question, ...], gram: Array, rows: float) -> float:
    """How well a run decides all questions: the distance d of two rivals that are confused as often, exp(-d^2 / 8).

    gram: of everything that is fitted to both recordings. rows: that count, of all joints.
    """
    doubts = [log_doubt(each, gram, rows) for each in questions if each.pairs]
    return float(np.sqrt(max(-8 * (logsumexp(doubts) - np.log(len(doubts))), 0.0)))


def log_doubt(question: Question, gram: Array, rows: float) -> float:
    """Logarithm of the mean chance that a wrong rival stays, over the right one, its shapes and its sizes.

    Where one is right, its log likelihood leads another's by a normal number of mean d^2 / 2 and standard deviation d,
    d^2 the noncentrality. The other stays where the lead is below what the rule of the diagnosis needs.
    """
    rests = [[rest(gram, np.append(question.found, law.columns)) for law in rival.laws] for rival in question.rivals]
    weights = np.array([each.weight for each in question.rivals])
    out = []
    for one, right in enumerate(question.rivals):
        for other, rival in enumerate(question.rivals):
            if one != other and not question.blind[one, other]:
                doubt = _pair(right, rival, rests[other], question.extras, rows)
                out.append(doubt + np.log(weights[one] / weights.sum() / (len(weights) - 1)))
    return float(logsumexp(out)) if out else 0.0


def _pair(right: Rival, other: Rival, rests: list[Array], extras: Index, rows: float) -> float:
    """Log chance that another rival stays where one is right, over the sizes that it may have."""
    out = []
    for law, sizes in right.possible:
        squared = [_noncentrality(law.columns, sizes, each, extras, rows) for each in rests]
        closest = np.argmin(squared, axis=0)
        needs = np.array([need(law, each, rows) for each in other.laws])[closest]
        square = np.maximum(np.min(squared, axis=0), LEAST**2)
        out += norm.logsf((square / 2 - needs) / np.sqrt(square)).tolist()
    return float(logsumexp(out) - np.log(len(out)))


def _noncentrality(own: Index, sizes: Array, left: Array, extras: Index, rows: float) -> Array:
    """What the fitted columns leave of a law with some sizes (draws, columns), one usual term more at its price."""
    products = left[:, own] @ sizes.T
    squared = np.sum(products[own] * sizes.T, axis=0)
    return np.asarray(squared - 2 * gained(products, left, extras, rows))


def gained(products: Array, left: Array, extras: Index, rows: float) -> Array:
    """Log likelihood less price that the best term of usual friction adds, (draws,).

    products: (columns, draws), of the columns with what is not explained. left: (columns, columns), as `rest` tells.
    """
    if not len(extras):
        return np.zeros(products.shape[1])
    lengths = np.maximum(np.diag(left)[extras], 1e-12)
    gains = products[extras] ** 2 / lengths[:, None] / 2
    return np.asarray(np.maximum(np.max(gains, axis=0) - 0.5 * np.log(max(rows, 2)), 0.0))


def need(right: Law, other: Law, rows: float) -> float:
    """By how much the likelihood of the right law has to lead that of another, in its logarithm."""
    return max(MAX_DEFICIT + right.price(rows) - other.price(rows), held_out_need(right, other, rows))


def held_out_need(right: Law, other: Law, rows: float) -> float:
    """What a special law of friction has to gain on usual friction: a share of the held-out error at its joint."""
    if right.candidate.effect in SPECIAL_FRICTION and other.candidate.effect in USUAL_EFFECTS:
        return 0.5 * Settings().least_gain * rows * right.share
    return -np.inf


def rest(gram: Array, fitted: Index) -> Array:
    """What fitted columns leave of the products of all columns."""
    return np.asarray(gram - gram[:, fitted] @ solved(gram, fitted, gram))
