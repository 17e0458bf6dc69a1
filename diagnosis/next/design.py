"""The design: limits of the robot, a family of motions, and the search with any registered algorithm."""

import zlib
from dataclasses import dataclass, replace

import numpy as np

from algorithms.contract import Box, uniform_points
from algorithms.driver import minimise
from algorithms.registry import BrokenAlgorithmError, UnknownAlgorithmError, load
from diagnosis.next.within import fourier_within
from problem.arm import Arm, Limits
from problem.base_parameters import base_parameters
from problem.contract import Problem
from problem.errors import InputError
from problem.excitation_problem import ExcitationProblem, FeasibilityRules
from problem.fitness import Criterion
from problem.limits import Constraints, peaks
from problem.motion import Motion
from problem.transforms import Array
from recordings.differentiate import differentiate
from recordings.recording import Recording
from recordings.run import Run

SWARM = 25
MOTION_HZ = 100.0  # instants at which limits of torque are checked


@dataclass(frozen=True)
class Budget:
    """How long the motion is and how it is searched for."""

    duration: float = 10.0
    harmonics: int = 8
    algorithm: str = "l-shade"
    evaluations: int = 1000
    seed: int = 0


def limits_in_force(arm: Arm, recording: Recording | None) -> tuple[Limits, ...]:
    """Limits of each joint; what the robot file leaves open is what the recording has shown the joint can do.

    Raises InputError where neither tells a range, a speed and an acceleration.
    """
    shown = None if recording is None else _shown(recording)
    out = []
    for number, joint in enumerate(arm.joints):
        known = joint.limits
        seen = Limits() if shown is None else shown[number]
        low, high = known.position if np.all(np.isfinite(known.position)) else seen.position
        speed = known.velocity if np.isfinite(known.velocity) else seen.velocity
        acceleration = known.acceleration if np.isfinite(known.acceleration) else seen.acceleration
        if not np.all(np.isfinite([low, high, speed, acceleration])):
            raise InputError(
                f"{arm.name}, {joint.name}: give position_limits, velocity_limit and acceleration_limit in the robot "
                "file, or --recording, whose motion shows what the joint can do"
            )
        out.append(Limits((low, high), speed, acceleration, known.torque))
    return tuple(out)


def excitation(arm: Arm, limits: tuple[Limits, ...], budget: Budget) -> ExcitationProblem:
    """The problem of the smallest condition number for the same motions and limits."""
    if any(np.isfinite(limit.torque) for limit in limits) and arm.links is None:
        limits = tuple(replace(limit, torque=np.inf) for limit in limits)
    trajectory = fourier_within(limits, budget.duration, budget.harmonics)
    samples = round(budget.duration * MOTION_HZ) + 1
    constraints, rules = Constraints(arm, limits), FeasibilityRules()
    return ExcitationProblem(
        "condition", arm, base_parameters(arm), trajectory, budget.duration, samples, constraints, Criterion(), rules
    )


def searched(problem: Problem, budget: Budget) -> Array:
    """The best point (dimension,) that the algorithm finds; InputError where none keeps the limits."""
    try:
        algorithm = load(budget.algorithm)
    except (UnknownAlgorithmError, BrokenAlgorithmError) as error:
        raise InputError(f"--algorithm: {error}") from None
    box = Box(problem.lower, problem.upper)
    rng = generator(problem.name, budget)
    population = uniform_points(SWARM, box, rng)

    def objective(points: Array) -> Array:
        return problem.evaluate(points).fitness

    with np.errstate(over="ignore"):
        found = minimise(algorithm, algorithm.Params(), objective, box, population, budget.evaluations, rng)
    if problem.evaluate(found.best_x[None]).violation[0] > 0:
        raise InputError(f"{problem.name}: {budget.evaluations} evaluations found no motion within all limits")
    return found.best_x


def random_point(problem: Problem, budget: Budget, tries: int = 200) -> Array:
    """A random point (dimension,) whose motion keeps the limits."""
    rng = generator("random motion", budget)
    for _ in range(tries):
        point = uniform_points(1, Box(problem.lower, problem.upper), rng)
        if problem.evaluate(point).violation[0] == 0:
            return np.asarray(point[0])
    raise InputError(f"{tries} random motions all break a limit")


def generator(purpose: str, budget: Budget) -> np.random.Generator:
    """The stream of random numbers for one purpose."""
    return np.random.default_rng([budget.seed, zlib.crc32(purpose.encode())])


def _shown(recording: Recording) -> list[Limits]:
    """What each joint did in a recording."""
    found = np.stack([_peaks(run) for run in recording.runs])
    low, high = found[..., 0].min(axis=0), found[..., 1].max(axis=0)
    rows = np.column_stack([low, high, found[..., 2].max(axis=0), found[..., 3].max(axis=0)]).tolist()
    return [Limits((row[0], row[1]), row[2], row[3]) for row in rows]


def _peaks(run: Run) -> Array:
    """Lowest and highest position, largest speed and acceleration, (joints, 4)."""
    motion = differentiate(run).motion
    alone = Motion(motion.position[None], motion.velocity[None], motion.acceleration[None])
    return np.asarray(peaks(alone)[0])
