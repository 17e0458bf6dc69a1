"""Other packages' algorithms behind the contract: their own paths, the same budget, no thread left behind."""

import sys
import threading

import numpy as np
import pytest

from algorithms import registry
from algorithms.check import check_algorithm
from algorithms.contract import Box, uniform_points
from algorithms.driver import minimise
from algorithms.peers.peer import Answer, Conversation
from algorithms.registry import BrokenAlgorithmError, load, names, peer_names

BOX = Box(np.full(4, -4.0), np.full(4, 6.0))
START = uniform_points(10, BOX, np.random.default_rng(1))
SEED = int(np.random.default_rng(2).integers(2**31))
HORIZON = 6

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")  # other packages' own affair


class Recorder:
    """The sphere, which remembers the points that it was asked."""

    def __init__(self):
        self.points = []

    def one(self, point):
        self.points.append(np.array(point))
        return float(np.square(point).sum())

    def all(self, X):
        return np.array([self.one(x) for x in X])


def path(name):
    """All points that an adapter evaluates after the first population."""
    recorder = Recorder()
    algorithm = load(name)
    minimise(algorithm, algorithm.Params(), recorder.all, BOX, START, 10 * (HORIZON + 1), np.random.default_rng(2))
    return np.array(recorder.points)[10:]


@pytest.mark.parametrize("name", peer_names())
def test_a_peer_keeps_the_promises_of_the_contract(name):
    assert load(name).name == name
    check_algorithm(load(name))


@pytest.mark.parametrize("name", peer_names())
def test_a_peer_uses_the_whole_budget_inside_the_box(name):
    points = path(name)
    assert len(points) == 10 * HORIZON
    assert (points >= BOX.lower).all()
    assert (points <= BOX.upper).all()


def test_scipy_takes_the_path_of_scipy_called_directly():
    from scipy.optimize import differential_evolution

    recorder = Recorder()
    differential_evolution(
        recorder.one,
        list(zip(*BOX, strict=True)),
        init=START,
        maxiter=HORIZON,
        tol=0.0,
        polish=False,
        rng=np.random.default_rng(SEED),
    )
    np.testing.assert_array_equal(path("scipy-de"), np.array(recorder.points)[10:])


@pytest.mark.parametrize(
    ("name", "module", "kind"),
    [("mealpy-woa", "WOA", "OriginalWOA"), ("mealpy-goa", "GOA", "OriginalGOA"), ("mealpy-gwo", "GWO", "OriginalGWO")],
)
def test_mealpy_takes_the_path_of_mealpy_called_directly(name, module, kind):
    import mealpy

    recorder = Recorder()
    problem = {"bounds": mealpy.FloatVar(*BOX), "obj_func": recorder.one, "minmax": "min", "log_to": None}
    method = getattr(getattr(mealpy, module), kind)(epoch=HORIZON, pop_size=10)
    method.solve(problem, starting_solutions=START, seed=SEED)
    np.testing.assert_array_equal(path(name), np.array(recorder.points)[10:])


@pytest.mark.parametrize(("name", "kind"), [("pygmo-pso", "pso"), ("pygmo-gwo", "gwo"), ("pygmo-de", "de")])
def test_pygmo_takes_the_path_of_pygmo_called_directly(name, kind):
    import pygmo

    recorder = Recorder()

    class Sphere:
        def fitness(self, point):
            return [recorder.one(point)]

        def get_bounds(self):
            return BOX

        def __deepcopy__(self, memo):
            return self

    population = pygmo.population(pygmo.problem(Sphere()), 0, seed=SEED)
    for point in START:
        population.push_back(point, [np.square(point).sum()])
    pygmo.algorithm(getattr(pygmo, kind)(gen=HORIZON, seed=SEED)).evolve(population)
    np.testing.assert_array_equal(path(name), np.array(recorder.points))


def test_a_run_that_is_given_up_leaves_no_thread_behind():
    before = threading.active_count()
    path("pygmo-de")
    path("mealpy-pso")
    assert threading.active_count() == before


def test_a_loop_asks_is_answered_and_ends():
    def loop(evaluate):
        assert evaluate(np.array([[1.0], [2.0]])).tolist() == [10.0, 20.0]
        evaluate(np.array([[3.0]]))

    conversation = Conversation(loop)
    assert conversation.asked.points.tolist() == [[1.0], [2.0]]
    conversation.answer(Answer(np.array([10.0, 20.0]), None))
    assert conversation.asked.points.tolist() == [[3.0]]
    conversation.answer(Answer(np.array([30.0]), None))
    assert conversation.asked is None


def test_an_error_in_the_loop_reaches_the_one_who_answers():
    def loop(evaluate):
        evaluate(np.zeros((1, 1)))
        raise ZeroDivisionError("in the loop")

    conversation = Conversation(loop)
    with pytest.raises(ZeroDivisionError, match="in the loop"):
        conversation.answer(Answer(np.zeros(1), None))


def test_a_loop_that_asks_on_after_it_was_given_up_ends_too():
    def stubborn(evaluate):
        for _ in range(3):
            try:
                evaluate(np.zeros((1, 1)))
            except BaseException:
                continue

    before = threading.active_count()
    conversation = Conversation(stubborn)
    del conversation
    assert threading.active_count() == before


def test_a_missing_package_is_answered_with_the_extra_that_brings_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygmo", None)
    monkeypatch.delitem(sys.modules, "algorithms.peers.pygmo_adapter", raising=False)
    with pytest.raises(BrokenAlgorithmError) as raised:
        load("pygmo-pso")
    assert str(raised.value) == "algorithm 'pygmo-pso' needs the package 'pygmo': pip install 'armlab[peers]'"


def test_peers_stand_apart_from_the_names_that_need_no_other_package():
    assert not set(names()) & set(peer_names())
    assert "did you mean 'pygmo-gwo'?" in registry._name_hint("pigmo-gwo")
