"""The stacked columns of everything that may add to the torque, and the products of the whitened ones."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.diagnosis.torque.rows.data import Observed
from armlab.diagnosis.torque.rows.noise import Noise
from armlab.effects.contract import Candidate, Scene
from armlab.recordings.differentiate import Signals
from problem.arm import Arm
from problem.base_parameters import BaseParameters
from problem.regressor import observation_matrix

Place = tuple[str, int | None, tuple[int, ...], str]


@dataclass(frozen=True, eq=False)
class Group:
    """A candidate's columns among all columns; variant: which of the shapes at its place."""

    candidate: Candidate
    variant: int
    columns: NDArray[np.intp]

    @cached_property
    def place(self) -> Place:
        """The effect and where it is: one group a place at most is in a model."""
        return place_of(self.candidate)


def place_of(candidate: Candidate) -> Place:
    """The effect and where it is; pushes in different runs are different places."""
    return candidate.effect, candidate.joint, candidate.joints, getattr(candidate, "run", "")


@dataclass(frozen=True, eq=False)
class Columns:
    """Per joint the columns that its torque has: parts (rows, some own columns), index (own columns,) into all columns.

    The first `base` columns are the base parameters; the last own column of each joint is the torque that is to be
    explained, and has the index `size`. The parts are those of the blocks, which many Columns share.
    """

    base: int
    size: int
    groups: tuple[Group, ...]
    parts: tuple[tuple[Array, ...], ...]
    index: tuple[NDArray[np.intp], ...]

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.parts)

    def matrix(self, joint: int) -> Array:
        """All own columns of a joint, (rows, own columns), in an array of their own."""
        return np.column_stack(self.parts[joint])

    def pick(self, joint: int, places: NDArray[np.intp]) -> Array:
        """Some of the own columns of a joint, (rows, places)."""
        ends = np.cumsum([each.shape[1] for each in self.parts[joint]])
        out = np.empty((len(places), len(self.parts[joint][0])))
        for row, place, part in zip(out, places, np.searchsorted(ends, places, side="right"), strict=True):
            row[:] = self.parts[joint][part][:, place - ends[part]]
        return out.T

    def torque_of(self, coefficients: Array) -> Array:
        """Torque of coefficients (size,), (rows, joints)."""
        return np.column_stack([self.torque_at(joint, coefficients) for joint in range(self.joints)])

    def torque_at(self, joint: int, coefficients: Array) -> Array:
        """Torque of coefficients (size,) at one joint, (rows,)."""
        own = coefficients[self.index[joint][:-1]]
        used = np.flatnonzero(own)
        return np.asarray(self.pick(joint, used) @ own[used])

    def target_at(self, joint: int) -> Array:
        """The torque of a joint that is to be explained, (rows,)."""
        return self.parts[joint][-1][:, 0]

    @property
    def target(self) -> Array:
        """The torque that is to be explained, (rows, joints)."""
        return np.column_stack([own[-1] for own in self.parts])


def filtered_columns(
    candidates: Sequence[Candidate], scenes: Sequence[Scene], observed: Observed, same_filter: bool
) -> list[Array]:
    """Candidates' columns through the filter of the torque, (kept rows, rows of the candidate, coefficients) each."""
    parts: list[list[Array]] = [[] for _ in candidates]
    for scene, signals in zip(scenes, observed.signals, strict=True):
        made = _seen_columns(candidates, scene)
        side_by_side = np.concatenate([each.reshape(len(each), -1).T for each in made]).T  # each column in one piece
        passed = signals.filter(side_by_side) if same_filter else side_by_side[signals.filter.rows]
        ends = np.cumsum([each[0].size for each in made])
        for part, each, own in zip(parts, made, np.split(passed, ends[:-1], axis=1), strict=True):
            part.append(own.reshape(-1, *each.shape[1:]))
    return [np.concatenate(part) for part in parts]


def _seen_columns(candidates: Sequence[Candidate], scene: Scene) -> list[Array]:
    """Candidates' columns, zero at joints whose torque is not measured, (samples, rows, coefficients) each."""
    kinds: dict[type[Candidate], list[int]] = {}
    for number, candidate in enumerate(candidates):
        kinds.setdefault(type(candidate), []).append(number)
    made: dict[int, Array] = {}
    for kind, own in kinds.items():
        made |= zip(own, kind.columns_together([candidates[number] for number in own], scene), strict=True)
    return [_without_unmeasured(made[number], each, scene.arm) for number, each in enumerate(candidates)]


def _without_unmeasured(columns: Array, candidate: Candidate, arm: Arm) -> Array:
    blind = [number for number, joint in enumerate(candidate.rows) if joint in arm.unmeasured]
    if blind:
        columns = columns.copy()
        columns[:, blind] = 0.0
    return columns


