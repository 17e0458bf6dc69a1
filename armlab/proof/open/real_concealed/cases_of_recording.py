"""All cases of one public recording: each look at validation runs is logged first, then the case is examined or read
from the stored outcomes, and judged.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from armlab.proof.open.real_concealed.conceal import ReferenceModel, identify_reference
from armlab.proof.open.real_concealed.examine import ExaminedCase, OutcomeStore, examine_stored, sought_in_case
from armlab.proof.open.real_concealed.fixed_plan import Case, cases_of
from armlab.proof.open.real_concealed.judge import CaseVerdict, judge_case
from armlab.proof.open.real_identification.identify_recording import recipe_named
from armlab.proof.open.real_identification.looks import Looks
from armlab.recordings.public import open_public_recording

Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class ConcealedStudy:
    """control: the outcome with nothing concealed. verdicts: of every case with something concealed."""

    reference: ReferenceModel
    control: ExaminedCase
    verdicts: tuple[CaseVerdict, ...]

    @property
    def name(self) -> str:
        """Of the recording."""
        return self.reference.recording.name


def study_recording(
    name: str, recordings: Path, stored: OutcomeStore, looks: Looks, progress: Progress
) -> ConcealedStudy:
    """Conceals, diagnoses and judges. recordings: where the recording is, or will be fetched to."""
    progress(f"{name}: the reference model")
    recording = open_public_recording(name, recordings)
    return study_cases(identify_reference(recording, recipe_named(name)), cases_of(name), stored, looks, progress)


def study_cases(
    reference: ReferenceModel, cases: tuple[Case, ...], stored: OutcomeStore, looks: Looks, progress: Progress
) -> ConcealedStudy:
    """The cases of a recording, the control first."""
    outcomes = []
    for number, case in enumerate(cases, 1):
        heading = f"{case.recording}, {number} of {len(cases)}: {case.name}"
        progress(heading)
        outcomes.append(examine_stored(reference, case, stored, looks, _progress_under(heading, progress)))
    control = next(each for case, each in zip(cases, outcomes, strict=True) if case.control)
    pairs = [(case, each) for case, each in zip(cases, outcomes, strict=True) if not case.control]
    verdicts = tuple(judge_case(case, each, sought_in_case(reference, case), control) for case, each in pairs)
    return ConcealedStudy(reference, control, verdicts)


def _progress_under(heading: str, progress: Progress) -> Progress:
    return lambda message: progress(f"{heading}: {message}")
