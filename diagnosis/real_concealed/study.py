"""All cases of one public recording, each logged before it is looked at, and what was kept of them."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from diagnosis.real_concealed.examine import examine, sought
from diagnosis.real_concealed.judge import Verdict, verdict_on
from diagnosis.real_concealed.kept import Kept
from diagnosis.real_concealed.outcome import Outcome
from diagnosis.real_concealed.plan import Case, cases_of
from diagnosis.real_concealed.reference import Reference, reference_of
from identification.real.looks import Looks
from identification.real.recipes import RECIPES
from recordings.load import load_recording
from recordings.public.fetch import fetch_recording

Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Study:
    """control: what is said of the reference model itself. verdicts: of every case with something concealed."""

    reference: Reference
    control: Outcome
    verdicts: tuple[Verdict, ...]

    @property
    def name(self) -> str:
        """Of the recording."""
        return self.reference.recording.name


def study(name: str, recordings: Path, kept: Kept, looks: Looks, progress: Progress) -> Study:
    """Conceals, diagnoses and judges. recordings: where the recording is, or will be fetched to."""
    place = recordings / name
    progress(f"{name}: the reference model")
    recording = load_recording(place if place.is_dir() else fetch_recording(name, place))
    recipe = next(each for each in RECIPES if each.name == name)
    return study_of(reference_of(recording, recipe), cases_of(name), kept, looks, progress)


def study_of(reference: Reference, cases: tuple[Case, ...], kept: Kept, looks: Looks, progress: Progress) -> Study:
    """The cases of a recording, the control first."""
    kept.folder.mkdir(parents=True, exist_ok=True)
    path = kept.folder / f"{reference.recording.name}.yaml"
    outcomes = []
    for number, case in enumerate(cases, 1):
        told = f"{case.recording}, {number} of {len(cases)}: {case.name}"
        progress(told)
        outcome = kept.read(case, reference.recording)
        if outcome is None:
            for run in reference.recording.with_role("validate"):
                looks.note(reference.recording.arm.name, run.name, f"concealed: {case.name}")
            outcome = examine(reference, case, path, _headed(told, progress))
            kept.write(case, reference.recording, outcome)
        outcomes.append(outcome)
    control = next(each for case, each in zip(cases, outcomes, strict=True) if case.control)
    pairs = [(case, each) for case, each in zip(cases, outcomes, strict=True) if not case.control]
    verdicts = tuple(verdict_on(case, each, sought(reference, case), control) for case, each in pairs)
    return Study(reference, control, verdicts)


def _headed(told: str, progress: Progress) -> Progress:
    """Tells what is being done under a heading."""
    return lambda message: progress(f"{told}: {message}")
