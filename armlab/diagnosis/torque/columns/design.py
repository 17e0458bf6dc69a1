"""What a diagnosis has on its table: the runs, the simulation, the candidates, and moments made of them."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.columns.columns import (
    Block,
    Columns,
    Moments,
    base_columns,
    compute_moments,
    filtered_columns,
    place_of,
    stack_columns,
)
from armlab.diagnosis.torque.columns.links import LinkPrior
from armlab.diagnosis.torque.columns.solver import Solver
from armlab.diagnosis.torque.rows.data import Observed
from armlab.diagnosis.torque.rows.features import Features
from armlab.diagnosis.torque.rows.noise import Noise
from armlab.diagnosis.torque.rows.simulation import Simulation
from armlab.diagnosis.torque.search.surrogate import FoldedFeatures
from armlab.effects.contract import Candidate, Family, Scene
from armlab.recordings.differentiate import Signals
from problem.base_parameters import BaseParameters
from problem.motion import Motion

SHAPE_STEP = 1e-4  # of the way between a shape's bounds, for derivatives
FILTERED_AT_ONCE = 16  # candidates: columns of more would take memory and no less time


@dataclass(frozen=True, eq=False)
class DesignMatrix:
    """rigid: filtered columns of the base parameters by joint. target: measured less simulated torque,
    filtered, (rows, joints). scenes: one a run, for the present model; calm: the same with the calm motion, for
    candidates that follow the model. blocks: the candidates' filtered columns. families: those that offered them.
    features, banks: of each joint, for surrogates: many of everything, and few of one kind each. offsets: how large
    those of each joint are thought to be before the data, (joints,), N m (N); None before a first fit.
    """

    settings: Settings
    observed: Observed
    simulation: Simulation
    base: BaseParameters
    prior: LinkPrior | None
    rigid: list[Array]
    target: Array
    scenes: tuple[Scene, ...]
    calm: tuple[Scene, ...]
    blocks: tuple[Block, ...] = ()
    families: tuple[Family, ...] = ()
    features: tuple[FoldedFeatures, ...] = ()
    banks: tuple[tuple[Features, ...], ...] = ()
    offsets: Array | None = None

    @property
    def places(self) -> int:
        """Number of places with a candidate."""
        return len({place_of(block.candidate) for block in self.blocks})

    @cached_property
    def columns(self) -> Columns:
        """Everything stacked, once."""
        return stack_columns(self.base, self.rigid, self.blocks, self.target)

    def solver(self, noise: Noise, as_large_as_torque: bool = False) -> tuple[Moments, Solver]:
        """Moments and solver under a noise model.

        as_large_as_torque: a law whose size is not known has a normal prior about zero, with the torque of its joints
        as standard deviation. Where a joint moves in one direction only, data cannot separate its Coulomb friction from
        its offset.
        """
        found, groups = compute_moments(self.columns, noise, self.observed), self.columns.groups
        scales = [self._known_scale(group.candidate) for group in groups]
        if as_large_as_torque:
            pairs = zip(scales, self.blocks, strict=True)
            scales = [known if np.isfinite(known) else self._torque_scale(block) for known, block in pairs]
        simulated = [self.simulation.coefficients_of(group.candidate) for group in groups]
        tuning, unsaid = self.settings.tuning.solver, self.simulation.joints_unsaid
        expected = frozenset(
            number
            for number, group in enumerate(groups)
            if group.candidate.facts.usual and group.candidate.is_friction and group.candidate.joint in unsaid
        )
        return found, Solver(
            found, groups, len(self.base), self.prior, self.places, scales, simulated, expected, tuning
        )

    def _known_scale(self, candidate: Candidate) -> float:
        """Standard deviation of a law's coefficients before the data; infinite where nothing is known."""
        facts, joint = candidate.facts, candidate.joint
        if self.offsets is None or not facts.usual or facts.dissipates or joint not in self.simulation.joints_unsaid:
            return candidate.prior_scale(self.simulation.inertial)
        return float(self.offsets[joint - 1])

    def _torque_scale(self, block: Block) -> float:
        """The coefficient with which a law makes as much torque as its joints have; infinite where it makes none."""
        torque = float(np.sqrt(np.mean(self.observed.torque[:, list(block.candidate.rows)] ** 2)))
        own = float(np.sqrt(np.mean(block.values**2)))
        return torque / own if torque > 0 and own > 0 else np.inf

    def block(self, candidate: Candidate, variant: int) -> Block:
        """A candidate's filtered columns."""
        return self.blocks_of([(candidate, variant)])[0]

    def blocks_of(self, asked: Sequence[tuple[Candidate, int]]) -> list[Block]:
        """The filtered columns of candidates, each with its variant; side by side they pass the filter faster."""
        made: dict[int, Block] = {}
        for scenes in (self.scenes, self.calm):
            places = [place for place, (each, _) in enumerate(asked) if self.scenes_of(each) is scenes]
            for start in range(0, len(places), FILTERED_AT_ONCE):
                some = places[start : start + FILTERED_AT_ONCE]
                candidates, same = [asked[place][0] for place in some], self.settings.guards.same_filter
                values = filtered_columns(candidates, scenes, self.observed, same)
                made |= {place: Block(*asked[place], own) for place, own in zip(some, values, strict=True)}
        return [made[place] for place in range(len(asked))]

    def slope(self, number: int, which: int) -> Array:
        """Derivative of a block's columns by a shape parameter of its candidate, of the shape of these columns."""
        block = self.blocks[number]
        if which not in block.slopes:
            block.slopes[which] = self._slope(block, which)
        return block.slopes[which]

    def _slope(self, block: Block, which: int) -> Array:
        low, high = block.candidate.bounds[which]
        ends = []
        for sign in (1, -1):
            shape = list(block.candidate.shape)
            shape[which] = float(np.clip(shape[which] + sign * SHAPE_STEP * (high - low), low, high))
            moved = self.block(block.candidate.with_shape(tuple(shape)), block.variant)
            ends.append((shape[which], moved.values))
        width = ends[0][0] - ends[1][0]
        return np.asarray((ends[0][1] - ends[1][1]) / (width or 1.0))

    def scenes_of(self, candidate: Candidate) -> tuple[Scene, ...]:
        """The scenes that a candidate sees."""
        return self.calm if candidate.follows_model and not candidate.follows_closely else self.scenes

    def with_candidates(self, families: Iterable[Family], left: Sequence[Array] | None = None) -> "DesignMatrix":
        """With the columns of every candidate that the families offer here, shape by shape.

        left: what a first fit leaves of each run, (samples, joints), for families that look at it.
        """
        offered = tuple(families)
        blocks = [block for family in offered for block in self._usable_blocks(self._offered(family, left))]
        return replace(self, blocks=tuple(blocks), families=offered)

    def _offered(self, family: Family, left: Sequence[Array] | None) -> list[tuple[Candidate, int]]:
        """Candidates of a family, each with its variant."""
        arm, scenes = self.simulation.arm, self.scenes
        places = family.candidates(arm, scenes) if left is None else family.scan(arm, scenes, left)
        return [(each, at) for shapes in places for at, each in enumerate(shapes) if not each.second_name]

    def _usable_blocks(self, asked: Sequence[tuple[Candidate, int]]) -> list[Block]:
        return [block for block in self.blocks_of(asked) if is_usable(block)]

    def scanned_again(self, left: Callable[[str], Sequence[Array]]) -> "DesignMatrix":
        """With more shapes from families that look at what a fit leaves: what was left before hid the best ones.

        left: what a fit leaves of each run without an effect, (samples, joints). Blocks that were there keep their
        numbers. A place is corrected for what both looks have compared, because the looks of its blocks add up.
        """
        known = {_scanned_shape(each.candidate) for each in self.blocks}
        scanning = (family for family in self.families if type(family).scan is not Family.scan)
        offered = (each for family in scanning for each in self._offered(family, left(family.effect)))
        asked = [(each, at) for each, at in offered if each.looks > 1 and _scanned_shape(each) not in known]
        found = self._usable_blocks(asked)
        return replace(self, blocks=(*self.blocks, *found)) if found else self

    def with_blocks(self, changed: dict[int, Block]) -> "DesignMatrix":
        """With other columns for some candidates, by their number."""
        return replace(self, blocks=tuple(changed.get(number, block) for number, block in enumerate(self.blocks)))

    def with_model(self, inertial: Array, torque: Callable[[Scene], Array]) -> "DesignMatrix":
        """With columns that follow another present model: its links, and its torque in a scene."""
        scenes = tuple(replace(scene, inertial=inertial, torque=torque(scene)) for scene in self.scenes)
        calm = tuple(replace(scene, inertial=inertial, torque=torque(scene)) for scene in self.calm)
        moved = replace(self, scenes=scenes, calm=calm)
        follow = [number for number, block in enumerate(self.blocks) if block.candidate.follows_model]
        asked = [(block.candidate, block.variant) for block in (self.blocks[number] for number in follow)]
        return moved.with_blocks(dict(zip(follow, moved.blocks_of(asked), strict=True)))


