"""The design of the next experiment from a verdict: the motion, the separation of each pair of rivals, and the
chances of a decision.
"""

import time
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
    search_motion,
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

RANDOM_MOTIONS = 20  # random motions that a design is compared with
WHOLE_LIBRARY = "library"  # in place of names: everything that comes near


@dataclass(frozen=True)
class RivalPair:
    """Two rivals of a question. before, random, after: standard errors between them with the first recording alone,
    with a random motion of the same limits (median), with the designed one. hopeless: no motion separates them.
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
    """point: (dimension,) of the designed motion, None where no motion helps. chances: one a question."""

    prepared: PreparedQuestions
    excitation: ExcitationProblem
    budget: Budget
    problem: TellApartProblem | None
    point: Array | None
    pairs: tuple[RivalPair, ...]
    chances: tuple[Chances | None, ...]
    seconds: float


def design_experiment(
    verdict: Path, robot: str, recording: Path | None, rivals: str | None, budget: Budget, links: LinkKnowledge | None
) -> Experiment:
    """Designs the next experiment; InputError, in one line, for anything that cannot be used."""
    began = time.perf_counter()
    arm = load_arm(robot)
    loaded = None if recording is None else load_recording(recording)
    prepared, plain = prepare_experiment(verdict, arm, loaded, rivals, budget, links)
    problem = point = None
    if any(question.pairs for question in prepared.questions):
        problem = tell_apart_problem(prepared, plain)
        point = search_motion(problem, budget)
    pairs = _compare_pairs(prepared, plain, problem, point, budget)
    decided = tuple(_question_chances(prepared, question, problem, point, budget) for question in prepared.questions)
    return Experiment(prepared, plain, budget, problem, point, pairs, decided, time.perf_counter() - began)


def prepare_experiment(
    verdict: Path,
    arm: Arm,
    recording: Recording | None,
    rivals: str | None,
    budget: Budget,
    links: LinkKnowledge | None,
) -> tuple[PreparedQuestions, ExcitationProblem]:
    """The questions of a verdict, and the motions that this arm may make."""
    read = read_verdict(verdict)
    if recording is not None and len(recording.arm) != len(arm):
        raise InputError(f"{recording.name} has {len(recording.arm)} joints, {arm.name} {len(arm)}")
    if len(read.noise) not in (0, len(arm)) or (not len(read.noise) and recording is None):
        raise InputError(f"{read.path} tells the noise of {len(read.noise)} joints, {arm.name} has {len(arm)}")
    limits = limits_in_force(arm, recording)
    plain = build_excitation_problem(arm, limits, budget)
    kind = links or infer_link_knowledge(read, arm)
    groups = choose_rival_groups(read, arm, plain, recording, rivals, kind, budget)
    return prepare_questions(read, groups, arm, plain.trajectory, budget.duration, recording, kind, budget.seed), plain


def infer_link_knowledge(verdict: VerdictWithModel, arm: Arm) -> LinkKnowledge:
    """How well links are known after a diagnosis: exactly where it left them as they were given."""
    if arm.links is None:
        return "free"
    return "exact" if np.allclose(verdict.inertial(arm), arm.parameters, rtol=1e-6, atol=1e-9) else "near"


def choose_rival_groups(
    verdict: VerdictWithModel,
    arm: Arm,
    plain: ExcitationProblem,
    recording: Recording | None,
    rivals: str | None,
    links: LinkKnowledge,
    budget: Budget,
) -> tuple[RivalGroup, ...]:
    """Groups of names of which one is right: those of the verdict, named ones, or with `library` all that come near."""
    if rivals != WHOLE_LIBRARY:
        return select_rival_groups(verdict, rivals)
    if recording is None:
        raise InputError("--rivals library: needs --recording, in which all names are compared")
    groups = find_nearby_names(verdict, arm, plain.trajectory, budget.duration, recording, links, budget.seed)
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
    plain: ExcitationProblem,
    problem: TellApartProblem | None,
    point: Array | None,
    budget: Budget,
) -> tuple[RivalPair, ...]:
    times = prepared.sampling.times(budget.duration)
    drawn = np.array([random_point(plain, _budget_with_seed(budget, number)) for number in range(RANDOM_MOTIONS)])
    motions = plain.trajectory.motions(drawn, times).motion
    scenes = [prepared.present.scene(motions.select(np.intp(number)), times) for number in range(RANDOM_MOTIONS)]
    others = [prepared.together(prepared.moments(scene).gram) for scene in scenes]
    before = prepared.before.gram + prepared.layout.prior
    after = before if problem is None or point is None else prepared.together(problem.moments(point).gram)
    out = []
    for number, question in enumerate(prepared.questions):
        for pair in sorted([*question.pairs, *question.hopeless]):
            hopeless = pair in question.hopeless
            near, far = question.separation(before, *pair), question.separation(after, *pair)
            middle = float(np.median([question.separation(each, *pair) for each in others]))
            weak = hopeless or far < CLEAR_SEPARATION
            elsewise = find_remedies(prepared, question, pair, scenes[0].motion, times) if weak else []
            names = (str(question.rivals[pair[0]].name), str(question.rivals[pair[1]].name))
            out.append(RivalPair(number, names, pair, near, middle, far, hopeless, tuple(elsewise)))
    return tuple(out)


def _budget_with_seed(budget: Budget, number: int) -> Budget:
    return Budget(budget.duration, budget.harmonics, budget.algorithm, budget.evaluations, budget.seed + 1000 + number)
