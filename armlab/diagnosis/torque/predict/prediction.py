"""The model that predicts: what is named, what every arm has, and what else helps on stretches that are held out.

To name an effect asks what is sure; to predict asks what helps. The names of a search are the start. Friction and
offset of every joint stand beside them, and what many arms have (other laws of friction, rotor inertia) is added part
by part where it lowers the error on blocks of time of the identification runs that are held out in turn. These blocks
also choose the cut-off. Validation runs take no part.
"""

from collections.abc import Container, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.diagnosis.torque.columns.blocks import WhitenedRows, whitened_rows
from armlab.diagnosis.torque.columns.columns import Columns
from armlab.diagnosis.torque.columns.design import DesignMatrix, build_design_matrix
from armlab.diagnosis.torque.columns.links import Widths
from armlab.diagnosis.torque.columns.solver import State
from armlab.diagnosis.torque.predict.yardstick import Yardstick, fit_yardstick
from armlab.diagnosis.torque.rows.data import Observed, observe, rows_in
from armlab.diagnosis.torque.rows.noise import Noise, fit_noise
from armlab.diagnosis.torque.search.fitted_model import FittedModel, fit_values, follow_model
from armlab.diagnosis.torque.search.refine import prior_precision
from armlab.diagnosis.torque.search.search import Search, Step
from armlab.diagnosis.tuning import PredictionTuning
from armlab.effects.contract import Candidate
from armlab.effects.friction_curve import FrictionCurve
from armlab.identification.torque_model import TorqueModel
from armlab.recordings.recording import Role

SMOOTHING_STEP = 2**0.5  # from one cut-off of positions that is tried to the next


@dataclass(frozen=True, eq=False)
class Prediction:
    """A model that predicts. places: of its groups, by the number that each has in the model of the names; what is not
    claimed there is present here. held_out: ||tau - tau_hat|| / ||tau|| of the filtered torque on blocks held out in
    turn; squared_errors: of each joint there, (joints,). judged, block: the rows of that, and the block of each. plain:
    least squares beside it, None where it could not be fitted.
    """

    model: FittedModel
    places: dict[int, int]
    held_out: float
    squared_errors: Array
    judged: Observed
    block: NDArray[np.intp]
    plain: Yardstick | None

    def with_names_alone(self, names: Iterable[int]) -> FittedModel:
        """The model fitted with some of its groups alone."""
        return replace(self.model, state=State(tuple(sorted(names)), self.model.state.widths))


def fit_prediction(named: FittedModel) -> Prediction:
    """The model that predicts, from one with the names that hold."""
    tuning = named.design.settings.tuning.prediction
    groups = named.solver.groups
    own = named.state.groups
    more = [number for number, group in enumerate(groups) if number not in own and _may_help(group.candidate)]
    numbers = (*own, *more)
    candidates = [groups[number].candidate for number in more]
    candidates = [*(_of_found_size(named, number) for number in own), *candidates]
    start = tuple(range(len(own)))
    own_design = replace(named.design, blocks=tuple(named.design.blocks[number] for number in numbers))
    observed = named.design.observed
    plain = fit_yardstick(named.design.simulation.arm, observed)
    cutoff = observed.cutoff_hz if plain is None else min(plain.cutoff_hz, observed.cutoff_hz)
    smooth = _design_at(named, candidates, cutoff, position_ratio=1.0)
    judge = _Judge.of(smooth if _has_rows(smooth.observed) else own_design)
    best = _improved(_Trial.of(own_design, start, named.state, named.noise, judge), tuning)
    if cutoff < observed.cutoff_hz:
        design = _design_at(named, candidates, cutoff)
        if _has_rows(design.observed):
            best = _better(best, [_improved(_Trial.of(design, start, named.state, None, judge), tuning)], tuning)
    design, noise = best.trial.model.design, best.trial.model.noise
    known = [
        _improved(_Trial.of(design, start, State(named.state.groups, widths), noise, judge), tuning)
        for widths in _widths_of_known_links(named)
    ]
    best = _better(best, known, tuning)
    model = _settled(replace(best.trial.model, state=best.state), tuning)
    places = {group: place for place, group in enumerate(numbers) if place in best.state.groups}
    squares, judged = best.trial.errors(best.state).sum(axis=0), judge.observed
    return Prediction(model, places, best.held_out, squares, judged, judge.blocks(judged), plain)


