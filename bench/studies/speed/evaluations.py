"""The speed of evaluations: from motions to the condition number beside Pinocchio with numpy, whole evaluations of a
problem, and how their time grows.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.derivatives import Question
from bench.studies.speed.clock import median_seconds
from problem.arm import Arm
from problem.base_parameters import base_parameters
from problem.contract import DifferentiableProblem, Problem
from problem.fitness import condition_number, singular_values
from problem.motion import Motion
from problem.registry import parse_problem
from problem.robot_file import load_arm

POPULATION_SIZE = 50
PIPELINE_SAMPLES = 100
PIPELINE_ROUNDS = 15
PINOCCHIO_ORDER = (0, 1, 2, 3, 4, 6, 9, 5, 7, 8)  # m, mc, Ixx Ixy Iyy Ixz Iyz Izz: where each of eq. 31 stands


def compare_with_pinocchio(arm_name: str = "irb120-arm") -> dict[str, float]:
    """Microseconds a trajectory of both pipelines, their ratio, and how far their results are apart.

    Both take the same population of random motions on one core. Pinocchio's pipeline: its regressor for each
    sample, the base columns of the stack, `numpy.linalg.cond`.
    """
    arm = with_joint_frames(load_arm(arm_name))
    motion = random_motions(arm, POPULATION_SIZE, PIPELINE_SAMPLES)
    columns = base_parameters(arm).columns
    ours, theirs = _armlab_task(arm, motion, columns), _pinocchio_task(arm, motion, columns)
    single = _armlab_task(arm, motion.select(np.arange(POPULATION_SIZE) == 0), columns)
    seconds = median_seconds({"armlab": ours, "single": single, "pinocchio": theirs}, PIPELINE_ROUNDS)
    armlab = 1000000.0 * seconds["armlab"] / POPULATION_SIZE
    pinocchio = 1000000.0 * seconds["pinocchio"] / POPULATION_SIZE
    return {
        "armlab_us": armlab,
        "armlab_one_at_a_time_us": 1e6 * seconds["single"],
        "pinocchio_us": pinocchio,
        "ratio_to_pinocchio": pinocchio / armlab,
        "ratio_to_pinocchio_one_at_a_time": pinocchio / (1e6 * seconds["single"]),
        "largest_relative_difference": float(np.max(np.abs(ours() / theirs() - 1.0))),
    }


def with_joint_frames(arm: Arm) -> Arm:
    """The same joints, with each link's frame where Pinocchio has it: at its joint."""
    tails = [np.eye(4), *(joint.after for joint in arm.joints)]
    joints = (
        replace(joint, before=tail @ joint.before, after=np.eye(4))
        for tail, joint in zip(tails, arm.joints, strict=False)
    )
    return Arm(arm.name, tuple(joints), gravity=arm.gravity)


def random_motions(arm: Arm, trajectories: int, samples: int) -> Motion:
    """Motions (trajectories, samples, joints) of independent random states."""
    rng = np.random.default_rng(0)
    return Motion(*(rng.uniform(-2, 2, (trajectories, samples, len(arm))) for _ in range(3)))


def _armlab_task(arm: Arm, motion: Motion, columns: NDArray[np.intp]) -> Callable[[], Array]:
    return lambda: condition_number(singular_values(arm, motion, columns, unit_columns=False))


