"""Rounds of fitting: noise from what is left, the search, better shapes, and columns that follow the new model."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.torque.columns.blocks import Folds, split_folds, whitened_rows
from armlab.diagnosis.torque.columns.columns import Columns, Moments
from armlab.diagnosis.torque.columns.design import DesignMatrix
from armlab.diagnosis.torque.columns.links import Widths
from armlab.diagnosis.torque.columns.solver import Fit, Solver, State
from armlab.diagnosis.torque.rows.features import flexible_features, motion_banks
from armlab.diagnosis.torque.rows.noise import Noise, choose_noise, error_colours, fit_noise
from armlab.diagnosis.torque.search.refine import prior_precision, refine_shapes
from armlab.diagnosis.torque.search.search import Search, Step, background_state
from armlab.diagnosis.torque.search.surrogate import fold_features, predict_structure
from armlab.effects.contract import Candidate, Family, Scene
from armlab.effects.model import FittedEffect, torque_in_mechanism
from problem.regressor import rigid_body_torque

OFFSET_SHARE = 0.3  # of the friction of a joint: offsets are 5 to 30 % of it (tables of TX40, UR10 and EMPS)
ZERO_SHARE = 0.01  # of the torque of a joint, which is read with a zero that is so much off (chosen by eye)
SMALLEST_OFFSET = 1e-9  # N m (N): less is none
Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class FittedModel:
    """A design with its moments, and the state that was found on it."""

    design: DesignMatrix
    noise: Noise
    moments: Moments
    solver: Solver
    state: State
    steps: tuple[Step, ...] = ()

    @property
    def columns(self) -> Columns:
        """The design's."""
        return self.design.columns

    @property
    def fit(self) -> Fit:
        """The fit of the state."""
        return self.solver.fit(self.state)

    def candidate(self, group: int) -> Candidate:
        """The effect of a group of columns, at its place."""
        return self.solver.candidate(group)

    def coefficients(self, fit: Fit) -> Array:
        """Of the unscaled columns, (size,)."""
        return np.asarray(fit.coefficients / self.moments.lengths)

    def base_parameters(self) -> tuple[Array, Array]:
        """Deviation of the base parameters from the simulation's, and its covariance under the noise model."""
        fit, count = self.fit, len(self.design.base)
        rank, lengths = fit.links.shape[1], self.moments.lengths[:count]
        spread = fit.links @ fit.inverse[:rank, :rank] @ fit.links.T
        return self.coefficients(fit)[:count], np.asarray(spread / np.outer(lengths, lengths))

    @cached_property
    def colours(self) -> Array:
        """`error_colours` of what the fit leaves, (joints,)."""
        return error_colours(self.residual(self.fit), self.design.observed, self.design.settings.tuning.noise)

    def residual(self, fit: Fit) -> Array:
        """What a fit leaves, (rows, joints), N m."""
        return np.column_stack([self.residual_at(joint, fit) for joint in range(self.columns.joints)])

    def residual_at(self, joint: int, fit: Fit) -> Array:
        """What a fit leaves at one joint, (rows,), N m."""
        return self.columns.target_at(joint) - self.columns.torque_at(joint, self.coefficients(fit))


def initial_link_widths(design: DesignMatrix) -> Widths | None:
    """Widths for a look at links that may be off: None without a nominal model or for a refit."""
    if design.prior is None or design.simulation.kind == "refit":
        return None
    return (design.settings.tuning.links.initial_width,) * design.prior.links


def fit_background(design: DesignMatrix, families: Sequence[Family], seed: int, progress: Progress) -> FittedModel:
    """Friction and links fitted, every candidate on the design, and errors taken as coloured for the first time.

    seed: of the surrogates' random waves.
    """
    progress("fitting links and friction")
    plain = design.with_candidates(family for family in families if family.facts.usual)
    first = _fit_model(
        plain, _white_noise(plain.target, plain), lambda solver: background_state(solver, initial_link_widths(plain))
    )
    moved = _follow_model(first)
    progress("looking for candidates")
    left = first.residual(first.fit)
    rng = np.random.default_rng(seed)
    tuning = design.settings.tuning.surrogate
    observed, joints = moved.observed, range(moved.observed.joints)
    flexible = [flexible_features(observed, joint, rng, tuning) for joint in joints]
    made = tuple(fold_features(each, observed, joint) for joint, each in enumerate(flexible))
    banks = motion_banks(observed, tuning)
    offered = moved.with_candidates(families, _split_by_run(moved, left))
    whole = replace(offered, features=made, banks=banks, offsets=_offset_scales(first))
    rough = _fit_model(
        whole, _white_noise(left, whole), lambda solver: background_state(solver, initial_link_widths(whole))
    )
    guards = replace(design.settings.guards, backward_elimination=False)
    forward = Search(rough.solver, replace(design.settings, guards=guards), True, 0)
    steps: list[Step] = []
    return replace(rough, state=forward.climb(rough.state, steps))


