"""The stages of a diagnosis: a bench with all columns, the search on it, and what is said of its end."""

import time
from dataclasses import asdict, dataclass

import numpy as np

from diagnosis.effects.library import library
from diagnosis.engine.claiming import claims_of
from diagnosis.engine.doubt import doubted, inexact
from diagnosis.engine.evidence import Evidence, looks_of
from diagnosis.engine.floor import noise_floor
from diagnosis.engine.links import are_bodies, link_prior
from diagnosis.engine.located import located
from diagnosis.engine.observed import Observed, observe
from diagnosis.engine.pruning import Passed, pruned, withdrawn
from diagnosis.engine.remaining import structured, structures, unknown_claim
from diagnosis.engine.rounds import Progress, Round, begun, coloured, inertial_of
from diagnosis.engine.segments import rows_of
from diagnosis.engine.simulation import simulation_of
from diagnosis.engine.solver import State
from diagnosis.engine.soundness import misread, unsound
from diagnosis.engine.surrogate import Structure
from diagnosis.engine.workbench import Workbench, workbench
from diagnosis.result import Claim, Diagnosis, JointFit, Status, Unexplained
from diagnosis.settings import Baseline, Settings
from diagnosis.summary import summary
from problem.base_parameters import base_parameters
from recordings.recording import Recording
from recordings.run import Array

Left = tuple[Structure, ...]

WORTH_CLOSING = 0.02  # of the noise floor: a smaller gap cannot be measured


@dataclass(frozen=True, eq=False)
class Ready:
    """A recording with its bench, before anything is searched. seed: of the surrogates' random waves."""

    recording: Recording
    bench: Workbench
    seed: int

    def begun(self, progress: Progress) -> Round:
        """With every candidate on the bench, and a first look at the noise."""
        return begun(self.bench, library(), self.seed, progress)

    def told(self, searched: Round, started: float, progress: Progress) -> Diagnosis:
        """Everything that can be said of a search. started: by `time.perf_counter`."""
        progress("testing claims")
        model, effects, links, left = _named(pruned(searched))
        remains = [each for each in left if structured(each)]
        unknowns = [each for each in remains if not inexact(each, effects)]
        residual = model.residual(model.fit)
        claims = claims_of(model, effects, links) + tuple(unknown_claim(model, each, residual) for each in unknowns)
        return _told(self.recording, model, claims, (unknowns, remains), time.perf_counter() - started)


def prepared(
    recording: Recording, baseline: Baseline | None, seed: int, settings: Settings, progress: Progress
) -> Ready | Diagnosis:
    """What `diagnose` starts with; a diagnosis where nothing can be said and why."""
    simulation = simulation_of(recording, baseline)
    reason = unsound(recording)
    if reason is not None:
        return Diagnosis(recording, simulation, "inconclusive", reason)
    progress("filtering")
    observed = observe(recording.runs, simulation.arm, simulation.inertial, settings)
    reason = misread(observed, simulation)
    if reason is not None:
        return Diagnosis(recording, simulation, "inconclusive", reason, observed)
    base = base_parameters(simulation.arm)
    links = simulation.inertial
    prior = None if links is None or not are_bodies(links) else link_prior(simulation.arm, base, links)
    return Ready(recording, workbench(observed, simulation, base, prior, settings), seed)


def _named(passed: Passed) -> tuple[Round, dict[int, Evidence], dict[int, Evidence], Left]:
    """The model with the names that hold: see `engine.doubt`; and what it leaves. Nothing without the guard."""
    model, effects, links = passed
    if not model.bench.settings.guards.unknown:
        return model, effects, links, ()
    left = structures(model, coloured(model))
    while doubtful := doubted(effects, left):
        model, effects, links = withdrawn(model, doubtful, "what is left at its joint is no less structured")
        left = structures(model, coloured(model))
    wrong = doubted(links, left)
    return model, effects, {link: each for link, each in links.items() if link not in wrong}, left


def _told(
    recording: Recording,
    model: Round,
    claims: tuple[Claim, ...],
    structure: tuple[list[Structure], list[Structure]],
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
    floor = noise_floor(final, bench.features, observed)
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
