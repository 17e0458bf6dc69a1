"""The search for a discriminating motion as a problem of the benchmark: minimise one over the smallest separation."""

from dataclasses import dataclass

import numpy as np

from diagnosis.next.moments import Moments
from diagnosis.next.prepare import Prepared
from diagnosis.next.question import soft_smallest
from problem.excitation_problem import ExcitationProblem
from problem.motion import Motion
from problem.transforms import Array

NOTHING = 1e-6  # standard errors: less is none


@dataclass(frozen=True, eq=False, kw_only=True)
class TellApartProblem(ExcitationProblem):
    """Find the motion on which rivals differ most, together with what was recorded before.

    A point's value is one over its softened smallest separation: the standard error of the decision, in units of the
    effect.
    """

    prepared: Prepared

    def separation(self, point: Array) -> float:
        """Softened smallest separation of a point (dimension,), standard errors."""
        motion = self.trajectory.motions(point[None], self.times).motion
        return self._smallest(motion.select(np.intp(0)))

    def moments(self, point: Array) -> Moments:
        """What the motion of a point (dimension,) would say."""
        motion = self.trajectory.motions(point[None], self.times).motion.select(np.intp(0))
        return self.prepared.moments(self.prepared.present.scene(motion, self.times))

    def _judge(self, motion: Motion) -> tuple[Array, Array]:
        """Value of motions (points, samples, joints), (points,), twice: it is also what is minimised."""
        smallest = np.array([self._smallest(motion.select(np.intp(number))) for number in range(len(motion.position))])
        value = 1 / np.maximum(smallest, NOTHING)
        return value, value

    def _smallest(self, motion: Motion) -> float:
        found = self.prepared.moments(self.prepared.present.scene(motion, self.times))
        gram = self.prepared.together(found.gram)
        return soft_smallest([each for question in self.prepared.questions for each in question.separations(gram)])


def tell_apart_problem(prepared: Prepared, excitation: ExcitationProblem, name: str = "tell-apart") -> TellApartProblem:
    """The problem for the trajectories and limits of another one; ValueError where no motion separates anything."""
    if not any(question.pairs for question in prepared.questions):
        raise ValueError("no motion separates these rivals")
    samples = len(prepared.sampling.times(excitation.duration))
    return TellApartProblem(
        name=name,
        arm=excitation.arm,
        base=excitation.base,
        trajectory=excitation.trajectory,
        duration=(samples - 1) / prepared.sampling.rate_hz,
        samples=samples,
        constraints=excitation.constraints,
        criterion=excitation.criterion,
        penalty=excitation.penalty,
        prepared=prepared,
    )
