"""The structure of a model: which columns there are, before any number is fitted."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.identification.components import Component
from armlab.recordings.differentiate import Signals
from problem.arm import PARAMETER_UNITS, Arm
from problem.base_parameters import BaseParameters, base_parameters
from problem.motion import Motion
from problem.regressor import observation_matrix, rigid_body_torque

PROBE_STATES = 400
INDEPENDENCE_TOLERANCE = 1e-9  # of a column's length, above rounding


@dataclass(frozen=True)
class Structure:
    """An arm and the components that add to its rigid-body torque.

    The columns are those of the base parameters, then those of the components in their order. load: (10 *
    joints,), the inertial parameters whose torque `load_dependent_friction` follows: a model's, never measured
    torque, whose noise would leak into the parameters.
    """

    arm: Arm
    components: tuple[Component, ...] = ()
    load: Array | None = field(default=None, compare=False)

    @cached_property
    def base(self) -> BaseParameters:
        """The base parameters of the rigid arm."""
        return base_parameters(self.arm)

    @cached_property
    def slices(self) -> tuple[slice, ...]:
        """Columns of each component."""
        ends = np.cumsum([len(self.base), *(len(part.names) for part in self.components)])
        return tuple(slice(int(start), int(end)) for start, end in pairwise(ends))

    @property
    def size(self) -> int:
        """Number of columns."""
        return len(self.base) + sum(len(part.names) for part in self.components)

    @property
    def names(self) -> tuple[str, ...]:
        """One name a column."""
        own = tuple(f"{part.label}: {name}" for part in self.components for name in part.names)
        return (*self.base.sums, *own)

    @property
    def base_units(self) -> tuple[str, ...]:
        """Units of the base parameters."""
        return tuple(PARAMETER_UNITS[column % 10] for column in self.base.columns)

    def with_components(self, components: tuple[Component, ...]) -> "Structure":
        """The same arm with other components."""
        return replace(self, components=components)

    def separable(self) -> tuple["Structure", tuple[Component, ...]]:
        """The structure without components that no motion tells from what stands before, and those.

        Such as the rotor inertia of a first joint, which acts like the link's own inertia about it.
        """
        kept, absorbed = list[Component](), list[Component]()
        motion = Motion(*(np.random.default_rng(1).uniform(-2, 2, (3, PROBE_STATES, len(self.arm)))))
        basis = _orthonormal_basis(self.with_components(()).matrix(motion))
        for part in self.components:
            columns = _place_in_rows(part, part.columns(motion, self._probe_load(motion)), len(self.arm))
            lengths = np.linalg.norm(columns, axis=0)
            rest = columns - basis @ (basis.T @ columns)
            lost = np.linalg.svd(rest / lengths, compute_uv=False)[-1] < INDEPENDENCE_TOLERANCE**0.5
            (absorbed if lost else kept).append(part)
            if not lost:
                basis = _orthonormal_basis(np.hstack([basis, columns / lengths]))
        return self.with_components(tuple(kept)), tuple(absorbed)

    def _probe_load(self, motion: Motion) -> Array:
        return np.asarray(np.random.default_rng(2).uniform(-1, 1, motion.position.shape))

    def loads(self, motion: Motion) -> Array | None:
        """Rigid torque (samples, joints) that load-dependent friction follows; None where nothing needs it."""
        if not any(part.effect == "load_dependent_friction" for part in self.components):
            return None
        if self.load is None:
            raise ValueError("load_dependent_friction needs inertial parameters: fit the rigid model first")
        return rigid_body_torque(self.arm, motion, self.load)

    def matrix(self, motion: Motion) -> Array:
        """All columns, (samples * joints, columns), the joints of a sample in consecutive rows; N m per unit."""
        rigid = observation_matrix(self.arm, motion)[:, self.base.columns]
        loads = self.loads(motion)
        parts = (_place_in_rows(part, part.columns(motion, loads), len(self.arm)) for part in self.components)
        return np.hstack([rigid, *parts])

    def filtered(self, signals: Signals) -> Array:
        """The columns that passed the filter of the torque, (kept * joints, columns)."""
        joints, kept = len(self.arm), len(signals.torque)
        out = np.zeros((kept, joints, self.size))
        rigid = observation_matrix(self.arm, signals.motion).reshape(signals.motion.samples, joints, -1)
        for joint in range(joints):
            columns = self.base.columns
            moving = np.flatnonzero(columns >= 10 * joint)  # links before a joint do not load it
            out[:, joint, moving] = signals.filter(rigid[:, joint, columns[moving]])
        loads = self.loads(signals.motion)
        for part, place in zip(self.components, self.slices, strict=True):
            out[:, part.joint - 1, place] = signals.filter(part.columns(signals.motion, loads))
        return out.reshape(kept * joints, self.size)

    def full(self, base_values: Array) -> Array:
        """Inertial parameters (10 * joints,) with the given base parameters and zeros elsewhere."""
        phi = np.zeros(10 * len(self.arm))
        phi[self.base.columns] = base_values
        return phi


def _place_in_rows(part: Component, columns: Array, joints: int) -> Array:
    rows = np.zeros((len(columns), joints, columns.shape[1]))
    rows[:, part.joint - 1] = columns
    return rows.reshape(-1, columns.shape[1])


def _orthonormal_basis(matrix: Array) -> Array:
    lengths: NDArray[np.float64] = np.linalg.norm(matrix, axis=0)
    return np.asarray(np.linalg.qr(matrix / np.where(lengths > 0, lengths, 1))[0])
