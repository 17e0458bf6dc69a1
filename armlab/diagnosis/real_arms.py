"""The public recordings of real arms, diagnosed with only the rigid body given: the study of one recording, its page
diagnosis.md, and the command that writes it.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.stats import chi2, norm

from armlab.common.arrays import Array
from armlab.common.files import write_texts
from armlab.diagnosis.diagnose import diagnose
from armlab.diagnosis.report.words import (
    effect_in_words,
    finding_in_words,
    format_number,
    format_probability,
    joint_unit,
    parameter_rows,
    place_in_words,
    verdict_sentences,
)
from armlab.diagnosis.result import Claim, Diagnosis
from armlab.effects.library import effect_named
from armlab.effects.parameters import ParameterValue
from armlab.effects.springs import CABLE_STIFFNESS, GRAVITY_COMPENSATOR
from armlab.identification.real.looks import Looks
from armlab.identification.real.report import LOOKS_FILE
from armlab.identification.real.study import RECIPES
from armlab.recordings.load import load_recording
from armlab.recordings.public import fetch_recording
from armlab.recordings.recording import Recording

LOGGED_MODEL = "diagnosis"
RECORDING_NAMES = ("emps", "staubli-tx40", "unisa-ur10", "kuka-kr300")
DIAGNOSED_BY_RUN = ("kuka-kr300",)  # each of their runs is diagnosed alone too: one payload, so one answer


@dataclass(frozen=True)
class RunGain:
    """Error of a run in percent of its torque, over all joints: as given (None without links), refitted, found.

    best_known: the figure of a published or hand-made model.
    """

    run: str
    given: float | None
    refitted: float
    found: float
    best_known: float | None


@dataclass(frozen=True, eq=False)
class RealStudy:
    """alone: the diagnosis of each run by itself, where that was asked for."""

    name: str
    diagnosis: Diagnosis
    gains: tuple[RunGain, ...]
    alone: tuple[tuple[str, Diagnosis], ...] = ()


def study_recording(name: str, recordings: Path, looks: Looks, progress: Callable[[str], None]) -> RealStudy:
    """Diagnoses a recording that is fetched into `recordings` (taken from there if it is there already)."""
    place = recordings / name
    recording = load_recording(place if place.is_dir() else fetch_recording(name, place))
    for run in recording.with_role("validate"):
        looks.note(recording.arm.name, run.name, LOGGED_MODEL)
    diagnosis = diagnose(recording, progress=progress)
    alone = tuple(
        _diagnose_run(recording, index, progress) for index in range(len(recording.runs)) if name in DIAGNOSED_BY_RUN
    )
    return RealStudy(name, diagnosis, run_gains(name, diagnosis), alone)


def _diagnose_run(recording: Recording, index: int, progress: Callable[[str], None]) -> tuple[str, Diagnosis]:
    run = recording.runs[index]
    return run.name, diagnose(replace(recording, runs=(replace(run, role="identify"),)), progress=progress)


def run_gains(name: str, diagnosis: Diagnosis) -> tuple[RunGain, ...]:
    """Errors of each run that validates, on its held-out blocks where no run does."""
    if diagnosis.observed is None or diagnosis.final is None or diagnosis.refit is None or diagnosis.nominal is None:
        return ()
    known = next((each.best_known for each in RECIPES if each.name == name), {})
    torque, out = diagnosis.observed.torque, []
    for index, run in enumerate(diagnosis.observed.names):
        segments = [each for each in diagnosis.observed.of_role("validate") if each.run == index]
        if not segments:
            continue
        rows = np.concatenate([np.arange(each.start, each.stop) for each in segments])
        given = None if diagnosis.simulation.kind == "refit" else _relative_error(diagnosis.nominal[rows], torque[rows])
        refitted = _relative_error(diagnosis.refit[rows], torque[rows])
        final = _relative_error(diagnosis.final[rows], torque[rows])
        out.append(RunGain(run, given, refitted, final, known.get(run)))
    return tuple(out)


def _relative_error(residual: Array, torque: Array) -> float:
    return float(100 * np.linalg.norm(residual) / np.linalg.norm(torque))


def mass_claims(diagnosis: Diagnosis) -> tuple[Claim, ...]:
    """Claims about the inertial parameters of a link."""
    return tuple(each for each in diagnosis.claims if effect_named(each.effect).where == "link")


COUNTERBALANCE_EFFECTS = (GRAVITY_COMPENSATOR.effect, CABLE_STIFFNESS.effect)  # names for the counterbalance of the arm
MIN_AGREEMENT_P_VALUE = 0.01
INTRODUCTION = """\
# Real arms, diagnosed with only the rigid body given

