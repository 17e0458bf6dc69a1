"""The motions of a design: limits in force, Fourier series within these limits that start anywhere or near a pose, and
the search with any registered algorithm.
"""

import zlib
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from algorithms.contract import Box, uniform_points
from algorithms.driver import minimise
from algorithms.registry import BrokenAlgorithmError, UnknownAlgorithmError, load
from armlab.common.arrays import Array
from armlab.common.errors import DataError, InputError
from armlab.recordings.differentiate import differentiate
from armlab.recordings.recording import Recording, Run
from problem.arm import Arm, Limits
from problem.base_parameters import base_parameters
from problem.contract import Problem
from problem.excitation import ExcitationProblem, FeasibilityRules
from problem.fitness import Criterion
from problem.limits import Constraints, peaks
from problem.motion import Motion
from problem.safe_motion import RecordedPlace, SafeConstraints, SafetyRules
from problem.safety_proof import SafetyReport, UnsafeMotionError, check_motion
from problem.trajectories import Excitation, JointFourier, sample_instants

USED_LIMIT_SHARE = 0.995  # of each limit is used: peaks may lie between the instants at which they are looked for
CENTRE_RANGE_SHARE = 0.97  # of the range: where q0 may be, so that there is room for a swing
PEAK_INSTANTS = 801  # instants


@dataclass(frozen=True, eq=False)
class WithinLimits:
    """A series whose swing about q0 shrinks, joint by joint, until position, speed and acceleration are allowed.

    A small swing is not enlarged, so that the search can find slow motions, too.
    """

    series: JointFourier
    limits: tuple[Limits, ...]

    @property
    def lower(self) -> Array:
        """Lower bounds, (dimension,)."""
        return self.series.lower

    @property
    def upper(self) -> Array:
        """Upper bounds, (dimension,)."""
        return self.series.upper

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the series' numbers."""
        return self.series.names

    def motions(self, points: Array, times: Array) -> Excitation:
        """Motions (points, samples, joints) of points (points, dimension) at `times` (samples,), s."""
        rest = self._centres(points)[:, None]
        scale = self._scale(points, rest)
        motion = self.series.motions(points, times).motion
        moved = Motion(rest + scale * (motion.position - rest), scale * motion.velocity, scale * motion.acceleration)
        return Excitation(moved, np.zeros(len(points)))

    def _centres(self, points: Array) -> Array:
        """q0 of each joint, (points, joints), inside the limits."""
        low, high = self._range
        every = points.reshape(len(points), len(self.limits), -1)[:, :, -1]
        room = (1 - CENTRE_RANGE_SHARE) * (high - low) / 2
        return np.asarray(np.clip(every, low + room, high - room))

    def _anchors(self, points: Array, position: Array) -> Array:
        """What the swing is measured from, q0: (points, 1, joints). position: at the instants of the peaks."""
        return points.reshape(len(points), len(self.limits), -1)[:, None, :, -1]

    @property
    def _range(self) -> tuple[Array, Array]:
        """Lowest and highest position that are used, (joints,) each."""
        low, high = np.array([each.position for each in self.limits]).T
        spared = (1 - USED_LIMIT_SHARE) * (high - low) / 2
        return low + spared, high - spared

    def _scale(self, points: Array, rest: Array) -> Array:
        """Share of the swing that the limits allow, (points, 1, joints)."""
        motion = self.series.motions(points, self._instants).motion
        swing = motion.position - self._anchors(points, motion.position)
        shares = [np.ones(rest.shape)]
        with np.errstate(divide="ignore", invalid="ignore"):
            for each, room in self._used_and_allowed(swing, motion, rest):
                shares.append(np.where(each > 0, room / each, np.inf))
        return np.asarray(np.min(shares, axis=0))

    def _used_and_allowed(self, swing: Array, motion: Motion, rest: Array) -> list[tuple[Array, Array]]:
        """What is used of each limit at a swing of one, and what there is of it: (points, 1, joints)."""
        low, high = self._range
        speed = USED_LIMIT_SHARE * np.array([each.velocity for each in self.limits])
        acceleration = USED_LIMIT_SHARE * np.array([each.acceleration for each in self.limits])
        return [
            (swing.max(axis=1, keepdims=True), high - rest),
            (-swing.min(axis=1, keepdims=True), rest - low),
            (np.abs(motion.velocity).max(axis=1, keepdims=True), np.broadcast_to(speed, rest.shape)),
            (np.abs(motion.acceleration).max(axis=1, keepdims=True), np.broadcast_to(acceleration, rest.shape)),
        ]

    @cached_property
    def _instants(self) -> Array:
        return sample_instants(self.series.duration, PEAK_INSTANTS)


