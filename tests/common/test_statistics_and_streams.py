"""What several parts compute in the same way: Holm's correction, Wilson's interval, named random streams."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from armlab.common.statistics import adjust_by_holm, wilson_interval
from armlab.common.streams import named_generator
from armlab.proof.blind.plan import random_stream


def test_holm_multiplies_the_smallest_p_value_most_and_keeps_the_order_along_the_last_axis() -> None:
    assert_allclose(adjust_by_holm(np.array([0.01, 0.04, 0.03, 0.005])), [0.03, 0.06, 0.06, 0.02])
    assert_allclose(adjust_by_holm(np.array([[0.5, 0.9], [0.2, 0.001]])), [[1.0, 1.0], [0.2, 0.002]])


def test_wilson_intervals_are_those_of_newcombe_1998_and_the_whole_range_without_trials() -> None:
    assert wilson_interval(81, 263) == pytest.approx((0.2553, 0.3662), abs=1e-4)
    assert wilson_interval(0, 0) == (0.0, 1.0)


def test_the_streams_of_the_truth_machine_are_these_for_ever() -> None:
    assert random_stream("loop", 3, 4, 5).random() == 0.17811789326253358
    assert random_stream("a", 1).random() != named_generator("a", 1).random()
