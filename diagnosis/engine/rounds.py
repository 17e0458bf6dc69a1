"""Rounds of fitting: noise from what is left, the search, better shapes, and columns that follow the new model."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from diagnosis.effects.contract import Family, Scene
from diagnosis.engine.columns import Columns
from diagnosis.engine.flexible import features
from diagnosis.engine.links import Widths
from diagnosis.engine.moments import Moments
from diagnosis.engine.noise import Noise, noise_of
from diagnosis.engine.refine import refined
from diagnosis.engine.search import Search, Step, background
from diagnosis.engine.solver import EXPECTED, Fit, Solver, State
from diagnosis.engine.surrogate import predictable
from diagnosis.engine.workbench import Workbench
from problem.regressor import rigid_body_torque
from recordings.run import Array

FIRST_WIDTH = 0.08  # of the links' errors, for the first look
ROUNDS = 2
Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Round:
    """A bench with its moments, and the state that was found on it."""

    bench: Workbench
    noise: Noise
    moments: Moments
    solver: Solver
    state: State
    steps: tuple[Step, ...] = ()

    @property
    def columns(self) -> Columns:
        """The bench's."""
        return self.bench.columns

    @property
    def fit(self) -> Fit:
        """The fit of the state."""
        return self.solver.fit(self.state)

    def coefficients(self, fit: Fit) -> Array:
        """Of the unscaled columns, (size,)."""
        return np.asarray(fit.coefficients / self.moments.lengths)

    def base_parameters(self) -> tuple[Array, Array]:
        """Deviation of the base parameters from the simulation's, and its covariance under the noise model."""
        fit, count = self.fit, len(self.bench.base)
        rank, lengths = fit.links.shape[1], self.moments.lengths[:count]
        spread = fit.links @ fit.inverse[:rank, :rank] @ fit.links.T
        return self.coefficients(fit)[:count], np.asarray(spread / np.outer(lengths, lengths))

    def residual(self, fit: Fit) -> Array:
        """What a fit leaves, (rows, joints), N m."""
        return np.column_stack([self.residual_at(joint, fit) for joint in range(self.columns.joints)])

    def residual_at(self, joint: int, fit: Fit) -> Array:
        """What a fit leaves at one joint, (rows,), N m."""
        return self.columns.matrices[joint][:, -1] - self.columns.explained_at(joint, self.coefficients(fit))


def open_widths(bench: Workbench) -> Widths | None:
    """Widths for a look at links that may be off: None without a nominal model or for a refit."""
    if bench.prior is None or bench.simulation.kind == "refit":
        return None
    return (FIRST_WIDTH,) * bench.prior.links


def begun(bench: Workbench, families: Sequence[Family], seed: int, progress: Progress) -> Round:
    """Friction and links fitted, every candidate on the bench, and errors taken as coloured for the first time.

    seed: of the surrogates' random waves.
    """
    progress("fitting links and friction")
    plain = bench.with_candidates(family for family in families if family.effect in EXPECTED)
    first = _round(plain, _flat(plain.target, plain), lambda solver: background(solver, open_widths(plain)))
    moved = _followed(first)
    progress("looking for candidates")
    left = first.residual(first.fit)
    rng = np.random.default_rng(seed)
    made = tuple(features(moved.observed, joint, rng) for joint in range(moved.observed.joints))
    whole = replace(moved.with_candidates(families, _by_run(moved, left)), features=made)
    rough = _round(whole, _flat(left, whole), lambda solver: background(solver, open_widths(whole)))
    forward = Search(rough.solver, replace(bench.settings.guards, backward_elimination=False), True, 0)
    steps: list[Step] = []
    return replace(rough, state=forward.improved(rough.state, steps))


def _by_run(bench: Workbench, residual: Array) -> list[Array]:
    """A residual (rows, joints) of each run, (samples, joints), NaN at rows that were not kept."""
    parts, start = [], 0
    for signals in bench.observed.signals:
        whole = np.full(signals.motion.position.shape, np.nan)
        whole[signals.filter.rows] = residual[start : start + len(signals.torque)]
        parts.append(whole)
        start += len(signals.torque)
    return parts