@dataclass(frozen=True, eq=False)
class FromPose(WithinLimits):
    """The same where the last number of a joint is the position in which the motion starts and ends, not q0."""

    def motions(self, points: Array, times: Array) -> Excitation:
        """Motions (points, samples, joints) of points (points, dimension) at `times` (samples,), s."""
        start = points.reshape(len(points), len(self.limits), -1)[:, None, :, -1]
        scale = self._scale(points, start)
        first = self.series.motions(points, self._instants[:1]).motion.position
        motion = self.series.motions(points, times).motion
        moved = Motion(start + scale * (motion.position - first), scale * motion.velocity, scale * motion.acceleration)
        return Excitation(moved, np.zeros(len(points)))

    def _anchors(self, points: Array, position: Array) -> Array:
        """The start, from which the swing is measured: (points, 1, joints)."""
        return position[:, :1]

    @classmethod
    def near(cls, free: WithinLimits, start: Array, reach: Array) -> "FromPose":
        """The motions of `free` that start within `reach` of `start`, (joints,) each."""
        low, high = free._range
        lowest, highest = np.clip(start - reach, low, high), np.clip(start + reach, low, high)
        series = replace(free.series, centre=(lowest + highest) / 2, reach=(highest - lowest) / 2)
        return cls(series, free.limits)


def fourier_within_limits(limits: tuple[Limits, ...], duration: float, harmonics: int) -> WithinLimits:
    """The series of an arm with these limits, from rest to rest; ValueError where a speed or a range is not limited."""
    low, high = np.array([each.position for each in limits]).T
    speed = np.array([each.velocity for each in limits])
    if not np.all(np.isfinite([low, high, speed])):
        raise DataError("a motion can only be designed for joints with limits of position and speed")
    coefficients = speed / np.sqrt(harmonics)
    return WithinLimits(
        JointFourier(duration, harmonics, (low + high) / 2, (high - low) / 2, coefficients, True), limits
    )


POPULATION_SIZE = 25
LIMIT_CHECK_HZ = 100.0  # instants at which limits of torque are checked


@dataclass(frozen=True)
class Budget:
    """How long the motion is and how it is searched for."""

    duration: float = 10.0
    harmonics: int = 8
    algorithm: str = "l-shade"
    evaluations: int = 1000
    seed: int = 0


def limits_in_force(arm: Arm, recording: Recording | None) -> tuple[Limits, ...]:
    """Limits of each joint from the robot file; where it gives none, the peaks of the recording.

    Raises InputError where neither gives a range, a speed and an acceleration.
    """
    shown = None if recording is None else _limits_shown(recording)
    out = []
    for number, joint in enumerate(arm.joints):
        given = joint.limits
        shown_by_joint = Limits() if shown is None else shown[number]
        low, high = given.position if np.all(np.isfinite(given.position)) else shown_by_joint.position
        speed = given.velocity if np.isfinite(given.velocity) else shown_by_joint.velocity
        acceleration = given.acceleration if np.isfinite(given.acceleration) else shown_by_joint.acceleration
        if not np.all(np.isfinite([low, high, speed, acceleration])):
            raise InputError(
                f"{arm.name}, {joint.name}: give position_limits, velocity_limit and acceleration_limit in the robot "
                "file, or --recording, whose motion shows what the joint can do"
            )
        out.append(Limits((low, high), speed, acceleration, given.torque))
    return tuple(out)


def build_excitation_problem(
    arm: Arm, limits: tuple[Limits, ...], budget: Budget, safety: SafetyRules | None = None
) -> ExcitationProblem:
    """The problem of the smallest condition number for the same motions and limits, which `safety` may narrow."""
    limits = limits if safety is None else safety.limits
    if any(np.isfinite(limit.torque) for limit in limits) and arm.links is None:
        limits = tuple(replace(limit, torque=np.inf) for limit in limits)
    trajectory = fourier_within_limits(limits, budget.duration, budget.harmonics)
    if safety is not None and safety.start is not None:
        trajectory = FromPose.near(trajectory, safety.start, safety.start_reach)
    samples = round(budget.duration * LIMIT_CHECK_HZ) + 1
    constraints = Constraints(arm, limits) if safety is None else SafeConstraints(arm, limits, rules=safety)
    return ExcitationProblem(
        name="condition",
        arm=arm,
        base=base_parameters(arm),
        trajectory=trajectory,
        duration=budget.duration,
        samples=samples,
        constraints=constraints,
        criterion=Criterion(),
        penalty=FeasibilityRules(),
    )