def _offset_scales(model: FittedModel) -> Array:
    """How large offsets are thought to be: as those of real arms beside the friction of a model, (joints,), N m (N).

    One that is far larger stands for gravity, or for a spring, that the motion does not separate from it. Where a joint
    has no friction, its torque has a zero that is a little off.
    """
    own, coefficients = np.zeros(model.columns.size), model.coefficients(model.fit)
    for group in (model.solver.groups[each] for each in model.state.groups):
        if group.candidate.is_friction:
            own[group.columns] = coefficients[group.columns]
    friction, torque = model.columns.torque_of(own), model.design.observed.torque
    squares = OFFSET_SHARE**2 * np.mean(friction**2, axis=0) + ZERO_SHARE**2 * np.mean(torque**2, axis=0)
    return np.asarray(np.sqrt(np.maximum(squares, SMALLEST_OFFSET**2)))


def scan_residual(model: FittedModel) -> DesignMatrix:
    """The design with more shapes of each scanned effect, from what a model leaves without the effect."""
    residual, coefficients = model.residual(model.fit), model.coefficients(model.fit)

    def without(effect: str) -> list[Array]:
        own = np.zeros_like(coefficients)
        for group in (model.solver.groups[each] for each in model.state.groups):
            if group.candidate.effect == effect:
                own[group.columns] = coefficients[group.columns]
        return _split_by_run(model.design, residual + model.columns.torque_of(own))

    return model.design.scanned_again(without)


def with_design(model: FittedModel, design: DesignMatrix) -> FittedModel:
    """The same state and noise on another design, in which its groups have the same numbers."""
    moments, solver = design.solver(model.noise)
    return replace(model, design=design, moments=moments, solver=solver)


def _split_by_run(design: DesignMatrix, residual: Array) -> list[Array]:
    """A residual (rows, joints) of each run, (samples, joints), NaN at rows that were not kept."""
    parts, start = [], 0
    for signals in design.observed.signals:
        whole = np.full(signals.motion.position.shape, np.nan)
        whole[signals.filter.rows] = residual[start : start + len(signals.torque)]
        parts.append(whole)
        start += len(signals.torque)
    return parts


def search_effects(model: FittedModel, progress: Progress) -> FittedModel:
    """Rounds of search, shapes and model from a first round, which is let go as the next one is made."""
    for number in range(model.design.settings.tuning.search.rounds):
        progress(f"searching, round {number + 1}")
        noise, known = fit_coloured_noise(model), model.state if number else None
        design, steps = _follow_model(model) if number else model.design, model.steps
        del model  # its columns, before there are others
        model = _search_state(design, noise, known, True, steps)
        progress("fitting nonlinear parameters")
        better = refine_shapes(design, noise, model.solver, model.state)
        if better:
            known, steps = model.state, model.steps
            del model
            model = _fit_model(design.with_blocks(better), noise, known, steps)
    progress("searching, last round")
    return _search_state(model.design, fit_coloured_noise(model), model.state, False, model.steps)


def _search_state(
    design: DesignMatrix, noise: Noise, known: State | None, afresh: bool, steps: tuple[Step, ...]
) -> FittedModel:
    """The best state under a noise model, from what is known already, and `afresh` from the two starts."""
    settings, links = design.settings, len(design.simulation.arm)
    opened = initial_link_widths(design)
    at_rest = None if opened is None else (0.0,) * links
    base = _fit_model(design, noise, State((), at_rest))
    starts = [] if known is None else [known]
    search = Search(base.solver, settings, opened is None, links)
    if afresh:
        starts.append(search.with_expected(State((), at_rest)))
    if afresh and settings.guards.background_start:
        starts.append(background_state(base.solver, opened))
    state, moves = search.best(starts)
    return replace(base, state=state, steps=(*steps, *moves))


