"""Streams come from names: the same on every machine, in every order, for any number of workers."""

import numpy as np
import pytest

from algorithms.contract import Box
from armlab.common.streams import named_generator
from bench.seeds import first_population, own_stream

BOX = Box(np.array([-1.0, 10.0]), np.array([1.0, 20.0]))


def test_the_stream_of_a_name_is_this_one_for_ever() -> None:
    assert named_generator("a", 1).random() == 0.7912922919927108


def test_first_population_is_this_one_for_ever() -> None:
    points = first_population(2024, "paper", 0, 2, BOX)
    np.testing.assert_array_equal(
        points, [[0.33975617177560036, 13.797796909241947], [0.5247641096336313, 13.681341768090808]]
    )


def test_first_population_lies_in_the_box() -> None:
    points = first_population(1, "paper", 3, 500, BOX)
    assert np.all((points >= BOX.lower) & (points <= BOX.upper))
    assert np.ptp(points, axis=0) == pytest.approx(BOX.upper - BOX.lower, rel=0.05)


def test_a_larger_swarm_begins_with_the_points_of_a_smaller_one() -> None:
    small, large = (first_population(1, "paper", 0, size, BOX) for size in (10, 30))
    np.testing.assert_array_equal(large[:10], small)


@pytest.mark.parametrize(
    "names",
    [
        (2, "paper", "de", "{}", 0),
        (1, "other", "de", "{}", 0),
        (1, "paper", "gwo", "{}", 0),
        (1, "paper", "de", "{1}", 0),
        (1, "paper", "de", "{}", 1),
    ],
)
def test_any_other_name_gives_another_stream(names: tuple[int, str, str, str, int]) -> None:
    assert own_stream(*names).random() != own_stream(1, "paper", "de", "{}", 0).random()


def test_names_that_read_alike_when_joined_are_told_apart() -> None:
    assert named_generator("ab", "c").random() != named_generator("a", "bc").random()
    assert named_generator(1).random() != named_generator("1").random()