def _scanned_shape(candidate: Candidate) -> tuple[object, ...]:
    """What a scan chooses: the law, its place and its shape."""
    return type(candidate), place_of(candidate), candidate.shape


def build_design_matrix(
    observed: Observed, simulation: Simulation, base: BaseParameters, prior: LinkPrior | None, settings: Settings
) -> DesignMatrix:
    """The table before any candidate is on it."""
    arm = simulation.arm
    rigid = base_columns(arm, base, observed.signals)
    simulated = np.concatenate([simulation.filtered(signals) for signals in observed.signals])
    inertial = simulation.inertial if simulation.inertial is not None else np.zeros(10 * len(arm))
    scenes = tuple(_scene_of_run(signals, signals.motion, simulation, inertial) for signals in observed.signals)
    pairs = zip(observed.signals, observed.calm, strict=True)
    calm = tuple(_scene_of_run(signals, motion, simulation, inertial) for signals, motion in pairs)
    target = observed.torque - simulated
    target[:, sorted(arm.unmeasured)] = 0.0
    return DesignMatrix(settings, observed, simulation, base, prior, rigid, target, scenes, calm)


def _scene_of_run(signals: Signals, motion: Motion, simulation: Simulation, inertial: Array) -> Scene:
    bare = simulation.scene_of(signals.run, motion)
    return replace(bare, inertial=inertial, torque=simulation.torque_in_mechanism(bare))


def is_usable(block: Block) -> bool:
    """Columns that are finite and not all zero: a joint that does not move has none."""
    return bool(np.isfinite(block.values).all() and np.all(np.any(block.values != 0, axis=(0, 1))))
