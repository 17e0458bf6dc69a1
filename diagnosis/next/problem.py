"""The search for a discriminating motion as a problem of the benchmark: minimise the doubt that it leaves."""

from dataclasses import dataclass

import numpy as np

from diagnosis.next.deciding import strength
from diagnosis.next.moments import Moments
from diagnosis.next.prepare import Prepared
from problem.excitation_problem import ExcitationProblem
from problem.motion import Motion
from problem.transforms import Array

NOTHING = 1e-6  # standard errors: less is none


@dataclass(frozen=True, eq=False, kw_only=True)
class TellApartProblem(ExcitationProblem):
    """Find the motion that decides best between rivals, together with what was recorded before.

    A point's value is one over its strength, in standard errors.
    """

    prepared: Prepared

    @property
    def spectral(self) -> bool:
        """Its value is no condition number."""
        return False

    def strength(self, point: Array) -> float:
        """How well the motion of a point (dimension,) decides, standard errors."""
        motion = self.trajectory.motions(point[None], self.times).motion
        return self._strength(motion.select(np.intp(0)))

    @property
    def rows(self) -> float:
        """Rows of both recordings from which a diagnosis learns, all joints."""
        return self.prepared.rows_with(self.samples)

    def moments(self, point: Array) -> Moments:
        """What the motion of a point (dimension,) would say."""
        motion = self.trajectory.motions(point[None], self.times).motion.select(np.intp(0))
        return self.prepared.moments(self.prepared.present.scene(motion, self.times))

    def _judge(self, motion: Motion) -> tuple[Array, Array]:
        """Value of motions (points, samples, joints), (points,), twice: it is also what is minimised."""
        found = np.array([self._strength(motion.select(np.intp(number))) for number in range(len(motion.position))])
        value = 1 / np.maximum(found, NOTHING)
        return value, value

    def _strength(self, motion: Motion) -> float:
        found = self.prepared.moments(self.prepared.present.scene(motion, self.times))
        return strength(self.prepared.questions, self.prepared.together(found.gram), self.rows)


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
