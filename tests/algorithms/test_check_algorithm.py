"""Every promise of the contract has an algorithm that breaks it, and a sentence that says so."""

from dataclasses import dataclass

import numpy as np
import pytest

from algorithms.check import check_algorithm
from algorithms.leaders import Leaders, leader
from algorithms.random_search import RandomSearch
from algorithms.registry import load, names


@pytest.mark.parametrize("name", names())
def test_built_in_algorithms_keep_every_promise(name):
    check_algorithm(load(name))


def test_a_missing_name_is_named(complaint):
    class Nameless(RandomSearch):
        name = ""

    assert "has no `name`" in complaint(Nameless)


def test_parameters_that_are_no_dataclass_are_named(complaint):
    class Loose(RandomSearch):
        Params = dict

    assert "has no dataclass `Params`" in complaint(Loose)


def test_parameters_without_defaults_are_named(complaint):
    @dataclass(frozen=True)
    class Needy:
        speed: float
        weight: float = 1.0

    class Demanding(RandomSearch):
        Params = Needy

    assert "has Params without a default: speed." in complaint(Demanding)


def test_parameters_that_can_change_are_named(complaint):
    @dataclass
    class Soft:
        speed: float = 1.0

    class Changeable(RandomSearch):
        Params = Soft

    assert "has Params that are not frozen" in complaint(Changeable)


def test_skipping_the_first_population_is_named(complaint):
    class Impatient(RandomSearch):
        @staticmethod
        def init(*arguments):
            state = RandomSearch.init(*arguments)
            state.started = True
            return state

    assert "does not ask for the first population first" in complaint(Impatient)


def test_a_population_that_shrinks_breaks_no_promise():
    class Shrinking(RandomSearch):
        @staticmethod
        def ask(state):
            X, state = RandomSearch.ask(state)
            return (X[1:] if state.started else X), state

    check_algorithm(Shrinking)


def test_a_population_of_nobody_is_named(complaint):
    class Empty(RandomSearch):
        @staticmethod
        def ask(state):
            X, state = RandomSearch.ask(state)
            return (X[:0] if state.started else X), state

        @staticmethod
        def tell(state, X, fitness):
            return RandomSearch.tell(state, X, fitness) if len(X) else state

    assert "asks in step 1 for points of shape (0, 3)" in complaint(Empty)


def test_points_that_are_not_finite_are_named(complaint):
    class Exploding(RandomSearch):
        @staticmethod
        def ask(state):
            X, state = RandomSearch.ask(state)
            return (X * np.inf if state.started else X), state

    assert "asks in step 1 for a point that is not finite, on a bowl" in complaint(Exploding)


def test_writing_into_told_arrays_is_named(complaint):
    class Writer(RandomSearch):
        @staticmethod
        def tell(state, X, fitness):
            state = RandomSearch.tell(state, X, fitness)
            fitness.sort()
            return state

    assert "writes into the caller's arrays when told step 0" in complaint(Writer)


def test_a_crash_on_fitness_that_is_not_a_number_is_named(complaint):
    class Fragile(RandomSearch):
        @staticmethod
        def tell(state, X, fitness):
            if np.isnan(fitness).any():
                raise ValueError("fitness must be finite")
            return RandomSearch.tell(state, X, fitness)

    assert "crashes when fitness is NaN or infinite at many points" in complaint(Fragile)


def test_a_crash_in_one_dimension_is_named(complaint):
    class Flat(RandomSearch):
        @staticmethod
        def tell(state, X, fitness):
            return RandomSearch.tell(state, X, fitness + 0.0 * X[:, 1])

    assert "crashes in one dimension: IndexError" in complaint(Flat)


def test_a_crash_beyond_the_horizon_is_named(complaint):
    class Scheduled(RandomSearch):
        @staticmethod
        def init(params, population, box, horizon, rng):
            state = RandomSearch.init(params, population, box, horizon, rng)
            state.schedule = iter(range(horizon + 1))
            return state

        @staticmethod
        def ask(state):
            if next(state.schedule, None) is None:
                raise IndexError("schedule exhausted")
            return RandomSearch.ask(state)

    assert "crashes beyond its horizon" in complaint(Scheduled)


def test_an_incumbent_that_was_never_told_is_named(complaint):
    class Boaster(RandomSearch):
        @staticmethod
        def incumbent(state):
            x, fitness = leader(state.leaders)
            return x, fitness - 1.0

    assert "has an incumbent that it was never told" in complaint(Boaster)


def test_taking_minus_infinity_for_the_best_is_named(complaint):
    class Credulous(RandomSearch):
        @staticmethod
        def tell(state, X, fitness):
            state = RandomSearch.tell(state, X, fitness)
            if (fitness == -np.inf).any():
                state.leaders = Leaders(X[fitness == -np.inf][:1].copy(), np.array([-np.inf]))
            return state

    assert "has an incumbent of fitness -inf, a loss" in complaint(Credulous)


def test_an_invented_fitness_among_losses_is_named(complaint):
    class Optimist(RandomSearch):
        @staticmethod
        def incumbent(state):
            x, fitness = leader(state.leaders)
            return x, min(fitness, 1e300)

    assert "was told only losses, but its incumbent has fitness 1e+300" in complaint(Optimist)


def test_an_answer_other_than_true_or_false_is_named(complaint):
    class Vague(RandomSearch):
        @staticmethod
        def finished(state):
            return 0

    assert "does not answer `finished` with True or False" in complaint(Vague)
