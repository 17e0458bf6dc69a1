"""Chooses cut-off, components and prior by blocked cross-validation inside the identification data.

Components are taken or left in groups.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from armlab.effects.contract import Candidate
from armlab.effects.drive import RotorInertia, TorqueOffset
from armlab.effects.friction import (
    POWER_EXPONENT_RANGE,
    CoulombFriction,
    LoadFriction,
    PowerFriction,
    Slopes,
    ViscousFriction,
)
from armlab.effects.scene import scene_of
from armlab.effects.springs import SineCompensator, SpringCompensator
from armlab.identification.components import every_joint, wrist_couplings
from armlab.identification.cross_validation import FoldMoments, fold_moments
from armlab.identification.estimators.least_squares import Prior, WeightedLeastSquares
from armlab.identification.priors import Pull
from armlab.identification.regression import Regression, regression, signals_of, suggested_cutoff
from armlab.identification.structure import Structure
from armlab.recordings.differentiate import Signals
from armlab.recordings.recording import Run
from problem.arm import Arm
from problem.drive_torque import torque_beside_columns

Groups = Mapping[str, tuple[Candidate, ...]]
USUAL_GROUPS = ("viscous", "coulomb", "rotor", "offset")
EXCLUSIVE_GROUPS = {  # one has the other's columns, or columns that short motions cannot separate from them
    "direction": "viscous",
    "viscous": "direction",
    "spring": "crank",
    "crank": "spring",
}


def candidate_groups(arm: Arm) -> dict[str, tuple[Candidate, ...]]:
    """The groups that may matter on any arm."""

    def power(exponent: float) -> tuple[Candidate, ...]:
        return every_joint(arm, PowerFriction, shape=(exponent,), bounds=(POWER_EXPONENT_RANGE,))

    groups = {
        "viscous": every_joint(arm, ViscousFriction),
        "coulomb": every_joint(arm, CoulombFriction),
        "rotor": every_joint(arm, RotorInertia),
        "offset": every_joint(arm, TorqueOffset),
        "direction": every_joint(arm, Slopes),
        "square root": power(0.5),
        "cube root": power(1 / 3),
        "square": power(2.0),
        "load": every_joint(arm, LoadFriction),
    }
    if len(arm) > 1:
        groups["wrist coupling"] = wrist_couplings(arm)
    return groups


def counterbalance_groups(arm: Arm, joint: int) -> dict[str, tuple[Candidate, ...]]:
    """A counterbalance at a joint that is known to have one: a torsion spring, or a linkage on a crank."""
    return {"spring": (SpringCompensator.at(arm, joint),), "crank": (SineCompensator.at(arm, joint),)}


def toggle_group(names: tuple[str, ...], name: str) -> tuple[str, ...]:
    """The chosen groups with one more or one less; what excludes each other is exchanged."""
    if name in names:
        return tuple(other for other in names if other != name)
    return (*(other for other in names if other != EXCLUSIVE_GROUPS.get(name)), name)


def components_of(groups: Groups, names: tuple[str, ...]) -> tuple[Candidate, ...]:
    """The components of the chosen groups, in the groups' order."""
    return tuple(part for name, parts in groups.items() if name in names for part in parts)


POSITION_FACTORS = (1.0, 2.0)
CUTOFF_SHARES = (0.35, 0.5, 0.7, 1.0)  # times the suggested one, above which a rigid model explains nothing
MAX_ERROR_SHARE_AFTER_CHANGE = 0.99  # a change has to lower the held-out error below this share of it
SHRINKAGE_SHARES = (1e-4, 1e-3, 1e-2, 1e-1)
NOMINAL_TOLERANCES = (0.03, 0.1, 0.3, 1.0, 3.0)
TriedAlternative = tuple[str, float]


@dataclass(frozen=True)
class Choice:
    """A structure and how to fit it.

    cutoff_hz, position_factor: of the filters, see `signals_of`. by_joint: joints weighted by their errors.
    held_out: held-out error against the filtered torque, recorded: against the torque as recorded, by which
    cut-offs are compared; both ||tau - tau_hat|| / ||tau||.
    """

    cutoff_hz: float
    groups: tuple[str, ...]
    pull: Pull
    by_joint: bool
    held_out: float
    recorded: float
    position_factor: float = 1.0


@dataclass(frozen=True, eq=False)
class Selection:
    """The choice, and every alternative that was looked at with its held-out error."""

    choice: Choice
    tried: tuple[TriedAlternative, ...]


def candidate_pulls(arm: Arm, payload: tuple[float, float, float] | None = None) -> tuple[Pull, ...]:
    """The priors that an arm allows."""
    free = (Pull(), *(Pull("shrinkage", share) for share in SHRINKAGE_SHARES))
    return free if arm.links is None else free + tuple(Pull("nominal", size, payload) for size in NOMINAL_TOLERANCES)


