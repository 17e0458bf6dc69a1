"""The torque of a model: rigid links and effects, by the one rule that every part of the project uses."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from armlab.common.arrays import Array
from armlab.effects.contract import Candidate, Scene


@dataclass(frozen=True, eq=False)
class FittedEffect:
    """A law of an effect with its coefficients."""

    candidate: Candidate
    coefficients: Array

    def torque(self, scene: Scene) -> Array:
        """What it adds to the torque, (samples, joints), N m (N)."""
        out = np.zeros(scene.torque.shape)
        out[:, list(self.candidate.rows)] = self.candidate.columns(scene) @ self.coefficients
        return out


def torque_in_mechanism(effects: Sequence[FittedEffect], scene: Scene) -> Array:
    """Torque with the effects that are no faults of the torque's channel, (samples, joints), N m (N).

    scene: its `inertial` are the links of the model and its `torque` what they need. Effects that do not follow the
    model come first, then those that do (load-dependent friction, elasticity, a skewed position).
    """
    inside = [each for each in effects if not each.candidate.of_channel]
    for follows in (False, True):
        parts = [each.torque(scene) for each in inside if each.candidate.follows_model is follows]
        scene = replace(scene, torque=np.sum([scene.torque, *parts], axis=0))
    return scene.torque


def torque_of_model(effects: Sequence[FittedEffect], scene: Scene) -> Array:
    """Torque as the channel records it, (samples, joints), N m (N): its faults act on the torque in the mechanism.

    scene: as in `torque_in_mechanism`.
    """
    read = replace(scene, torque=torque_in_mechanism(effects, scene))
    faults = [each.torque(read) for each in effects if each.candidate.of_channel]
    return np.asarray(np.sum([read.torque, *faults], axis=0))
