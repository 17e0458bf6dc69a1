"""Typed settings of the problems, one class a preset, with a key for each choice that the paper leaves open.

Limits are those of the robot file, unless the settings replace them.
"""

import operator
from collections.abc import Sized
from typing import Annotated, ClassVar, Literal, TypeVar

import numpy as np
from annotated_types import Ge, Gt
from pydantic import Field

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.settings import Settings
from problem.arm import Arm, Limits
from problem.base_parameters import BaseParameters, base_parameters
from problem.contract import Problem
from problem.excitation import ExcitationProblem, FeasibilityRules, Penalty, ShiftedProblem, shift_randomly
from problem.feasible import FeasibleFourier
from problem.fitness import Criterion
from problem.friction import FRICTION_NAMES
from problem.functions import FUNCTIONS, TestFunction
from problem.inverse_kinematics import planar_arm
from problem.limits import Constraints, Workspace
from problem.robot_file import load_arm
from problem.safe_motion import ClearanceSettings, SafeConstraints, SafetySettings, safety_rules
from problem.trajectories import CartesianFourier, JointFourier, Trajectory

Positive = Annotated[float, Gt(0)]
Vector = tuple[float, float, float]
Range = tuple[float, float]
PerJoint = Positive | tuple[Positive, ...]
T = TypeVar("T")


class LimitSettings(Settings):
    """Limits in place of the robot file's: one number for all joints, or one a joint; rad (m), s, N m (N).

    position: `robot` keeps the file's; a list has one [lower, upper] a joint, or null where there is none.
    velocity: largest speed. acceleration: largest acceleration. torque: largest torque; `none` drops the file's.
    """

    position: Literal["robot"] | tuple[Range | None, ...] = "robot"
    velocity: PerJoint | None = None
    acceleration: PerJoint | None = None
    torque: PerJoint | Literal["none"] | None = None

    def of(self, arm: Arm) -> tuple[Limits, ...]:
        """The limits in force, one a joint. Raises InputError for a wrong number of entries or order."""
        positions = self._positions(arm)
        velocities = self._rates(arm, "velocity")
        accelerations = self._rates(arm, "acceleration")
        torques = self._rates(arm, "torque")
        joints = range(len(arm))
        return tuple(Limits(positions[i], velocities[i], accelerations[i], torques[i]) for i in joints)

    def _positions(self, arm: Arm) -> list[Range]:
        if self.position == "robot":
            return [joint.limits.position for joint in arm.joints]
        given: list[Range] = [(-np.inf, np.inf) if limits is None else limits for limits in self.position]
        for low, high in given:
            if low >= high:
                raise InputError(f"limits.position should be [lower, upper], so [{high}, {low}]")
        _check_count("limits.position", given, arm)
        return given

    def _rates(self, arm: Arm, name: str) -> list[float]:
        given = getattr(self, name)
        if given is None:
            return [getattr(joint.limits, name) for joint in arm.joints]
        if given == "none":
            return [np.inf] * len(arm)
        return list(per_joint_values(f"limits.{name}", given, arm))


class WorkspaceSettings(Settings):
    """Where the arm may be, in the base frame, m.

    reach: largest distance from the base. floor: lowest height. keep_out: two opposite corners of a box that the arm
    stays out of.
    """

    reach: Positive | None = None
    floor: float | None = None
    keep_out: tuple[Vector, Vector] | None = None

    def build(self, tool: Vector) -> Workspace:
        """The workspace for the links' frames and a tool point in the last link's frame, m."""
        given = {name: value for name, value in self.model_dump().items() if value is not None}
        return Workspace(**given, tool=tool)


def per_joint_values(name: str, given: T | tuple[T, ...], arm: Arm) -> tuple[T, ...]:
    """The given value for each joint. Raises InputError if a list has not one entry a joint."""
    if not isinstance(given, tuple):
        return (given,) * len(arm)
    _check_count(name, given, arm)
    return given


def _check_count(name: str, given: Sized, arm: Arm) -> None:
    if len(given) != len(arm):
        raise InputError(f"{name} should have {len(arm)} entries, one a joint of '{arm.name}', has {len(given)}")


NotNegative = Annotated[float, Ge(0)]
Count = Annotated[int, Ge(1)]


class CriterionSettings(Settings):
    """What makes a motion good.

    kind: eq. 44 of the paper, the determinant (D) or the smallest eigenvalue (E) of the information matrix.
    weight_smallest: of the smallest singular value in eq. 44. weight_largest: of the largest one; within limits the
    default weights add less than a tenth of the condition number.
    """

    kind: Literal["eq44", "d_optimality", "e_optimality"] = "eq44"
    weight_smallest: NotNegative = 0.01
    weight_largest: NotNegative = 0.01

    def build(self) -> Criterion:
        """The criterion."""
        return Criterion(self.kind, self.weight_smallest, self.weight_largest)


class PenaltySettings(Settings):
    """Penalty of a broken limit: step + weight * violation.

    step: outweighs any gain in the condition number. weight: for each unit of violation.
    """

    step: NotNegative = 100.0
    weight: Positive = 1000.0

    def build(self) -> Penalty:
        """The penalty."""
        return Penalty(self.step, self.weight)