def select_structure(
    arm: Arm,
    runs: Sequence[Run],
    groups: Groups,
    candidates: Sequence[Pull],
    starts: Sequence[tuple[str, ...]] = (USUAL_GROUPS,),
    cutoffs: Sequence[float] = CUTOFF_SHARES,
) -> Selection:
    """The choice with the least held-out error.

    At one cut-off, structures, priors and the smoothing of positions are compared on the filtered torque, from
    every start; cut-offs are compared by the torque as recorded, so that none gains by hiding what it cannot
    explain. Raises ValueError where there is no cut-off to choose from.
    """
    suggested = max(suggested_cutoff(run) for run in runs)
    tried: list[TriedAlternative] = []
    bests = []
    for cutoff in (share * suggested for share in cutoffs):
        climbs = []
        for factor in POSITION_FACTORS:
            search = _Search.prepare(arm, [signals_of(run, cutoff, factor) for run in runs], groups, candidates)
            first = Choice(cutoff, USUAL_GROUPS, candidates[0], True, np.inf, np.inf, factor)
            climbs += [search.climb(replace(first, groups=start), tried) for start in starts]
        bests.append(min(climbs, key=lambda each: each.held_out))
    return Selection(min(bests, key=lambda each: each.recorded), tuple(tried))


@dataclass(frozen=True, eq=False)
class _Search:
    """One cut-off: moments of all candidate columns against the filtered and the recorded torque."""

    groups: Groups
    columns: dict[str, list[int]]
    base: list[int]
    priors: dict[Pull, Prior | None]
    filtered: FoldMoments
    recorded: FoldMoments

    @staticmethod
    def prepare(arm: Arm, signals: Sequence[Signals], groups: Groups, candidates: Sequence[Pull]) -> "_Search":
        structure = with_load(Structure(arm, components_of(groups, tuple(groups))), signals)
        data = regression(structure, signals)
        columns, index = dict[str, list[int]](), 0
        for name, parts in groups.items():
            places = structure.slices[index : index + len(parts)]
            columns[name] = [column for place in places for column in range(place.start, place.stop)]
            index += len(parts)
        priors = {pull: pull.prior(structure, data) for pull in candidates}
        recorded = fold_moments(data, unfiltered_regression(structure, signals, data))
        return _Search(groups, columns, list(range(len(structure.base))), priors, fold_moments(data, data), recorded)

    def error(self, choice: Choice, against: FoldMoments) -> float:
        columns = self.base + [column for name in choice.groups for column in self.columns[name]]
        return against.held_out_error(sorted(columns), self.priors[choice.pull], choice.by_joint)

    def climb(self, start: Choice, tried: list[TriedAlternative]) -> Choice:
        """Takes the best change until none is worth it."""
        current = replace(start, held_out=self.error(start, self.filtered))
        while True:
            changes = [replace(each, held_out=self.error(each, self.filtered)) for each in self._changes(current)]
            tried.extend((describe_choice(each), each.held_out) for each in changes)
            best = min(changes, key=lambda each: each.held_out)
            if best.held_out > MAX_ERROR_SHARE_AFTER_CHANGE * current.held_out:
                return replace(current, recorded=self.error(current, self.recorded))
            current = best

    def _changes(self, current: Choice) -> Iterator[Choice]:
        yield from (replace(current, groups=toggle_group(current.groups, name)) for name in self.groups)
        for pull in self.priors:
            yield from (replace(current, pull=pull, by_joint=by_joint) for by_joint in (True, False))


def describe_choice(choice: Choice) -> str:
    """A choice in a line."""
    weights = "joints weighted" if choice.by_joint else "joints alike"
    groups = ", ".join(choice.groups) or "rigid only"
    filters = f"{choice.cutoff_hz:.3g} Hz, positions {choice.position_factor * choice.cutoff_hz:.3g} Hz"
    return f"{filters}; {groups}; prior {choice.pull}; {weights}"


def with_load(structure: Structure, signals: Sequence[Signals]) -> Structure:
    """The structure with inertial parameters that load-dependent friction can follow: those of a first fit."""
    if not structure.follows_load:
        return structure
    rest = tuple(part for part in structure.components if not part.follows_model)
    first = structure.with_components(rest)
    values = WeightedLeastSquares()(regression(first, signals)).values
    return replace(structure, load=first.full(values[: len(first.base)]))


def unfiltered_regression(structure: Structure, signals: Sequence[Signals], data: Regression) -> Regression:
    """The same rows without any filter on the torque: what a prediction has to meet in the end."""
    matrices, torques = [], []
    for each in signals:
        rows = each.filter.rows
        whole = structure.matrix(scene_of(each.run, each.motion, structure.arm)).reshape(
            each.motion.samples, data.joints, -1
        )
        matrices.append(whole[rows].reshape(-1, structure.size))
        torques.append((each.run.torque - torque_beside_columns(structure.arm, each.motion))[rows].ravel())
    return replace(data, matrix=np.vstack(matrices), torque=np.concatenate(torques))
