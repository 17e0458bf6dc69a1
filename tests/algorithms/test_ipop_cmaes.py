"""IPOP-CMA-ES: the package's own runs, one after the other, each with twice the population."""

import numpy as np
from cmaes import CMA

from algorithms.cmaes import IPOPCMAES, IPOPParams
from algorithms.contract import Box, uniform_points
from algorithms.driver import minimise

BOX = Box(np.array([-4.0, 0.0]), np.array([4.0, 0.5]))
START = uniform_points(9, BOX, np.random.default_rng(1))


def cost(X):
    return np.square(X - [1.0, 0.2]).sum(axis=1)


def test_steps_are_those_of_the_package_from_the_best_of_the_first_population():
    state = IPOPCMAES.init(IPOPParams(), START, BOX, 3, np.random.default_rng(9))
    seeds = np.random.default_rng(9).integers(2**32, size=2)
    X, state = IPOPCMAES.ask(state)
    np.testing.assert_array_equal(X, START)
    state = IPOPCMAES.tell(state, X, cost(X))
    best = START[cost(START).argmin()]
    package = CMA(np.round((best - [-4.0, 0.0]) / [8.0, 0.5], 9), 0.3, seed=int(seeds[1]))
    for _ in range(3):
        expected = np.array([package.ask() * [8.0, 0.5] + [-4.0, 0.0] for _ in range(6)])  # 4 + 3 ln 2
        X, state = IPOPCMAES.ask(state)
        np.testing.assert_allclose(X, expected, rtol=1e-9)
        state = IPOPCMAES.tell(state, X, cost(X))
        package.tell([((x - [-4.0, 0.0]) / [8.0, 0.5], y) for x, y in zip(expected, cost(expected), strict=True)])


def test_the_population_doubles_whenever_a_run_has_converged():
    state = IPOPCMAES.init(IPOPParams(), START, BOX, 3, np.random.default_rng(9))
    sizes = []
    for _ in range(300):
        X, state = IPOPCMAES.ask(state)
        state = IPOPCMAES.tell(state, X, cost(X))
        sizes.append(len(X))
    assert list(dict.fromkeys(sizes))[:4] == [9, 6, 12, 24]
    assert state.restarts >= 2
    assert not IPOPCMAES.finished(state)


def test_a_restart_begins_at_another_place_and_finds_the_deeper_of_two_hollows():
    def hollows(X):
        return np.minimum(0.5 + 20 * np.square(X + 2.0).sum(axis=1), 200 * np.square(X - [3.0, 0.4]).sum(axis=1))

    trapped = np.tile([[-2.0, 0.1]], (6, 1))
    result = minimise(IPOPCMAES, IPOPParams(), hollows, BOX, trapped, 20_000, np.random.default_rng(2))
    assert result.best_fitness < 1e-6
