"""Recordings of one robot on one table: filtered together, with the columns of one common model.

The common model has free links, what every arm has, and what the diagnoses of the recordings found. What may have
changed are the same columns again, times the recording that a row is of (`changes.py`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import DataError
from armlab.diagnosis.changes.shared_states import shared_weights
from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.columns.columns import Block, Place, place_of
from armlab.diagnosis.torque.columns.design import DesignMatrix, build_design_matrix, is_usable
from armlab.diagnosis.torque.columns.solver import State
from armlab.diagnosis.torque.rows.data import Observed, observe
from armlab.diagnosis.torque.rows.noise import fit_noise
from armlab.diagnosis.torque.rows.simulation import Simulation
from armlab.diagnosis.torque.search.fitted_model import FittedModel, follow_model
from armlab.diagnosis.tuning import ComparisonTuning
from armlab.effects.contract import Candidate
from armlab.effects.library import library
from armlab.effects.links import PAYLOAD_FACTS, InertialError, Payload
from armlab.recordings.recording import Recording, Run
from problem.base_parameters import base_parameters

# what wears, is handled or is set anew on any arm; other effects may have changed where a recording has them
CHANGING_EFFECTS = (
    "coulomb_friction",
    "viscous_friction",
    "torque_offset",
    "torque_gain_error",
    "encoder_offset",
    "time_delay",
    "channel_skew",
    "base_tilt",
)


@dataclass(frozen=True, eq=False)
class Pooled:
    """Recordings in one design, and the common model fitted to all of them.

    owner: of each run, the recording that it is of, from 0. recordings: how many there are. changes: the columns of
    everything that may have changed. only_shared: whether rows count as `shared` says, else all alike.
    """

    model: FittedModel
    owner: tuple[int, ...]
    recordings: int
    changes: tuple[Block, ...]
    only_shared: bool = True

    @property
    def design(self) -> DesignMatrix:
        """Of the common model."""
        return self.model.design

    @property
    def observed(self) -> Observed:
        """All runs."""
        return self.model.design.observed

    @property
    def tuning(self) -> ComparisonTuning:
        """Numbers of the comparison."""
        return self.model.design.settings.tuning.comparison

    @cached_property
    def members(self) -> NDArray[np.intp]:
        """The recording of each row, (rows,)."""
        counts = [len(each.torque) for each in self.observed.signals]
        return np.repeat(np.array(self.owner, dtype=np.intp), counts)

    @cached_property
    def stretches(self) -> NDArray[np.intp]:
        """Number of the stretch of time of each row, (rows,).

        A stretch is part of one run. Runs of two recordings that follow the same motion share their stretches: what
        the model lacks is the same in both, and is no difference between them.
        """
        rate, starts = self.observed.rate_hz, np.cumsum([0, *(len(each.torque) for each in self.observed.signals)])
        shortest = float(np.bincount(self.members).min()) / rate
        length = min(self.tuning.stretch_s, shortest / self.tuning.min_stretches)
        numbers, first_number = np.empty(self.observed.rows, dtype=np.intp), 0
        for start, stop in pairwise(starts):
            blocks = max(int((stop - start) / rate / length), 1)
            numbers[start:stop] = first_number + np.arange(stop - start) * blocks // (stop - start)
            first_number += blocks
        for run, first in enumerate(self._first_of_motion()):
            if first == run:
                continue
            own = self.observed.signals[run]
            other = self.observed.signals[first]
            clock, theirs = own.time - own.run.time[0], other.time - other.run.time[0]
            place = np.clip(np.searchsorted(theirs, clock), 0, len(theirs) - 1)
            numbers[starts[run] : starts[run + 1]] = numbers[starts[first] : starts[first + 1]][place]
        return np.asarray(np.unique(numbers, return_inverse=True)[1], dtype=np.intp)

    @cached_property
    def shared(self) -> Array:
        """How much each row of a joint counts, (rows, joints): less where one recording alone had such positions of the
        arm and speeds of the joint.

        What the model lacks differs from place to place, and would be a change between recordings of other places.
        """
        if not self.only_shared:
            return np.ones((self.observed.rows, self.observed.joints))
        position, speed = self.observed.kept("position"), np.abs(self.observed.kept("velocity"))
        squares = (position - position.mean(axis=0)) ** 2
        stretches = len(np.unique(self.stretches))
        states = [np.column_stack([position, *own]) for own in zip(squares.T, speed.T, strict=True)]
        return np.column_stack([shared_weights(each, self.members, stretches) for each in states])

    @cached_property
    def shared_share(self) -> float:
        """Share of the rows that count, of the recording with the smallest."""
        return min(float(self.shared[self.members == each].mean()) for each in range(self.recordings))

    def _first_of_motion(self) -> list[int]:
        """For each run the first run of another recording that follows the same motion; itself where there is none."""
        out: list[int] = []
        taken: set[tuple[int, int]] = set()
        for run, owner in enumerate(self.owner):
            first = next(
                (
                    other
                    for other in range(run)
                    if out[other] == other
                    and self.owner[other] != owner
                    and (other, owner) not in taken
                    and self._same_motion(run, other)
                ),
                run,
            )
            taken.add((first, owner))
            out.append(first)
        return out

    def _same_motion(self, run: int, other: int) -> bool:
        """Whether two runs follow the same path in time: alike long, and nowhere far apart."""
        one, two = (self.observed.signals[each] for each in (run, other))
        lengths = sorted(float(each.run.time[-1] - each.run.time[0]) for each in (one, two))
        if lengths[0] < self.tuning.same_length * lengths[1]:
            return False
        clock, theirs = (each.run.time - each.run.time[0] for each in (one, two))
        kept = clock <= theirs[-1]
        travel = np.ptp(one.motion.position, axis=0)
        for joint in range(one.motion.joints):
            there = np.interp(clock[kept], theirs, two.motion.position[:, joint])
            apart = np.sqrt(np.mean((one.motion.position[kept, joint] - there) ** 2))
            if apart > self.tuning.same_motion * max(travel[joint], 1e-9):
                return False
        return True


def pool_plainly(recordings: Sequence[Recording], simulation: Simulation, settings: Settings) -> Pooled:
    """The recordings on one table as plain least squares sees them: rigid links, Coulomb and viscous friction, offsets.

    The torque is filtered far below where the rest of a real arm begins, all rows count, and no drift within a run
    stands for a change. Raises DataError where no run is long enough.
    """
    tuning = settings.tuning
    data = replace(
        tuning.data,
        cutoff_hz=tuning.comparison.plain_cutoff_hz,
        min_cutoff_hz=tuning.comparison.plain_cutoff_hz,
        min_segment_rows=2,
        min_moving_share=1.0,
        held_out_blocks=2,
        held_out_every=2,
    )
    single = min(len(recordings[0].runs), len(recordings[-1].runs)) < 2
    level = tuning.comparison.single_run_level if single else tuning.comparison.level
    plain = replace(tuning, data=data, comparison=replace(tuning.comparison, drift_waves=0, level=level))
    return pool_recordings(recordings, (), simulation, replace(settings, tuning=plain))


def pool_recordings(
    recordings: Sequence[Recording], found: Sequence[Candidate], simulation: Simulation, settings: Settings
) -> Pooled:
    """The recordings on one table. found: laws of the common model beside what every arm has; simulation: what the
    columns are deviations from.

    Raises DataError where no run has a joint in motion for long enough.
    """
    runs = [run for number, each in enumerate(recordings) for run in _labelled_runs(each, number)]
    owner = tuple(number for number, each in enumerate(recordings) for _ in each.runs)
    observed = observe(runs, simulation.arm, simulation.inertial, settings)
    reason = observed.reason_too_short(simulation.arm)
    if reason is not None:
        raise DataError(reason)
    bare = build_design_matrix(observed, simulation, base_parameters(simulation.arm), None, settings)
    design = _with_candidates(bare, [*found, *_usual_beside(bare, found)])
    first = _fit_common(design)
    model = _fit_common(follow_model(design, first))
    return Pooled(model, owner, len(recordings), tuple(_changing_blocks(model)))


def follow_levels(pooled: Pooled, values: Array) -> Pooled:
    """The same with columns that follow the common model with other values (columns,): those beside the changes.

    The common model alone averages over what changed, and a gain is a share of the torque that a model predicts.
    """
    model = pooled.model
    model.solver.hold(model.state, values * model.moments.lengths)
    moved = _fit_common(follow_model(model.design, model))
    moved.solver.hold(moved.state, values * moved.moments.lengths)
    return replace(pooled, model=moved, changes=tuple(_changing_blocks(moved)))


def _labelled_runs(recording: Recording, number: int) -> Iterator[Run]:
    """The runs with names that tell the recordings apart, all of one role."""
    for run in recording.runs:
        yield replace(run, file=f"{number + 1}: {run.file}", role="identify")


def unite_candidates(diagnoses: Sequence[Diagnosis]) -> tuple[Candidate, ...]:
    """What the models of the diagnoses have, each effect once at a place, without laws that another one contains.

    The order of the diagnoses does not matter: the comparison back is the mirror image. A push belongs to its run: it
    stays with the recording in which it was found.
    """
    pushes: list[Candidate] = []
    found: dict[Place, Candidate] = {}
    for number, diagnosis in enumerate(diagnoses):
        for candidate in () if diagnosis.model is None else diagnosis.model.structure.components:
            if candidate.facts.single_event:
                run = getattr(candidate, "run", "")
                pushes.append(replace(candidate, run=f"{number + 1}: {run}"))  # type: ignore[type-var]
            else:
                place = place_of(candidate)
                found[place] = min(candidate, found.get(place, candidate), key=_wider_first)
    whole = [each for each in found.values() if not any(_contains(other, each) for other in found.values())]
    return (*sorted(whole, key=lambda each: (each.effect, each.joints)), *pushes)


def _wider_first(candidate: Candidate) -> tuple[int, str, tuple[float, ...]]:
    """Of several forms of a law at a place, the one with the most coefficients."""
    return -candidate.size, candidate.form, candidate.shape


def _is_covered(candidate: Candidate, chosen: Sequence[Candidate]) -> bool:
    same = (each.effect == candidate.effect and each.joints == candidate.joints for each in chosen)
    return any(same) or any(_contains(each, candidate) for each in chosen)


def _contains(one: Candidate, other: Candidate) -> bool:
    return one.joints == other.joints and other.effect in one.replaces


def _usual_beside(design: DesignMatrix, found: Sequence[Candidate]) -> list[Candidate]:
    """What every arm has, where no law that was found stands for it."""
    families = (family for family in library() if family.facts.usual)
    places = (place for family in families for place in family.candidates(design.simulation.arm, design.scenes))
    return [place[0] for place in places if not _is_covered(place[0], found)]


def _with_candidates(design: DesignMatrix, candidates: Sequence[Candidate]) -> DesignMatrix:
    blocks = (design.block(each, 0) for each in candidates)
    return replace(design, blocks=tuple(each for each in blocks if is_usable(each)))


def _fit_common(design: DesignMatrix) -> FittedModel:
    """Least squares of everything in the design, joints weighted by what that leaves."""
    tuning, state = design.settings.tuning.noise, State(tuple(range(len(design.blocks))), None)
    left = design.target
    for _ in range(2):
        noise = fit_noise(left, design.observed, 0.0, tuning, colour=False)
        moments, solver = design.solver(noise)
        model = FittedModel(design, noise, moments, solver, state)
        left = model.residual(model.fit)
    return model


def _changing_blocks(model: FittedModel) -> Iterator[Block]:
    """Columns of everything that may have changed: a load of any link, what wears, and whatever the model has."""
    design, seen = model.design, set[Place]()
    arm, scenes = design.simulation.arm, design.scenes
    offered: list[Candidate] = [
        Payload.at(arm, link) for link in range(1, len(arm) + 1) if InertialError.is_visible(arm, link)
    ]
    for family in library():
        if family.facts.id in CHANGING_EFFECTS:
            offered += [place[0] for place in family.candidates(arm, scenes)]
    own = [each.candidate for each in design.blocks]
    offered += [each for each in own if not each.facts.single_event and each.facts.where != "link"]
    for candidate in offered:
        block = design.block(candidate, 0)
        if place_of(candidate) not in seen and is_usable(block):
            seen.add(place_of(candidate))
            yield block


def is_body(candidate: Candidate) -> bool:
    """Whether it is a load of a link."""
    return candidate.effect == PAYLOAD_FACTS.id