def _pinocchio_task(arm: Arm, motion: Motion, columns: NDArray[np.intp]) -> Callable[[], Array]:
    import pinocchio

    model = _pinocchio_model(arm)
    data = model.createData()
    chosen = [10 * (column // 10) + PINOCCHIO_ORDER[column % 10] for column in columns]

    def condition(q: Array, v: Array, a: Array) -> float:
        regressor = pinocchio.computeJointTorqueRegressor
        rows = [regressor(model, data, *state).copy() for state in zip(q, v, a, strict=True)]
        return float(np.linalg.cond(np.vstack(rows)[:, chosen]))

    trajectories = list(zip(motion.position, motion.velocity, motion.acceleration, strict=True))
    return lambda: np.array([condition(*trajectory) for trajectory in trajectories])


def _pinocchio_model(arm: Arm) -> Any:
    """The arm as a Pinocchio model; a regressor needs no inertias."""
    import pinocchio

    model = pinocchio.Model()
    model.gravity.linear = np.array(arm.gravity)
    parent = 0
    for joint in arm.joints:
        kind = pinocchio.JointModelRZ() if joint.kind == "revolute" else pinocchio.JointModelPZ()
        placement = pinocchio.SE3(joint.before[:3, :3], joint.before[:3, 3])
        parent = model.addJoint(parent, kind, placement, joint.name)
    return model


PRESETS = ("paper", "joint-fourier", "random-frame")
ARMS = ("irb120-arm", "irb120", "unisa-panda")
SAMPLE_COUNTS = (50, 100, 200, 500, 1000)
SWARM_SIZES = (10, 30, 100, 300, 1000)
EVALUATION_ROUNDS = 11


def evaluations_per_second(swarm_size: int = 50) -> dict[str, float]:
    """Whole evaluations a second of each preset on one core, in populations of `swarm_size`."""
    tasks = {name: _evaluation_task(_build_problem(preset=name), swarm_size) for name in PRESETS}
    return {name: swarm_size / seconds for name, seconds in median_seconds(tasks, EVALUATION_ROUNDS).items()}


DERIVATIVE_PROBLEMS: Mapping[str, Mapping[str, object]] = {
    "paper": {"preset": "paper"},
    "joint-fourier": {"preset": "joint-fourier"},
    "joint-fourier, six joints": {"preset": "joint-fourier", "arm": "irb120"},
    "joint-fourier, seven joints": {
        "preset": "joint-fourier",
        "arm": "unisa-panda",
        "limits": {"torque": "none", "acceleration": None},
    },
}
_WATCH = 0.3  # as `sqp` asks


def price_of_derivatives() -> dict[str, dict[str, float]]:
    """What a point with derivatives costs in evaluations: as stated in experiments, and as measured now.

    Measured against an evaluation in a population of 50, and against one of a single point.
    """
    return {name: _measure_price(_build_problem(**settings)) for name, settings in DERIVATIVE_PROBLEMS.items()}


def _measure_price(problem: Problem) -> dict[str, float]:
    if not isinstance(problem, DifferentiableProblem):
        raise TypeError(f"problem {problem.name!r} offers no derivatives")
    rng = np.random.default_rng(0)
    population = rng.uniform(problem.lower, problem.upper, (POPULATION_SIZE, len(problem.lower)))
    best = population[np.argmin(problem.evaluate(population).fitness)]
    question = Question(10.0, np.zeros(0, dtype=np.intp), _WATCH)
    tasks: dict[str, Callable[[], object]] = {
        "population": lambda: problem.evaluate(population),
        "single": lambda: problem.evaluate(best[None]),
        "derivatives": lambda: problem.differentiate(best, question),
    }
    seconds = median_seconds(tasks, EVALUATION_ROUNDS)
    whole = seconds["single"] + seconds["derivatives"]
    return {
        "stated": len(problem.lower) + 1,
        "in_population": whole / (seconds["population"] / POPULATION_SIZE),
        "single": whole / seconds["single"],
        "us": 1e6 * whole,
    }


def growth_with_samples() -> dict[str, float]:
    """Microseconds from motion to condition number of one trajectory against its samples, three joints."""
    return _microseconds_each({str(samples): _condition_task(ARMS[0], samples) for samples in SAMPLE_COUNTS}, 50)


def growth_with_joints() -> dict[str, float]:
    """Microseconds from motion to condition number of one trajectory of 100 samples for 3, 6 and 7 joints."""
    return _microseconds_each({str(len(load_arm(arm))): _condition_task(arm, 100) for arm in ARMS}, 50)


def growth_with_swarm_size() -> dict[str, float]:
    """Microseconds a whole evaluation of `joint-fourier` against the points that are evaluated at once."""
    problem = _build_problem(preset="joint-fourier")
    tasks = {str(size): _evaluation_task(problem, size) for size in SWARM_SIZES}
    return {size: 1e6 * taken / int(size) for size, taken in median_seconds(tasks, EVALUATION_ROUNDS).items()}


def _microseconds_each(tasks: Mapping[str, Callable[[], object]], each: int) -> dict[str, float]:
    return {name: 1e6 * taken / each for name, taken in median_seconds(tasks, EVALUATION_ROUNDS).items()}


def _build_problem(**settings: object) -> Problem:
    return parse_problem(settings, "the speed report").build()


def _evaluation_task(problem: Problem, points: int) -> Callable[[], object]:
    population = np.random.default_rng(0).uniform(problem.lower, problem.upper, (points, len(problem.lower)))
    return lambda: problem.evaluate(population)


def _condition_task(arm_name: str, samples: int) -> Callable[[], object]:
    arm = load_arm(arm_name)
    motion, columns = random_motions(arm, 50, samples), base_parameters(arm).columns
    return lambda: singular_values(arm, motion, columns, unit_columns=False)
