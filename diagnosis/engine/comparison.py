"""A model beside smaller ones on the same rows: robust covariances, and errors on data that took no part."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from diagnosis.engine.folds import Folds, Gain, folds_of, gain_of
from diagnosis.engine.refine import precision_of
from diagnosis.engine.robust import Scatter, block_numbers, scatter, whitened_rows
from diagnosis.engine.rounds import Round
from diagnosis.engine.segments import rows_of
from diagnosis.engine.solver import Fit, State
from recordings.run import Array

HELD_BLOCK_S = 1.0  # s: stretches of held-out time that are compared


@dataclass(frozen=True, eq=False)
class Comparison:
    """The state of a round beside others, whose groups are its own and some more."""

    found: Round
    state: State
    more: frozenset[int]

    @cached_property
    def wide(self) -> Fit:
        """The fit with everything that is compared."""
        return self.found.solver.fit(State(tuple(sorted({*self.state.groups, *self.more})), self.state.widths))

    @cached_property
    def folds(self) -> Folds:
        """Whitened rows of the wide fit, in folds."""
        found, fit = self.found, self.wide
        rows = whitened_rows(found.columns, {}, fit, found.moments.lengths, found.noise, found.bench.observed)
        links = np.linalg.lstsq(fit.links, fit.coefficients[: len(fit.links)])[0]
        values = np.concatenate([links, fit.coefficients[fit.columns]])
        return folds_of(rows, values, precision_of(found.solver, fit, len(fit.inverse)))

    def scattered(self, state: State) -> Scatter:
        """Robust covariance of the parameters of a state within the wide fit."""
        chosen = self._chosen(state)
        rows, fit = self.folds.rows, self.found.solver.fit(state)
        errors = [
            target - design[:, chosen] @ self._values(fit)
            for target, design in zip(self.folds.targets, rows.designs, strict=True)
        ]
        own = type(rows)(tuple(design[:, chosen] for design in rows.designs), tuple(errors), rows.blocks)
        precision = self.folds.precision[np.ix_(chosen, chosen)]
        return scatter(own, precision, self.found.bench.settings.guards.robust_variance)

    def _values(self, fit: Fit) -> Array:
        links = np.linalg.lstsq(fit.links, fit.coefficients[: len(fit.links)])[0]
        return np.concatenate([links, fit.coefficients[fit.columns]])

    def _chosen(self, state: State) -> list[int]:
        """Where the parameters of a smaller state stand among those of the wide fit."""
        rank = self.wide.links.shape[1]
        at = {int(column): rank + place for place, column in enumerate(self.wide.columns)}
        return [*range(rank), *(at[int(column)] for column in self.found.solver.fit(state).columns)]

    def gains(self, fit: Fit, less: Fit, joints: tuple[int, ...]) -> dict[int, tuple[Gain, Gain]]:
        """Per joint the gain on validation rows, and on identification stretches held out in turn."""
        pair = [self._in_turn(each.state) for each in (less, fit)]
        blocks = self.folds.rows.blocks
        return {
            joint: (self.validated(fit, less, joint), gain_of(pair[0][joint], pair[1][joint], blocks[joint]))
            for joint in joints
        }

    def _in_turn(self, state: State) -> list[Array]:
        """Held-out errors of a state, stretch by stretch; those of the judged state itself are kept."""
        return self._own_errors if state == self.state else self.folds.errors(self._chosen(state))

    @cached_property
    def _own_errors(self) -> list[Array]:
        return self.folds.errors(self._chosen(self.state))

    def validated(self, fit: Fit, less: Fit, joint: int) -> Gain:
        """The gain at a joint on validation rows."""
        observed, noise = self.found.bench.observed, self.found.noise
        left = np.column_stack([self.found.residual_at(joint, each) for each in (less, fit)])
        white = noise.white(left, joint, observed, "validate")
        blocks = noise.numbers(block_numbers(observed, HELD_BLOCK_S), joint, observed, "validate")
        return gain_of(white[:, 0], white[:, 1], blocks)

    def validation_rms(self, fit: Fit, joint: int) -> float:
        """What a fit leaves at a joint on validation rows, N m."""
        observed = self.found.bench.observed
        rows = rows_of(observed.of_role("validate", joint), observed.rows)
        return float(np.sqrt(np.mean(self.found.residual_at(joint, fit)[rows] ** 2)))
