"""The diagnosis of a recording with torque: read it rightly, filter it, and let the stages say what is missing.

`prepare` makes filtered rows and the columns of the links; `stages.py` lists how names are found and claimed, one
sentence each; `conclude.py` makes the diagnosis of what is believed in the end.
"""

import time
from dataclasses import replace

from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.settings import Baseline, Settings
from armlab.diagnosis.torque.belief import Belief
from armlab.diagnosis.torque.columns.design import DesignMatrix, build_design_matrix
from armlab.diagnosis.torque.columns.links import link_prior
from armlab.diagnosis.torque.conclude import conclude
from armlab.diagnosis.torque.rows.data import in_fixed_order, observe
from armlab.diagnosis.torque.rows.simulation import read_simulation, reason_misread
from armlab.diagnosis.torque.search.fitted_model import (
    FittedModel,
    Progress,
)
from armlab.diagnosis.torque.stages import BY_PROBABILITY, BY_TESTS, find_names, run_stages
from armlab.recordings.check import signs_of_wrong_reading
from armlab.recordings.dead_joints import leave_dead_joints_out
from armlab.recordings.identifiable import reason_impossible, reason_not_identifiable
from armlab.recordings.reading.answer import Answer, read_rightly, with_joints_left_out
from armlab.recordings.reading.tuning import ReadingTuning
from armlab.recordings.recording import ROLES, Recording
from problem.base_parameters import base_parameters
from problem.pseudo_inertia import are_bodies


def diagnose(
    recording: Recording,
    baseline: Baseline | None = None,
    seed: int = 0,
    settings: Settings | None = None,
    progress: Progress = lambda message: None,
    as_read: bool = False,
    only_setup: bool = False,
    repetitions: int = 0,
) -> Diagnosis:
    """Where the simulation and the recording differ, what physics is missing, and how much better it then predicts.

    baseline: what is compared; the simulation where there is one if left out. seed: of the surrogates' random waves.
    progress: is told what is being done. as_read: the recording and the robot file are not doubted. only_setup: nothing
    but the reading is asked. repetitions: how often it is asked whether names survive (`with_survival`). Raises
    InputError where the wanted baseline is not there.
    """
    started, settings, recording = time.perf_counter(), settings or Settings(), leave_dead_joints_out(recording)
    signs = signs_of_wrong_reading(recording)
    setup = None if as_read else find_setup(recording, baseline, settings, progress)
    read_after = time.perf_counter() - started
    if setup is not None:
        recording = setup.recording
        signs += tuple(each.finding for each in setup.doubts)
    if only_setup or (setup is not None and setup.is_lost):
        return with_setup(replace(_reading_alone(recording, baseline, settings, setup), signs=signs), setup, read_after)
    design = prepare(recording, baseline, settings, progress)
    if isinstance(design, Diagnosis):
        return with_setup(replace(design, signs=signs), setup, read_after)
    belief = run_stages(BY_PROBABILITY, find_names(design, seed, progress), progress)
    found = conclude(recording, belief)
    if repetitions:
        from armlab.diagnosis.torque.survival import with_survival  # and joblib, which takes long to import

        found = with_survival(found, belief, design, repetitions, seed, progress)
    found = _only_if_explained(found, setup, settings.tuning.reading)
    found = replace(found, signs=signs, seconds=time.perf_counter() - started)
    return with_setup(found, setup, read_after)


