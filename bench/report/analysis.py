"""Everything that the report shows of one problem, computed once."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from armlab.common.arrays import Array
from bench.result_sets.result_set import ResultSet, runs_by_algorithm
from bench.statistics import Summary, is_feasible, quantile, summarise
from bench.statistics.critical_difference import CriticalDifference, block_losses, critical_difference
from bench.statistics.ends import quantile_interval, row_quantiles
from bench.statistics.pairwise import Duel, duels, log_losses
from bench.statistics.performance import (
    CondensedTimes,
    Run,
    area_under_curve,
    condense_times,
    expected_running_time,
    running_times,
    share_reached,
    targets_between,
)

CURVE_POINTS = 60  # at which convergence is drawn
QUARTILES = (0.25, 0.5, 0.75)
BUDGET_SHARES = (0.1, 0.3, 1.0)  # of the evaluations, at which algorithms are rated
TARGET_SHARES = (0.25, 0.5, 0.75)  # of the way from easy to hard, of the targets for which they are


@dataclass(frozen=True, eq=False)
class RunProgress:
    """The runs of one algorithm, condensed, so that more repetitions take no more memory.

    quartiles: of the best so far at the moments (3, moments). hits: running times to the targets. expected: expected
    running time to each target (targets,). area: median area under the curve, NaN if no algorithm found a feasible
    point.
    """

    quartiles: Array
    hits: CondensedTimes
    expected: Array
    area: float


@dataclass(frozen=True, eq=False)
class ProblemAnalysis:
    """One problem, swarm size and budget: its trials, and the progress of its runs by algorithm.

    moments: numbers of evaluations, evenly spaced in the logarithm, from the first population to the budget. targets:
    from the worst of the first feasible values to the best positive one of all, and 0 where it was reached; empty if
    nothing feasible was found. fixed_budget: the best so far at each of BUDGET_SHARES, a row a repetition and a column
    an algorithm. fixed_target: evaluations until each of TARGET_SHARES, likewise.
    """

    label: str
    trials: pd.DataFrame
    moments: Array
    targets: Array
    progress: Mapping[str, RunProgress]
    fixed_budget: tuple[pd.DataFrame, ...]
    fixed_target: tuple[pd.DataFrame, ...]

    @property
    def problem(self) -> str:
        """The label of its problem alone."""
        return str(self.trials["problem"].iloc[0])

    @property
    def algorithms(self) -> list[str]:
        """Labels in the order of the configuration."""
        return list(self.progress)

    @property
    def repetitions(self) -> int:
        """The least number of runs of an algorithm."""
        return int(self.trials["algorithm"].value_counts().min())

    def ends(self, algorithm: str) -> Array:
        """Values at the end (repetitions,), infinite where infeasible."""
        rows = self.trials[self.trials["algorithm"] == algorithm]
        values = rows["value"].to_numpy()
        return np.where(is_feasible(values, rows["violation"].to_numpy()), values, np.inf)

    def summary(self, algorithm: str) -> Summary:
        """Its table row."""
        ends = self.ends(algorithm)
        return summarise(ends, np.zeros(len(ends)))

    def median_interval(self, algorithm: str) -> tuple[float, float]:
        """95 % bootstrap interval of its median."""
        return quantile_interval(self.ends(algorithm))

    def seconds_per_evaluation(self, algorithm: str) -> float:
        """Median processor time of a run over its evaluations, everything included; NaN where no run has one."""
        rows = self.trials[(self.trials["algorithm"] == algorithm) & (self.trials["evaluations"] > 0)]
        return float((rows["seconds"] / rows["evaluations"]).median())

    def work(self, algorithm: str) -> float:
        """The same in a fixed unit, which other machines reproduce: that of the cheapest algorithm on this problem."""
        costs = [self.seconds_per_evaluation(name) for name in self.algorithms]
        return self.seconds_per_evaluation(algorithm) / float(np.nanmin(costs))

    @cached_property
    def losses(self) -> pd.DataFrame:
        """log10 of the ends, a row a repetition and a column an algorithm, an infeasible one worse than all others."""
        return log_losses(self.trials)

    @cached_property
    def ranking(self) -> CriticalDifference:
        """The ranking on this problem, over its repetitions."""
        return critical_difference(self.losses)

    @cached_property
    def all_duels(self) -> list[Duel]:
        """Every pair, Holm over all of them."""
        names = self.algorithms
        return duels(self.trials, [(a, b) for k, a in enumerate(names) for b in names[k + 1 :]])


def analyse_cells(results: ResultSet) -> list[ProblemAnalysis]:
    """All cells in the order of the configuration; the runs of only one cell are in memory at a time."""
    return [analyse_cell(label, trials, runs_by_algorithm(trials, curves)) for label, trials, curves in results.cells()]


def losses_by_problem(cells: Sequence[ProblemAnalysis]) -> pd.DataFrame:
    """Losses to rank: one row a problem, medians, averaged over its swarm sizes and budgets; one column an algorithm.

    With one cell only, one row a repetition.
    """
    losses = block_losses([cell.losses for cell in cells])
    return losses if len(cells) == 1 else losses.groupby([cell.problem for cell in cells], sort=False).mean()


def analyse_cell(label: str, trials: pd.DataFrame, numbered: Mapping[str, Mapping[int, Run]]) -> ProblemAnalysis:
    """A cell from its runs by algorithm and repetition; trials: tidy, of one budget."""
    runs = {name: [by_number[k] for k in sorted(by_number)] for name, by_number in numbered.items()}
    budget = int(trials["budget"].iloc[0])
    first = min(run.evaluations[0] for some in runs.values() for run in some)
    moments = np.unique(np.geomspace(first, max(budget, first), CURVE_POINTS).round())
    targets = _choose_targets([run for some in runs.values() for run in some])
    progress = {name: _summarise_progress(some, moments, targets, budget) for name, some in runs.items()}
    rated = targets[[round(share * (len(targets) - 1)) for share in TARGET_SHARES]] if len(targets) else targets
    return ProblemAnalysis(
        label,
        trials,
        moments,
        targets,
        progress,
        _by_repetition(numbered, lambda run: _best_at(run, np.array(BUDGET_SHARES) * budget), len(BUDGET_SHARES)),
        _by_repetition(numbered, lambda run: running_times(run, rated), len(rated)),
    )


def _by_repetition(
    runs: Mapping[str, Mapping[int, Run]], measure: Callable[[Run], Array], count: int
) -> tuple[pd.DataFrame, ...]:
    """Each of `count` numbers that are measured of a run: a row a repetition, a column an algorithm."""
    found = {name: {number: measure(run) for number, run in of.items()} for name, of in runs.items()}
    return tuple(
        pd.DataFrame({name: {number: values[k] for number, values in of.items()} for name, of in found.items()})
        for k in range(count)
    )


def share_of_targets_reached(cells: Sequence[ProblemAnalysis], algorithm: str, moments: Array) -> Array:
    """Share of targets reached at moments (moments,), over all runs and all cells with targets."""
    found = [cell.progress[algorithm].hits for cell in cells if len(cell.targets)]
    return share_reached(found, moments) if found else np.zeros(len(moments))


def _choose_targets(runs: Sequence[Run]) -> Array:
    found = np.concatenate([run.best[np.isfinite(run.best)] for run in runs])
    positive = found[found > 0]
    if not len(positive):
        return found[:1]  # nothing but 0, or nothing feasible
    easy = max(run.best[np.isfinite(run.best)][0] for run in runs if np.isfinite(run.best).any())
    return targets_between(easy or positive.max(), positive.min(), exact=len(positive) < len(found))


def _summarise_progress(runs: Sequence[Run], moments: Array, targets: Array, budget: int) -> RunProgress:
    best = np.stack([_best_at(run, moments) for run in runs], axis=1)
    times = np.stack([running_times(run, targets) for run in runs])
    spent = np.array([run.evaluations[-1] for run in runs])
    limits = targets[targets > 0]  # a value of 0 counts as the least positive one
    areas = [area_under_curve(run, limits[-1], limits[0], budget) for run in runs] if len(limits) else [np.nan]
    return RunProgress(
        quartiles=np.stack([row_quantiles(best, share) for share in QUARTILES]),
        hits=condense_times(times),
        expected=expected_running_time(times, spent),
        area=quantile(np.array(areas), 0.5),
    )


def _best_at(run: Run, moments: Array) -> Array:
    """The best so far at moments (moments,)."""
    place = np.searchsorted(run.evaluations, moments, side="right") - 1
    return np.where(place < 0, np.inf, run.best[np.maximum(place, 0)])
