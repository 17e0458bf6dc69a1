"""One arm: identified, diagnosed from each baseline, and every model judged on the runs that validate.

A look at a run that validates is logged before it happens.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.settings import Baseline, Settings
from armlab.diagnosis.torque.diagnose import diagnose
from armlab.diagnosis.torque.names.decide import calibrated_weights
from armlab.diagnosis.torque.predict.found_model import model_found, named_model
from armlab.effects.drive import RotorInertia
from armlab.identification.structure import Structure
from armlab.identification.torque_model import TorqueModel
from armlab.proof.open.real_arms.judged_run import JudgedRun, Percent, common_cutoff, judged_run
from armlab.proof.open.real_identification.identify_recording import Recipe, Study
from armlab.proof.open.real_identification.identify_recording import study_recording as identify_by_recipe
from armlab.proof.open.real_identification.looks import Looks
from armlab.recordings.recording import Recording, Run

ModelName = Literal["rigid_given", "rigid_refitted", "plain_friction", "identify", "named", "diagnose"]
DIAGNOSED_BY_RUN = ("kuka-kr300",)  # each of their runs is diagnosed alone, too: one payload, so one answer
Progress = Callable[[str], None]


@dataclass(frozen=True)
class ModelLine:
    """A row of the table: the errors of every model on one run; a model that there is not is left out.

    cutoff_hz: of the filter that all of them share. best_known: percent of filtered torque that a source states.
    reading_seconds: of `diagnose`, in which it asks how the recording is to be read. looks: how often the run
    was looked at until now.
    """

    arm: str
    baseline: Baseline
    run: str
    cutoff_hz: float
    errors: dict[ModelName, Percent]
    best_known: float | None
    identify_seconds: float
    diagnose_seconds: float
    reading_seconds: float
    looks: int

    @property
    def time_ratio(self) -> float:
        """Seconds of `diagnose` over those of `identify`."""
        return self.diagnose_seconds / self.identify_seconds

    @property
    def reading_ratio(self) -> float:
        """Seconds that `diagnose` asks how the recording is to be read, over those of what follows."""
        return self.reading_seconds / (self.diagnose_seconds - self.reading_seconds)

    def named_share(self, torque: Literal["recorded", "filtered"]) -> float | None:
        """What named physics closes of what the whole model closes; None where that closes nothing."""
        if "named" not in self.errors or "diagnose" not in self.errors:
            return None
        refitted, named, whole = (
            float(getattr(self.errors[name], torque)) for name in ("rigid_refitted", "named", "diagnose")
        )
        return (refitted - named) / (refitted - whole) if refitted > whole else None


@dataclass(frozen=True, eq=False)
class AloneStudy:
    """The diagnosis of one run by itself. errors: of its models on the other runs."""

    run: str
    diagnosis: Diagnosis
    errors: dict[str, dict[ModelName, Percent]]


@dataclass(frozen=True, eq=False)
class ArmStudy:
    """Everything of one arm. judged: the runs that validate. alone: of runs that are diagnosed alone, too."""

    recording: Recording
    identified: Study
    diagnoses: dict[Baseline, Diagnosis]
    judged: tuple[JudgedRun, ...]
    lines: tuple[ModelLine, ...]
    alone: tuple[AloneStudy, ...] = ()

    @property
    def name(self) -> str:
        """Of the recording."""
        return self.identified.recipe.name


def study_arm(recipe: Recipe, recording: Recording, looks: Looks, progress: Progress) -> ArmStudy:
    """Identifies and diagnoses a recording, then judges each model."""
    for run in recording.with_role("validate"):
        looks.note(recipe.name, run.name, "identify")
    progress(f"{recipe.name}: identify")
    identified = identify_by_recipe(recipe, recording)
    cutoff = common_cutoff(recording)
    judged = tuple(judged_run(run, cutoff) for run in recording.with_role("validate"))
    diagnoses: dict[Baseline, Diagnosis] = {}
    for baseline in baselines_of(recording):
        for run in recording.with_role("validate"):
            looks.note(recipe.name, run.name, f"diagnose, {baseline}")
        diagnoses[baseline] = diagnose(
            recording,
            baseline,
            settings=Settings(weights=calibrated_weights(recipe.name)),
            progress=progress_under(f"{recipe.name}, {baseline}", progress),
        )
    lines = tuple(_lines(recipe, identified, diagnoses, judged, cutoff, looks))
    alone = tuple(_alone_studies(recipe, recording, cutoff, looks, progress))
    return ArmStudy(recording, identified, diagnoses, judged, lines, alone)


def baselines_of(recording: Recording) -> tuple[Baseline, ...]:
    """The baselines of an arm: its links as given, where there are any, and refitted ones."""
    return ("refit",) if recording.arm.links is None else ("nominal", "refit")


def progress_under(heading: str, progress: Progress) -> Progress:
    """Progress messages below a heading."""
    return lambda message: progress(f"{heading}: {message}")


def _lines(
    recipe: Recipe,
    identified: Study,
    diagnoses: dict[Baseline, Diagnosis],
    judged: tuple[JudgedRun, ...],
    cutoff_hz: float,
    looks: Looks,
) -> Iterator[ModelLine]:
    usual = usual_models(identified.recording, identified, cutoff_hz)
    for each in judged:
        errors = {name: each.percent(model) for name, model in usual.items()}
        for baseline, diagnosis in diagnoses.items():
            found = {name: each.percent(model) for name, model in found_models(diagnosis).items()}
            yield ModelLine(
                arm=recipe.name,
                baseline=baseline,
                run=each.run.name,
                cutoff_hz=cutoff_hz,
                errors=errors | found,
                best_known=recipe.best_known.get(each.run.name),
                identify_seconds=identified.seconds,
                diagnose_seconds=diagnosis.seconds,
                reading_seconds=diagnosis.setup_seconds,
                looks=looks.count(recipe.name, each.run.name),
            )


def usual_models(recording: Recording, identified: Study, cutoff_hz: float) -> dict[ModelName, TorqueModel]:
    """The rigid arm as given, where it has links, and what is identified."""
    given: dict[ModelName, TorqueModel] = {}
    if recording.arm.links is not None:
        given["rigid_given"] = given_model(recording, cutoff_hz)
    models = identified.models
    return given | {
        "rigid_refitted": models["rigid"].model_,
        "plain_friction": models["friction"].model_,
        "identify": models["chosen"].model_,
    }


def given_model(recording: Recording, cutoff_hz: float) -> TorqueModel:
    """Links and rotors as the robot file has them; ValueError for an arm without links."""
    arm = recording.arm
    rotors = [(RotorInertia.at(arm, joint), value) for joint, value in enumerate(arm.rotor_inertia, 1) if value]
    structure = Structure(arm, tuple(rotor for rotor, _ in rotors))
    values = np.concatenate([structure.base.values(arm.parameters), np.array([value for _, value in rotors])])
    return TorqueModel(recording.robot, structure, values, inertial=arm.parameters, cutoff_hz=cutoff_hz)


def found_models(diagnosis: Diagnosis) -> dict[ModelName, TorqueModel]:
    """The models of a diagnosis; none where it fitted nothing."""
    if diagnosis.inertial is None:
        return {}
    return {"named": named_model(diagnosis), "diagnose": model_found(diagnosis)}


def _alone_studies(
    recipe: Recipe, recording: Recording, cutoff_hz: float, looks: Looks, progress: Progress
) -> Iterator[AloneStudy]:
    for run in recording.runs if recipe.name in DIAGNOSED_BY_RUN else ():
        diagnosis = _diagnose_alone(recipe, recording, run, progress)
        others = [each for each in recording.runs if each.name != run.name]
        for other in others:
            if other.role == "validate":
                looks.note(recipe.name, other.name, f"diagnose, nominal, {run.name} alone")
        models = found_models(diagnosis)
        errors = {
            other.name: {name: judged_run(other, cutoff_hz).percent(model) for name, model in models.items()}
            for other in others
        }
        yield AloneStudy(run.name, diagnosis, errors)


def _diagnose_alone(recipe: Recipe, recording: Recording, run: Run, progress: Progress) -> Diagnosis:
    heading = f"{recipe.name}, nominal, {run.name} alone"
    alone = replace(recording, runs=(replace(run, role="identify"),))
    settings = Settings(weights=calibrated_weights(recipe.name))
    return diagnose(alone, "nominal", settings=settings, progress=progress_under(heading, progress))