PenaltyOrRules = PenaltySettings | Literal["feasibility_rules"]


class ExcitationSettings(Settings):
    """What all excitation problems share.

    arm: a built-in name or a file. joints: how many of its first joints move, all if left out. duration: s.
    samples: instants, both ends included. columns: which columns are kept as base parameters, where there is
    a choice. unit_columns: scale columns to unit length. friction_columns: identify Coulomb friction, viscous friction
    and a torque offset of each joint, too, three columns a joint (`problem.friction`). tool: a point in the last link's
    frame, m, that the workspace limits too. frame_seed: search in randomly shifted coordinates. criterion: what
    makes a motion good. limits: of the joints. workspace: where the arm may be. penalty: of broken limits, or
    `feasibility_rules` (Deb 2000). collisions: distances that the arm keeps from itself, a floor and boxes, at the
    samples with a margin for what lies between them (`problem.safe_motion`); not looked at if left out.
    """

    arm: str = "irb120-arm"
    joints: Count | None = None
    duration: Positive = 10.0
    samples: Annotated[int, Ge(2)] = 100
    columns: Literal["later_columns", "earlier_columns"] | tuple[str, ...] = "later_columns"
    unit_columns: bool = False
    friction_columns: bool = Field(default=False, exclude_if=operator.not_)  # written settings without it stay the same
    criterion: CriterionSettings = CriterionSettings()
    penalty: PenaltyOrRules = PenaltySettings()
    limits: LimitSettings = LimitSettings()
    workspace: WorkspaceSettings = WorkspaceSettings()
    tool: Vector = (0.0, 0.0, 0.0)
    frame_seed: Annotated[int, Ge(0)] | None = None
    collisions: ClearanceSettings | None = Field(default=None, exclude_if=operator.not_)

    title: ClassVar[str] = ""

    def build(self) -> ExcitationProblem | ShiftedProblem:
        """The problem. Raises InputError where the settings do not fit the arm."""
        arm = self._arm()
        trajectory = self.trajectory(arm)
        limits = self.limits.of(arm)
        if any(np.isfinite(limit.torque) for limit in limits) and arm.links is None:
            raise InputError(
                f"a torque limit needs the inertial parameters of '{arm.name}', whose file has no `links`; "
                "`limits: {torque: none}` drops it"
            )
        problem = ExcitationProblem(
            name=self.title,
            arm=arm,
            base=self._base(arm),
            trajectory=trajectory,
            duration=self.duration,
            samples=self.samples,
            constraints=self._constraints(arm, limits),
            criterion=self.criterion.build(),
            penalty=FeasibilityRules() if self.penalty == "feasibility_rules" else self.penalty.build(),
            unit_columns=self.unit_columns,
            friction_columns=self.friction_columns,
        )
        return problem if self.frame_seed is None else shift_randomly(problem, self.frame_seed)

    def _constraints(self, arm: Arm, limits: tuple[Limits, ...]) -> Constraints:
        workspace = self.workspace.build(self.tool)
        if self.collisions is None:
            return Constraints(arm, limits, workspace)
        rules = safety_rules(arm, self.arm, limits, SafetySettings(**dict(self.collisions)), None)
        return SafeConstraints(arm, limits, workspace, rules=rules)

    def trajectory(self, arm: Arm) -> Trajectory:
        """The family of trajectories that is searched."""
        raise NotImplementedError

    def _arm(self) -> Arm:
        arm = load_arm(self.arm)
        if self.joints is not None and self.joints > len(arm):
            raise InputError(f"joints: {self.joints} is more than the {len(arm)} of '{arm.name}'")
        return arm.first(self.joints or len(arm))

    def _base(self, arm: Arm) -> BaseParameters:
        try:
            base = base_parameters(arm, self.columns)
        except ValueError as error:
            raise InputError(f"columns: {error}") from None
        friction = len(arm) * len(FRICTION_NAMES) if self.friction_columns else 0
        columns = len(base) + friction
        if self.samples * len(arm) < columns:
            what = f"{len(base)} base parameters" + (f" and {friction} of friction" if friction else "")
            raise InputError(
                f"samples: {self.samples} of {len(arm)} joints cannot show {what}; "
                f"take {-(-columns // len(arm))} or more"
            )
        return base


class JointLimitSettings(LimitSettings):
    """Limits with an acceleration that no data sheet of the IRB 120 gives; null leaves the robot file's."""

    acceleration: PerJoint | None = 40.0


class PaperLimitSettings(JointLimitSettings):
    """The same with joint 1 free; `position: robot` limits it like the others."""

    position: Literal["robot"] | tuple[Range | None, ...] = (
        None,
        (-1.919862177194, 1.919862177194),
        (-1.919862177194, 1.221730476396),
    )


