"""All friction of a model at each joint, whatever its laws: its size at a low and at a high speed of the recording."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.result import JointFriction
from armlab.diagnosis.torque.names.intervals import ShapedFit, extend_with_shapes
from armlab.diagnosis.torque.rows.data import rows_in
from armlab.diagnosis.torque.search.fitted_model import FittedModel
from armlab.effects.contract import Candidate
from armlab.effects.scene import Scene, instants
from problem.motion import Motion

SPEED_QUANTILES = (0.1, 0.9)  # of a joint's speeds in motion
NEAREST_ROWS = 0.1  # of a joint's rows: those about a speed that show a law which depends on more than the speed


def joint_friction(model: FittedModel) -> tuple[JointFriction, ...]:
    """The friction of each joint that has some in a model, claimed or not, with that of the simulation."""
    groups = model.solver.groups
    found = {
        joint: [each for each in model.state.groups if groups[each].candidate.is_friction_of(joint)]
        for joint in range(1, model.columns.joints + 1)
    }
    if not any(found.values()):
        return ()
    sized = _Sized(model, extend_with_shapes(model))
    return tuple(sized.friction(joint, own) for joint, own in found.items() if own)


@dataclass(frozen=True, eq=False)
class _Sized:
    model: FittedModel
    wide: ShapedFit

    @cached_property
    def _velocity(self) -> Array:
        return self.model.design.observed.kept("velocity")

    def friction(self, joint: int, groups: Sequence[int]) -> JointFriction:
        observed = self.model.design.observed
        speed = np.abs(self._velocity[rows_in(observed.used(joint - 1), observed.rows), joint - 1])
        tuning = self.model.design.settings.tuning.data
        creeping = tuning.creep_ratio * np.quantile(speed, tuning.high_speed_quantile)
        if np.quantile(speed, SPEED_QUANTILES[0]) < creeping:  # it counts as moving all the time, and rests
            speed = speed[speed >= creeping]
        low, high = (float(each) for each in np.quantile(speed, SPEED_QUANTILES))
        (first, first_half), (last, last_half) = (self._size(joint, groups, each) for each in (low, high))
        ends = ((first - first_half, first + first_half), (last - last_half, last + last_half))
        return JointFriction(joint, (low, high), (first, last), ends)

    def _size(self, joint: int, groups: Sequence[int], speed: float) -> tuple[float, float]:
        """Half the difference of the torques forwards and backwards, and half its interval, N m (N)."""
        model = self.model
        slopes = np.concatenate([self._slopes(joint, each, speed) for each in groups])
        values = np.concatenate([model.solver.values(model.fit, each) for each in groups])
        columns = np.concatenate([model.solver.groups[each].columns for each in groups])
        rank = model.fit.links.shape[1]
        at = [rank + int(np.flatnonzero(model.fit.columns == column)[0]) for column in columns]
        lengths = model.moments.lengths[columns]
        spread = self.wide.spread.covariance[np.ix_(at, at)] / np.outer(lengths, lengths)
        variance = max(float(slopes @ spread @ slopes), 0.0)
        size = float(slopes @ values) + self._simulated(joint, speed)
        return size, self.wide.factor * float(np.sqrt(variance))

    def _simulated(self, joint: int, speed: float) -> float:
        """What the simulation has already, N m (N)."""
        simulation = self.model.design.simulation
        own = () if simulation.model is None else simulation.model.effects
        parts = [each for each in own if each.candidate.is_friction_of(joint)]
        scene = self._instants(joint, speed)
        return sum(float(np.diff(each.torque(scene)[::-1, joint - 1])[0]) / 2 for each in parts)

    def _instants(self, joint: int, speed: float) -> Scene:
        """One joint forwards and then backwards, the others at rest."""
        velocity = np.zeros((2, self.model.columns.joints))
        velocity[:, joint - 1] = speed, -speed
        still = np.zeros_like(velocity)
        return instants(self.model.design.simulation.arm, Motion(still, velocity, still))

    def _slopes(self, joint: int, group: int, speed: float) -> Array:
        """What each coefficient of a law adds to the friction at a speed, (coefficients,)."""
        candidate = self.model.candidate(group)
        if _depends_on_speed_alone(candidate):
            columns = candidate.columns(self._instants(joint, speed))
            return np.asarray((columns[0, 0] - columns[1, 0]) / 2)
        own = self._velocity[:, joint - 1]
        observed = self.model.design.observed
        used = np.flatnonzero(rows_in(observed.used(joint - 1), observed.rows))
        near = used[np.argsort(np.abs(np.abs(own[used]) - speed))[: max(int(NEAREST_ROWS * len(used)), 1)]]
        index = self.model.columns.index[joint - 1]
        place = np.array([int(np.flatnonzero(index == each)[0]) for each in self.model.solver.groups[group].columns])
        laid = self.model.columns.pick(joint - 1, place)[near]
        return np.asarray(np.mean(np.sign(own[near])[:, None] * laid, axis=0))


def _depends_on_speed_alone(candidate: Candidate) -> bool:
    of_more = candidate.of_time or candidate.follows_model or candidate.of_channel
    return candidate.facts.axis == "velocity" and not of_more
