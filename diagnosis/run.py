"""The whole diagnosis of a recording, from its runs to everything that can be said."""

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict

import numpy as np

from diagnosis.effects.library import library
from diagnosis.engine.claiming import claims_of
from diagnosis.engine.doubt import doubted, inexact
from diagnosis.engine.evidence import Evidence, looks_of
from diagnosis.engine.floor import noise_floor
from diagnosis.engine.links import link_prior
from diagnosis.engine.located import located
from diagnosis.engine.observed import Observed, observe
from diagnosis.engine.pruning import Passed, pruned, withdrawn
from diagnosis.engine.remaining import structured, structures, unknown_claim
from diagnosis.engine.rounds import Round, begun, coloured, found, inertial_of
from diagnosis.engine.segments import rows_of
from diagnosis.engine.simulation import simulation_of
from diagnosis.engine.solver import State
from diagnosis.engine.soundness import misread, unsound
from diagnosis.engine.surrogate import Features, Structure, features
from diagnosis.engine.workbench import workbench
from diagnosis.result import Claim, Diagnosis, JointFit, Status, Unexplained
from diagnosis.settings import Baseline, Settings
from diagnosis.summary import summary
from problem.base_parameters import base_parameters
from recordings.recording import Recording
from recordings.run import Array

Left = tuple[Structure, ...]

WORTH_CLOSING = 0.02  # of the noise floor: a smaller gap cannot be measured


def diagnose(
    recording: Recording,
    baseline: Baseline | None = None,
    seed: int = 0,
    settings: Settings | None = None,
    progress: Callable[[str], None] = lambda message: None,
) -> Diagnosis:
    """Where the simulation and the recording differ, what physics is missing, and how much better it then predicts.

    baseline: what is compared; the simulation where there is one if left out. seed: of the surrogates' random waves.
    progress: is told what is being done. Raises InputError where the wanted baseline is not there.
    """
    started = time.perf_counter()
    chosen = settings or Settings()
    simulation = simulation_of(recording, baseline)
    reason = unsound(recording)
    if reason is not None:
        return Diagnosis(recording, simulation, "inconclusive", reason)
    progress("filtering")
    observed = observe(recording.runs, simulation.arm, simulation.inertial, chosen)
    reason = misread(observed, simulation)
    if reason is not None:
        return Diagnosis(recording, simulation, "inconclusive", reason, observed)
    base = base_parameters(simulation.arm)
    prior = None if simulation.inertial is None else link_prior(simulation.arm, base, simulation.inertial)
    bench = workbench(observed, simulation, base, prior, chosen)
    rng = np.random.default_rng(seed)
    made = [features(observed, joint, rng) for joint in range(observed.joints)]
    searched = found(begun(bench, library(), progress), made, progress)
    progress("testing claims")
    model, effects, links, left = _named(pruned(searched), made)
    unknowns = [each for each in left if structured(each) and not inexact(each, effects)]
    residual = model.residual(model.fit)
    claims = claims_of(model, effects, links) + tuple(unknown_claim(model, each, residual) for each in unknowns)
    remains = [each for each in left if structured(each)]
    return _told(recording, model, claims, (unknowns, remains), made, time.perf_counter() - started)


def _named(passed: Passed, made: Sequence[Features]) -> tuple[Round, dict[int, Evidence], dict[int, Evidence], Left]:
    """The model with the names that hold: see `engine.doubt`; and what it leaves. Nothing without the guard."""
    model, effects, links = passed
    if not model.bench.settings.guards.unknown:
        return model, effects, links, ()
    left = structures(model, made, coloured(model, made))
    while doubtful := doubted(effects, left):
        model, effects, links = withdrawn(model, doubtful, "what is left at its joint is no less structured")
        left = structures(model, made, coloured(model, made))
    return model, effects, links, left


def _told(
    recording: Recording,
    model: Round,
    claims: tuple[Claim, ...],
    structure: tuple[list[Structure], list[Structure]],
    made: Sequence[Features],
    seconds: float,
) -> Diagnosis:
    """structure: what is a finding `unknown`, and all that remains."""
    bench, (unknowns, remains) = model.bench, structure
    final = model.residual(model.fit)
    for each in unknowns:
        final[:, each.joint] -= each.prediction
    refit = model.residual(model.solver.fit(State((), None)))
    start = refit if bench.simulation.kind == "refit" else bench.target
    observed = bench.observed
    floor = noise_floor(final, made, observed)
    fits = _fits(refit, final, floor, bench.observed)
    where = located(start, floor, bench.observed)
    status: Status = "mismatch" if claims else "none"
    unexplained = tuple(
        Unexplained(each.joint + 1, float(np.clip(each.share, 0, 1)), each.depends_on) for each in remains
    )
    base, covariance = model.base_parameters()
    return Diagnosis(
        recording, bench.simulation, status, summary(status, claims, fits), bench.observed, bench.target, refit, final,
        inertial_of(model), base, covariance, claims, where if claims else (), unexplained, fits, model.steps,
        looks_of(model), seconds, {**asdict(bench.settings.guards), "cutoff_hz": bench.settings.cutoff_hz},
    )  # fmt: skip


def _fits(refit: Array, final: Array, floor: Array, observed: Observed) -> tuple[JointFit, ...]:
    out = []
    for joint, noise in enumerate(floor.tolist()):
        rows = rows_of(observed.of_role("validate", joint), observed.rows)
        before, after = (float(np.sqrt(np.mean(each[rows, joint] ** 2))) for each in (refit, final))
        gap = before - noise
        out.append(
            JointFit(joint + 1, before, after, noise, (before - after) / gap if gap > WORTH_CLOSING * noise else None)
        )
    return tuple(out)