Percent: `||tau - tau_hat|| / ||tau||` over all joints, filtered torque, on data that took no part in any fit.
They are not untouched: bounds and forms of the diagnosis were chosen after earlier looks at them, each of which is in
`validation_looks.jsonl`. What judges the diagnosis on data that nobody had seen is `results/proof/`.
As given: the CAD links where the source publishes them. Refitted: base parameters fitted, nothing else. Found: with
every finding, and with the surrogate where something is unknown. Best known: the figure of a published or hand-made
model of that run. What is not sure is not named: an unknown stands with what it depends on.
"""


def studies_markdown(studies: Sequence[RealStudy]) -> str:
    """The whole page."""
    return INTRODUCTION + "".join(f"\n{line}" for each in studies for line in _study_lines(each)) + "\n"


def _study_lines(study: RealStudy) -> Iterator[str]:
    diagnosis = study.diagnosis
    first, second = verdict_sentences(diagnosis)
    yield f"## {study.name}\n"
    yield f"{first} {second}\n"
    yield from gain_table(study.gains)
    if diagnosis.claims:
        yield from _claims_table(diagnosis)
    for each in diagnosis.unexplained:
        depends = ", ".join(each.depends_on)
        yield f"Unexplained at joint {each.joint}: {100 * each.share:.0f} % of the held-out variance, by {depends}.\n"
    if study.alone:
        yield from _run_lines(study)


def gain_table(gains: Sequence[RunGain]) -> Iterator[str]:
    """Errors of each run that took no part."""
    yield "| run | as given | refitted | found | best known |"
    yield "|---|---:|---:|---:|---:|"
    for each in gains:
        cells = (
            _format_percent(each.given),
            _format_percent(each.refitted),
            _format_percent(each.found),
            _format_percent(each.best_known),
        )
        yield f"| {each.run} | {' | '.join(cells)} |"
    yield ""


def _format_percent(value: float | None) -> str:
    return "–" if value is None else f"{value:.1f} %"


def _claims_table(diagnosis: Diagnosis) -> Iterator[str]:
    yield "| finding | where | law | held-out error without, with it | p | fits as well |"
    yield "|---|---|---|---|---|---|"
    for claim in diagnosis.claims:
        evidence = claim.evidence
        size = joint_unit(diagnosis.simulation.arm, evidence.joint)
        error = (
            f"{format_number(evidence.rms_before)}, {format_number(evidence.rms_after)} {size} (joint "
            f"{evidence.joint + 1})"
        )
        rivals = "; ".join(
            f"{effect_in_words(each.effect)}, {place_in_words(each.effect, each.joint, each.joints)}"
            for each in claim.rivals
        )
        law = claim.equation.replace("|", "\\|")
        where = place_in_words(claim.effect, claim.joint, claim.joints)
        p_value = format_probability(evidence.corrected)
        yield f"| {effect_in_words(claim.effect)} | {where} | `{law}` | {error} | {p_value} | {rivals or '–'} |"
    yield ""


def _run_lines(study: RealStudy) -> Iterator[str]:
    """Lines on the diagnosis of each run alone, which should all find the same load."""
    yield "Each run by itself (blocks of time held out), what it says of the links:\n"
    masses: list[ParameterValue] = []
    for run, diagnosis in study.alone:
        mass_texts, run_masses = [], list[ParameterValue]()
        for claim in mass_claims(diagnosis):
            for parameter in (each for each in claim.parameters if each.name == "mass"):
                run_masses.append(parameter)
                (row,) = parameter_rows(parameter)
                mass_texts.append(f"{finding_in_words(claim)}, mass {row.value} kg ({row.interval})")
        by_width = sorted((each for each in run_masses if each.interval), key=_interval_width)
        masses += by_width[:1]  # one a run, of the smallest interval
        springs = [finding_in_words(each) for each in diagnosis.claims if each.effect in COUNTERBALANCE_EFFECTS]
        yield f"- {run}: {'; '.join([*mass_texts, *springs]) or 'nothing'}"
    yield f"\n{mass_agreement(masses)}\n"


def _interval_width(parameter: ParameterValue) -> float:
    return float(np.ptp(np.array(parameter.interval, dtype=float)))


def mass_agreement(masses: Sequence[ParameterValue]) -> str:
    """Whether masses with intervals can be one mass: chi-square of their weighted mean."""
    sized = [each for each in masses if each.interval]
    if len(sized) < 2:
        return "Too few of them give a mass to be compared."
    values = np.array([each.value for each in sized], dtype=float)
    widths = np.array([_interval_width(each) for each in sized])
    weights = 1 / (widths / (2 * float(norm.ppf(0.975)))) ** 2
    mean = float(weights @ values / weights.sum())
    p_value = float(chi2.sf(float(weights @ (values - mean) ** 2), len(values) - 1))
    word = "agree" if p_value > MIN_AGREEMENT_P_VALUE else "do not agree within their intervals"
    return f"{len(values)} masses, weighted mean {mean:.4g} kg: they {word} (p {format_probability(p_value)})."


PAGE_NAME = "diagnosis.md"


def diagnose_public_recordings(
    results: Path, recordings: Path, only: Sequence[str] = (), progress: Callable[[str], None] = lambda message: None
) -> Iterator[str]:
    """Lines that tell what was found and written; the page holds the recordings of this call."""
    looks, studies = Looks(results / LOOKS_FILE), []
    for name in (each for each in RECORDING_NAMES if not only or each in only):
        progress(name)
        studies.append(study_recording(name, recordings, looks, progress))
        yield f"{name}: {' '.join(verdict_sentences(studies[-1].diagnosis))}"
        for gain in studies[-1].gains:
            yield f"  {gain.run}: {gain.refitted:.1f} % refitted, {gain.found:.1f} % with what was found"
    if studies:
        write_texts({PAGE_NAME: studies_markdown(studies)}, results)
        yield str(results / PAGE_NAME)
