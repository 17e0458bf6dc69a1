"""What several tests of algorithms need: numbers written down in the place of chance, and the checker's words."""

import numpy as np
import pytest

from algorithms.check import BrokenPromiseError, check_algorithm
from algorithms.contract import Box


class Script:
    """Gives the listed numbers in order, whatever shape is asked for, and nothing beyond them."""

    def __init__(self, *numbers):
        self.numbers = list(numbers)

    def random(self, size):
        count = int(np.prod(size))
        assert count <= len(self.numbers), "more random numbers drawn than the test lists"
        drawn, self.numbers = self.numbers[:count], self.numbers[count:]
        return np.array(drawn, dtype=float).reshape(size)


@pytest.fixture
def script():
    return Script


@pytest.fixture
def walk():
    """Tell the fitness that stands written beside each step, and give back what was asked for."""

    def walk(algorithm, state, fitness_of_steps):
        asked = []
        for fitness in fitness_of_steps:
            X, state = algorithm.ask(state)
            state = algorithm.tell(state, X.copy(), np.array(fitness, dtype=float))
            asked.append(X)
        return asked, state

    return walk


@pytest.fixture
def interval():
    """A box of one dimension."""
    return lambda lower, upper: Box(np.array([float(lower)]), np.array([float(upper)]))


@pytest.fixture
def complaint():
    """What the checker says about an algorithm that breaks a promise."""

    def complaint(algorithm):
        with pytest.raises(BrokenPromiseError) as caught:
            check_algorithm(algorithm)
        message = str(caught.value)
        assert message.startswith(f"Algorithm {algorithm.__name__} ")
        assert message.endswith(".")
        assert "\n" not in message
        return message

    return complaint