def base_columns(arm: Arm, base: BaseParameters, runs: Sequence[Signals]) -> list[Array]:
    """Per joint the columns of the base parameters that load it, (rows of all runs, columns), through the filter."""
    parts: list[list[Array]] = [[] for _ in arm.joints]
    for signals in runs:
        rigid = observation_matrix(arm, signals.motion).reshape(signals.motion.samples, len(arm), -1)
        for joint, own in enumerate(parts):
            own.append(np.asarray(signals.filter(rigid[:, joint, base.columns[base.columns >= 10 * joint]])))
    return [np.concatenate(own) for own in parts]


@dataclass(frozen=True, eq=False)
class Block:
    """Filtered columns of one candidate, kept to be stacked again: (rows, rows of the candidate, coefficients).

    slopes: their derivatives by the candidate's shapes, which `DesignMatrix.slope` keeps here by number.
    """

    candidate: Candidate
    variant: int
    values: Array
    slopes: dict[int, Array] = field(default_factory=dict)


def stack_columns(base: BaseParameters, rigid: list[Array], blocks: Sequence[Block], target: Array) -> Columns:
    """All columns side by side. rigid: by joint. target: (rows, joints)."""
    joints = target.shape[1]
    start = len(base)
    groups, index = [], []
    own = [[each] for each in rigid]
    names: list[list[NDArray[np.intp]]] = [[] for _ in range(joints)]
    for block in blocks:
        columns = np.arange(start, start + block.values.shape[2])
        start += len(columns)
        groups.append(Group(block.candidate, block.variant, columns))
        for number, row in enumerate(block.candidate.rows):
            own[row].append(block.values[:, number])
            names[row].append(columns)
    for joint in range(joints):
        own[joint].append(target[:, [joint]])
        loading = np.flatnonzero(base.columns >= 10 * joint)
        index.append(np.concatenate([loading, *names[joint], [start]]).astype(np.intp))
    return Columns(len(base), start, tuple(groups), tuple(map(tuple, own)), tuple(index))


@dataclass(frozen=True, eq=False)
class Moments:
    """gram: (size + 1, size + 1), of the identification rows of all joints, columns scaled to unit length.

    The last row and column belong to the torque, which is not scaled. lengths: (size,), of the columns. heldout: per
    joint (own + 1, own + 1) of the validation rows, in the same scale. rows: whitened identification rows a joint.
    """

    gram: Array
    lengths: Array
    heldout: tuple[Array, ...]
    index: tuple[NDArray[np.intp], ...]
    rows: tuple[int, ...]

    @property
    def size(self) -> int:
        """Number of columns, the torque aside."""
        return len(self.gram) - 1

    @property
    def power(self) -> float:
        """Squared length of the whitened torque."""
        return float(self.gram[-1, -1])

    def heldout_error(self, coefficients: Array) -> Array:
        """Whitened squared error on held-out rows, (joints,); coefficients: (size,), of scaled columns."""
        full = np.append(-coefficients, 1.0)
        out = []
        for gram, index in zip(self.heldout, self.index, strict=True):
            part = full[index]
            used = np.flatnonzero(part)
            out.append(part[used] @ gram[np.ix_(used, used)] @ part[used])
        return np.asarray(np.maximum(np.array(out, dtype=np.float64), 0))


SHORTEST_COLUMN = 1e-100  # length of a column; products of shorter ones are too small to divide by


def compute_moments(columns: Columns, noise: Noise, observed: Observed) -> Moments:
    """Whitens all columns and multiplies them."""
    gram = np.zeros((columns.size + 1, columns.size + 1))
    heldout, rows = [], []
    for joint, index in enumerate(columns.index):
        matrix = columns.matrix(joint)
        identify = _gram(noise.white(matrix, joint, observed, "identify"))
        gram[np.ix_(index, index)] += identify[0]
        heldout.append(_gram(noise.white(matrix, joint, observed, "validate"))[0])
        rows.append(identify[1])
    lengths = np.sqrt(np.diag(gram)[:-1])
    scale = np.append(np.where(lengths > SHORTEST_COLUMN, lengths, 1.0), 1.0)
    everything = np.arange(len(scale))
    for each, own in zip((gram, *heldout), (everything, *columns.index), strict=True):
        each *= 1 / scale[own]
        each *= 1 / scale[own, None]
    return Moments(gram, scale[:-1], tuple(heldout), columns.index, tuple(rows))


def _gram(white: Array) -> tuple[Array, int]:
    return white.T @ white, len(white)
