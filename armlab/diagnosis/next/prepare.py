"""From a verdict to questions with numbers: rivals with laws and sizes, what is free beside them, and names of the
library that come near a finding.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.diagnosis.next.first_run import FirstRun, FoundEffect, PresentModel, observe_first_run
from armlab.diagnosis.next.moments import DesignMoments, Index, empty_moments
from armlab.diagnosis.next.question import (
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
from armlab.diagnosis.next.verdict_file import RivalGroup, VerdictFinding, VerdictWithModel
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.columns.links import link_prior
from armlab.effects.contract import UNKNOWN, Candidate, Scene
from armlab.effects.library import library
from armlab.recordings.recording import Recording
from problem.arm import Arm
from problem.base_parameters import BaseParameters, base_parameters
from problem.trajectories import Trajectory

LinkKnowledge = Literal["exact", "near", "free"]
NEAR_LINK_WIDTH = 0.08  # width of the links' errors: about as far as drawings are off
RICH_MOTIONS = 3  # random motions that stand for all motions


@dataclass(frozen=True, eq=False)
class PreparedQuestions:
    """Questions with everything that a design needs to answer them.

    present: the model of the verdict. layout: the columns of all laws. seen: moments of all rows of the first
    recording; before: those of the rows from which a diagnosis learns. rows: number of those rows, of all joints.
    learned_share: share of a new run from which a diagnosis will learn; the rest is held out.
    """

    present: PresentModel
    layout: Layout
    questions: tuple[Question, ...]
    sampling: Sampling
    seen: DesignMoments
    before: DesignMoments
    rows: int
    learned_share: float
    first: FirstRun | None

    def moments(self, scene: Scene) -> DesignMoments:
        """Moments of a designed motion, of the share from which a diagnosis will learn."""
        whole = self.layout.moments(scene, self.sampling.filter(len(scene.time)), self.sampling)
        return DesignMoments(self.learned_share * whole.gram, self.learned_share * whole.vector)

    @property
    def known_moments(self) -> DesignMoments:
        """Moments of the first recording, with the prior of the links."""
        return DesignMoments(self.seen.gram + self.layout.prior, self.seen.vector)

    def rows_with(self, samples: int) -> float:
        """Rows of both recordings from which a diagnosis learns, all joints; samples: of a designed motion."""
        return self.rows + self.learned_share * (samples // SAMPLES_PER_ROW) * len(self.present.arm)

    def total_gram(self, gram: Array) -> Array:
        """Gram matrix of the first recording and a new run (columns, columns), with the prior of the links."""
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
    """Restores the model of a verdict, and prepares one question for each group of rival names.

    groups: names of which one is right. trajectory, duration (s): motions that may be designed. links: how well the
    links are known. lenient: leave out groups with a name that leaves no trace in the torques. Raises InputError where
    such a name is asked for, or where neither the verdict nor a recording says how large a rival is.
    """
    families = library()
    restored = {each.name: restore_part(each, arm, families) for each in verdict.findings}
    parts = {name: part for name, part in restored.items() if part is not None}
    own = tuple(part for name, part in parts.items() if not name.facts.in_links)
    present = PresentModel(arm, verdict.inertial(arm), own)
    first = observe_first_run(recording, present) if recording is not None else None
    sampling = white_noise_sampling(verdict.noise, verdict.cutoff_hz or Settings().tuning.data.cutoff_hz)
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
    return _Preparation(present, parts, laws, layout, links, first, rich, sampling).prepare(groups, offered)


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

    def prepare(self, groups: tuple[RivalGroup, ...], offered: OfferedLaws) -> PreparedQuestions:
        """Chooses laws and sizes, and keeps the columns that are needed."""
        sampling, whole, before = self._recorded_moments(groups)
        shown = self._rich_gram(sampling)
        seen = whole.gram if self.first else shown
        places = sum(map(len, offered.values()))
        questions = []
        for group in groups:
            free, found = self._free_columns(group), self._found_columns(group)
            known = DesignMoments(seen + self.layout.prior, whole.vector)
            joints = len(self.present.arm)
            rivals = choose_rivals(
                self._rival_choices(group), found, known, shown, places, self.first is not None, joints
            )
            questions.append(Question(rivals, free, found, inseparable_rivals(rivals, free, shown + self.layout.prior)))
        return self._keep_needed_columns(tuple(questions), sampling, whole, before)

    def _recorded_moments(self, groups: tuple[RivalGroup, ...]) -> tuple[Sampling, DesignMoments, DesignMoments]:
        """The sampling, and moments of all rows and of those from which a diagnosis learns."""
        if self.first is None:
            return self.white, empty_moments(self.layout.size), empty_moments(self.layout.size)
        columns = self.first.columns(self.layout)
        found = [self.parts[group[0]][0] for group in groups if group[0] in self.parts]
        fitted = np.unique(np.concatenate([self._free_columns(()), *(self.layout.indices_of(each) for each in found)]))
        sampling = self.first.sampling(columns, fitted.astype(np.intp))
        sampling = replace(sampling, standing=self._standing_speeds(sampling, groups))
        before = self.first.moments(columns, sampling.noise, "identify")
        whole = before + self.first.moments(columns, sampling.noise, "validate")
        asked = {group[0] for group in groups if group[0].facts.in_links}
        for name in sorted(asked & self.parts.keys(), key=str):
            part = self.parts[name]  # the links of the model hold its torque, so the residual does not
            whole, before = self._with_torque_of(whole, part), self._with_torque_of(before, part)
        return sampling, whole, before

    def _standing_speeds(self, sampling: Sampling, groups: tuple[RivalGroup, ...]) -> tuple[float, ...]:
        """Speeds below which a joint stands still whose friction sticks, found or asked for; 0 for the others."""
        named = {*self.parts, *(name for group in groups for name in group)}
        sticking = {name.joint for name in named if name.facts.sticks}
        return tuple(each if joint + 1 in sticking else 0.0 for joint, each in enumerate(sampling.standing))

    def _with_torque_of(self, moments: DesignMoments, part: FoundEffect) -> DesignMoments:
        """The moments with the torque of a part added to the residual."""
        candidate, values = part
        return DesignMoments(moments.gram, moments.vector + moments.gram[:, self.layout.indices_of(candidate)] @ values)

    def _free_columns(self, group: RivalGroup) -> Index:
        """Columns that may be fitted beside the rivals of a group: what was found, and usual friction of all joints."""
        usual = [each for each in usual_friction(self.present.arm, self.rich) if name_of(each) not in group]
        return np.unique(np.concatenate([self._found_columns(group), *map(self.layout.indices_of, usual)])).astype(
            np.intp
        )

    def _found_columns(self, group: RivalGroup) -> Index:
        """Columns of the other findings, and of the links where they are not known exactly."""
        others = [part[0] for name, part in self.parts.items() if name not in group and not name.facts.in_links]
        rigid = np.arange(0 if self.links == "exact" else len(self.layout.base))
        return np.unique(np.concatenate([rigid, *map(self.layout.indices_of, others)])).astype(np.intp)

    def _rival_choices(self, group: RivalGroup) -> list[RivalChoice]:
        out = []
        for name in group:
            part = self.parts.get(name)
            values = None if part is None else part[1]
            shapes = [*([] if part is None else [part[0]]), *self.laws[name]]
            unique = list(dict.fromkeys(shapes))
            out.append(RivalChoice(name, tuple((each, self.layout.indices_of(each)) for each in unique), values))
        if all(each.values is None for each in out) and self.first is None:
            raise InputError(f"how large is {group[0]}? the verdict has found none of the rivals: give --recording")
        return out

    def _rich_gram(self, sampling: Sampling) -> Array:
        """Gram matrix of the rich motions; rows near a standstill count, too."""
        sampling = replace(sampling, standing=())
        moments = [self.layout.moments(scene, sampling.filter(len(scene.time)), sampling) for scene in self.rich]
        return np.asarray(np.sum([each.gram for each in moments], axis=0))

    def _keep_needed_columns(
        self, questions: tuple[Question, ...], sampling: Sampling, whole: DesignMoments, before: DesignMoments
    ) -> PreparedQuestions:
        """The questions with only the columns that they need. whole, before: moments of all columns."""
        laws = [law.columns for question in questions for rival in question.rivals for law in rival.laws]
        needed = np.concatenate([np.arange(len(self.layout.base)), *(each.free for each in questions), *laws])
        kept = np.unique(needed).astype(np.intp)
        chosen = [each for each, at in zip(self.layout.candidates, self.layout.places, strict=True) if at[0] in kept]
        count = len(self.layout.base)
        layout = build_layout(self.layout.base, chosen, self.rich[0], self.layout.prior[:count, :count])
        return PreparedQuestions(
            present=self.present,
            layout=layout,
            questions=tuple(each.with_columns(kept) for each in questions),
            sampling=sampling,
            seen=whole.select(kept),
            before=before.select(kept),
            rows=self.first.rows if self.first else 0,
            learned_share=self.first.learned_share if self.first else 1.0,
            first=self.first,
        )


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
    """One group for each finding: its name, its rivals in the verdict, and the names that explain the data nearly as
    well. A finding without such a name has no group.
    """
    findings = [
        each
        for each in verdict.findings
        if each.parameters and each.name.facts != UNKNOWN and not each.name.facts.scanned
    ]
    out = []
    for finding in findings[:MAX_FINDINGS]:
        pairs = tuple((finding.name, name) for name in _candidate_names(finding, verdict, arm))
        prepared = prepare_questions(verdict, pairs, arm, trajectory, duration, recording, links, seed, lenient=True)
        leads = [_nearby_name(prepared, each) for each in prepared.questions]
        nearby = sorted((each for each in leads if each is not None), key=_search_lead)
        group = dict.fromkeys((finding.name, *finding.rivals, *(name for name, _ in nearby)))
        out.append(tuple(group)[:MAX_GROUP_SIZE])
    return tuple(group for group in out if len(group) > 1)


def _search_lead(near: tuple[Name, float]) -> float:
    return near[1]


def _candidate_names(finding: VerdictFinding, verdict: VerdictWithModel, arm: Arm) -> list[Name]:
    """Everything of the library at the finding's joint, at its link, and of the whole robot."""
    joint = finding.name.joint
    joints: Sequence[int] = range(1, len(arm) + 1) if joint is None else (joint,)
    known = {each.name for each in verdict.findings}
    out = []
    for family in library():
        if family.facts.where == "robot" and not family.facts.scanned:
            out.append(Name(family.effect, None))
        elif not family.facts.scanned:
            out += [Name(family.effect, each) for each in joints]
    return [name for name in out if name not in known]


def _nearby_name(prepared: PreparedQuestions, question: Question) -> tuple[Name, float] | None:
    """The other name of a question, and by how much a search prefers the finding; None where there is no doubt.

    There is no doubt where physics refuses the size that the other name needs. There is none either where the other
    law contains that of the finding and explains no more than noise beyond it.
    """
    known = prepared.known_moments
    finding, other = question.rivals
    law = other.laws[0]
    gain = explained_power(known, question.free, law.columns) - explained_power(
        known, question.free, finding.laws[0].columns
    )
    larger = bool(question.inseparable[0, 1]) and law.freedom > finding.laws[0].freedom
    needed = MIN_BEYOND_NOISE**2 if larger else -(MAX_AMBIGUOUS_LEAD**2)
    if gain < needed or law.candidate.objection(other.values) is not None:
        return None
    return other.name, law.price(prepared.rows) - finding.laws[0].price(prepared.rows) - 0.5 * gain
