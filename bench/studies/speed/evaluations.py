"""The speed of evaluations: from motions to the condition number beside Pinocchio with numpy and beside compiled code
of CasADi, in C and over four lanes in C++, whole evaluations of a problem, and how their time grows.
"""

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.derivatives import Question
from bench.studies.speed.casadi_regressor import compile_regressor
from bench.studies.speed.clock import median_seconds
from bench.studies.speed.four_lanes import compile_gram_matrices, cpp_compiler
from problem.arm import Arm
from problem.base_parameters import base_parameters
from problem.contract import DifferentiableProblem, Problem
from problem.motion import Motion
from problem.registry import parse_problem
from problem.robot_file import load_arm
from problem.spectrum import find_spectrum, spectra_of_gram_matrices

POPULATION_SIZE = 50
PIPELINE_SAMPLES = 100
PIPELINE_ROUNDS = 31
PINOCCHIO_ORDER = (0, 1, 2, 3, 4, 6, 9, 5, 7, 8)  # m, mc, Ixx Ixy Iyy Ixz Iyz Izz: where each of eq. 31 stands


REFERENCE = "Pinocchio regressor, numpy.linalg.cond, one at a time"
POPULATION, SINGLE = f"population of {POPULATION_SIZE}", "one at a time"
OURS, ANCHOR = "armlab", "CasADi in C++ over four lanes, numpy.linalg.eigvalsh"
HELPED_ANCHOR = "CasADi in C++ over four lanes, armlab's spectra.c"


@dataclass(frozen=True)
class PipelineFigures:
    """From motions to condition numbers in several ways, on the same random motions.

    us: microseconds a trajectory by pipeline. results_apart: largest relative difference of the condition numbers from
    Pinocchio's. matrices_apart: largest difference of an entry of CasADi's observation matrix from Pinocchio's,
    relative to the largest entry.
    """

    joints: int
    us: dict[str, float]
    results_apart: float
    matrices_apart: float

    @property
    def has_anchor(self) -> bool:
        """Whether there was a C++ compiler."""
        return f"{ANCHOR}, {SINGLE}" in self.us

    @property
    def ratios(self) -> dict[str, float]:
        """How many times as fast as Pinocchio with numpy each pipeline is."""
        return {name: self.us[REFERENCE] / taken for name, taken in self.us.items()}

    @property
    def shares_of_anchor(self) -> dict[str, float]:
        """The time of armlab's two pipelines as a share of that of the anchor in the same way of calling."""
        if not self.has_anchor:
            return {}
        return {way: self.us[f"{OURS}, {way}"] / self.us[f"{ANCHOR}, {way}"] for way in (POPULATION, SINGLE)}


def compare_pipelines(arm_name: str, rounds: int = PIPELINE_ROUNDS) -> PipelineFigures:
    """armlab, CasADi's generated code and Pinocchio with numpy, on one core, taking turns.

    Pinocchio: its regressor for each sample, the base columns of the stack, `numpy.linalg.cond`. CasADi in C: see
    `casadi_regressor`; behind it `numpy.linalg.cond`, or the eigenvalues of the Gram matrix by numpy. The anchor is the
    Gram matrix of `four_lanes` with numpy's eigenvalues, and the same with armlab's `spectra.c` in their place; it is
    left out where there is no C++ compiler.
    """
    arm = with_joint_frames(load_arm(arm_name))
    motion = random_motions(arm, POPULATION_SIZE, PIPELINE_SAMPLES)
    singles = [motion.select(np.arange(POPULATION_SIZE) == number) for number in range(POPULATION_SIZE)]
    columns = base_parameters(arm).columns
    with tempfile.TemporaryDirectory() as folder:
        observe = compile_regressor(arm, columns, Path(folder))
        four_lanes = compile_gram_matrices(arm, columns, Path(folder)) if cpp_compiler() else None
    stack = _pinocchio_stack(arm, columns)

    def each(condition: Callable[[Motion], Array]) -> Callable[[], Array]:
        return lambda: np.concatenate([condition(single) for single in singles])

    def of_armlab(some: Motion) -> Array:
        return find_spectrum(arm, some, columns, unit_columns=False).condition_number

    def of_c_code(some: Motion) -> Array:
        matrices = observe(some)
        return _condition_by_numpy(np.swapaxes(matrices, 1, 2) @ matrices)

    pipelines: dict[str, Callable[[Motion], Array]] = {OURS: of_armlab}
    if four_lanes is not None:
        pipelines[ANCHOR] = lambda some: _condition_by_numpy(four_lanes(some))
        pipelines[HELPED_ANCHOR] = lambda some: spectra_of_gram_matrices(four_lanes(some))[0].condition_number
    pipelines["CasADi in C, Gram matrix, numpy.linalg.eigvalsh"] = of_c_code
    tasks: dict[str, Callable[[], Array]] = {}
    for name, pipeline in pipelines.items():
        tasks[f"{name}, {POPULATION}"] = partial(pipeline, motion)
        tasks[f"{name}, {SINGLE}"] = each(pipeline)
    tasks[f"CasADi in C, numpy.linalg.cond, {SINGLE}"] = each(lambda single: np.linalg.cond(observe(single)))
    tasks[REFERENCE] = each(lambda single: np.linalg.cond(stack(single)[None]))
    seconds = median_seconds(tasks, rounds)
    found = {name: task() for name, task in tasks.items()}
    theirs = stack(singles[0])
    return PipelineFigures(
        joints=len(arm),
        us={name: 1e6 * taken / POPULATION_SIZE for name, taken in seconds.items()},
        results_apart=max(float(np.abs(values / found[REFERENCE] - 1).max()) for values in found.values()),
        matrices_apart=float(np.abs(observe(singles[0])[0] - theirs).max() / np.abs(theirs).max()),
    )


def _condition_by_numpy(gram: Array) -> Array:
    """Condition numbers (points,) from the eigenvalues of Gram matrices (points, n, n)."""
    squares = np.linalg.eigvalsh(gram)
    condition: Array = np.sqrt(squares[:, -1] / squares[:, 0])
    return condition


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


def _pinocchio_stack(arm: Arm, columns: NDArray[np.intp]) -> Callable[[Motion], Array]:
    """Pinocchio's observation matrix (samples * joints, chosen) of one motion (1, samples, joints)."""
    import pinocchio

    model = _pinocchio_model(arm)
    data = model.createData()
    chosen = [10 * (column // 10) + PINOCCHIO_ORDER[column % 10] for column in columns]

    def stack(motion: Motion) -> Array:
        regressor = pinocchio.computeJointTorqueRegressor
        states = zip(motion.position[0], motion.velocity[0], motion.acceleration[0], strict=True)
        return np.asarray(np.vstack([regressor(model, data, *state).copy() for state in states])[:, chosen])

    return stack


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
    return lambda: find_spectrum(arm, motion, columns, unit_columns=False)
