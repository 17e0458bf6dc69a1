"""The driver: budgets, bounds, the best, histories, resuming."""

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from algorithms.contract import Box, uniform_points
from algorithms.driver import (
    BOUND_POLICIES,
    clip,
    iterate,
    minimise,
    planned_iterations,
    reflect,
    summarise_batches,
    wrap,
)
from algorithms.registry import load, names

BOX = Box(np.array([-1.0, -2.0, 0.0]), np.array([2.0, 1.5, 4.0]))


class Recorder:
    """An objective that keeps what it was asked and what it answered."""

    def __init__(self, values=None):
        self.values = values or (lambda X: np.square(X - 0.4).sum(axis=1))
        self.X, self.fitness = [], []

    def __call__(self, X):
        fitness = self.values(X)
        self.X.append(X.copy())
        self.fitness.append(fitness.copy())
        return fitness


def run(name, objective, evaluations, swarm_size=6, bounds="clip", seed=0):
    population = uniform_points(swarm_size, BOX, np.random.default_rng(seed))
    algorithm = load(name)
    rng = np.random.default_rng(seed + 1)
    return minimise(algorithm, algorithm.Params(), objective, BOX, population, evaluations, rng, bounds)


@pytest.mark.parametrize("name", names())
@pytest.mark.parametrize("evaluations", [1, 5, 6, 7, 29, 30])
def test_exactly_the_budget_is_evaluated(name, evaluations):
    objective = Recorder()
    result = run(name, objective, evaluations)
    assert sum(map(len, objective.X)) == result.evaluations == evaluations
    assert result.history_evaluations.tolist() == np.cumsum([len(X) for X in objective.X]).tolist()
    assert len(objective.X[0]) == min(6, evaluations)


def test_a_last_batch_that_the_budget_cuts_counts_for_the_best_but_is_not_told():
    objective = Recorder(lambda X: np.full(len(X), 5.0 if len(X) == 6 else 1.0))
    result = run("spso", objective, 14)
    assert result.best_so_far.tolist() == [5.0, 5.0, 1.0]
    assert result.present_best.tolist() == [5.0, 5.0, 5.0]


def test_horizon_is_the_number_of_populations_after_the_first():
    assert planned_iterations(1550, 50) == 30
    assert planned_iterations(1599, 50) == 30
    assert planned_iterations(7, 50) == 0


def test_the_first_population_is_evaluated_as_it_is():
    objective = Recorder()
    run("gwo", objective, 30, seed=4)
    np.testing.assert_array_equal(objective.X[0], uniform_points(6, BOX, np.random.default_rng(4)))


@settings(max_examples=60, deadline=None)
@given(
    name=st.sampled_from(names()),
    bounds=st.sampled_from(sorted(BOUND_POLICIES)),
    evaluations=st.integers(1, 80),
    swarm_size=st.integers(4, 12),
    seed=st.integers(0, 2**32),
    holes=st.floats(0.0, 1.0),
)
def test_points_stay_in_the_box_and_the_best_is_the_minimum_of_all(name, bounds, evaluations, swarm_size, seed, holes):
    noise = np.random.default_rng(seed)

    def values(X):
        broken = noise.choice([np.nan, np.inf, -np.inf], len(X))
        return np.where(noise.random(len(X)) < holes, broken, np.sin(7 * X).sum(axis=1))

    objective = Recorder(values)
    result = run(name, objective, evaluations, swarm_size, bounds, seed)
    X, fitness = np.concatenate(objective.X), np.concatenate(objective.fitness)
    assert ((BOX.lower <= X) & (BOX.upper >= X)).all()
    losses = np.where(np.isfinite(fitness), fitness, np.inf)
    assert result.best_fitness == losses.min()
    np.testing.assert_array_equal(result.best_x, X[losses.argmin()])
    for k, used in enumerate(result.history_evaluations):
        assert result.best_so_far[k] == losses[:used].min()
        np.testing.assert_array_equal(result.best_x_history[k], X[losses[:used].argmin()])