def _may_help(law: Candidate) -> bool:
    """Whether it is what many arms have, and foretells nothing absurd of faster motions."""
    return law.facts.common and not law.outgrows_speed


def _of_found_size(named: FittedModel, number: int) -> Candidate:
    """A law of a model; a friction curve has a prior of its size, because slower signals do not tell of its details."""
    law = named.candidate(number)
    if not isinstance(law, FrictionCurve):
        return law
    return replace(law, largest=float(np.abs(np.cumsum(named.solver.values(named.fit, number))).max()))


def _better(usual: "_Improved", others: Sequence["_Improved"], tuning: PredictionTuning) -> "_Improved":
    """The best of some trials, where it is better by more than a small share than the usual one."""
    best = min(others, key=lambda each: each.held_out, default=usual)
    return best if best.held_out < (1 - tuning.min_trial_gain) * usual.held_out else usual


def _settled(model: FittedModel, tuning: PredictionTuning) -> FittedModel:
    """The model with columns that follow itself: a large gain is a share of a torque that it changes.

    Fitted anew until the torque hardly changes. The model as it is where it has no such columns, or where it does not
    settle, which its log says.
    """
    if not any(model.candidate(group).follows_model for group in model.state.groups):
        return model
    present, residual = model, model.residual(model.fit)
    for _ in range(tuning.max_follow_rounds):
        design = follow_model(present.design, present)
        present = replace(fit_with_prior(design, present.noise, present.state.widths), state=present.state)
        left = present.residual(present.fit)
        change = np.sum((left - residual) ** 2)
        residual = left
        if change < tuning.follow_tolerance**2 * np.sum(left**2):
            return present
    why = f"not settled after {tuning.max_follow_rounds} rounds: columns that follow the model stay as they were"
    return replace(model, steps=(*model.steps, Step(why, 0.0)))


def _has_rows(observed: Observed) -> bool:
    """Whether every joint has stretches in motion that identify, and some that validate."""
    roles: tuple[Role, ...] = ("identify", "validate")
    return all(observed.of_role(role, joint) for role in roles for joint in range(observed.joints))


def _widths_of_known_links(model: FittedModel) -> list[Widths]:
    """How far all links may be from a robot file that holds them, where the names stand beside free links."""
    if model.state.widths is not None or model.design.prior is None:
        return []
    tuning = model.design.settings.tuning.prediction
    return [(width,) * model.design.prior.links for width in tuning.link_widths]


def _design_at(
    model: FittedModel, candidates: Sequence[Candidate], cutoff_hz: float, position_ratio: float | None = None
) -> DesignMatrix:
    """The design of these candidates with another cut-off; columns follow the model as it is fitted.

    position_ratio: of the positions' cut-off to it, as in the settings where it is left out.
    """
    design = model.design
    usual = design.settings.tuning.data
    ratio = position_ratio or usual.position_cutoff_ratio
    data = replace(usual, cutoff_hz=cutoff_hz, min_cutoff_hz=cutoff_hz, position_cutoff_ratio=ratio)
    settings = replace(design.settings, tuning=replace(design.settings.tuning, data=data))
    runs = [each.run for each in design.observed.signals]
    observed = observe(runs, design.simulation.arm, design.simulation.inertial, settings)
    fresh = build_design_matrix(observed, design.simulation, design.base, design.prior, settings)
    moved = follow_model(replace(fresh, offsets=design.offsets), model)
    return replace(moved, blocks=tuple(moved.blocks_of([(each, 0) for each in candidates])))