def found(current: Round, progress: Progress) -> Round:
    """Rounds of search, shapes and model from a first round, which is let go as the next one is made."""
    for number in range(ROUNDS):
        progress(f"searching, round {number + 1}")
        noise, known = coloured(current), current.state if number else None
        bench, steps = _followed(current) if number else current.bench, current.steps
        del current  # its columns, before there are others
        searched = _searched(bench, noise, known, True, steps)
        progress("fitting nonlinear parameters")
        bench, steps = bench.with_blocks(refined(bench, noise, searched.solver, searched.state)), searched.steps
        known = searched.state
        del searched
        current = _round(bench, noise, known, steps)
    progress("searching, last round")
    return _searched(current.bench, coloured(current), current.state, False, current.steps)


def _searched(bench: Workbench, noise: Noise, known: State | None, afresh: bool, steps: tuple[Step, ...]) -> Round:
    """The best state under a noise model, from what is known already, and `afresh` from the two starts."""
    guards, links = bench.settings.guards, len(bench.simulation.arm)
    opened = open_widths(bench)
    at_rest = None if opened is None else (0.0,) * links
    base = _round(bench, noise, State((), at_rest))
    starts = [] if known is None else [known]
    if afresh:
        starts.append(State((), at_rest))
    if afresh and guards.background_start:
        starts.append(background(base.solver, opened))
    state, moves = Search(base.solver, guards, opened is None, links).best(starts)
    return replace(base, state=state, steps=(*steps, *moves))


def coloured(current: Round) -> Noise:
    """Noise of what a round leaves and no surrogate predicts."""
    observed, guards = current.bench.observed, current.bench.settings.guards
    left = current.residual(current.fit)
    for joint, each in enumerate(current.bench.features):
        left[:, joint] -= predictable(left[:, joint], joint, each, observed)
    return noise_of(left, observed, len(current.fit.inverse) / observed.joints, guards.prewhitening)


def _flat(residual: Array, bench: Workbench) -> Noise:
    return noise_of(residual, bench.observed, 0.0, colour=False)


def _round(
    bench: Workbench, noise: Noise, state: State | Callable[[Solver], State], steps: tuple[Step, ...] = ()
) -> Round:
    moments, solver = bench.solver(noise)
    chosen = state(solver) if callable(state) else state
    return Round(bench, noise, moments, solver, chosen, steps)


def _followed(current: Round) -> Workbench:
    """The bench with columns that follow the model of a round."""
    bench, fit = current.bench, current.fit
    inertial = inertial_of(current)
    nominal = bench.simulation.inertial
    change = inertial if nominal is None else inertial - nominal

    def torque(scene: Scene) -> Array:
        out = bench.simulation.torque(scene) + rigid_body_torque(scene.arm, scene.motion, change)
        for group in fit.state.groups:
            candidate = current.solver.groups[group].candidate
            if candidate.of_channel:  # acts on what is recorded, itself not included
                continue
            out[:, list(candidate.rows)] += candidate.columns(scene) @ current.solver.values(fit, group)
        return out

    return bench.with_model(inertial, torque)


def inertial_of(current: Round) -> Array:
    """Inertial parameters (10 * joints,) of the links of a round: the simulation's, and what they are off."""
    bench, fit = current.bench, current.fit
    base = current.coefficients(fit)[: len(bench.base)]
    nominal = bench.simulation.inertial
    start = np.zeros(10 * len(bench.simulation.arm)) if nominal is None else nominal
    if bench.prior is None or fit.state.widths is None:
        change = np.zeros(len(start))
        change[bench.base.columns] = base
        return np.asarray(start + change)
    if not any(fit.state.widths):
        return start
    mean, _ = bench.prior.deviations(fit.state.widths, base, np.zeros((len(base), len(base))))
    return np.asarray(start + mean)
