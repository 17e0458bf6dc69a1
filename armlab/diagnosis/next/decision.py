"""The probability that a run decides a question: in closed form for the search of a motion, and by simulated runs
for the card.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp
from scipy.stats import norm

from armlab.common.arrays import Array
from armlab.diagnosis.next.moments import Index, draw_coefficients, solve_least_squares
from armlab.diagnosis.next.prepare import PreparedQuestions
from armlab.diagnosis.next.question import Law, Question, RivalLaw
from armlab.diagnosis.settings import Settings

MIN_SEPARATION = 1e-9  # standard errors


def decision_strength(questions: tuple[Question, ...], gram: Array, rows: float) -> float:
    """How well a run decides all questions, in standard errors.

    It is the distance d of two rivals that are confused as often, exp(-d^2 / 8). gram: of all columns in both
    recordings. rows: number of rows from which a diagnosis learns, of all joints.
    """
    doubts = [log_doubt(each, gram, rows) for each in questions if each.pairs]
    return float(np.sqrt(max(-8 * (logsumexp(doubts) - np.log(len(doubts))), 0.0)))


def log_doubt(question: Question, gram: Array, rows: float) -> float:
    """Logarithm of the chance that a wrong rival stays, averaged over which rival is right, its shapes and its sizes.

    The log likelihood of the right rival leads that of another one by a normal variable of mean d^2 / 2 and standard
    deviation d, where d^2 is the noncentrality. The other one stays where the lead is below `required_lead`.
    """
    rests = [
        [unexplained_gram(gram, np.append(question.found, law.columns)) for law in rival.laws]
        for rival in question.rivals
    ]
    weights = np.array([each.weight for each in question.rivals])
    out = []
    for one, right in enumerate(question.rivals):
        for other, rival in enumerate(question.rivals):
            if one != other and not question.inseparable[one, other]:
                doubt = _log_pair_doubt(right, rival, rests[other], question.extras, rows)
                out.append(doubt + np.log(weights[one] / weights.sum() / (len(weights) - 1)))
    return float(logsumexp(out)) if out else 0.0


def _log_pair_doubt(right: RivalLaw, other: RivalLaw, rests: list[Array], extras: Index, rows: float) -> float:
    """Log chance that another rival stays where one is right, over the sizes that it may have."""
    out = []
    for law, sizes in right.possible_sizes:
        squared = [_noncentrality(law.columns, sizes, each, extras, rows) for each in rests]
        closest = np.argmin(squared, axis=0)
        needs = np.array([required_lead(law, each, rows) for each in other.laws])[closest]
        square = np.maximum(np.min(squared, axis=0), MIN_SEPARATION**2)
        out += norm.logsf((square / 2 - needs) / np.sqrt(square)).tolist()
    return float(logsumexp(out) - np.log(len(out)))


def _noncentrality(own: Index, sizes: Array, left: Array, extras: Index, rows: float) -> Array:
    """Power (draws,) of a law with sizes (draws, columns) that the fitted columns leave, in standard errors squared.

    The best column of usual friction is fitted, too, where it gains more than its price.
    """
    products = left[:, own] @ sizes.T
    squared = np.sum(products[own] * sizes.T, axis=0)
    return np.asarray(squared - 2 * usual_friction_gain(products, left, extras, rows))


def usual_friction_gain(products: Array, left: Array, extras: Index, rows: float) -> Array:
    """Log likelihood that the best term of usual friction gains beyond its price, (draws,), at least zero.

    products: (columns, draws), of the columns with the unexplained torque. left: (columns, columns), of
    `unexplained_gram`.
    """
    if not len(extras):
        return np.zeros(products.shape[1])
    lengths = np.maximum(np.diag(left)[extras], 1e-12)
    gains = products[extras] ** 2 / lengths[:, None] / 2
    return np.asarray(np.maximum(np.max(gains, axis=0) - 0.5 * np.log(max(rows, 2)), 0.0))


def required_lead(right: Law, other: Law, rows: float) -> float:
    """Lead in log likelihood at which a diagnosis names the right law and not the other one."""
    return max(
        Settings().tuning.claims.max_deficit + right.price(rows) - other.price(rows),
        required_held_out_gain(right, other, rows),
    )


def required_held_out_gain(right: Law, other: Law, rows: float) -> float:
    """Gain in log likelihood that a law needs over a usual effect that it contains; -inf for other pairs.

    It stands for the share of held-out error by which a diagnosis wants such a law to be better.
    """
    if other.candidate.facts.usual and other.candidate.effect in right.candidate.facts.contains:
        return 0.5 * Settings().tuning.surrogate.least_gain * rows * right.share
    return -np.inf


def unexplained_gram(gram: Array, fitted: Index) -> Array:
    """Gram matrix (columns, columns) of what the fitted columns leave of all columns."""
    return np.asarray(gram - gram[:, fitted] @ solve_least_squares(gram, fitted, gram))


SIMULATED_RUNS = 400


@dataclass(frozen=True)
class Chances:
    """Shares of simulated runs. right: one name is left, the right one. wrong: one name, another. open: several."""

    right: float
    wrong: float
    open: float


def decision_chances(
    prepared: PreparedQuestions, question: Question, new: Array, rows: float, rng: np.random.Generator
) -> Chances:
    """Chances that a run with the Gram matrix `new` (columns, columns) decides a question.

    Each rival is right with the probability of its weight. rows: of both recordings, all joints.
    """
    weights = np.array([each.weight for each in question.rivals])
    chances = [chances_if_right(prepared, question, right, new, rows, rng) for right in range(len(weights))]
    shares = np.array([[each.right, each.wrong, each.open] for each in chances])
    return Chances(*(weights @ shares / weights.sum()).tolist())


def chances_if_right(
    prepared: PreparedQuestions, question: Question, right: int, new: Array, rows: float, rng: np.random.Generator
) -> Chances:
    """The same chances if one rival is right, with shapes and sizes that fit the first recording."""
    gram = prepared.total_gram(new)
    values = _draw_coefficients(prepared, question, right, rng)
    noise = _matrix_root(new) @ rng.normal(size=values.shape)
    vectors = prepared.before.vector[:, None] + new @ values + noise
    explained = [_log_likelihoods(question, each, gram, vectors, rows) for each in range(len(question.rivals))]
    return judge_draws(question, explained, right, rows)


def judge_draws(question: Question, explained: list[Array], right: int, rows: float) -> Chances:
    """Shares of draws by what the rule of the diagnosis decides. explained: log likelihoods (laws, draws) by rival."""
    laws = [each.laws for each in question.rivals]
    prices = [np.array([[law.price(rows)] for law in each]) for each in laws]
    scores = np.array(
        [np.max(likelihoods - price, axis=0) for likelihoods, price in zip(explained, prices, strict=True)]
    )
    best, ordered = np.argmax(scores, axis=0), np.sort(scores, axis=0)
    clear = ordered[-1] - ordered[-2] > Settings().tuning.claims.max_deficit
    whole = np.array([np.max(likelihoods, axis=0) for likelihoods in explained])
    for one, special in enumerate(laws):
        for other, usual in enumerate(laws):
            least = required_held_out_gain(special[0], usual[0], rows)
            clear &= (best != one) | (other == one) | (whole[one] - whole[other] > least)
    return Chances(*(float(np.mean(each)) for each in (clear & (best == right), clear & (best != right), ~clear)))


def _draw_coefficients(prepared: PreparedQuestions, question: Question, right: int, rng: np.random.Generator) -> Array:
    """Coefficients of all columns after the first recording if one rival is right, (columns, draws)."""
    rival = question.rivals[right]
    out = []
    shares = np.array([len(sizes) for _, sizes in rival.possible_sizes], dtype=np.float64)
    for (law, sizes), share in zip(rival.possible_sizes, shares / shares.sum(), strict=True):
        count = max(round(SIMULATED_RUNS * share), 1)
        drawn = np.zeros((len(prepared.layout.prior), count))
        drawn[law.columns] = sizes[rng.integers(len(sizes), size=count)].T
        if prepared.first is not None:
            chosen, coefficients = draw_coefficients(
                prepared.known_moments, question.found, law.columns, law.candidate, count, rng
            )
            if coefficients.shape[1]:
                drawn = np.zeros((len(drawn), coefficients.shape[1]))
                drawn[chosen] = coefficients
        out.append(drawn)
    return np.concatenate(out, axis=1)


def _log_likelihoods(question: Question, number: int, gram: Array, vectors: Array, rows: float) -> Array:
    """Log likelihood of each law of a rival, (laws, draws), with the gain of the best term of usual friction."""
    out = []
    for law in question.rivals[number].laws:
        chosen = np.append(question.found, law.columns)
        values = solve_least_squares(gram, chosen, vectors)
        left = vectors - gram[:, chosen] @ values
        more = usual_friction_gain(left, unexplained_gram(gram, chosen), question.extras, rows)
        out.append(0.5 * np.sum(values * vectors[chosen], axis=0) + more)
    return np.array(out)


def _matrix_root(gram: Array) -> Array:
    values, axes = np.linalg.eigh(gram)
    return np.asarray(axes * np.sqrt(np.maximum(values, 0)))
