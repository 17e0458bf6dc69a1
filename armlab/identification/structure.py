"""The structure of a model: which columns there are, before any number is fitted."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import DataError
from armlab.effects.contract import Candidate, Scene
from armlab.effects.scene import instants, scene_of
from armlab.recordings.differentiate import Signals
from problem.arm import PARAMETER_UNITS, Arm
from problem.base_parameters import BaseParameters, base_parameters
from problem.motion import Motion
from problem.regressor import observation_matrix

PROBE_STATES = 400
INDEPENDENCE_TOLERANCE = 1e-9  # of a column's length, above rounding


@dataclass(frozen=True)
class Structure:
    """An arm and the laws of effects that add to its rigid-body torque.

    The columns are those of the base parameters, then those of the components in their order. load: (10 * joints,),
    the links whose torque is felt by components that follow the model, such as load-dependent friction: a model's,
    never measured torque, whose noise would leak into the parameters.
    """

    arm: Arm
    components: tuple[Candidate, ...] = ()
    load: Array | None = field(default=None, compare=False)

    @cached_property
    def base(self) -> BaseParameters:
        """The base parameters of the rigid arm."""
        return base_parameters(self.arm)

    @cached_property
    def slices(self) -> tuple[slice, ...]:
        """Columns of each component."""
        ends = np.cumsum([len(self.base), *(part.size for part in self.components)])
        return tuple(slice(int(start), int(end)) for start, end in pairwise(ends))

    @property
    def size(self) -> int:
        """Number of columns."""
        return len(self.base) + sum(part.size for part in self.components)

    @property
    def names(self) -> tuple[str, ...]:
        """One name a column."""
        own = tuple(f"{part.label}: {name}" for part in self.components for name in part.names[: part.size])
        return (*self.base.sums, *own)

    @property
    def base_units(self) -> tuple[str, ...]:
        """Units of the base parameters."""
        return tuple(PARAMETER_UNITS[column % 10] for column in self.base.columns)

    @property
    def follows_load(self) -> bool:
        """Whether a component follows the links of a model."""
        return any(part.follows_model for part in self.components)

    def with_components(self, components: tuple[Candidate, ...]) -> "Structure":
        """The same arm with other components."""
        return replace(self, components=components)

    def separable(self) -> tuple["Structure", tuple[Candidate, ...]]:
        """The structure without components that no motion separates from the columns before them, and those components.

        An example is the rotor inertia of a first joint, which acts like the inertia of the link about its axis.
        """
        kept, absorbed = list[Candidate](), list[Candidate]()
        motion = Motion(*(np.random.default_rng(1).uniform(-2, 2, (3, PROBE_STATES, len(self.arm)))))
        links = np.random.default_rng(2).uniform(0, 1, 10 * len(self.arm))
        scene = instants(self.arm, motion, links)
        basis = _orthonormal_basis(self.with_components(()).matrix(scene))
        for part in self.components:
            columns = _component_columns(part, scene).reshape(-1, part.size)
            lengths = np.linalg.norm(columns, axis=0)
            rest = columns - basis @ (basis.T @ columns)
            lost = np.linalg.svd(rest / lengths, compute_uv=False)[-1] < INDEPENDENCE_TOLERANCE**0.5
            (absorbed if lost else kept).append(part)
            if not lost:
                basis = _orthonormal_basis(np.hstack([basis, columns / lengths]))
        return self.with_components(tuple(kept)), tuple(absorbed)

    def matrix(self, scene: Scene) -> Array:
        """All columns, (samples * joints, columns), the joints of a sample in consecutive rows; N m per unit.

        Raises ValueError where a component follows links that the structure does not have.
        """
        rigid = observation_matrix(self.arm, scene.motion)[:, self.base.columns]
        own = self._with_load(scene)
        parts = (_component_columns(part, own).reshape(-1, part.size) for part in self.components)
        return np.hstack([rigid, *parts])

    def filtered(self, signals: Signals) -> Array:
        """The columns that passed the filter of the torque, (kept * joints, columns); ValueError as for `matrix`."""
        joints, kept = len(self.arm), len(signals.torque)
        out = np.zeros((kept, joints, self.size))
        rigid = observation_matrix(self.arm, signals.motion).reshape(signals.motion.samples, joints, -1)
        columns = self.base.columns
        for joint in range(joints):
            loading = np.flatnonzero(columns >= 10 * joint)  # links before a joint do not load it
            out[:, joint, loading] = signals.filter(rigid[:, joint, columns[loading]])
        scene = self._with_load(scene_of(signals.run, signals.motion, self.arm))
        for part, place in zip(self.components, self.slices, strict=True):
            values = part.columns(scene)
            for number, joint in enumerate(part.rows):
                out[:, joint, place] = signals.filter(values[:, number])
        return out.reshape(kept * joints, self.size)

    def _with_load(self, scene: Scene) -> Scene:
        if not self.follows_load:
            return scene
        if self.load is None:
            followers = ", ".join(part.label for part in self.components if part.follows_model)
            raise DataError(f"{followers}: needs inertial parameters; fit the rigid model first")
        return replace(scene, inertial=self.load)

    def full(self, base_values: Array) -> Array:
        """Inertial parameters (10 * joints,) with the given base parameters and zeros elsewhere."""
        phi = np.zeros(10 * len(self.arm))
        phi[self.base.columns] = base_values
        return phi


def _component_columns(part: Candidate, scene: Scene) -> Array:
    """Columns of a component in the rows of all joints, (samples, joints, coefficients)."""
    out = np.zeros((*scene.motion.position.shape, part.size))
    out[:, list(part.rows)] = part.columns(scene)
    return out


def _orthonormal_basis(matrix: Array) -> Array:
    lengths: NDArray[np.float64] = np.linalg.norm(matrix, axis=0)
    return np.asarray(np.linalg.qr(matrix / np.where(lengths > 0, lengths, 1))[0])