def fit_coloured_noise(model: FittedModel) -> Noise:
    """Noise of what a round leaves and no surrogate predicts: coloured where colour does not cost predictions.

    Where physics is missing, the autoregression learns it, and least squares that are whitened by it neglect the
    frequencies of the motion. Noise cannot be told from that by its looks, but by what it does: were it noise, the
    whitened fit would predict held-out stretches of the torque at least as well as the plain one does (the idea of
    Hausman 1978). A joint where it predicts them worse has white errors.
    """
    observed, settings = model.design.observed, model.design.settings
    left = model.residual(model.fit)
    for joint, each in enumerate(model.design.features):
        left[:, joint] -= predict_structure(left[:, joint], joint, each, observed, settings.tuning.surrogate)
    fitted, tuning = len(model.fit.inverse) / observed.joints, settings.tuning.noise
    white = fit_noise(left, observed, fitted, tuning, colour=False)
    if not settings.guards.prewhitening:
        return white
    coloured = fit_noise(left, observed, fitted, tuning)
    losses = whitening_losses(model, coloured, white)
    return choose_noise(coloured, white, losses > tuning.max_prediction_loss)


def whitening_losses(model: FittedModel, coloured: Noise, white: Noise) -> Array:
    """Share by which a fit under coloured noise predicts held-out stretches worse than a plain one, (joints,)."""
    plain, whitened = (split_fit(model, model.fit, each) for each in (white, coloured))
    everything = range(len(plain.precision))
    pairs = zip(plain.errors_of(whitened.solutions(everything)), plain.errors(everything), strict=True)
    return np.array([float(worse @ worse) / max(float(better @ better), 1e-300) - 1 for worse, better in pairs])


def split_fit(model: FittedModel, fit: Fit, noise: Noise) -> Folds:
    """The rows of a fit under some noise, in folds."""
    folds = model.design.settings.tuning.blocks.folds
    rows = whitened_rows(model.columns, {}, fit, model.moments.lengths, noise, model.design.observed)
    return split_folds(rows, fit_values(fit), prior_precision(model.solver, fit, len(fit.inverse)), folds)


def fit_values(fit: Fit) -> Array:
    """Parameters of a fit: those of the links' factor, then the effects'."""
    links = np.linalg.lstsq(fit.links, fit.coefficients[: len(fit.links)])[0]
    return np.concatenate([links, fit.coefficients[fit.columns]])


def _white_noise(residual: Array, design: DesignMatrix) -> Noise:
    return fit_noise(residual, design.observed, 0.0, design.settings.tuning.noise, colour=False)


def _fit_model(
    design: DesignMatrix, noise: Noise, state: State | Callable[[Solver], State], steps: tuple[Step, ...] = ()
) -> FittedModel:
    moments, solver = design.solver(noise)
    chosen = state(solver) if callable(state) else state
    return FittedModel(design, noise, moments, solver, chosen, steps)


def _follow_model(model: FittedModel) -> DesignMatrix:
    """The design with columns that follow the model of a round."""
    return follow_model(model.design, model)


def follow_model(design: DesignMatrix, model: FittedModel) -> DesignMatrix:
    """A design with columns that follow a model."""
    return design.with_model(inertial_parameters(model), torque_of(model))


def torque_of(model: FittedModel) -> Callable[[Scene], Array]:
    """The torque in the mechanism of a model, (samples, joints) of a scene."""
    fit, design = model.fit, model.design
    inertial = inertial_parameters(model)
    nominal = design.simulation.inertial
    change = inertial if nominal is None else inertial - nominal

    chosen = [(model.candidate(group), model.solver.values(fit, group)) for group in fit.state.groups]
    effects = [FittedEffect(candidate, values) for candidate, values in chosen]

    def torque(scene: Scene) -> Array:
        simulated = design.simulation.torque_in_mechanism(scene)
        rigid = simulated + rigid_body_torque(scene.arm, scene.motion, change)
        return torque_in_mechanism(effects, replace(scene, inertial=inertial, torque=rigid))

    return torque


def inertial_parameters(model: FittedModel) -> Array:
    """Inertial parameters (10 * joints,) of the links of a round: the simulation's, and what they are off."""
    design, fit = model.design, model.fit
    base = model.coefficients(fit)[: len(design.base)]
    nominal = design.simulation.inertial
    start = np.zeros(10 * len(design.simulation.arm)) if nominal is None else nominal
    if design.prior is None or fit.state.widths is None:
        change = np.zeros(len(start))
        change[design.base.columns] = base
        return np.asarray(start + change)
    if not any(fit.state.widths):
        return start
    mean, _ = design.prior.deviations(fit.state.widths, base, np.zeros((len(base), len(base))))
    return np.asarray(start + mean)
