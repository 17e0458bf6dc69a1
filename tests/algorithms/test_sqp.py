"""Algorithms that ask for derivatives: what they find, what they pay, and that a run can be resumed."""

import pickle
import threading

import numpy as np
import pytest

from algorithms.check import check_algorithm
from algorithms.contract import Box, uniform_points
from algorithms.driver import DerivativeSource, iterate, minimise, summarise_batches
from algorithms.registry import load, names, names_with_derivatives
from algorithms.sqp import SQPParams, descend, run_slsqp
from armlab.common.derivatives import Derivatives

BOX = Box(np.full(3, -4.0), np.full(3, 6.0))
START = uniform_points(6, BOX, np.random.default_rng(1))
FIRST_AT_MOST = 1.0  # the limit of `fenced_bowl`


def fenced_bowl(point, question):
    """(x - 2)^2 summed, within x_1 <= 1 and x_2 <= 5: the best point is (1, 2, 2), of value 1."""
    margins = np.array([FIRST_AT_MOST - point[0], 5.0 - point[1]])
    watched = np.union1d(question.watched, np.flatnonzero(margins < question.within)).astype(np.intp)
    slopes = np.array([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])[watched]
    return Derivatives(float(np.square(point - 2).sum()), 2 * (point - 2), margins, watched, slopes)


def bowl_with_penalty(X):
    return np.square(X - 2).sum(axis=1) + 100.0 * (X[:, 0] > FIRST_AT_MOST)


def run(name, evaluations, price=4):
    algorithm = load(name)
    source = DerivativeSource(fenced_bowl, price)
    rng = np.random.default_rng(2)
    return minimise(algorithm, algorithm.Params(), bowl_with_penalty, BOX, START, evaluations, rng, source=source)


@pytest.mark.parametrize("name", names_with_derivatives())
def test_it_keeps_the_promises_of_the_contract(name):
    assert load(name).name == name
    assert name not in names()
    check_algorithm(load(name))


@pytest.mark.parametrize("name", names_with_derivatives())
def test_it_finds_the_best_point_on_the_fence(name):
    result = run(name, 600)
    assert result.best_x == pytest.approx([1.0, 2.0, 2.0], abs=1e-4)


@pytest.mark.parametrize("solver", [run_slsqp], ids=["slsqp"])
def test_a_descent_adds_limits_that_its_answer_breaks(solver):
    start = np.array([-3.9, 0.0, 0.0])  # all limits are far from here: none is watched at first
    blind = SQPParams(watch=0.0, cuts=1, powers=(10.0,))
    assert list(descend(blind, fenced_bowl, BOX, start, solver))[-1] == pytest.approx([2.0, 2.0, 2.0], abs=1e-6)
    seeing = SQPParams(watch=0.0, cuts=3, powers=(10.0,))
    assert list(descend(seeing, fenced_bowl, BOX, start, solver))[-1] == pytest.approx([1.0, 2.0, 2.0], abs=1e-6)


def test_a_point_with_derivatives_costs_its_price_and_the_budget_is_never_exceeded():
    algorithm = load("sqp")

    def batches(evaluations, price):
        state = algorithm.init(algorithm.Params(), START, BOX, 10, np.random.default_rng(2))
        return list(iterate(algorithm, state, bowl_with_penalty, BOX, evaluations, source=source(price)))

    def source(price):
        return DerivativeSource(fenced_bowl, price)

    found = batches(6 + 4 * 3 + 3, 4)
    assert [(len(batch.X), batch.cost) for batch in found] == [(6, 6), (1, 4), (1, 4), (1, 4)]
    assert summarise_batches(found).history_evaluations.tolist() == [6, 10, 14, 18]
    dear = batches(6 + 4 * 3 + 3, 15)
    assert [batch.cost for batch in dear] == [6, 15]
    np.testing.assert_array_equal(dear[1].X, found[1].X)


@pytest.mark.parametrize("name", names_with_derivatives())
def test_a_run_pickled_midway_takes_the_same_path(name):
    algorithm, source = load(name), DerivativeSource(fenced_bowl, 2)

    def start():
        return algorithm.init(algorithm.Params(), START, BOX, 6, np.random.default_rng(1))

    whole = list(iterate(algorithm, start(), bowl_with_penalty, BOX, 120, source=source))
    used = sum(batch.cost for batch in whole[: len(whole) // 2])
    first = list(iterate(algorithm, start(), bowl_with_penalty, BOX, used, source=source))
    state = pickle.loads(pickle.dumps(first[-1].state))
    second = list(iterate(algorithm, state, bowl_with_penalty, BOX, 120 - used, source=source))
    paths = [np.concatenate([batch.X for batch in batches]) for batches in (first + second, whole)]
    np.testing.assert_array_equal(*paths)


def test_a_run_that_is_given_up_leaves_no_thread_and_prints_nothing(capfd):
    before = threading.active_count()
    run("ipopt", 60)
    assert threading.active_count() == before
    assert capfd.readouterr() == ("", "")


def test_without_a_source_of_derivatives_the_algorithm_is_refused():
    algorithm = load("sqp")
    with pytest.raises(ValueError, match="'sqp' asks for derivatives, and the problem offers none"):
        minimise(algorithm, algorithm.Params(), bowl_with_penalty, BOX, START, 60, np.random.default_rng(0))
