"""From a verdict to questions with numbers: rivals with their laws and sizes, and all that is free beside them."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from armlab.diagnosis.links import link_prior
from armlab.diagnosis.settings import Settings
from armlab.effects.contract import Candidate, Scene
from armlab.effects.library import library
from diagnosis.next.asked import Asked
from diagnosis.next.first_run import FirstRun, first_run
from diagnosis.next.laws import Offered, alternatives, background, leaves_trace, name_of, offered_by, part_of
from diagnosis.next.moments import Index, Moments, no_run
from diagnosis.next.present import Part, Present
from diagnosis.next.question import IN_LINKS, Layout, Name, Question, blindness, layout_of
from diagnosis.next.sampling import THINNED, Sampling, white
from diagnosis.next.sizes import Choice, chosen_rivals
from diagnosis.next.verdict_file import VerdictFile
from problem.arm import Arm
from problem.base_parameters import BaseParameters, base_parameters
from problem.errors import InputError
from problem.trajectory import Trajectory
from recordings.recording import Recording
from recordings.run import Array

Links = Literal["exact", "near", "free"]
NEAR = 0.08  # width of the links' errors: about as far as drawings are off
DRY = ("coulomb_friction", "stribeck_friction", "presliding_hysteresis", "asymmetric_friction",
       "load_dependent_friction")  # fmt: skip
RICH = 3  # random motions that show what any motion could show


@dataclass(frozen=True, eq=False)
class Prepared:
    """seen: what the first recording says of the columns of `layout`; before: its rows from which a diagnosis learns.

    rows: those rows, of all joints. counted: share of a new run that will be among them, the rest is held out.
    """

    present: Present
    layout: Layout
    questions: tuple[Question, ...]
    sampling: Sampling
    seen: Moments
    before: Moments
    rows: int
    counted: float
    first: FirstRun | None

    def moments(self, scene: Scene) -> Moments:
        """What a diagnosis would learn from a designed motion."""
        whole = self.layout.moments(scene, self.sampling.filter(len(scene.time)), self.sampling)
        return Moments(self.counted * whole.gram, self.counted * whole.vector)

    @property
    def known(self) -> Moments:
        """All that the first recording says, with what is known of the links beforehand."""
        return Moments(self.seen.gram + self.layout.prior, self.seen.vector)

    def rows_with(self, samples: int) -> float:
        """Rows of both recordings from which a diagnosis learns, all joints; samples: of a designed motion."""
        return self.rows + self.counted * (samples // THINNED) * len(self.present.arm)

    def together(self, gram: Array) -> Array:
        """Moments of both runs, and what is known of the links beforehand."""
        return np.asarray(gram + self.before.gram + self.layout.prior)


def prepare(
    verdict: VerdictFile,
    groups: tuple[Asked, ...],
    arm: Arm,
    trajectory: Trajectory,
    duration: float,
    recording: Recording | None = None,
    links: Links = "near",
    seed: int = 0,
    lenient: bool = False,
) -> Prepared:
    """Everything that a design needs; InputError where a rival cannot be sized or leaves no trace.

    lenient: groups with such a rival are left out instead.
    """
    families = library()
    parts = {each.name: part for each in verdict.findings if (part := part_of(each, arm, families)) is not None}
    own = tuple(part for name, part in parts.items() if name.effect != IN_LINKS)
    present = Present(arm, verdict.inertial(arm), own)
    first = first_run(recording, present) if recording is not None else None
    sampling = white(verdict.noise, verdict.cutoff_hz or Settings().cutoff_hz)
    if first is not None:
        sampling = replace(sampling, kept_hz=first.observed.rate_hz, cutoff_hz=first.observed.cutoff_hz)
    rich = _rich(present, trajectory, sampling.times(duration), seed)
    scenes = list(first.scenes) if first else rich
    offered = offered_by(families, arm, scenes)
    if lenient:
        groups = tuple(group for group in groups if all(leaves_trace(name, offered) for name in group))
    laws = {name: alternatives(name, offered) for name in dict.fromkeys(each for group in groups for each in group)}
    candidates = [*background(arm, scenes), *(part[0] for part in own)]
    candidates += [parts[name][0] for name in laws if name in parts]
    candidates += [each for shapes in laws.values() for each in shapes]
    base = base_parameters(arm)
    layout = layout_of(base, candidates, scenes[0], _prior(arm, base, present.inertial, links))
    return _Preparation(present, parts, laws, layout, links, first, rich, sampling).prepared(groups, offered)


@dataclass(frozen=True, eq=False)
class _Preparation:
    present: Present
    parts: dict[Name, Part]
    laws: dict[Name, list[Candidate]]
    layout: Layout
    links: Links
    first: FirstRun | None
    rich: list[Scene]
    white: Sampling

    def prepared(self, groups: tuple[Asked, ...], offered: Offered) -> Prepared:
        """Chooses laws and sizes, and keeps the columns that are needed."""
        sampling, whole, before = self._recorded(groups)
        shown = self._shown(sampling)
        seen = whole.gram if self.first else shown
        places = sum(map(len, offered.values()))
        questions = []
        for group in groups:
            free, found = self._free(group), self._found(group)
            known = Moments(seen + self.layout.prior, whole.vector)
            joints = len(self.present.arm)
            rivals = chosen_rivals(self._choices(group), found, known, shown, places, self.first is not None, joints)
            questions.append(Question(rivals, free, found, blindness(rivals, free, shown + self.layout.prior)))
        return self._kept(tuple(questions), sampling, whole, before)

    def _recorded(self, groups: tuple[Asked, ...]) -> tuple[Sampling, Moments, Moments]:
        """The sampling, and moments of all rows and of those from which a diagnosis learns."""
        if self.first is None:
            return self.white, no_run(self.layout.size), no_run(self.layout.size)
        columns = self.first.columns(self.layout)
        found = [self.parts[group[0]][0] for group in groups if group[0] in self.parts]
        fitted = np.unique(np.concatenate([self._free(()), *(self.layout.of(each) for each in found)]))
        sampling = self.first.sampling(columns, fitted.astype(np.intp))
        sampling = replace(sampling, standing=self._standing(sampling, groups))
        before = self.first.moments(columns, sampling.noise, "identify")
        whole = before + self.first.moments(columns, sampling.noise, "validate")
        for name in sorted({group[0] for group in groups if group[0].effect == IN_LINKS} & self.parts.keys(), key=str):
            candidate, values = self.parts[name]  # what the links of the model hold already is given back
            whole, before = (self._given_back(each, candidate, values) for each in (whole, before))
        return sampling, whole, before

    def _standing(self, sampling: Sampling, groups: tuple[Asked, ...]) -> tuple[float, ...]:
        """Speeds below which a joint with dry friction, found or asked for, stands still; 0 for the others."""
        named = {*self.parts, *(name for group in groups for name in group)}
        sticky = {name.joint for name in named if name.effect in DRY}
        return tuple(each if joint + 1 in sticky else 0.0 for joint, each in enumerate(sampling.standing))

    def _given_back(self, moments: Moments, candidate: Candidate, values: Array) -> Moments:
        return Moments(moments.gram, moments.vector + moments.gram[:, self.layout.of(candidate)] @ values)

    def _free(self, group: Asked) -> Index:
        """Columns that may be fitted beside the rivals of a group: what was found, and usual friction of all joints."""
        usual = [each for each in background(self.present.arm, self.rich) if name_of(each) not in group]
        return np.unique(np.concatenate([self._found(group), *map(self.layout.of, usual)])).astype(np.intp)

    def _found(self, group: Asked) -> Index:
        """Columns of the other findings, and of the links where they are not known exactly."""
        others = [part[0] for name, part in self.parts.items() if name not in group and name.effect != IN_LINKS]
        rigid = np.arange(0 if self.links == "exact" else len(self.layout.base))
        return np.unique(np.concatenate([rigid, *map(self.layout.of, others)])).astype(np.intp)

    def _choices(self, group: Asked) -> list[Choice]:
        out = []
        for name in group:
            part = self.parts.get(name)
            values = None if part is None else part[1]
            shapes = [*([] if part is None else [part[0]]), *self.laws[name]]
            unique = list(dict.fromkeys(shapes))
            out.append(Choice(name, tuple((each, self.layout.of(each)) for each in unique), values))
        if all(each.values is None for each in out) and self.first is None:
            raise InputError(f"how large is {group[0]}? the verdict has found none of the rivals: give --recording")
        return out

    def _shown(self, sampling: Sampling) -> Array:
        """What rich motions show, even while a joint stands still."""
        sampling = replace(sampling, standing=())
        moments = [self.layout.moments(scene, sampling.filter(len(scene.time)), sampling) for scene in self.rich]
        return np.asarray(np.sum([each.gram for each in moments], axis=0))

    def _kept(self, questions: tuple[Question, ...], sampling: Sampling, *recorded: Moments) -> Prepared:
        """The same with only the columns that the questions need."""
        laws = [law.columns for question in questions for rival in question.rivals for law in rival.laws]
        needed = np.concatenate([np.arange(len(self.layout.base)), *(each.free for each in questions), *laws])
        kept = np.unique(needed).astype(np.intp)
        chosen = [each for each, at in zip(self.layout.candidates, self.layout.places, strict=True) if at[0] in kept]
        count = len(self.layout.base)
        layout = layout_of(self.layout.base, chosen, self.rich[0], self.layout.prior[:count, :count])
        whole, before = (Moments(each.gram[np.ix_(kept, kept)], each.vector[kept]) for each in recorded)
        rows, counted = (self.first.rows, self.first.counted) if self.first else (0, 1.0)
        moved = tuple(each.moved(kept) for each in questions)
        return Prepared(self.present, layout, moved, sampling, whole, before, rows, counted, self.first)


def _prior(arm: Arm, base: BaseParameters, inertial: Array, links: Links) -> Array:
    if links != "near":
        return np.zeros((len(base), len(base)))
    prior = link_prior(arm, base, inertial)
    return np.asarray(np.linalg.pinv(prior.spread((NEAR,) * len(arm)), rcond=1e-12, hermitian=True))


def _rich(present: Present, trajectory: Trajectory, times: Array, seed: int) -> list[Scene]:
    rng = np.random.default_rng(seed)
    low, high = trajectory.lower, trajectory.upper
    points = low + (high - low) * rng.random((RICH, len(low)))
    motion = trajectory.motions(points, times).motion
    return [present.scene(motion.select(np.intp(number)), times) for number in range(RICH)]