def search_motion(problem: Problem, budget: Budget) -> Array:
    """The best point (dimension,) that the algorithm finds; InputError where none keeps the limits."""
    try:
        algorithm = load(budget.algorithm)
    except (UnknownAlgorithmError, BrokenAlgorithmError) as error:
        raise InputError(f"--algorithm: {error}") from None
    box = Box(problem.lower, problem.upper)
    rng = random_generator(problem.name, budget)
    population = uniform_points(POPULATION_SIZE, box, rng)
    population[::2] = [shrink_motion(problem, point) for point in population[::2]]

    def objective(points: Array) -> Array:
        return problem.evaluate(points).fitness

    with np.errstate(over="ignore"):
        result = minimise(algorithm, algorithm.Params(), objective, box, population, budget.evaluations, rng)
    if problem.evaluate(result.best_x[None]).violation[0] > 0:
        raise InputError(f"{problem.name}: {budget.evaluations} evaluations found no motion within all limits")
    return result.best_x


def random_point(problem: Problem, budget: Budget, tries: int = 200) -> Array:
    """A random point (dimension,) whose motion keeps the limits, smaller where safety rules ask for it."""
    rng = random_generator("random motion", budget)
    for _ in range(tries):
        point = shrink_motion(problem, uniform_points(1, Box(problem.lower, problem.upper), rng)[0])
        if problem.evaluate(point[None]).violation[0] == 0:
            return point
    raise InputError(f"{tries} random motions all break a limit")


SHRINK_SHARES = (1.0, 0.85, 0.7, 0.55, 0.4, 0.3, 0.2, 0.1, 0.05, 0.0)  # of the way from standing still to a motion


def shrink_motion(problem: Problem, point: Array) -> Array:
    """The point (dimension,), moved towards standing still in a safe pose until its motion keeps the safety rules.

    A problem without safety rules leaves it as it is.
    """
    if not isinstance(problem, ExcitationProblem) or not isinstance(problem.constraints, SafeConstraints):
        return point
    still = _still_point(problem, problem.constraints.rules)
    shrunk = (still + share * (point - still) for share in SHRINK_SHARES)
    kept = (
        each
        for each in shrunk
        if problem.constraints.violation(problem.trajectory.motions(each[None], problem.times))[0] == 0
    )
    return next(kept, point)


def secure_motion(problem: ExcitationProblem, point: Array, rules: SafetyRules) -> tuple[Array, SafetyReport]:
    """A point whose motion is shown to keep its rules at every instant, and what was checked of it.

    The motion of `point` (dimension,), smaller where it needs to be: a search sees fewer poses than a proof. Raises
    InputError where none is found.
    """
    still, told = _still_point(problem, rules), ""
    for share in SECURE_SHARES:
        chosen = still + share * (point - still)
        try:
            return chosen, check_motion(rules, problem.trajectory, chosen, problem.duration)
        except UnsafeMotionError as error:
            told = told or str(error)
    raise InputError(f"{problem.name}: no motion is found that keeps the safety rules: {told}")


SECURE_SHARES = (1.0, 0.99, 0.97, 0.94, 0.9, 0.8, 0.65, 0.5)  # of a motion that a search has found


def _still_point(problem: ExcitationProblem, rules: SafetyRules) -> Array:
    """The point (dimension,) of standing still in the safe pose."""
    out = np.zeros((len(problem.arm), len(problem.lower) // len(problem.arm)))
    out[:, -1] = rules.still
    return out.ravel()


def random_generator(purpose: str, budget: Budget) -> np.random.Generator:
    """The stream of random numbers for one purpose."""
    return np.random.default_rng([budget.seed, zlib.crc32(purpose.encode())])


def recorded_place(recording: Recording) -> RecordedPlace:
    """The range of a recording and the pose in which its first run starts."""
    positions = [run.position for run in recording.runs]
    lowest = np.min([each.min(axis=0) for each in positions], axis=0)
    highest = np.max([each.max(axis=0) for each in positions], axis=0)
    return RecordedPlace(lowest, highest, np.asarray(positions[0][0]))


def _limits_shown(recording: Recording) -> list[Limits]:
    """The peaks of each joint in a recording, as limits."""
    lowest, highest, speed, acceleration = np.stack([_motion_peaks(run) for run in recording.runs], axis=1)
    rows = np.column_stack(
        [lowest.min(axis=0), *(part.max(axis=0) for part in (highest, speed, acceleration))]
    ).tolist()
    return [Limits((row[0], row[1]), row[2], row[3]) for row in rows]


def _motion_peaks(run: Run) -> Array:
    """Lowest and highest position, largest speed and acceleration, (4, joints)."""
    motion = differentiate(run).motion
    alone = Motion(motion.position[None], motion.velocity[None], motion.acceleration[None])
    return np.asarray(peaks(alone)[0])
