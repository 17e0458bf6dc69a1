"""From a verdict to questions with numbers: rivals with laws and sizes, what is free beside them, and names of the
library that come near a finding.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.diagnosis.links import link_prior
from armlab.diagnosis.next.first_run import FirstRun, FoundEffect, PresentModel, observe_first_run
from armlab.diagnosis.next.moments import Index, Moments, empty_moments
from armlab.diagnosis.next.question import (
    LINK_PARAMETER_ERROR,
    Layout,
    Name,
    Question,
    build_layout,
    inseparable_rivals,
)
from armlab.diagnosis.next.rivals import (
    MIN_BEYOND_NOISE,
    OfferedLaws,
    RivalChoice,
    alternative_laws,
    choose_rivals,
    explained_power,
    leaves_trace,
    name_of,
    offered_laws,
    restore_part,
    usual_friction,
)
from armlab.diagnosis.next.sampling import SAMPLES_PER_ROW, Sampling, white_noise_sampling
from armlab.diagnosis.next.verdict_file import Finding, RivalGroup, VerdictWithModel
from armlab.diagnosis.settings import Settings
from armlab.effects.contract import UNKNOWN, Candidate, Scene
from armlab.effects.library import effect_named, library
from armlab.recordings.recording import Recording
from problem.arm import Arm
from problem.base_parameters import BaseParameters, base_parameters
from problem.trajectories import Trajectory

LinkKnowledge = Literal["exact", "near", "free"]
NEAR_LINK_WIDTH = 0.08  # width of the links' errors: about as far as drawings are off
RICH_MOTIONS = 3  # random motions that show what any motion could show


@dataclass(frozen=True, eq=False)
class PreparedQuestions:
    """seen: what the first recording says of the columns of `layout`; before: its rows from which a diagnosis learns.

    rows: those rows, of all joints. counted: share of a new run that will be among them, the rest is held out.
    """

    present: PresentModel
    layout: Layout
    questions: tuple[Question, ...]
    sampling: Sampling
    seen: Moments
    before: Moments
    rows: int
    learned_share: float
    first: FirstRun | None

    def moments(self, scene: Scene) -> Moments:
        """What a diagnosis would learn from a designed motion."""
        whole = self.layout.moments(scene, self.sampling.filter(len(scene.time)), self.sampling)
        return Moments(self.learned_share * whole.gram, self.learned_share * whole.vector)

    @property
    def known_moments(self) -> Moments:
        """All that the first recording says, with what is known of the links beforehand."""
        return Moments(self.seen.gram + self.layout.prior, self.seen.vector)

    def rows_with(self, samples: int) -> float:
        """Rows of both recordings from which a diagnosis learns, all joints; samples: of a designed motion."""
        return self.rows + self.learned_share * (samples // SAMPLES_PER_ROW) * len(self.present.arm)

    def together(self, gram: Array) -> Array:
        """Moments of both runs, and what is known of the links beforehand."""
        return np.asarray(gram + self.before.gram + self.layout.prior)


def prepare_questions(
    verdict: VerdictWithModel,
    groups: tuple[RivalGroup, ...],
    arm: Arm,
    trajectory: Trajectory,
    duration: float,
    recording: Recording | None = None,
    links: LinkKnowledge = "near",
    seed: int = 0,
    lenient: bool = False,
) -> PreparedQuestions:
    """Everything that a design needs; InputError where a rival cannot be sized or leaves no trace.

    lenient: groups with such a rival are left out instead.
    """
    families = library()
    parts = {each.name: part for each in verdict.findings if (part := restore_part(each, arm, families)) is not None}
    own = tuple(part for name, part in parts.items() if name.effect != LINK_PARAMETER_ERROR)
    present = PresentModel(arm, verdict.inertial(arm), own)
    first = observe_first_run(recording, present) if recording is not None else None
    sampling = white_noise_sampling(verdict.noise, verdict.cutoff_hz or Settings().cutoff_hz)
    if first is not None:
        sampling = replace(sampling, kept_hz=first.observed.rate_hz, cutoff_hz=first.observed.cutoff_hz)
    rich = _rich_scenes(present, trajectory, sampling.times(duration), seed)
    scenes = list(first.scenes) if first else rich
    offered = offered_laws(families, arm, scenes)
    if lenient:
        groups = tuple(group for group in groups if all(leaves_trace(name, offered) for name in group))
    laws = {name: alternative_laws(name, offered) for name in dict.fromkeys(each for group in groups for each in group)}
    candidates = [*usual_friction(arm, scenes), *(part[0] for part in own)]
    candidates += [parts[name][0] for name in laws if name in parts]
    candidates += [each for shapes in laws.values() for each in shapes]
    base = base_parameters(arm)
    layout = build_layout(base, candidates, scenes[0], _link_precision(arm, base, present.inertial, links))
    return _Preparation(present, parts, laws, layout, links, first, rich, sampling).prepared(groups, offered)


@dataclass(frozen=True, eq=False)
class _Preparation:
    present: PresentModel
    parts: dict[Name, FoundEffect]
    laws: dict[Name, list[Candidate]]
    layout: Layout
    links: LinkKnowledge
    first: FirstRun | None
    rich: list[Scene]
    white: Sampling

    def prepared(self, groups: tuple[RivalGroup, ...], offered: OfferedLaws) -> PreparedQuestions:
        """Chooses laws and sizes, and keeps the columns that are needed."""
        sampling, whole, before = self._recorded_moments(groups)
        shown = self._rich_gram(sampling)
        seen = whole.gram if self.first else shown
        places = sum(map(len, offered.values()))
        questions = []
        for group in groups:
            free, found = self._free_columns(group), self._found_columns(group)
            known = Moments(seen + self.layout.prior, whole.vector)
            joints = len(self.present.arm)
            rivals = choose_rivals(
                self._rival_choices(group), found, known, shown, places, self.first is not None, joints
            )
            questions.append(Question(rivals, free, found, inseparable_rivals(rivals, free, shown + self.layout.prior)))
        return self._keep_needed_columns(tuple(questions), sampling, whole, before)

    def _recorded_moments(self, groups: tuple[RivalGroup, ...]) -> tuple[Sampling, Moments, Moments]:
        """The sampling, and moments of all rows and of those from which a diagnosis learns."""
        if self.first is None:
            return self.white, empty_moments(self.layout.size), empty_moments(self.layout.size)
        columns = self.first.columns(self.layout)
        found = [self.parts[group[0]][0] for group in groups if group[0] in self.parts]
        fitted = np.unique(np.concatenate([self._free_columns(()), *(self.layout.of(each) for each in found)]))
        sampling = self.first.sampling(columns, fitted.astype(np.intp))
        sampling = replace(sampling, standing=self._standing_speeds(sampling, groups))
        before = self.first.moments(columns, sampling.noise, "identify")
        whole = before + self.first.moments(columns, sampling.noise, "validate")
        for name in sorted(
            {group[0] for group in groups if group[0].effect == LINK_PARAMETER_ERROR} & self.parts.keys(), key=str
        ):
            candidate, values = self.parts[name]  # what the links of the model hold already is given back
            whole, before = (self._give_back(each, candidate, values) for each in (whole, before))
        return sampling, whole, before

    def _standing_speeds(self, sampling: Sampling, groups: tuple[RivalGroup, ...]) -> tuple[float, ...]:
        """Speeds below which a joint with dry friction, found or asked for, stands still; 0 for the others."""
        named = {*self.parts, *(name for group in groups for name in group)}
        sticky = {name.joint for name in named if effect_named(name.effect).sticks}
        return tuple(each if joint + 1 in sticky else 0.0 for joint, each in enumerate(sampling.standing))

    def _give_back(self, moments: Moments, candidate: Candidate, values: Array) -> Moments:
        return Moments(moments.gram, moments.vector + moments.gram[:, self.layout.of(candidate)] @ values)

    def _free_columns(self, group: RivalGroup) -> Index:
        """Columns that may be fitted beside the rivals of a group: what was found, and usual friction of all joints."""
        usual = [each for each in usual_friction(self.present.arm, self.rich) if name_of(each) not in group]
        return np.unique(np.concatenate([self._found_columns(group), *map(self.layout.of, usual)])).astype(np.intp)

    def _found_columns(self, group: RivalGroup) -> Index:
        """Columns of the other findings, and of the links where they are not known exactly."""
        others = [
            part[0] for name, part in self.parts.items() if name not in group and name.effect != LINK_PARAMETER_ERROR
        ]
        rigid = np.arange(0 if self.links == "exact" else len(self.layout.base))
        return np.unique(np.concatenate([rigid, *map(self.layout.of, others)])).astype(np.intp)

    def _rival_choices(self, group: RivalGroup) -> list[RivalChoice]:
        out = []
        for name in group:
            part = self.parts.get(name)
            values = None if part is None else part[1]
            shapes = [*([] if part is None else [part[0]]), *self.laws[name]]
            unique = list(dict.fromkeys(shapes))
            out.append(RivalChoice(name, tuple((each, self.layout.of(each)) for each in unique), values))
        if all(each.values is None for each in out) and self.first is None:
            raise InputError(f"how large is {group[0]}? the verdict has found none of the rivals: give --recording")
        return out

    def _rich_gram(self, sampling: Sampling) -> Array:
        """What rich motions show, even while a joint stands still."""
        sampling = replace(sampling, standing=())
        moments = [self.layout.moments(scene, sampling.filter(len(scene.time)), sampling) for scene in self.rich]
        return np.asarray(np.sum([each.gram for each in moments], axis=0))

    def _keep_needed_columns(
        self, questions: tuple[Question, ...], sampling: Sampling, *recorded: Moments
    ) -> PreparedQuestions:
        """The same with only the columns that the questions need."""
        laws = [law.columns for question in questions for rival in question.rivals for law in rival.laws]
        needed = np.concatenate([np.arange(len(self.layout.base)), *(each.free for each in questions), *laws])
        kept = np.unique(needed).astype(np.intp)
        chosen = [each for each, at in zip(self.layout.candidates, self.layout.places, strict=True) if at[0] in kept]
        count = len(self.layout.base)
        layout = build_layout(self.layout.base, chosen, self.rich[0], self.layout.prior[:count, :count])
        whole, before = (Moments(each.gram[np.ix_(kept, kept)], each.vector[kept]) for each in recorded)
        rows, counted = (self.first.rows, self.first.learned_share) if self.first else (0, 1.0)
        moved = tuple(each.with_columns(kept) for each in questions)
        return PreparedQuestions(self.present, layout, moved, sampling, whole, before, rows, counted, self.first)


def _link_precision(arm: Arm, base: BaseParameters, inertial: Array, links: LinkKnowledge) -> Array:
    if links != "near":
        return np.zeros((len(base), len(base)))
    prior = link_prior(arm, base, inertial)
    return np.asarray(np.linalg.pinv(prior.spread((NEAR_LINK_WIDTH,) * len(arm)), rcond=1e-12, hermitian=True))


def _rich_scenes(present: PresentModel, trajectory: Trajectory, times: Array, seed: int) -> list[Scene]:
    rng = np.random.default_rng(seed)
    low, high = trajectory.lower, trajectory.upper
    points = low + (high - low) * rng.random((RICH_MOTIONS, len(low)))
    motion = trajectory.motions(points, times).motion
    return [present.scene(motion.select(np.intp(number)), times) for number in range(RICH_MOTIONS)]


MAX_AMBIGUOUS_LEAD = 3.0  # standard errors: closer names are no more than guessed
MAX_GROUP_SIZE = 4  # names in a group
MAX_FINDINGS = 4  # findings that are asked about


def find_nearby_names(
    verdict: VerdictWithModel,
    arm: Arm,
    trajectory: Trajectory,
    duration: float,
    recording: Recording,
    links: LinkKnowledge,
    seed: int,
) -> tuple[RivalGroup, ...]:
    """For each finding its name, the rivals of the verdict, and the names that come closest; lone names left out."""
    named = [
        each
        for each in verdict.findings
        if each.parameters and each.name.effect != UNKNOWN.id and not effect_named(each.name.effect).scanned
    ]
    out = []
    for finding in named[:MAX_FINDINGS]:
        pairs = tuple((finding.name, name) for name in _candidate_names(finding, verdict, arm))
        found = prepare_questions(verdict, pairs, arm, trajectory, duration, recording, links, seed, lenient=True)
        near = sorted(
            (told for each in found.questions if (told := _nearby_name(found, each)) is not None), key=_search_lead
        )
        group = dict.fromkeys((finding.name, *finding.rivals, *(name for name, _ in near)))
        out.append(tuple(group)[:MAX_GROUP_SIZE])
    return tuple(group for group in out if len(group) > 1)


def _search_lead(near: tuple[Name, float]) -> float:
    return near[1]


def _candidate_names(finding: Finding, verdict: VerdictWithModel, arm: Arm) -> list[Name]:
    """Everything of the library at the finding's joint, at its link, and of the whole robot."""
    joint = finding.name.joint
    joints: Sequence[int] = range(1, len(arm) + 1) if joint is None else (joint,)
    known = {each.name for each in verdict.findings}
    out = []
    for family in library():
        if not family.facts.scanned:
            robot = family.facts.where == "robot"
            out += [Name(family.effect, None)] if robot else [Name(family.effect, each) for each in joints]
    return [name for name in out if name not in known]


def _nearby_name(prepared: PreparedQuestions, question: Question) -> tuple[Name, float] | None:
    """The other name of a question and how much a search prefers the finding to it; None where there is no doubt.

    No rival is a name that physics refuses with the size that it would need, nor a larger law that holds the
    finding's as a part, unless it explains more by more than noise.
    """
    seen = prepared.known_moments
    found, other = question.rivals
    law = other.laws[0]
    gain = explained_power(seen, question.free, law.columns) - explained_power(
        seen, question.free, found.laws[0].columns
    )
    larger = bool(question.inseparable[0, 1]) and law.freedom > found.laws[0].freedom
    needed = MIN_BEYOND_NOISE**2 if larger else -(MAX_AMBIGUOUS_LEAD**2)
    if gain < needed or law.candidate.objection(other.values) is not None:
        return None
    return other.name, law.price(prepared.rows) - found.laws[0].price(prepared.rows) - 0.5 * gain