@dataclass(frozen=True, eq=False)
class _Judge:
    """The identification rows that judge every trial: one filter of torque and positions, whatever that of a trial.

    edges: of each run the stamps at which another block of time begins, s, and the number of its first block.
    """

    observed: Observed
    columns: Columns
    edges: tuple[tuple[Array, int], ...]

    @classmethod
    def of(cls, design: DesignMatrix) -> "_Judge":
        """The rows of a design; blocks are alike long."""
        observed, count = design.observed, design.settings.tuning.blocks.folds
        rows = rows_in(observed.of_role("identify"), observed.rows)
        run = np.concatenate([np.full(len(each.torque), index) for index, each in enumerate(observed.signals)])
        block = np.zeros(observed.rows, dtype=np.intp)
        block[rows] = np.arange(rows.sum()) * count // rows.sum()
        edges = []
        for index in range(len(observed.signals)):
            own = rows & (run == index)
            numbers = np.unique(block[own])
            begins = [float(observed.time[own & (block == number)][0]) for number in numbers]
            edges.append((np.array(begins[1:]), int(numbers[0]) if len(numbers) else 0))
        return cls(observed, design.columns, tuple(edges))

    def blocks(self, observed: Observed) -> NDArray[np.intp]:
        """The block of time of each row (rows,) of the same runs, whatever their cut-off."""
        parts = []
        for each, (begins, first) in zip(observed.signals, self.edges, strict=True):
            parts.append(first + np.searchsorted(begins, each.time - each.run.time[0], "right"))
        return np.concatenate(parts).astype(np.intp)


