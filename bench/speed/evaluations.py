"""Whole evaluations of a problem, from a population of points to their fitness, and how their time grows."""

from collections.abc import Callable, Mapping

import numpy as np

from bench.speed.clock import median_seconds
from bench.speed.condition import random_motions
from problem.base_parameters import base_parameters
from problem.contract import Problem
from problem.fitness import singular_values
from problem.registry import parse_problem
from problem.robot_file import load_arm

PRESETS = ("paper", "joint-fourier", "random-frame")
ARMS = ("irb120-arm", "irb120", "unisa-panda")
SAMPLES = (50, 100, 200, 500, 1000)
SWARM_SIZES = (10, 30, 100, 300, 1000)
ROUNDS = 11


def evaluations_per_second(swarm_size: int = 50) -> dict[str, float]:
    """Whole evaluations a second of each preset on one core, in populations of `swarm_size`."""
    tasks = {name: _evaluation(_problem(preset=name), swarm_size) for name in PRESETS}
    return {name: swarm_size / seconds for name, seconds in median_seconds(tasks, ROUNDS).items()}


def growth_with_samples() -> dict[str, float]:
    """Microseconds from motion to condition number of one trajectory against its samples, three joints."""
    return _microseconds({str(samples): _condition(ARMS[0], samples) for samples in SAMPLES}, 50)


def growth_with_joints() -> dict[str, float]:
    """Microseconds from motion to condition number of one trajectory of 100 samples for 3, 6 and 7 joints."""
    return _microseconds({str(len(load_arm(arm))): _condition(arm, 100) for arm in ARMS}, 50)


def growth_with_swarm_size() -> dict[str, float]:
    """Microseconds a whole evaluation of `joint-fourier` against the points that are evaluated at once."""
    problem = _problem(preset="joint-fourier")
    tasks = {str(size): _evaluation(problem, size) for size in SWARM_SIZES}
    return {size: 1e6 * taken / int(size) for size, taken in median_seconds(tasks, ROUNDS).items()}


def _microseconds(tasks: Mapping[str, Callable[[], object]], each: int) -> dict[str, float]:
    return {name: 1e6 * taken / each for name, taken in median_seconds(tasks, ROUNDS).items()}


def _problem(**settings: object) -> Problem:
    return parse_problem(settings, "the speed report").build()


def _evaluation(problem: Problem, points: int) -> Callable[[], object]:
    population = np.random.default_rng(0).uniform(problem.lower, problem.upper, (points, len(problem.lower)))
    return lambda: problem.evaluate(population)


def _condition(arm_name: str, samples: int) -> Callable[[], object]:
    arm = load_arm(arm_name)
    motion, columns = random_motions(arm, 50, samples), base_parameters(arm).columns
    return lambda: singular_values(arm, motion, columns, unit_columns=False)
