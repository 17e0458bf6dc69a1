"""Everything that the page says of one problem, computed once."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from algorithms.contract import Array
from bench.sharing.result_set import ResultSet, runs_of
from bench.statistics import Summary, is_feasible, quantile, summarise
from bench.statistics.anytime import area_under_curve
from bench.statistics.bootstrap import quantile_interval
from bench.statistics.ends import row_quantiles
from bench.statistics.paired import Duel, duels, log_losses
from bench.statistics.targets import Run, expected_running_time, running_times, targets_between

MOMENTS = 60  # at which convergence is drawn
QUARTILES = (0.25, 0.5, 0.75)


@dataclass(frozen=True, eq=False)
class Cell:
    """One problem, swarm size and budget: its trials, and its runs by algorithm (in the order of their repetitions)."""

    label: str
    trials: pd.DataFrame
    runs: dict[str, list[Run]]
    budget: int

    @property
    def algorithms(self) -> list[str]:
        """Labels in the order of the configuration."""
        return list(self.runs)

    @cached_property
    def moments(self) -> Array:
        """Numbers of evaluations, evenly spaced in the logarithm, from the first population to the budget."""
        first = min(run.evaluations[0] for runs in self.runs.values() for run in runs)
        return np.unique(np.geomspace(first, max(self.budget, first), MOMENTS).round())

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

    def convergence(self, algorithm: str) -> tuple[Array, Array, Array]:
        """Lower quartile, median and upper quartile of the best so far at the moments, (moments,) each."""
        best = np.stack([_at(run, self.moments) for run in self.runs[algorithm]], axis=1)
        lower, middle, upper = (row_quantiles(best, share) for share in QUARTILES)
        return lower, middle, upper

    @cached_property
    def targets(self) -> Array:
        """From the worst of the first feasible values to the best of all; empty if nothing feasible was found."""
        firsts = [run.best[np.isfinite(run.best)][:1] for runs in self.runs.values() for run in runs]
        found = np.concatenate(firsts)
        if not len(found):
            return np.zeros(0)
        hard = min(run.best.min() for runs in self.runs.values() for run in runs)
        return targets_between(found.max(), hard) if hard > 0 else np.zeros(0)

    def times(self, algorithm: str, targets: Array) -> Array:
        """Running times (repetitions, targets)."""
        return np.stack([running_times(run, targets) for run in self.runs[algorithm]])

    def expected_times(self, algorithm: str, targets: Array) -> Array:
        """Expected running time to each target (targets,)."""
        spent = np.array([run.evaluations[-1] for run in self.runs[algorithm]])
        return expected_running_time(self.times(algorithm, targets), spent)

    def area(self, algorithm: str) -> float:
        """Median of the area under the convergence curve; NaN if nothing feasible was found by anyone."""
        if not len(self.targets):
            return float("nan")
        worst, best = self.targets[0], self.targets[-1]
        return quantile(
            np.array([area_under_curve(run, best, worst, self.budget) for run in self.runs[algorithm]]), 0.5
        )

    @cached_property
    def losses(self) -> dict[str, Array]:
        """log10 of the ends by algorithm, an infeasible one worse than all others."""
        return log_losses(self.trials)

    @cached_property
    def all_duels(self) -> list[Duel]:
        """Every pair, Holm over all of them."""
        names = self.algorithms
        return duels(self.trials, [(a, b) for k, a in enumerate(names) for b in names[k + 1 :]])


def cells_of(results: ResultSet) -> list[Cell]:
    """All cells in the order of the configuration."""
    return [_cell(*parts) for parts in results.cells()]


def _cell(label: str, trials: pd.DataFrame, curves: pd.DataFrame) -> Cell:
    runs = {name: [by_number[k] for k in sorted(by_number)] for name, by_number in runs_of(curves).items()}
    return Cell(label, trials, runs, int(trials["budget"].iloc[0]))


def block_losses(cells: list[Cell]) -> pd.DataFrame:
    """Losses to rank, a row a problem: medians of log10; with one problem only, a row a repetition."""
    if len(cells) == 1:
        return pd.DataFrame(cells[0].losses)
    return pd.DataFrame([{name: float(np.median(ends)) for name, ends in cell.losses.items()} for cell in cells])


def _at(run: Run, moments: Array) -> Array:
    """The best so far at moments (moments,)."""
    place = np.searchsorted(run.evaluations, moments, side="right") - 1
    return np.where(place < 0, np.inf, run.best[np.maximum(place, 0)])