@dataclass(frozen=True, eq=False)
class _Trial:
    """A design on which structures are compared. begin: named effects and the usual ones of every joint.

    rows, judged: of all columns, whitened, and as the judge has them, the identification rows of each joint. fitting,
    judging: the block of time of each of those rows.
    """

    model: FittedModel
    names: tuple[int, ...]
    begin: State
    rows: WhitenedRows
    judged: WhitenedRows
    fitting: tuple[NDArray[np.intp], ...]
    judging: tuple[NDArray[np.intp], ...]

    @classmethod
    def of(
        cls, design: DesignMatrix, names: tuple[int, ...], state: State, noise: Noise | None, judge: _Judge
    ) -> "_Trial":
        """noise: white with the scatter that the named and usual effects leave, where it is left out."""
        observed, tuning = design.observed, design.settings.tuning
        if noise is None:
            plain = fit_noise(design.target, observed, 0.0, tuning.noise, colour=False)
            first = fit_with_prior(design, plain, state.widths)
            left = first.residual(first.solver.fit(with_usual(first, names)))
            noise = fit_noise(left, observed, 0.0, tuning.noise, colour=False)
        model = fit_with_prior(design, noise, state.widths)
        everything = model.solver.fit(State(tuple(range(len(model.solver.groups))), state.widths))
        unit, lengths = _unit_noise(judge.observed), model.moments.lengths
        rows = whitened_rows(design.columns, {}, everything, lengths, noise, observed)
        raw = whitened_rows(judge.columns, {}, everything, lengths, unit, judge.observed)
        values, joints = fit_values(everything), range(observed.joints)
        own, judged = judge.blocks(observed), judge.blocks(judge.observed)
        return cls(
            model,
            names,
            with_usual(model, names),
            _targets(rows, values),
            _targets(raw, values),
            tuple(noise.numbers(own, joint, observed, "identify") for joint in joints),
            tuple(unit.numbers(judged, joint, judge.observed, "identify") for joint in joints),
        )

    @property
    def _folds(self) -> int:
        return self.model.design.settings.tuning.blocks.folds

    @cached_property
    def _normal(self) -> tuple[Array, Array]:
        """Normal equations without each fold: (folds, parameters, parameters) and (folds, parameters)."""
        count, size = self._folds, self.rows.designs[0].shape[1]
        grams, products = np.zeros((count, size, size)), np.zeros((count, size))
        for design, target, fold in zip(self.rows.designs, self.rows.errors, self.fitting, strict=True):
            for number in range(count):
                own = fold == number
                grams[number] += design[own].T @ design[own]
                products[number] += design[own].T @ target[own]
        return grams.sum(axis=0) - grams + self._precision, products.sum(axis=0) - products

    @cached_property
    def _precision(self) -> Array:
        everything = self.model.solver.fit(State(tuple(range(len(self.model.solver.groups))), self.begin.widths))
        return prior_precision(self.model.solver, everything, self.rows.designs[0].shape[1])

    @cached_property
    def _products(self) -> list[tuple[NDArray[np.intp], Array]]:
        """Per joint the own columns and their products on each fold, (folds, columns + 1, columns + 1), torque last."""
        out = []
        for design, target, fold in zip(self.judged.designs, self.judged.errors, self.judging, strict=True):
            used = np.flatnonzero(np.any(design != 0, axis=0))
            both = np.column_stack([design[:, used], target])
            parts = (both[fold == number] for number in range(self._folds))
            out.append((used, np.stack([part.T @ part for part in parts])))
        return out

    def errors(self, state: State) -> Array:
        """Squared error of the torque on each fold as it is held out, (folds, joints)."""
        grams, products = self._normal
        rank = self.model.solver.fit(self.begin).links.shape[1]
        own = [np.arange(rank), *(self._columns(group, rank) for group in state.groups)]
        columns = np.concatenate(own).astype(np.intp)
        values = np.zeros(products.shape)
        own_grams = grams[:, columns[:, None], columns]
        values[:, columns] = np.linalg.solve(own_grams, products[:, columns, None])[:, :, 0]
        out = []
        for used, judged in self._products:
            full = np.column_stack([-values[:, used], np.ones(len(values))])[:, :, None]
            out.append((full.transpose(0, 2, 1) @ judged @ full)[:, 0, 0])
        return np.column_stack(out)

    def _columns(self, group: int, rank: int) -> NDArray[np.intp]:
        return self.model.solver.groups[group].columns - len(self.model.design.base) + rank

    @cached_property
    def power(self) -> float:
        """Squared length of the torque that is to be explained, of all joints."""
        return float(sum(target @ target for target in self.judged.errors))

    def held_out(self, state: State) -> float:
        """||tau - tau_hat|| / ||tau|| over all joints on the folds held out in turn."""
        return float(np.sqrt(np.sum(self.errors(state)) / self.power))

    def _scores(self, state: State) -> Array:
        """Sum of the logarithms of the joints' errors on each fold, (folds,): a small joint counts as a large one."""
        return np.asarray(0.5 * np.sum(np.log(np.maximum(self.errors(state), 1e-300)), axis=1))

    def improve(self, tuning: PredictionTuning) -> State:
        """The best of the changes, one after the other, until none lowers the errors enough, and surely enough."""
        state, scores = self.begin, self._scores(self.begin)
        search = Search(self.model.solver, self.model.design.settings, True, 0)
        absurd = {group for group in state.groups if search.objection(state, group) is not None}
        while True:
            changes = [(scores - self._scores(other), other) for other in self._changes(search, state)]
            worth = [each for each in changes if _is_sure(each[0], tuning)]
            worth.sort(key=lambda each: -float(np.mean(each[0])))
            better = next((each for each in worth if self._is_physical(search, each[1], absurd)), None)
            if better is None:
                return state
            scores, state = scores - better[0], better[1]

    def _is_physical(self, search: Search, state: State, absurd: Container[int]) -> bool:
        """Whether no group breaks a law of physics; absurd: those that did so before."""
        return all(
            search.objection(state, group) is None
            and (group in self.names or not _outgrows_friction(self.model, state, group))
            for group in state.groups
            if group not in absurd
        )

    def _changes(self, search: Search, state: State) -> Iterator[State]:
        for group in range(len(self.model.solver.groups)):
            if group in state.groups:
                if group not in self.names:
                    yield state.minus(group)
            elif not search.excluded(state, group):
                other = search.in_place(state, group)
                if set(self.names) <= set(other.groups):
                    yield other


@dataclass(frozen=True, eq=False)
class _Improved:
    """A trial with the parts that help its predictions, and the error of that on blocks held out in turn."""

    trial: _Trial
    state: State
    held_out: float


def _improved(trial: _Trial, tuning: PredictionTuning) -> _Improved:
    state = trial.improve(tuning)
    return _Improved(trial, state, trial.held_out(state))


def _unit_noise(observed: Observed) -> Noise:
    """White noise of one newton metre, at rest too."""
    joints, ones = observed.joints, np.ones(observed.rows)
    return Noise((np.ones(1),) * joints, (1.0,) * joints, (ones,) * joints, (False,) * joints)


