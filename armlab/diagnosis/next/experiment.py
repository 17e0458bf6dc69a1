"""The design of the next experiment from a verdict: the motion, the separation of each pair of rivals, and the
chances of a decision.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.diagnosis.next.decision import Chances, decision_chances
from armlab.diagnosis.next.motion import (
    Budget,
    build_excitation_problem,
    limits_in_force,
    random_generator,
    random_point,
    recorded_place,
    search_motion,
    secure_motion,
)
from armlab.diagnosis.next.prepare import LinkKnowledge, PreparedQuestions, find_nearby_names, prepare_questions
from armlab.diagnosis.next.problem import TellApartProblem, tell_apart_problem
from armlab.diagnosis.next.question import CLEAR_SEPARATION, Question
from armlab.diagnosis.next.remedies import Remedy, find_remedies
from armlab.diagnosis.next.verdict_file import RivalGroup, VerdictWithModel, read_verdict, select_rival_groups
from armlab.recordings.load import load_recording
from armlab.recordings.recording import Recording
from problem.arm import Arm
from problem.excitation import ExcitationProblem
from problem.robot_file import load_arm
from problem.safe_motion import SafetyRules, SafetySettings, safety_rules
from problem.safety_proof import SafetyReport

RANDOM_MOTIONS = 20  # random motions that a design is compared with
WHOLE_LIBRARY = "library"  # in place of names: all names that explain the data nearly as well


@dataclass(frozen=True)
class RivalPair:
    """Two rivals of a question, and the standard errors between them.

    before: with the first recording alone. random: with a random motion of the same limits, too (median). after: with
    the designed motion, too. hopeless: no motion separates them.
    """

    question: int
    names: tuple[str, str]
    places: tuple[int, int]
    before: float
    random: float
    after: float
    hopeless: bool
    remedies: tuple[Remedy, ...] = ()


@dataclass(frozen=True, eq=False)
class Experiment:
    """point: (dimension,) of the designed motion, None where no motion helps. chances: one a question.

    safety: what was checked of the motion beside its limits, None where there is no motion.
    """

    prepared: PreparedQuestions
    excitation: ExcitationProblem
    budget: Budget
    problem: TellApartProblem | None
    point: Array | None
    pairs: tuple[RivalPair, ...]
    chances: tuple[Chances | None, ...]
    safety: SafetyReport | None
    seconds: float


def design_experiment(
    verdict: Path,
    robot: str,
    recording: Path | None,
    rivals: str | None,
    budget: Budget,
    links: LinkKnowledge | None,
    safety: SafetySettings,
    progress: Callable[[str], None] = lambda message: None,
) -> Experiment:
    """Designs the next experiment; InputError, in one line, for anything that cannot be used.

    progress: is told what is being done.
    """
    began = time.perf_counter()
    progress("reading the verdict")
    loaded_verdict, arm = read_verdict(verdict), load_arm(robot)
    recorded = None if recording is None else load_recording(recording)
    _check_same_joints(arm, recorded)
    place = None if recorded is None else recorded_place(recorded)
    rules = safety_rules(arm, robot, limits_in_force(arm, recorded), safety, place)
    progress("preparing the questions")
    prepared, excitation = _prepare(loaded_verdict, arm, recorded, rivals, budget, links, rules)
    problem = point = report = None
    if any(question.pairs for question in prepared.questions):
        progress("searching the motion")
        problem = tell_apart_problem(prepared, excitation)
        point, report = secure_motion(problem, search_motion(problem, budget), rules)
    progress("weighing what the motion tells")
    pairs = _compare_pairs(prepared, excitation, problem, point, budget)
    chances = tuple(_question_chances(prepared, question, problem, point, budget) for question in prepared.questions)
    return Experiment(prepared, excitation, budget, problem, point, pairs, chances, report, time.perf_counter() - began)


def prepare_experiment(
    verdict: Path,
    arm: Arm,
    recording: Recording | None,
    rivals: str | None,
    budget: Budget,
    links: LinkKnowledge | None,
) -> tuple[PreparedQuestions, ExcitationProblem]:
    """The questions of a verdict, and the motions that this arm may make; without safety rules."""
    return _prepare(read_verdict(verdict), arm, recording, rivals, budget, links, None)


def _prepare(
    loaded_verdict: VerdictWithModel,
    arm: Arm,
    recording: Recording | None,
    rivals: str | None,
    budget: Budget,
    links: LinkKnowledge | None,
    safety: SafetyRules | None,
) -> tuple[PreparedQuestions, ExcitationProblem]:
    _check_same_joints(arm, recording)
    if not len(loaded_verdict.noise) and recording is None:
        raise InputError(f"{loaded_verdict.path} tells nothing of the noise, as it is inconclusive: give --recording")
    if len(loaded_verdict.noise) not in (0, len(arm)):
        raise InputError(
            f"{loaded_verdict.path} tells the noise of {len(loaded_verdict.noise)} joints, {arm.name} has {len(arm)}"
        )
    excitation = build_excitation_problem(arm, limits_in_force(arm, recording), budget, safety)
    known_links = links or infer_link_knowledge(loaded_verdict, arm)
    groups = choose_rival_groups(loaded_verdict, arm, excitation, recording, rivals, known_links, budget)
    return prepare_questions(
        loaded_verdict, groups, arm, excitation.trajectory, budget.duration, recording, known_links, budget.seed
    ), excitation


def _check_same_joints(arm: Arm, recording: Recording | None) -> None:
    if recording is not None and len(recording.arm) != len(arm):
        raise InputError(f"{recording.name} has {len(recording.arm)} joints, {arm.name} {len(arm)}")


def infer_link_knowledge(verdict: VerdictWithModel, arm: Arm) -> LinkKnowledge:
    """How well links are known after a diagnosis: exactly where it left them as they were given."""
    if arm.links is None:
        return "free"
    return "exact" if np.allclose(verdict.inertial(arm), arm.parameters, rtol=1e-6, atol=1e-9) else "near"


def choose_rival_groups(
    verdict: VerdictWithModel,
    arm: Arm,
    excitation: ExcitationProblem,
    recording: Recording | None,
    rivals: str | None,
    links: LinkKnowledge,
    budget: Budget,
) -> tuple[RivalGroup, ...]:
    """Groups of names of which one is right: those of the verdict, or those in `rivals`.

    With `library` in `rivals`, each finding stands with all names that explain the recording nearly as well.
    """
    if rivals != WHOLE_LIBRARY:
        return select_rival_groups(verdict, rivals)
    if recording is None:
        raise InputError("--rivals library: needs --recording, in which all names are compared")
    groups = find_nearby_names(verdict, arm, excitation.trajectory, budget.duration, recording, links, budget.seed)
    if not groups:
        raise InputError(f"{verdict.path}: no name of the library comes near a finding, so nothing is to be decided")
    return groups


def _question_chances(
    prepared: PreparedQuestions,
    question: Question,
    problem: TellApartProblem | None,
    point: Array | None,
    budget: Budget,
) -> Chances | None:
    if problem is None or point is None or not question.pairs:
        return None
    return decision_chances(
        prepared, question, problem.moments(point).gram, problem.rows, random_generator("chances", budget)
    )


def _compare_pairs(
    prepared: PreparedQuestions,
    excitation: ExcitationProblem,
    problem: TellApartProblem | None,
    point: Array | None,
    budget: Budget,
) -> tuple[RivalPair, ...]:
    times = prepared.sampling.times(budget.duration)
    drawn = np.array([random_point(excitation, _budget_with_seed(budget, number)) for number in range(RANDOM_MOTIONS)])
    motions = excitation.trajectory.motions(drawn, times).motion
    scenes = [prepared.present.scene(motions.select(np.intp(number)), times) for number in range(RANDOM_MOTIONS)]
    random_grams = [prepared.total_gram(prepared.moments(scene).gram) for scene in scenes]
    before = prepared.before.gram + prepared.layout.prior
    after = before if problem is None or point is None else prepared.total_gram(problem.moments(point).gram)
    out = []
    for number, question in enumerate(prepared.questions):
        for pair in sorted([*question.pairs, *question.hopeless]):
            hopeless = pair in question.hopeless
            first_alone, designed = question.separation(before, *pair), question.separation(after, *pair)
            random = float(np.median([question.separation(each, *pair) for each in random_grams]))
            weak = hopeless or designed < CLEAR_SEPARATION
            remedies = find_remedies(prepared, question, pair, scenes[0].motion, times) if weak else []
            names = (str(question.rivals[pair[0]].name), str(question.rivals[pair[1]].name))
            out.append(RivalPair(number, names, pair, first_alone, random, designed, hopeless, tuple(remedies)))
    return tuple(out)


def _budget_with_seed(budget: Budget, number: int) -> Budget:
    return Budget(budget.duration, budget.harmonics, budget.algorithm, budget.evaluations, budget.seed + 1000 + number)