class PaperSettings(ExcitationSettings):
    """The paper's problem: eq. 44-48 on the first three joints of the IRB 120.

    harmonics: of the Fourier series.
    one_c: one c for all harmonics, as in the published optimum, or one each. centre: of the circle, m; the
    shoulder by default. radius_limit: of each a_k, m: their sum may just leave the reach of the wrist, 0.58 m.
    coefficient_limit: of b_k and c, m/s. rest: eq. 48 by a window on the Fourier part. elbow: branch of the
    inverse kinematics. The circle turns joint 1 once round, which its range, +-165 deg, does not allow: by
    default its position is not limited (`limits: {position: robot}` limits it). Speeds are the data sheet's;
    no acceleration limit is published: 40 rad/s2. The tool point is the flange with a straight wrist.
    """

    preset: Literal["paper"] = "paper"
    harmonics: Count = 3
    one_c: bool = True
    rest: bool = True
    elbow: Literal["up", "down"] = "up"
    centre: Vector = (0.0, 0.0, 0.29)
    radius_limit: Positive = 0.2
    coefficient_limit: Positive = 0.5
    tool: Vector = (0.0, 0.0, 0.374)
    limits: PaperLimitSettings = PaperLimitSettings()

    title: ClassVar[str] = "paper"

    def trajectory(self, arm: Arm) -> CartesianFourier:
        """Eq. 45-47 with inverse kinematics."""
        return CartesianFourier(
            arm=planar_arm(arm, np.array(self.tool)),
            duration=self.duration,
            harmonics=self.harmonics,
            centre=self.centre,
            radius_limit=self.radius_limit,
            coefficient_limit=self.coefficient_limit,
            one_c=self.one_c,
            rest=self.rest,
            elbow_up=self.elbow == "up",
        )


SearchSpace = Literal["coefficients", "feasible"]


class JointFourierSettings(ExcitationSettings):
    """Finite Fourier series in joint space, five harmonics (Swevers 1997).

    harmonics: of the series.
    coefficient_limit: of a_k and b_k, rad/s, one number or one a joint; the speed limit shared among the
    harmonics if left out. rest: start and end at rest. search_space: `coefficients` as they are, or `feasible`, where
    every point keeps the limits of position, velocity and acceleration. No acceleration limit is published: 40 rad/s2.
    """

    preset: Literal["joint-fourier"] = "joint-fourier"
    harmonics: Count = 5
    rest: bool = False
    coefficient_limit: PerJoint | None = None
    search_space: SearchSpace = "coefficients"
    limits: JointLimitSettings = JointLimitSettings()

    title: ClassVar[str] = "joint-fourier"

    def trajectory(self, arm: Arm) -> JointFourier | FeasibleFourier:
        """The series for every joint of the arm, in its search space."""
        series = self._series(arm)
        return series if self.search_space == "coefficients" else FeasibleFourier(series, self.limits.of(arm))

    def _series(self, arm: Arm) -> JointFourier:
        if self.rest and self.harmonics < 2:
            raise InputError("rest: true needs at least two harmonics")
        lower, upper = np.array([limit.position for limit in self.limits.of(arm)]).T
        if not np.all(np.isfinite(upper - lower)):
            lower, upper = np.where(np.isfinite(upper - lower), [lower, upper], [[-np.pi], [np.pi]])
        return JointFourier(
            duration=self.duration,
            harmonics=self.harmonics,
            centre=(lower + upper) / 2,
            reach=(upper - lower) / 2,
            coefficient_limit=self._coefficient_limit(arm),
            rest=self.rest,
        )

    def _coefficient_limit(self, arm: Arm) -> Array:
        if self.coefficient_limit is not None:
            return np.array(per_joint_values("coefficient_limit", self.coefficient_limit, arm))
        speeds = np.array([limit.velocity for limit in self.limits.of(arm)])
        if not np.all(np.isfinite(speeds)):
            raise InputError(f"'{arm.name}' has joints without a speed limit: give `coefficient_limit` in rad/s")
        return np.asarray(speeds / self.harmonics)


class RandomFrameSettings(JointFourierSettings):
    """`joint-fourier` in randomly shifted coordinates: a fair test of algorithms that are drawn to the origin."""

    preset: Literal["random-frame"] = "random-frame"  # type: ignore[assignment]
    frame_seed: Annotated[int, Ge(0)] | None = 1


class FunctionSettings(Settings):
    """A classical test function.

    dimension: number of unknowns. half_width: of the box about the origin. shift_seed: moves the optimum to a random
    place in the inner half of the box.
    """

    preset: Literal["sphere", "ellipsoid", "rosenbrock", "rastrigin", "ackley"]
    dimension: Count = 15
    half_width: Annotated[float, Gt(0)] = 5.0
    shift_seed: Annotated[int, Ge(0)] | None = None

    def build(self) -> Problem:
        """The function on its box."""
        optimum = np.zeros(self.dimension)
        if self.shift_seed is not None:
            optimum = np.random.default_rng(self.shift_seed).uniform(-0.5, 0.5, self.dimension) * self.half_width
        return TestFunction(self.preset, FUNCTIONS[self.preset], self.half_width, optimum)