def _is_sure(gains: Array, tuning: PredictionTuning) -> bool:
    """Whether gains (folds,) are large, and larger than their scatter between folds would make them."""
    error = float(np.std(gains, ddof=1)) / np.sqrt(len(gains))
    return bool(np.mean(gains) > max(tuning.min_gain, tuning.min_standard_errors * error))


def fit_with_prior(design: DesignMatrix, noise: Noise, widths: Widths | None) -> FittedModel:
    """A model without any law yet; laws whose size is not known have a prior of the size of the torque."""
    moments, solver = design.solver(noise, as_large_as_torque=True)
    return FittedModel(design, noise, moments, solver, State((), widths))


def with_usual(model: FittedModel, names: tuple[int, ...]) -> State:
    """Named effects, and the usual ones that none of them replaces and that physics allows."""
    search = Search(model.solver, model.design.settings, True, 0)
    state = State(names, model.state.widths)
    for number, group in enumerate(model.solver.groups):
        if group.candidate.facts.usual and number not in names and not search.excluded(state, number):
            state = state.plus(number)
    for number in sorted(set(state.groups) - set(names)):
        if search.objection(state, number) is not None or _outgrows_friction(model, state, number):
            state = state.minus(number)
    return state


def _outgrows_friction(model: FittedModel, state: State, group: int) -> bool:
    """Whether a usual part that does not dissipate, an offset, is larger than the friction of its joint.

    Offsets of real arms are 5 to 30 % of the friction level (tables of TX40, UR10 and EMPS). A larger one stands for
    gravity, or for a spring, that the motion does not separate from it.
    """
    groups, fit = model.solver.groups, model.solver.fit(state)
    own = groups[group].candidate
    if not own.facts.usual or own.facts.dissipates:
        return False
    beside = [
        groups[each].columns
        for each in state.groups
        if own.joint is not None and groups[each].candidate.is_friction_of(own.joint)
    ]
    friction = np.concatenate([*beside, np.empty(0, dtype=np.intp)]).astype(np.intp)
    power = fit.coefficients[friction] @ model.moments.gram[np.ix_(friction, friction)] @ fit.coefficients[friction]
    return bool(np.sum(fit.coefficients[groups[group].columns] ** 2) > power)


def _targets(rows: WhitenedRows, values: Array) -> WhitenedRows:
    """The rows with the torque in the place of the errors of a fit."""
    targets = tuple(error + design @ values for error, design in zip(rows.errors, rows.designs, strict=True))
    return replace(rows, errors=targets)


def choose_smoothing(model: TorqueModel, plain: Yardstick | None, observed: Observed) -> TorqueModel:
    """The model with the cut-off of positions that predicts the torque of the identification runs best, as recorded.

    From the cut-off of plain least squares it goes up, and then down, as long as that helps.
    """
    if model.cutoff_hz is None or plain is None:
        return model
    rows = rows_in(observed.of_role("identify"), observed.rows)

    def tried(factor: float) -> tuple[float, TorqueModel]:
        smoothed = replace(model, position_factor=factor)
        return float(np.sum(recorded_residual(smoothed, observed)[rows] ** 2)), smoothed

    error, best = tried(plain.cutoff_hz / model.cutoff_hz)
    for step in (SMOOTHING_STEP, 1 / SMOOTHING_STEP):
        other, smoothed = tried(best.position_factor * step)
        while other < error:
            error, best = other, smoothed
            other, smoothed = tried(best.position_factor * step)
    return best


def with_smoothing_of(model: TorqueModel, other: TorqueModel) -> TorqueModel:
    """Another model that smooths positions as a model does."""
    if model.cutoff_hz is None or other.cutoff_hz is None:
        return other
    return replace(other, position_factor=model.position_factor * model.cutoff_hz / other.cutoff_hz)


def filtered_residual(model: TorqueModel, observed: Observed) -> Array:
    """Measured torque less that of a model through the same filter, (rows, joints), N m (N)."""
    return np.concatenate([each.torque - each.filter(model.predict(each.run)) for each in observed.signals])


def recorded_residual(model: TorqueModel, observed: Observed) -> Array:
    """Torque as recorded less that of a model at the kept rows, (rows, joints), N m (N)."""
    return np.concatenate([(each.run.torque - model.predict(each.run))[each.filter.rows] for each in observed.signals])
