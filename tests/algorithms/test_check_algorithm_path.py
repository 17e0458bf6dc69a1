"""Promises about the path of a run: whose arrays, whose randomness, what a pickle keeps."""

import random

import numpy as np
import pytest

from algorithms.leaders import Leaders, no_leaders, promote
from algorithms.random_search import RandomSearch


class Follower(RandomSearch):
    """Walks around its leader, so that what it remembers shows in its path."""

    @staticmethod
    def ask(state):
        X, state = RandomSearch.ask(state)
        return (0.5 * (X + state.leaders.position[0]) if state.started else X), state


def test_keeping_the_told_array_is_named(complaint):
    class Keeper(Follower):
        @staticmethod
        def tell(state, X, fitness):
            best = int(np.nan_to_num(fitness, nan=np.inf, neginf=np.inf).argmin())
            state = RandomSearch.tell(state, X, fitness)
            if state.leaders.fitness[0] == fitness[best]:
                state.leaders = Leaders(X[best : best + 1], state.leaders.fitness)
            return state

    assert "keeps the caller's arrays or gives away its own" in complaint(Keeper)


def test_giving_away_the_own_array_is_named(complaint):
    class Giver(Follower):
        @staticmethod
        def ask(state):
            if not state.started:
                return state.population, state
            state.population += 0.1 * state.rng.random(state.population.shape)
            return state.population, state

    assert "keeps the caller's arrays or gives away its own" in complaint(Giver)


def test_giving_away_the_incumbent_is_named(complaint):
    class Generous(Follower):
        @staticmethod
        def incumbent(state):
            return state.leaders.position[0], float(state.leaders.fitness[0])

    assert "keeps the caller's arrays or gives away its own" in complaint(Generous)


def test_keeping_the_first_population_is_named(complaint):
    class Borrower(RandomSearch):
        @staticmethod
        def init(params, population, box, horizon, rng):
            state = RandomSearch.init(params, population, box, horizon, rng)
            state.population = population
            return state

    assert "keeps the caller's arrays or gives away its own" in complaint(Borrower)


@pytest.mark.parametrize("draw", [random.random, np.random.random, lambda: np.random.seed(5) or 0.0])  # noqa: NPY002
def test_use_of_global_random_numbers_is_named(complaint, draw):
    class Global(RandomSearch):
        @staticmethod
        def ask(state):
            X, state = RandomSearch.ask(state)
            return (X + 1e-3 * draw() if state.started else X), state

    assert "draws from the global random state of numpy or Python" in complaint(Global)


def test_a_generator_of_its_own_is_named(complaint):
    own = np.random.default_rng()

    class Stubborn(RandomSearch):
        @staticmethod
        def init(params, population, box, horizon, rng):
            return RandomSearch.init(params, population, box, horizon, own)

    assert "takes another path when it gets the same generator again" in complaint(Stubborn)


def test_memory_that_two_runs_share_is_named(complaint):
    class Shared(RandomSearch):
        leaders = None

        @staticmethod
        def init(params, population, box, horizon, rng):
            Shared.leaders = no_leaders(population, 1)
            return RandomSearch.init(params, population, box, horizon, rng)

        @staticmethod
        def ask(state):
            X, state = RandomSearch.ask(state)
            return (0.5 * (X + Shared.leaders.position[0]) if state.started else X), state

        @staticmethod
        def tell(state, X, fitness):
            promote(Shared.leaders, X, fitness)
            return RandomSearch.tell(state, X, fitness)

    assert "takes another path while a second run goes on beside it" in complaint(Shared)


class HalfPickled:
    """A state that forgets its leaders in a pickle."""

    def __init__(self, state):
        self.__dict__.update(state.__dict__)

    def __getstate__(self):
        return {**self.__dict__, "leaders": no_leaders(self.population, 1)}


def test_a_state_that_is_pickled_in_part_is_named(complaint):
    class Forgetful(Follower):
        @staticmethod
        def init(*arguments):
            return HalfPickled(RandomSearch.init(*arguments))

    assert "takes another path when its State is pickled and read back" in complaint(Forgetful)


def test_a_state_that_cannot_be_pickled_is_named(complaint):
    class Closed(RandomSearch):
        @staticmethod
        def init(*arguments):
            state = RandomSearch.init(*arguments)
            state.hook = lambda: None
            return state

    assert "crashes when its State is pickled and read back" in complaint(Closed)
