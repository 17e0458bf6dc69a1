"""The diagnosis of a recording, step by step."""

import time
from dataclasses import asdict, dataclass

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.claims import make_claims
from armlab.diagnosis.data import Observed, observe, rows_in
from armlab.diagnosis.design import DesignMatrix, build_design_matrix
from armlab.diagnosis.evidence import Evidence, count_looks
from armlab.diagnosis.fitted_model import (
    FittedModel,
    Progress,
    fit_background,
    fit_coloured_noise,
    inertial_parameters,
    search_effects,
)
from armlab.diagnosis.formats import Status
from armlab.diagnosis.links import are_bodies, link_prior
from armlab.diagnosis.location import locate_excess, noise_floor
from armlab.diagnosis.pruning import Pruned, prune, withdraw
from armlab.diagnosis.result import Claim, Diagnosis, JointFit, Unexplained
from armlab.diagnosis.settings import Baseline, Settings
from armlab.diagnosis.simulation import read_simulation, reason_misread, reason_unusable
from armlab.diagnosis.solver import State
from armlab.diagnosis.summary import summarise
from armlab.diagnosis.surrogate import Structure
from armlab.diagnosis.unknown import (
    is_form_error,
    is_structured,
    make_unknown_claim,
    names_contradicted_by_residual,
    predict_residual_structure,
)
from armlab.effects.library import library
from armlab.recordings.recording import Recording
from problem.base_parameters import base_parameters


def diagnose(
    recording: Recording,
    baseline: Baseline | None = None,
    seed: int = 0,
    settings: Settings | None = None,
    progress: Progress = lambda message: None,
) -> Diagnosis:
    """Where the simulation and the recording differ, what physics is missing, and how much better it then predicts.

    baseline: what is compared; the simulation where there is one if left out. seed: of the surrogates' random waves.
    progress: is told what is being done. Raises InputError where the wanted baseline is not there.
    """
    started = time.perf_counter()
    ready = prepare(recording, baseline, seed, settings or Settings(), progress)
    if isinstance(ready, Diagnosis):
        return ready
    return ready.told(search_effects(ready.fit_background(progress), progress), started, progress)


Structures = tuple[Structure, ...]

MIN_GAP = 0.02  # of the noise floor: a smaller gap cannot be measured


@dataclass(frozen=True, eq=False)
class PreparedDiagnosis:
    """A recording with its bench, before anything is searched. seed: of the surrogates' random waves."""

    recording: Recording
    bench: DesignMatrix
    seed: int

    def fit_background(self, progress: Progress) -> FittedModel:
        """With every candidate on the bench, and a first look at the noise."""
        return fit_background(self.bench, library(), self.seed, progress)

    def told(self, searched: FittedModel, started: float, progress: Progress) -> Diagnosis:
        """Everything that can be said of a search. started: by `time.perf_counter`."""
        progress("testing claims")
        model, effects, links, left = _name_effects(prune(searched))
        remains = [each for each in left if is_structured(each)]
        unknowns = [each for each in remains if not is_form_error(each, effects)]
        residual = model.residual(model.fit)
        claims = make_claims(model, effects, links) + tuple(
            make_unknown_claim(model, each, residual) for each in unknowns
        )
        return _assemble(self.recording, model, claims, (unknowns, remains), time.perf_counter() - started)


def prepare(
    recording: Recording, baseline: Baseline | None, seed: int, settings: Settings, progress: Progress
) -> PreparedDiagnosis | Diagnosis:
    """What `diagnose` starts with; a diagnosis where nothing can be said and why."""
    simulation = read_simulation(recording, baseline)
    reason = reason_unusable(recording)
    if reason is not None:
        return Diagnosis(recording, simulation, "inconclusive", reason)
    progress("filtering")
    observed = observe(recording.runs, simulation.arm, simulation.inertial, settings)
    reason = reason_misread(observed, simulation)
    if reason is not None:
        return Diagnosis(recording, simulation, "inconclusive", reason, observed)
    base = base_parameters(simulation.arm)
    links = simulation.inertial
    prior = None if links is None or not are_bodies(links) else link_prior(simulation.arm, base, links)
    return PreparedDiagnosis(recording, build_design_matrix(observed, simulation, base, prior, settings), seed)


def _name_effects(passed: Pruned) -> tuple[FittedModel, dict[int, Evidence], dict[int, Evidence], Structures]:
    """The model with the names that hold: see `engine.doubt`; and what it leaves. Nothing without the guard."""
    model, effects, links = passed
    if not model.bench.settings.guards.unknown:
        return model, effects, links, ()
    left = predict_residual_structure(model, fit_coloured_noise(model))
    while doubtful := names_contradicted_by_residual(effects, left):
        model, effects, links = withdraw(model, doubtful, "what is left at its joint is no less structured")
        left = predict_residual_structure(model, fit_coloured_noise(model))
    wrong = names_contradicted_by_residual(links, left)
    return model, effects, {link: each for link, each in links.items() if link not in wrong}, left


def _assemble(
    recording: Recording,
    model: FittedModel,
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
    fits = _joint_fits(refit, final, floor, bench.observed)
    where = locate_excess(start, floor, bench.observed)
    status: Status = "mismatch" if claims else "none"
    unexplained = tuple(
        Unexplained(each.joint + 1, float(np.clip(each.share, 0, 1)), each.depends_on) for each in remains
    )
    base, covariance = model.base_parameters()
    return Diagnosis(
        recording,
        bench.simulation,
        status,
        summarise(status, claims, fits),
        observed,
        bench.target,
        refit,
        final,
        inertial_parameters(model),
        base,
        covariance,
        claims,
        where if claims else (),
        unexplained,
        fits,
        model.steps,
        count_looks(model),
        seconds,
        {**asdict(bench.settings.guards), "cutoff_hz": bench.settings.cutoff_hz},
    )


def _joint_fits(refit: Array, final: Array, floor: Array, observed: Observed) -> tuple[JointFit, ...]:
    out = []
    for joint, noise in enumerate(floor.tolist()):
        rows = rows_in(observed.of_role("validate", joint), observed.rows)
        before, after = (float(np.sqrt(np.mean(each[rows, joint] ** 2))) for each in (refit, final))
        gap = before - noise
        out.append(JointFit(joint + 1, before, after, noise, (before - after) / gap if gap > MIN_GAP * noise else None))
    return tuple(out)
