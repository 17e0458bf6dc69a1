"""The check itself: the fixed run against the baseline, as lines to read and a verdict."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from algorithms.contract import Array
from bench.regression.baseline import Baseline
from bench.regression.comparison import Comparison, compare
from bench.regression.sweep import Ends
from bench.statistics import quantile

_HEADS = ("problem", "algorithm", "baseline", "now", "best", "now", "p median", "p best", "verdict")
_IF_MEANT = "If the problem or an algorithm was meant to change, `armlab regression --update-baseline` accepts this."


@dataclass(frozen=True)
class Verdict:
    """comparisons: of every cell. identical: cells whose ends are those that the baseline's own fixed run had."""

    comparisons: Sequence[Comparison]
    rate: float
    identical: int

    @property
    def alarms(self) -> list[Comparison]:
        """The cells that differ from the baseline."""
        return [comparison for comparison in self.comparisons if comparison.differs(self.rate)]

    @property
    def passed(self) -> bool:
        """Whether no cell differs."""
        return not self.alarms

    def lines(self) -> list[str]:
        """A table of all cells, and below it what is found, a sentence for each cell that differs."""
        return [*_table([_HEADS, *(self._row(comparison) for comparison in self.comparisons)]), *self.sentences()]

    def sentences(self) -> list[str]:
        """What is found, in words."""
        count = f"{len(self.comparisons)} cells, 2 statistics each, family-wise false-alarm rate {self.rate:g}"
        same = f"{self.identical} of {len(self.comparisons)} cells are identical to the baseline's own fixed run"
        if self.passed:
            return [f"passed: {count}; {same}."]
        alarms = [self._sentence(comparison) for comparison in self.alarms]
        return [*alarms, f"FAILED: {len(alarms)} of {count}; {same}.", _IF_MEANT]

    def _row(self, comparison: Comparison) -> tuple[str, ...]:
        baseline, now = comparison.baseline, comparison.now
        verdict = _direction(comparison) if comparison.differs(self.rate) else "as before"
        return (
            *comparison.cell, _quartiles(baseline), _quartiles(now), f"{baseline.min():.2f}", f"{now.min():.2f}",
            f"{comparison.p_location:.2g}", f"{comparison.p_best:.2g}", verdict,
        )  # fmt: skip

    def _sentence(self, comparison: Comparison) -> str:
        baseline, now, cell = comparison.baseline, comparison.now, comparison.cell
        chance = min(comparison.p_location, comparison.p_best)
        return (
            f"{cell.algorithm} on {cell.problem} is {_direction(comparison)}: "
            f"median {_change(quantile(baseline, 0.5), quantile(now, 0.5))}, "
            f"best {_change(float(baseline.min()), float(now.min()))}, p = {chance:.2g} after Holm."
        )


def judge(baseline: Baseline, now: Ends, rate: float) -> Verdict:
    """Compare the ends of the fixed run with the baseline."""
    identical = sum(np.array_equal(np.sort(ends), np.sort(baseline.fixed_run[cell])) for cell, ends in now.items())
    return Verdict(compare(baseline.ends, now), rate, identical)


def _direction(comparison: Comparison) -> str:
    return "WORSE" if comparison.worse else "BETTER than chance allows"


def _quartiles(ends: Array) -> str:
    lower, median, upper = (quantile(ends, share) for share in (0.25, 0.5, 0.75))
    return f"{median:.2f} [{lower:.2f}, {upper:.2f}]"


def _change(before: float, after: float) -> str:
    factor = f" (x {after / before:.2f})" if np.isfinite(before) and np.isfinite(after) else ""
    return f"{before:.2f} -> {after:.2f}{factor}"


def _table(rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