@pytest.mark.parametrize("name", names())
@pytest.mark.parametrize("value", [None, 3.0])
def test_a_run_pickled_midway_takes_the_same_path(name, value):
    values = None if value is None else lambda X: np.full(len(X), value)  # a constant makes MuPSO mutate
    algorithm, population = load(name), uniform_points(6, BOX, np.random.default_rng(0))
    horizon = planned_iterations(180, 6)

    def start():
        return algorithm.init(algorithm.Params(), population, BOX, horizon, np.random.default_rng(1))

    whole = list(iterate(algorithm, start(), Recorder(values), BOX, 180))
    used = sum(len(batch.X) for batch in whole[: len(whole) // 3])  # not every population has 6 points
    first = list(iterate(algorithm, start(), Recorder(values), BOX, used))
    state = pickle.loads(pickle.dumps(first[-1].state))
    second = list(iterate(algorithm, state, Recorder(values), BOX, 180 - used))
    resumed, through = summarise_batches(first + second), summarise_batches(whole)
    np.testing.assert_array_equal(
        np.concatenate([batch.X for batch in first + second]), np.concatenate([batch.X for batch in whole])
    )
    np.testing.assert_array_equal(resumed.present_best, through.present_best)
    np.testing.assert_array_equal(resumed.best_x_history, through.best_x_history)


def test_present_best_is_forgotten_at_a_mutation_while_the_best_so_far_is_kept():
    fitness = iter([np.full(6, value) for value in [2.0] * 11 + [3.0] * 4])
    result = run("mupso", lambda X: next(fitness), 90)
    assert result.final_state.mutations == [11]
    assert result.present_best.tolist() == [2.0] * 11 + [3.0] * 4
    assert result.best_so_far.tolist() == [2.0] * 15


def test_a_finished_algorithm_is_asked_no_more():
    assert run("mupso", lambda X: np.zeros(len(X)), 600).evaluations == 11 * 6


def test_bound_policies_move_only_what_is_outside_as_computed_by_hand():
    box = Box(np.zeros(7), np.full(7, 4.0))
    X = np.array([[-1.0, 0.0, 3.7, 4.0, 5.0, 9.0, -4.5]])
    np.testing.assert_array_equal(clip(X, box), [[0.0, 0.0, 3.7, 4.0, 4.0, 4.0, 0.0]])
    np.testing.assert_array_equal(reflect(X, box), [[1.0, 0.0, 3.7, 4.0, 3.0, 1.0, 3.5]])
    np.testing.assert_array_equal(wrap(X, box), [[3.0, 0.0, 3.7, 4.0, 1.0, 1.0, 3.5]])


@settings(deadline=None)
@given(
    x=st.floats(-1e9, 1e9),
    lower=st.floats(-1e3, 1e3),
    width=st.floats(1e-3, 1e3),
    name=st.sampled_from(sorted(BOUND_POLICIES)),
)
def test_every_bound_policy_ends_inside_and_leaves_inside_points_alone(x, lower, width, name):
    box = Box(np.array([lower]), np.array([lower + width]))
    moved = BOUND_POLICIES[name](np.array([[x]]), box)
    assert box.lower <= moved <= box.upper
    np.testing.assert_array_equal(BOUND_POLICIES[name](moved, box), moved)


@pytest.mark.parametrize(
    ("box", "evaluations", "bounds", "message"),
    [
        (BOX, 0, "clip", "the budget is 0 evaluations"),
        (BOX, 10, "bounce", "unknown bound policy 'bounce': choose one of clip, reflect, wrap"),
        (Box(BOX.upper, BOX.lower), 10, "clip", "box dimension 0: lower limit 2.0"),
        (Box(BOX.lower, np.full(3, np.nan)), 10, "clip", "box dimension 0"),
        (Box(BOX.lower[:2], BOX.upper[:2]), 10, "clip", "for points of 3 dimensions"),
    ],
)
def test_an_impossible_problem_is_refused_in_one_line(box, evaluations, bounds, message):
    spso = load("spso")
    population = uniform_points(4, BOX, np.random.default_rng(0))
    with pytest.raises(ValueError, match=message):
        minimise(spso, spso.Params(), Recorder(), box, population, evaluations, np.random.default_rng(0), bounds)


def test_an_objective_of_the_wrong_shape_is_refused():
    with pytest.raises(ValueError, match=r"returned shape \(6, 1\) for 6 points, not \(6,\)"):
        run("spso", lambda X: X[:, :1], 12)
