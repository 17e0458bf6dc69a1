"""Whether two samples of ends come from one distribution: where they lie, and how good their best are.

Both statistics use ranks alone, so they say the same of cond and of log10 cond, and an infeasible end is simply
the worst. They are two-sided: a search that became better tells that the problem changed.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import gammaln
from scipy.stats import mannwhitneyu

from algorithms.contract import Array
from bench.regression.sweep import Cell, Ends
from bench.statistics.holm import holm


@dataclass(frozen=True, eq=False)
class Comparison:
    """One cell: its ends in the baseline (m,) and now (n,), and both p-values after Holm's correction."""

    cell: Cell
    baseline: Array
    now: Array
    p_location: float
    p_best: float

    def differs(self, rate: float) -> bool:
        """Whether the cell raises an alarm at that family-wise false-alarm rate."""
        return min(self.p_location, self.p_best) <= rate

    @property
    def superiority(self) -> float:
        """Chance that an end of the baseline is better than one of now, ties counting half (A12)."""
        difference = np.sign(_finite(self.now)[:, None] - _finite(self.baseline)[None, :])
        return float((difference.mean() + 1) / 2)

    @property
    def worse(self) -> bool:
        """The direction of the difference, by the statistic that shows it more clearly."""
        if self.p_location <= self.p_best:
            return self.superiority > 0.5
        return bool(self.now.min() > self.baseline.min())


def compare(baseline: Ends, now: Ends) -> list[Comparison]:
    """All cells of `now`, which the baseline must have too, with p-values after Holm over both statistics of all."""
    adjusted = holm(np.concatenate([p_values(baseline[cell], now[cell]) for cell in now])).reshape(-1, 2)
    return [
        Comparison(cell, baseline[cell], now[cell], float(p_location), float(p_best))
        for cell, (p_location, p_best) in zip(now, adjusted, strict=True)
    ]


def p_values(baseline: Array, now: Array) -> Array:
    """Two-sided p-values (..., 2), of location and of the best, of ends (..., m) and (..., n)."""
    return np.stack([location_p_value(baseline, now), best_p_value(baseline, now)], axis=-1)


def location_p_value(baseline: Array, now: Array) -> Array:
    """Mann and Whitney's rank-sum test, normal approximation with corrections for ties and continuity, (...,)."""
    batch = np.broadcast_shapes(baseline.shape[:-1], now.shape[:-1])
    samples = (np.broadcast_to(ends, (*batch, ends.shape[-1])) for ends in (now, baseline))
    return np.asarray(mannwhitneyu(*samples, axis=-1, method="asymptotic").pvalue)


def best_p_value(baseline: Array, now: Array) -> Array:
    """Rosenbaum's test (Ann. Math. Statist. 25, 1954, 146): ends of one sample that beat all of the other, (...,).

    That the k best of all m + n ends belong to the sample of size m has the chance C(m, k) / C(m + n, k).
    """
    beaten = (baseline < now.min(axis=-1, keepdims=True)).sum(axis=-1)
    beating = (now < baseline.min(axis=-1, keepdims=True)).sum(axis=-1)
    m, n = baseline.shape[-1], now.shape[-1]
    one_sided = np.minimum(_chance_of_leading(beaten, m, n), _chance_of_leading(beating, n, m))
    return np.minimum(2.0 * one_sided, 1.0)


def _chance_of_leading(k: Array, size: int, others: int) -> Array:
    return np.asarray(np.exp(gammaln(size + 1) - gammaln(size - k + 1) + gammaln(size + others - k + 1)
                             - gammaln(size + others + 1)))  # fmt: skip


def _finite(ends: Array) -> Array:
    """The ends with the largest number for infinite ones, whose difference is then zero and not undefined."""
    return np.minimum(ends, np.finfo(float).max)
