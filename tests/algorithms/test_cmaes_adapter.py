"""CMA-ES is the package's own: the adapter only normalises, seeds and starts it."""

import copy

import numpy as np
import pytest
import scipy.linalg
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


def test_a_generation_of_the_package_is_that_of_equations_38_to_47():
    d, n = 5, 12
    optimiser = CMA(np.full(d, 0.5), 0.02, seed=3, population_size=n)
    held_back = 0
    for _ in range(30):
        before = copy.deepcopy(optimiser.__dict__)
        U = np.array([optimiser.ask() for _ in range(n)])
        fitness = (np.arange(1, d + 1) * np.square(U - 3.0)).sum(axis=1)
        optimiser.tell(list(zip(U, fitness.tolist(), strict=True)))
        after, weights, mu = optimiser.__dict__, before["_weights"], before["_mu"]
        root = np.linalg.inv(scipy.linalg.sqrtm(before["_C"]).real)
        y = (U[fitness.argsort()] - before["_mean"]) / before["_sigma"]
        y_w = weights[:mu] @ y[:mu]
        c_s, c_c, c_1, c_mu = (before[name] for name in ("_c_sigma", "_cc", "_c1", "_cmu"))
        p_s = (1 - c_s) * before["_p_sigma"] + np.sqrt(c_s * (2 - c_s) * before["_mu_eff"]) * (root @ y_w)
        step = before["_sigma"] * np.exp(c_s / before["_d_sigma"] * (np.linalg.norm(p_s) / before["_chi_n"] - 1))
        h = float(not np.allclose(after["_pc"], (1 - c_c) * before["_pc"]))
        p_c = (1 - c_c) * before["_pc"] + h * np.sqrt(c_c * (2 - c_c) * before["_mu_eff"]) * y_w
        lengths = np.square(y @ root).sum(axis=1)
        active = np.where(weights >= 0, weights, weights * d / lengths)
        kept = 1 + c_1 * (1 - h) * c_c * (2 - c_c) - c_1 - c_mu * weights.sum()
        C = kept * before["_C"] + c_1 * np.outer(p_c, p_c) + c_mu * (y.T * active) @ y
        assert after["_mean"] == pytest.approx(before["_mean"] + before["_sigma"] * y_w)
        assert after["_p_sigma"] == pytest.approx(p_s)
        assert after["_sigma"] == pytest.approx(step)
        assert after["_pc"] == pytest.approx(p_c)
        assert after["_C"] == pytest.approx(C, abs=1e-7)  # the package adds 1e-8 to a length
        held_back += h == 0.0
    assert 0 < held_back < 30
