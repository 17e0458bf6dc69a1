"""The excitation problem: a point in a box, its trajectory, and the fitness of that trajectory.

The coordinates of a problem can also be shifted at random. A shift changes the results of an algorithm that is drawn to
the origin; any other algorithm finds the same trajectories.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from armlab.common.arrays import Array
from armlab.common.derivatives import Derivatives, Question
from problem.arm import Arm
from problem.base_parameters import BaseParameters
from problem.contract import DifferentiableProblem, Evaluation, Problem, why_not_differentiable
from problem.coupled_joints import refuse_coupled
from problem.fitness import Criterion
from problem.limits import Constraints
from problem.motion import Motion
from problem.smooth import LimitRows, differentiate
from problem.spectrum import Spectrum, find_spectrum
from problem.trajectories import Trajectory, sample_instants


@dataclass(frozen=True)
class Penalty:
    """The fitness of a point that breaks limits: merit + step + weight * violation."""

    step: float
    weight: float

    def fitness(self, merit: Array, violation: Array) -> Array:
        """What is minimised (points,), from merits and violations (points,)."""
        return merit + np.where(violation > 0, self.step + self.weight * violation, 0.0)


@dataclass(frozen=True)
class FeasibilityRules:
    """Deb 2000: feasible points come first, ordered by merit; the others follow, ordered by violation.

    The rules are one number per point, so that every search that compares fitness follows them.
    """

    floor: float = 1e30  # above every finite merit, and far enough below the largest double for any violation

    def fitness(self, merit: Array, violation: Array) -> Array:
        """What is minimised (points,), from merits and violations (points,)."""
        return np.where(violation > 0, self.floor * (1.0 + violation), merit)


@dataclass(frozen=True, eq=False)
class ExcitationProblem:
    """Find the trajectory that identifies the base parameters of an arm best.

    unit_columns: columns scaled to unit length. friction_columns: with friction and offset of each joint.
    """

    name: str
    arm: Arm
    base: BaseParameters
    trajectory: Trajectory
    duration: float
    samples: int
    constraints: Constraints
    criterion: Criterion
    penalty: Penalty | FeasibilityRules
    unit_columns: bool = False
    friction_columns: bool = False

    def __post_init__(self) -> None:
        """Raises InputError for an arm with coupled joints: rules and derivatives are those of free ones."""
        refuse_coupled(self.arm, "an excitation problem")

    @property
    def spectral(self) -> bool:
        """Whether a point's value is the condition number, whose derivatives are known."""
        return True

    @property
    def lower(self) -> Array:
        """Lower bounds, (dimension,)."""
        return self.trajectory.lower

    @property
    def upper(self) -> Array:
        """Upper bounds, (dimension,)."""
        return self.trajectory.upper

    @cached_property
    def times(self) -> Array:
        """Instants (samples,) at which a trajectory is judged, s."""
        return sample_instants(self.duration, self.samples)

    @property
    def no_derivatives_because(self) -> str:
        """Why there are no derivatives; empty where there are."""
        if any(np.isfinite(limit.torque) for limit in self.constraints.limits):
            return "derivatives of a torque limit are not known"
        return "derivatives of a workspace limit are not known" if self.constraints.workspace.limited else ""

    def differentiate(self, point: Array, question: Question) -> Derivatives:
        """Derivatives at a point (dimension,): of a smooth criterion, and of distances to limits at the samples."""
        return differentiate(self, self._limit_rows, point, question)

    @cached_property
    def _limit_rows(self) -> LimitRows:
        return LimitRows(self)

    def evaluate(self, points: Array) -> Evaluation:
        """Fitness, condition number and violation of points (points, dimension).

        Each point's result is the same to the bit in any batch; a point that is not finite costs infinitely.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            return self._evaluate(points)

    def _evaluate(self, points: Array) -> Evaluation:
        excitation = self.trajectory.motions(np.ascontiguousarray(points, dtype=np.float64), self.times)
        violation = self.constraints.violation(excitation)
        reached = excitation.overreach == 0
        if reached.all():
            merit, value = self._judge(excitation.motion)
        else:
            merit, value = np.zeros(len(points)), np.full(len(points), np.inf)
            merit[reached], value[reached] = self._judge(excitation.motion.select(reached))
        return Evaluation(self.penalty.fitness(merit, violation), value, violation)

    def _judge(self, motion: Motion) -> tuple[Array, Array]:
        """Criterion and condition number of motions (points, samples, joints), (points,) each."""
        spectrum = self.spectrum(motion)
        return self.criterion.value(spectrum), spectrum.condition_number

    def spectrum(self, motion: Motion) -> Spectrum:
        """The spectrum that judges motions (points, samples, joints)."""
        return find_spectrum(self.arm, motion, self.base.columns, self.unit_columns, self.friction_columns)


MAX_SHIFT_WIDTHS = 2.0  # widths of the box by which the origin may move


@dataclass(frozen=True, eq=False)
class ShiftedProblem:
    """A problem in coordinates x + shift (dimension,)."""

    problem: Problem
    shift: Array
    name: str

    @property
    def lower(self) -> Array:
        """Lower bounds, (dimension,)."""
        return self.problem.lower + self.shift

    @property
    def upper(self) -> Array:
        """Upper bounds, (dimension,)."""
        return self.problem.upper + self.shift

    def evaluate(self, points: Array) -> Evaluation:
        """Results of the points (points, dimension) in the problem's own coordinates."""
        return self.problem.evaluate(points - self.shift)

    @property
    def no_derivatives_because(self) -> str:
        """Why there are no derivatives; empty where there are."""
        return why_not_differentiable(self.problem)

    def differentiate(self, point: Array, question: Question) -> Derivatives:
        """Derivatives at a point (dimension,); a shift changes none. Raises TypeError if there are none."""
        if not isinstance(self.problem, DifferentiableProblem):
            raise TypeError(f"{self.name} {why_not_differentiable(self.problem)}")
        return self.problem.differentiate(point - self.shift, question)


def shift_randomly(problem: Problem, seed: int) -> ShiftedProblem:
    """The problem with its origin moved by up to two widths of the box in each coordinate."""
    shift = np.random.default_rng(seed).uniform(-MAX_SHIFT_WIDTHS, MAX_SHIFT_WIDTHS, len(problem.lower))
    return ShiftedProblem(problem, shift * (problem.upper - problem.lower), f"{problem.name}-frame-{seed}")
