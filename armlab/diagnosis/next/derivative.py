"""How the strength of a decision changes with the motion.

A design has two levels. Inside, each wrong rival is fitted to what the right one would give: the noncentrality is

    d^2 = min over c of  (u - S c)' G (u - S c)

with u the coefficients of the right rival, S the columns that are fitted and G the Gram matrix of a motion. Outside,
the motion is chosen. By the envelope theorem (Danskin 1967) the fitted c does not count in a derivative:

    d(d^2) = e' dG e,  e = u - S c

So the strength has the derivative sum(Q * dG) with one matrix Q, the weighted sum of all e e', and no fit is repeated
along the coordinates of a motion.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp
from scipy.stats import norm

from armlab.common.arrays import Array
from armlab.diagnosis.next.decision import MIN_SEPARATION, required_lead, unexplained_gram
from armlab.diagnosis.next.moments import Index, solve_least_squares
from armlab.diagnosis.next.question import Question


@dataclass(frozen=True, eq=False)
class DoubtTerm:
    """One wrong rival beside one size of the right one.

    log_weight: of the term in the doubt. square: the noncentrality. need: lead in log likelihood that decides. own,
    sizes: columns and coefficients of the right rival. fitted: columns that imitate it.
    """

    log_weight: float
    square: float
    need: float
    own: Index
    sizes: Array
    fitted: Index

    @property
    def log_doubt(self) -> float:
        """Logarithm of the chance that the wrong rival stays, weighted."""
        return self.log_weight + float(norm.logsf(self._lead))

    @property
    def slope(self) -> float:
        """Derivative of the logarithm of the chance along the noncentrality."""
        if self.square <= MIN_SEPARATION**2:
            return 0.0
        rate = 1 / (4 * np.sqrt(self.square)) + self.need / (2 * self.square**1.5)
        return -float(np.exp(norm.logpdf(self._lead) - norm.logsf(self._lead)) * rate)

    def left(self, gram: Array) -> Array:
        """What the fitted columns leave of the right rival: e, (columns,)."""
        out = np.zeros(len(gram))
        out[self.own] += self.sizes
        out[self.fitted] -= solve_least_squares(gram, self.fitted, gram @ out)
        return out

    @property
    def _lead(self) -> float:
        return float((self.square / 2 - self.need) / np.sqrt(self.square))


def strength_slope(questions: tuple[Question, ...], gram: Array, rows: float) -> tuple[float, Array]:
    """The strength of a decision, standard errors, and its derivatives (columns, columns) along the Gram matrix.

    As `decision_strength`, whose arguments these are.
    """
    asked = [doubt_terms(each, gram, rows) for each in questions if each.pairs]
    logs = [float(logsumexp([term.log_doubt for term in terms])) for terms in asked]
    whole = float(logsumexp(logs))
    strength = float(np.sqrt(max(-8 * (whole - np.log(len(logs))), 0.0)))
    slope = np.zeros_like(gram)
    if strength == 0:
        return strength, slope
    for term in (term for terms in asked for term in terms):
        left = term.left(gram)
        slope += np.exp(term.log_doubt - whole) * term.slope * np.outer(left, left)
    return strength, -4 / strength * slope


def doubt_terms(question: Question, gram: Array, rows: float) -> list[DoubtTerm]:
    """All terms of `log_doubt` of a question: for each pair of rivals, each shape and size of the right one."""
    weights, found = np.array([each.weight for each in question.rivals]), question.found
    fits = [[np.append(found, law.columns) for law in rival.laws] for rival in question.rivals]
    rests = [[unexplained_gram(gram, fitted) for fitted in each] for each in fits]
    out = []
    for one, right in enumerate(question.rivals):
        cases = [(law, draw) for law, sizes in right.possible_sizes for draw in sizes]
        share = np.log(weights[one] / weights.sum() / (len(weights) - 1) / len(cases))
        for other, rival in enumerate(question.rivals):
            if one == other or question.inseparable[one, other]:
                continue
            for law, draw in cases:
                imitations = [
                    _imitate(law.columns, draw, left, fitted, question.extras, rows)
                    for left, fitted in zip(rests[other], fits[other], strict=True)
                ]
                closest = int(np.argmin([square for square, _ in imitations]))
                square, fitted = imitations[closest]
                need = required_lead(law, rival.laws[closest], rows)
                out.append(DoubtTerm(share, max(square, MIN_SEPARATION**2), need, law.columns, draw, fitted))
    return out


def _imitate(own: Index, sizes: Array, left: Array, fitted: Index, extras: Index, rows: float) -> tuple[float, Index]:
    """The noncentrality of a law with sizes (columns,), and the columns that imitate it: the fitted ones, and the best
    one of usual friction where it gains more than its price.
    """
    products = left[:, own] @ sizes
    square = float(products[own] @ sizes)
    if not len(extras):
        return square, fitted
    gains = products[extras] ** 2 / np.maximum(np.diag(left)[extras], 1e-12) / 2
    best = int(np.argmax(gains))
    gain = float(gains[best]) - 0.5 * np.log(max(rows, 2))
    return (square, fitted) if gain <= 0 else (square - 2 * gain, np.append(fitted, extras[best]))
