"""CMA-ES is the package's own: the adapter only normalises, seeds and starts it."""

import numpy as np
import pytest
from cmaes import CMA

from algorithms.cmaes import CMAES, CMAESParams
from algorithms.contract import Box, uniform_points

BOX = Box(np.array([-4.0, 0.0]), np.array([4.0, 0.5]))
START = uniform_points(6, BOX, np.random.default_rng(1))


def cost(X):
    return np.square(X - [1.0, 0.2]).sum(axis=1)


def test_three_steps_are_those_of_the_package_in_the_unit_box_after_the_first_population():
    state = CMAES.init(CMAESParams(), START, BOX, 3, np.random.default_rng(9))
    seed = int(np.random.default_rng(9).integers(2**32))
    package = CMA(np.array([0.5, 0.5]), 12**-0.5, seed=seed, population_size=6)
    expected = START
    for step in range(4):
        X, state = CMAES.ask(state)
        np.testing.assert_allclose(X, expected, rtol=1e-9, err_msg=f"step {step}")
        state = CMAES.tell(state, X, cost(X))
        package.tell([((x - [-4.0, 0.0]) / [8.0, 0.5], y) for x, y in zip(expected, cost(expected), strict=True)])
        expected = np.array([package.ask() * [8.0, 0.5] + [-4.0, 0.0] for _ in range(6)])


def test_it_is_finished_when_the_package_stops_on_a_flat_objective():
    state = CMAES.init(CMAESParams(), START, BOX, 100, np.random.default_rng(0))
    steps = 0
    while not CMAES.finished(state):
        X, state = CMAES.ask(state)
        state = CMAES.tell(state, X, np.zeros(6))
        steps += 1
    # the package compares the last 10 + 30 * 2 / 6 generations
    assert steps == 21


def test_a_single_point_is_refused():
    with pytest.raises(ValueError, match="1 is too few"):
        CMAES.init(CMAESParams(), START[:1], BOX, 3, np.random.default_rng(0))