def _only_if_explained(found: Diagnosis, setup: Answer | None, tuning: ReadingTuning) -> Diagnosis:
    """The diagnosis, or an inconclusive one where neither a reading nor physics explains the torque.

    What is found stands where the model explains the torque that it was fitted to, and not what was held out.
    """
    if not found.left or found.simulation.kind == "simulated":
        return found
    fitted, share = (found.left[role] for role in ROLES)
    if share <= tuning.max_unexplained:
        return found
    if fitted <= tuning.max_unexplained and any(not each.minor for each in found.claims):
        return replace(found, carries_over=False)
    tried = f", however it is read ({setup.looks} readings were tried)" if setup is not None and setup.looks > 1 else ""
    reason = (
        f"Links, friction and all other physics leave {share:.0%} of the variation of the torque{tried}: another "
        "robot, or torque that is none? Move one joint alone and see which columns change."
    )
    if fitted <= tuning.max_unexplained:
        reason = (
            f"Of the variation of the torque the model leaves {fitted:.0%} where it was fitted, and {share:.0%} where "
            "it was not: the motion is too short, or too unlike what was held out, to tell its numbers. Record longer "
            "runs in which all joints move."
        )
    return Diagnosis(found.recording, found.simulation, "inconclusive", reason, found.observed)


def _reading_alone(
    recording: Recording, baseline: Baseline | None, settings: Settings, setup: Answer | None
) -> Diagnosis:
    """What is said where physics is not asked. setup: how the recording is to be read, if that was asked."""
    simulation = read_simulation(recording, baseline)
    reason = reason_not_identifiable(recording)
    if reason is None and setup is not None and setup.looks == 0 and not setup.is_lost:
        reason = TOO_SHORT_TO_READ
    if reason is not None:
        return Diagnosis(recording, simulation, "inconclusive", reason)
    right = "Nothing else is wrong" if setup is not None and setup.sentence else "Nothing is wrong"
    return Diagnosis(recording, simulation, "none", f"{right} with the reading; physics was not asked.")


TOO_SHORT_TO_READ = (
    "The runs are too short, or the transmission cannot be undone, to tell how the recording is to be read: "
    "record longer runs."
)


def find_setup(
    recording: Recording, baseline: Baseline | None, settings: Settings, progress: Progress
) -> Answer | None:
    """How the recording and the robot file are to be read.

    None for a recording that cannot be used anyhow, and where the links of the robot file play no part.
    """
    simulation = read_simulation(recording, baseline)
    if simulation.kind == "simulated" or reason_not_identifiable(recording) is not None:
        left_out = with_joints_left_out(Answer((), recording, None), recording)
        return left_out if left_out.findings else None
    progress("reading the recording rightly")
    return read_rightly(recording, simulation.inertial, settings.tuning.reading)


def with_setup(diagnosis: Diagnosis, setup: Answer | None, seconds: float) -> Diagnosis:
    """The diagnosis of a recording read rightly, with the mistakes of its reading."""
    if setup is None or not setup.findings:
        return replace(diagnosis, setup=setup, setup_seconds=seconds)
    return replace(diagnosis, status="mismatch", setup=setup, setup_seconds=seconds)


def prepare(
    recording: Recording, baseline: Baseline | None, settings: Settings, progress: Progress
) -> DesignMatrix | Diagnosis:
    """The runs filtered, and the columns of the links; a diagnosis where nothing can be said, and why."""
    simulation = read_simulation(recording, baseline)
    reason = reason_not_identifiable(recording) or reason_impossible(recording.runs, recording.arm)
    if reason is not None:
        return Diagnosis(recording, simulation, "inconclusive", reason)
    progress("filtering")
    observed = observe(in_fixed_order(recording.runs), simulation.arm, simulation.inertial, settings)
    reason = observed.reason_too_short(simulation.arm) or reason_misread(
        observed, simulation, settings.tuning.soundness
    )
    if reason is not None:
        return Diagnosis(recording, simulation, "inconclusive", reason, observed)
    base = base_parameters(simulation.arm)
    links = simulation.inertial
    prior = None if links is None or not are_bodies(links) else link_prior(simulation.arm, base, links)
    return build_design_matrix(observed, simulation, base, prior, settings)


def conclude_search(recording: Recording, searched: FittedModel, progress: Progress) -> Diagnosis:
    """The diagnosis of a recording from what a search found."""
    named = run_stages(BY_TESTS, Belief(searched), progress)
    return conclude(recording, run_stages(BY_PROBABILITY, named, progress))
