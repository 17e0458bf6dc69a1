"""Fits and scores any set of groups from the moments alone: generalised least squares with a prior on the links.

The score of a set is a log evidence: half the explained chi-square, less half the log determinant of what the data tell
about the links beyond their prior, less a price for each group (Schwarz 1978 for its parameters, and the log of the
number of places that were looked at: Chen and Chen 2008, extended BIC with gamma = 1).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from armlab.common.arrays import Array
from armlab.diagnosis.torque.columns.columns import Group, Moments
from armlab.diagnosis.torque.columns.inverses import inverse_of
from armlab.diagnosis.torque.columns.links import LinkPrior, Widths
from armlab.diagnosis.tuning import SolverTuning
from armlab.effects.contract import Candidate

MAX_OVERSHOOT = 0.1  # of a law of the simulation, by which a finding may take off more than all of it (chosen by eye)
ROUNDING = 1e-9  # of the squared length of a column: added, so that columns that hold each other stop no fit
LEAST_UNABSORBED = 1e-6  # of the squared length of a column: where others leave less of it, it is not seen
MAX_KEPT_FITS = 500  # of a solver: of seven joints each takes 50 kB, and 2 % more are fitted anew than with any more


@dataclass(frozen=True)
class State:
    """The groups of a model by number, ascending; widths: of the links' errors, None where base parameters are free."""

    groups: tuple[int, ...]
    widths: Widths | None

    def plus(self, group: int) -> "State":
        """With one more group."""
        return State(tuple(sorted({*self.groups, group})), self.widths)

    def minus(self, group: int) -> "State":
        """Without a group."""
        return State(tuple(each for each in self.groups if each != group), self.widths)


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted state. coefficients: (size,) of scaled columns. score: log evidence less prices.

    columns: of the effects in the model, scaled; links: factor (base, rank) of the links' errors.
    inverse: (rank + columns, rank + columns), the covariance where errors are as the noise model says.
    """

    state: State
    coefficients: Array
    score: float
    chi_square: float
    columns: NDArray[np.intp]
    links: Array
    inverse: Array


@dataclass(frozen=True, eq=False)
class LinkColumns:
    """Links' errors in the normal equations. factor: (base, rank). products: with all columns, (rank, size + 1).

    own: with each other, the prior's precision added, (rank, rank). price: of a score.
    """

    factor: Array
    products: Array
    own: Array
    precision: float
    price: float


class Solver:
    """Solves and scores states. groups: of the columns. prior: None where there is no nominal model.

    places: number of places that are looked at, the factor of the correction. scales: of each group's coefficients.
    simulated: the coefficients that the simulation has of each group's law already, to which what is fitted adds.
    expected: numbers of usual friction of joints of whose friction the simulation says nothing.
    """

    def __init__(
        self,
        moments: Moments,
        groups: Sequence[Group],
        base: int,
        prior: LinkPrior | None,
        places: int,
        scales: Sequence[float],
        simulated: Sequence[Array],
        expected: frozenset[int],
        tuning: SolverTuning,
    ) -> None:
        self.moments, self.groups, self.base, self.prior, self.places = moments, groups, base, prior, places
        self.simulated, self.expected, self.tuning = simulated, expected, tuning
        self.precisions = self._precisions(scales)
        self._links: dict[Widths | None, LinkColumns] = {}
        self._fits: dict[State, Fit] = {}  # those that were asked for last
        self._held: dict[State, Fit] = {}
        self._rests: tuple[State, dict[int, tuple[Array, Array]]] | None = None  # of the state that was asked for last
        self._contained: dict[int, tuple[int, ...]] = {}

    def _precisions(self, scales: Sequence[float]) -> Array:
        """Prior precision of each scaled column, (size,)."""
        out = np.full(self.moments.size, ROUNDING)
        for group, scale in zip(self.groups, scales, strict=True):
            out[group.columns] += 1 / (scale * self.moments.lengths[group.columns]) ** 2
        return out

    def candidate(self, group: int) -> Candidate:
        """The effect of a group of columns, at its place."""
        return self.groups[group].candidate

    def objection(self, group: int, values: Array, covariance: Array) -> str | None:
        """What physics says against a group with these coefficients beside those of the simulation.

        Where the arm does not have a law of the simulation, the group takes it off, and a little more by chance.
        """
        candidate, present = self.candidate(group), (1 + MAX_OVERSHOOT) * self.simulated[group]
        return candidate.absurdity(values) or candidate.objection(values + present, covariance)

    @cached_property
    def prices(self) -> Array:
        """Price of each group, in units of log likelihood."""
        return np.array([self._price(number, group) for number, group in enumerate(self.groups)])

    @cached_property
    def ranks(self) -> NDArray[np.intp]:
        """Independent columns of each group."""
        out = np.zeros(len(self.groups), dtype=np.intp)
        for numbers, offered in self._by_width.values():
            values = np.linalg.eigvalsh(self.moments.gram[offered[:, :, None], offered[:, None, :]])
            least = LEAST_UNABSORBED * np.maximum(values[:, -1:], 1e-300)
            out[numbers] = np.sum(values > least, axis=1)
        return out

    def _price(self, number: int, group: Group) -> float:
        rows = sum(self.moments.rows[row] for row in group.candidate.rows)
        parameters = self.ranks[number] + len(group.candidate.shape)
        tried = 1 if group.candidate.facts.usual else self.places * group.candidate.looks
        return float(0.5 * parameters * np.log(max(rows, 2)) + np.log(tried))

    @cached_property
    def unusual(self) -> NDArray[np.bool_]:
        """Which groups are no friction or offset as every arm has them."""
        return np.array([not each.candidate.facts.usual for each in self.groups], dtype=bool)

    @cached_property
    def replaces(self) -> NDArray[np.bool_]:
        """Which groups take the place of which others at their joint, (groups, groups)."""
        out = np.zeros((len(self.groups), len(self.groups)), dtype=bool)
        numbers: dict[tuple[str, int | None], list[int]] = {}
        for number, candidate in enumerate(each.candidate for each in self.groups):
            numbers.setdefault((candidate.effect, candidate.joint), []).append(number)
        for number, candidate in enumerate(each.candidate for each in self.groups):
            for effect in candidate.replaces:
                out[number, numbers.get((effect, candidate.joint), [])] = True
        return out

    def is_held(self, state: State, group: int) -> bool:
        """Whether a state keeps a group: usual friction of a joint at which no other law of friction stands."""
        others = (self.candidate(each) for each in state.groups if self.unusual[each])
        joint = self.candidate(group).joint
        return group in self.expected and not any(each.is_friction and each.joint == joint for each in others)

    def contained(self, number: int) -> tuple[int, ...]:
        """Numbers of the simpler effects that a group contains and has to be better than."""
        if number not in self._contained:
            own = self.candidate(number)
            self._contained[number] = tuple(
                other
                for other, each in enumerate(self.groups)
                if each.candidate.joint == own.joint
                and (
                    each.candidate.effect in own.facts.contains
                    or (each.candidate.effect in own.replaces and each.candidate.facts.usual)
                )
            )
        return self._contained[number]

    def crowd(self, groups: Sequence[int]) -> int:
        """How many unusual effects there are."""
        return int(np.sum(self.unusual[list(groups)]))

    def links(self, widths: Widths | None) -> LinkColumns:
        """The links' errors as columns of the normal equations."""
        if widths not in self._links:
            self._links[widths] = self._linked(widths)
        return self._links[widths]

    def _linked(self, widths: Widths | None) -> LinkColumns:
        gram, base = self.moments.gram, self.base
        if widths is None or self.prior is None:
            precision = 10 * ROUNDING
            return LinkColumns(np.eye(base), gram[:base], gram[:base, :base] + precision * np.eye(base), precision, 0.0)
        if not any(widths):
            return LinkColumns(np.empty((base, 0)), np.empty((0, len(gram))), np.empty((0, 0)), 1.0, 0.0)
        factor = self.prior.factor(widths, self.moments.lengths[:base])
        products = factor.T @ gram[:base]
        inner = products[:, :base] @ factor
        own = np.eye(len(inner)) + inner
        occam = 0.5 * float(np.linalg.slogdet(own)[1])
        sizes = {width for width in widths if width}
        some = sum(1 for width in widths if width) if len(set(widths)) > 1 else 0
        price = 0.5 * len(sizes) * np.log(sum(self.moments.rows)) + some * np.log(self.places)
        return LinkColumns(factor, products, own, 1.0, occam + float(price))

    def fit(self, state: State) -> Fit:
        """The fit of a state, kept for the next question."""
        return self._held.get(state) or self.free_fit(state)

    def free_fit(self, state: State) -> Fit:
        """The fit of a state that no constraint holds."""
        fit = self._fits.pop(state, None) or self._fitted(state)
        self._fits[state] = fit  # as the last one
        if len(self._fits) > MAX_KEPT_FITS:
            del self._fits[next(iter(self._fits))]
        return fit

    def hold(self, state: State, coefficients: Array) -> None:
        """Keeps coefficients (size,) as the fit of a state: what a constraint that columns do not know has made them.

        Scores and covariances are those of the free fit, the chi-square that of these coefficients.
        """
        free, gram = self.free_fit(state), self.moments.gram
        chi_square = float(2 * coefficients @ gram[:-1, -1] - coefficients @ gram[:-1, :-1] @ coefficients)
        score = free.score - max(free.chi_square - chi_square, 0.0) / 2
        self._held[state] = replace(free, coefficients=coefficients, chi_square=chi_square, score=score)

    def _columns(self, state: State) -> NDArray[np.intp]:
        parts = [self.groups[group].columns for group in state.groups]
        return np.concatenate(parts).astype(np.intp) if parts else np.empty(0, dtype=np.intp)

    def system(self, state: State) -> tuple[Array, NDArray[np.intp]]:
        """Matrix of the normal equations, and the effects' columns."""
        links, columns = self.links(state.widths), self._columns(state)
        rank = len(links.own)
        matrix = np.empty((rank + len(columns), rank + len(columns)))
        matrix[:rank, :rank] = links.own
        matrix[:rank, rank:] = links.products[:, columns]
        matrix[rank:, :rank] = matrix[:rank, rank:].T
        matrix[rank:, rank:] = self.moments.gram[np.ix_(columns, columns)]
        at = np.arange(rank, len(matrix))
        matrix[at, at] += self.precisions[columns]
        return matrix, columns

    def products(self, state: State, columns: NDArray[np.intp] | slice = slice(None)) -> Array:
        """Products of what a state has in its normal equations with columns, all by default, the torque the last."""
        links = self.links(state.widths).products[:, columns]
        return np.vstack([links, self.moments.gram[self._columns(state)][:, columns]])

    def _fitted(self, state: State) -> Fit:
        matrix, columns = self.system(state)
        links = self.links(state.widths)
        factor, price = links.factor, links.price
        coefficients = np.zeros(self.moments.size)
        chi_square, inverse = 0.0, np.empty((0, 0))
        if len(matrix):
            inverse = inverse_of(matrix)
            towards = np.concatenate([links.products[:, -1], self.moments.gram[columns, -1]])
            solution = inverse @ towards
            chi_square = float(solution @ towards)
            rank = factor.shape[1]
            coefficients[: self.base] = factor @ solution[:rank]
            coefficients[columns] = solution[rank:]
        count = self.crowd(state.groups)
        price += float(np.sum(self.prices[list(state.groups)])) + self.tuning.crowd_penalty * count * (count - 1) / 2
        score = 0.5 * chi_square - price
        return Fit(state, coefficients, score, chi_square, columns, factor, inverse)

    def gains(self, state: State, but: int | None = None) -> Array:
        """How much each group would raise the score, were it added: (groups,). but: a group of the state to go without.

        What is absorbed by others counts for nothing.
        """
        return self._gains(state, but, LEAST_UNABSORBED)

    def gains_at_most(self, state: State, but: int | None = None) -> Array:
        """The same, no less than what a fit finds: what is absorbed counts."""
        return self._gains(state, but, ROUNDING)

    def _gains(self, state: State, but: int | None, ridge: float) -> Array:
        """ridge: of columns of unit length.

        With W what the state makes of all columns and A the part of its covariance that belongs to the group, the
        columns that are left without it have the products W' A^-1 W more.
        """
        if self._rests is None or self._rests[0] != state:
            self._rests = state, self._what_is_left(state)
        rests, out, freed = self._rests[1], np.empty(len(self.groups)), None
        if but is not None:
            freed, state = self._of_group(state, but), state.minus(but)
        for width, (numbers, offered) in self._by_width.items():
            rest, towards = rests[width]
            if freed is not None:
                one, other = freed[0][:, offered], freed[1][:, offered]  # (columns of `but`, groups, width)
                rest = rest + np.einsum("rgi,rgj->gij", one, other)
                towards = towards + np.einsum("rgi,r->gi", one, freed[1][:, -1])
            solved = np.linalg.solve(rest + ridge * np.eye(width), towards[:, :, None])[:, :, 0]
            out[numbers] = 0.5 * np.sum(towards * solved, axis=1)
        return out - self.prices - self.tuning.crowd_penalty * self.crowd(state.groups) * self.unusual

    def _of_group(self, state: State, group: int) -> tuple[Array, Array]:
        """Two matrices (columns of a group, size + 1): their product is what a state explains with it alone."""
        fit, links = self.fit(state), self.links(state.widths)
        place, rank = self._place(fit, group), len(links.own)
        weights = (
            fit.inverse[place, :rank] @ links.products + fit.inverse[place, rank:] @ self.moments.gram[fit.columns]
        )
        return weights, np.asarray(np.linalg.solve(fit.inverse[place, place], weights), dtype=np.float64)

    def _place(self, fit: Fit, group: int) -> slice:
        """Where a group's coefficients stand in a fit's covariance."""
        columns = self.groups[group].columns
        at = fit.links.shape[1] + int(np.flatnonzero(fit.columns == columns[0])[0])
        return slice(at, at + len(columns))

    @cached_property
    def _by_width(self) -> dict[int, tuple[NDArray[np.intp], NDArray[np.intp]]]:
        widths: dict[int, list[int]] = {}
        for number, group in enumerate(self.groups):
            widths.setdefault(len(group.columns), []).append(number)
        return {
            width: (np.array(numbers), np.stack([self.groups[number].columns for number in numbers]))
            for width, numbers in widths.items()
        }

    def _what_is_left(self, state: State) -> dict[int, tuple[Array, Array]]:
        """Products of groups, (groups, width, width), and with the torque, less what a state explains, by width."""
        matrix, gram, out = self.system(state)[0], self.moments.gram, {}
        whole = np.zeros((0, self.moments.size + 1))
        if len(matrix):
            whole = solve_triangular(np.linalg.cholesky(matrix), self.products(state), lower=True)
        for width, (_, offered) in self._by_width.items():
            part = whole[:, offered]  # (rows, groups, width)
            rest = gram[offered[:, :, None], offered[:, None, :]] - np.einsum("rgi,rgj->gij", part, part)
            rest += self.precisions[offered][:, :, None] * np.eye(width)
            out[width] = rest, gram[offered, -1] - np.einsum("rgi,r->gi", part, whole[:, -1])
        return out

    def losses(self, fit: Fit) -> dict[int, float]:
        """How much the score changes where a group of the model is taken out."""
        rank, at = fit.links.shape[1], 0
        crowd, out = self.tuning.crowd_penalty * (self.crowd(fit.state.groups) - 1), {}
        for group in fit.state.groups:
            count = len(self.groups[group].columns)
            place = slice(rank + at, rank + at + count)
            values = fit.coefficients[self.groups[group].columns]
            lost = 0.5 * float(values @ np.linalg.pinv(fit.inverse[place, place], hermitian=True) @ values)
            out[group] = float(self.prices[group]) + crowd * float(self.unusual[group]) - lost
            at += count
        return out

    def covariance(self, fit: Fit, group: int) -> Array:
        """Covariance of a group's coefficients, in units of its unscaled columns."""
        place, lengths = self._place(fit, group), self.moments.lengths[self.groups[group].columns]
        return np.asarray(fit.inverse[place, place] / np.outer(lengths, lengths))

    def values(self, fit: Fit, group: int) -> Array:
        """A group's coefficients of unscaled columns."""
        columns = self.groups[group].columns
        return np.asarray(fit.coefficients[columns] / self.moments.lengths[columns])
