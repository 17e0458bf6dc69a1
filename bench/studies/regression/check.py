"""The regression check: do the ends of the fixed run and of the baseline come from one distribution?

The answer is a verdict and lines to read.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import gammaln
from scipy.stats import mannwhitneyu

from armlab.common.arrays import Array
from armlab.common.statistics import adjust_by_holm
from bench.statistics import quantile
from bench.studies.regression.sweep import Baseline, Cell, Ends
from bench.terminal import text_table


@dataclass(frozen=True, eq=False)
class CellComparison:
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
        difference = np.sign(_finite_ends(self.now)[:, None] - _finite_ends(self.baseline)[None, :])
        return float((difference.mean() + 1) / 2)

    @property
    def worse(self) -> bool:
        """The direction of the difference, by the statistic that shows it more clearly."""
        if self.p_location <= self.p_best:
            return self.superiority > 0.5
        return bool(self.now.min() > self.baseline.min())


def compare_ends(baseline: Ends, now: Ends) -> list[CellComparison]:
    """All cells of `now`, which the baseline must have too, with p-values after Holm's correction over both statistics
    of all cells.
    """
    adjusted = adjust_by_holm(np.concatenate([p_values(baseline[cell], now[cell]) for cell in now])).reshape(-1, 2)
    return [
        CellComparison(cell, baseline[cell], now[cell], float(p_location), float(p_best))
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
    return np.asarray(
        np.exp(gammaln(size + 1) - gammaln(size - k + 1) + gammaln(size + others - k + 1) - gammaln(size + others + 1))
    )


def _finite_ends(ends: Array) -> Array:
    """The ends with the largest number for infinite ones, whose difference is then zero and not undefined."""
    return np.minimum(ends, np.finfo(float).max)


_COLUMN_HEADS = ("problem", "algorithm", "baseline", "now", "best", "now", "p median", "p best", "verdict")
_ACCEPT_HINT = (
    "If the problem or an algorithm was meant to change, `armlab tools regression --update-baseline` accepts this."
)


@dataclass(frozen=True)
class CheckVerdict:
    """comparisons: of every cell. of_other_kernels: cells that other kernels than the baseline's give.

    identical: cells but these whose ends equal those of the baseline's own fixed run.
    """

    comparisons: Sequence[CellComparison]
    rate: float
    identical: int
    of_other_kernels: int = 0

    @property
    def alarms(self) -> list[CellComparison]:
        """The cells that differ from the baseline."""
        return [comparison for comparison in self.comparisons if comparison.differs(self.rate)]

    @property
    def passed(self) -> bool:
        """Whether no cell differs."""
        return not self.alarms

    def lines(self) -> list[str]:
        """A table of all cells, and below it the findings, a sentence for each cell that differs."""
        return [
            *text_table([_COLUMN_HEADS, *(self._row(comparison) for comparison in self.comparisons)]),
            *self.sentences(),
        ]

    def sentences(self) -> list[str]:
        """The findings in words."""
        count = f"{len(self.comparisons)} cells, 2 statistics each, family-wise false-alarm rate {self.rate:g}"
        comparable = len(self.comparisons) - self.of_other_kernels
        same = f"{self.identical} of {comparable} cells are identical to the baseline's own fixed run"
        if self.of_other_kernels:
            same += f", {self.of_other_kernels} of other kernels were compared as distributions alone"
        if self.passed:
            return [f"passed: {count}; {same}."]
        alarms = [self._sentence(comparison) for comparison in self.alarms]
        return [*alarms, f"FAILED: {len(alarms)} of {count}; {same}.", _ACCEPT_HINT]

    def _row(self, comparison: CellComparison) -> tuple[str, ...]:
        baseline, now = comparison.baseline, comparison.now
        verdict = _describe_direction(comparison) if comparison.differs(self.rate) else "as before"
        return (
            *comparison.cell,
            _format_quartiles(baseline),
            _format_quartiles(now),
            f"{baseline.min():.2f}",
            f"{now.min():.2f}",
            f"{comparison.p_location:.2g}",
            f"{comparison.p_best:.2g}",
            verdict,
        )

    def _sentence(self, comparison: CellComparison) -> str:
        baseline, now, cell = comparison.baseline, comparison.now, comparison.cell
        chance = min(comparison.p_location, comparison.p_best)
        return (
            f"{cell.algorithm} on {cell.problem} is {_describe_direction(comparison)}: "
            f"median {_format_change(quantile(baseline, 0.5), quantile(now, 0.5))}, "
            f"best {_format_change(float(baseline.min()), float(now.min()))}, p = {chance:.2g} after Holm."
        )


def judge_run(baseline: Baseline, now: Ends, rate: float, of_other_kernels: Collection[Cell] = ()) -> CheckVerdict:
    """Compare the ends of the fixed run with the baseline.

    of_other_kernels: cells that depend on the kernels of BLAS, which are not the baseline's.
    """
    identical = sum(
        np.array_equal(np.sort(ends), np.sort(baseline.fixed_run[cell]))
        for cell, ends in now.items()
        if cell not in of_other_kernels
    )
    return CheckVerdict(compare_ends(baseline.ends, now), rate, identical, len(of_other_kernels))


def _describe_direction(comparison: CellComparison) -> str:
    return "WORSE" if comparison.worse else "BETTER than chance allows"


def _format_quartiles(ends: Array) -> str:
    lower = quantile(ends, 0.25)
    median = quantile(ends, 0.5)
    upper = quantile(ends, 0.75)
    return f"{median:.2f} [{lower:.2f}, {upper:.2f}]"


def _format_change(before: float, after: float) -> str:
    factor = f" (x {after / before:.2f})" if np.isfinite(before) and np.isfinite(after) else ""
    return f"{before:.2f} -> {after:.2f}{factor}"
