"""The present model: the arm, its links as they were found, and the effects of a verdict, in any motion."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from armlab.effects.contract import Candidate, Scene
from problem.arm import Arm
from problem.motion import Motion
from problem.regressor import rigid_body_torque
from recordings.run import Array

Part = tuple[Candidate, Array]


@dataclass(frozen=True, eq=False)
class Present:
    """inertial: (10 * joints,) of the links. parts: effects with their coefficients."""

    arm: Arm
    inertial: Array
    parts: tuple[Part, ...] = ()

    def scene(self, motion: Motion, time: Array, run: str = "designed") -> Scene:
        """A run as effects see it; time: (samples,), s, from the first sample."""
        torque = rigid_body_torque(self.arm, motion, self.inertial)
        if self.arm.rotor_inertia:
            torque = torque + np.asarray(self.arm.rotor_inertia) * motion.acceleration
        scene = Scene(run, time, motion, self.arm, self.inertial, torque)
        scene = self._with(scene, lambda candidate: not candidate.follows_model)
        return self._with(scene, lambda candidate: candidate.follows_model)

    def _with(self, scene: Scene, wanted: Callable[[Candidate], bool]) -> Scene:
        torque = scene.torque.copy()
        for candidate, values in self.parts:
            if wanted(candidate):
                torque[:, list(candidate.rows)] += candidate.columns(scene) @ values
        return replace(scene, torque=torque)
