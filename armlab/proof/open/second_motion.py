"""Second motions for a recording, for comparison: the designed one, a random one, and the one of the smallest
condition number.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import DataError, InputError
from armlab.common.files import write_texts
from armlab.diagnosis.next.decision import Chances, decision_chances
from armlab.diagnosis.next.experiment import (
    WHOLE_LIBRARY,
    choose_rival_groups,
    infer_link_knowledge,
    prepare_experiment,
)
from armlab.diagnosis.next.motion import (
    Budget,
    build_excitation_problem,
    limits_in_force,
    random_generator,
    random_point,
    search_motion,
)
from armlab.diagnosis.next.problem import TellApartProblem, tell_apart_problem
from armlab.diagnosis.next.question import Name
from armlab.diagnosis.next.verdict_file import RivalGroup, read_verdict
from armlab.diagnosis.torque.diagnose import diagnose
from armlab.recordings.load import load_recording
from armlab.recordings.recording import Recording
from armlab.report.verdict_files import verdict_texts
from problem.arm import Arm
from problem.excitation import ExcitationProblem
from problem.robot_file import load_arm
from problem.trajectories import sample_instants

MotionKind = Literal["designed", "random", "condition"]
MOTION_RATE_HZ = 250.0


@dataclass(frozen=True, eq=False)
class FollowUpMotion:
    """motion: (samples, 1 + joints), s and rad. expected: for each question its names and the chances."""

    motion: Array
    expected: tuple[tuple[tuple[Name, ...], Chances], ...]


def write_diagnosis(recording: Path, out: Path) -> None:
    """Writes the verdict about a recording and its model into `out`."""
    diagnosis = diagnose(load_recording(recording))
    write_texts(verdict_texts(diagnosis, out), out)


def suspect_rivals(verdict: Path, robot: Path, recording: Path) -> tuple[RivalGroup, ...]:
    """Groups of names, of the whole library, between which the recording leaves doubt."""
    arm, loaded, budget = load_arm(str(robot)), load_recording(recording), Budget()
    excitation = build_excitation_problem(arm, limits_in_force(arm, loaded), budget)
    loaded_verdict = read_verdict(verdict)
    try:
        return choose_rival_groups(
            loaded_verdict, arm, excitation, loaded, WHOLE_LIBRARY, infer_link_knowledge(loaded_verdict, arm), budget
        )
    except InputError:
        return ()


def design_second_motion(
    kind: MotionKind, verdict: Path, robot: Path, recording: Path, budget: Budget
) -> FollowUpMotion | None:
    """A motion of that kind, and what it is expected to decide; None where no motion can be designed.

    All kinds share limits, duration, harmonics and number of evaluations.
    """
    arm, loaded = load_arm(str(robot)), load_recording(recording)
    excitation = build_excitation_problem(arm, limits_in_force(arm, loaded), budget)
    problem = _build_problem(verdict, arm, loaded, budget)
    if kind == "random":
        point = random_point(excitation, budget)
    elif kind == "condition":
        point = search_motion(excitation, budget)
    elif problem is None:
        return None
    else:
        point = search_motion(problem, budget)
    return FollowUpMotion(
        _sample_motion(excitation, point), () if problem is None else _expected_decisions(problem, point, budget)
    )


def _build_problem(verdict: Path, arm: Arm, recording: Recording, budget: Budget) -> TellApartProblem | None:
    """The problem between the rivals of the verdict, else between all names near a finding; None if no motion helps."""
    for rivals in (None, WHOLE_LIBRARY):
        try:
            return tell_apart_problem(*prepare_experiment(verdict, arm, recording, rivals, budget, None))
        except (InputError, DataError):
            continue
    return None


def _expected_decisions(
    problem: TellApartProblem, point: Array, budget: Budget
) -> tuple[tuple[tuple[Name, ...], Chances], ...]:
    gram, prepared = problem.moments(point).gram, problem.prepared
    return tuple(
        (
            tuple(each.name for each in question.rivals),
            decision_chances(prepared, question, gram, problem.rows, random_generator("chances", budget)),
        )
        for question in prepared.questions
    )


def _sample_motion(excitation: ExcitationProblem, point: Array) -> Array:
    times = sample_instants(excitation.duration, round(excitation.duration * MOTION_RATE_HZ) + 1)
    motion = excitation.trajectory.motions(point[None], times).motion
    return np.column_stack([times, motion.position[0]])
