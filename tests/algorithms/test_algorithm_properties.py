"""Moved, scaled, pure noise: what each algorithm does to its problem, as recorded facts."""

import numpy as np
import pytest

from algorithms.properties import SWARM_SIZE, evaluated_points, measure_properties, path_deviation
from algorithms.registry import load, names

DRAWN_TO_THE_ORIGIN = ["gwo", "woa"]
MOVED_WITH_THE_PROBLEM = [name for name in names() if name not in DRAWN_TO_THE_ORIGIN]


@pytest.mark.parametrize("name", MOVED_WITH_THE_PROBLEM)
def test_the_path_moves_with_the_problem_over_1550_evaluations(name):
    assert len(evaluated_points(load(name), 1.0, 0.0, 0, "clip")) == 1550
    assert path_deviation(load(name), offset=5.0, factor=1.0, seed=0, bounds="clip") <= 1e-12


@pytest.mark.parametrize("name", DRAWN_TO_THE_ORIGIN)
def test_gwo_and_woa_leave_the_path_of_the_moved_problem_in_the_first_iteration(name):
    here, there = (evaluated_points(load(name), 1.0, offset, 0, "clip") for offset in (0.0, 5.0))
    first, second = slice(0, SWARM_SIZE), slice(SWARM_SIZE, 2 * SWARM_SIZE)
    np.testing.assert_allclose(there[first] - 5.0, here[first], atol=1e-12)
    assert np.abs(there[second] - 5.0 - here[second]).max() > 0.1


@pytest.mark.parametrize("name", names())
def test_the_path_is_identical_to_the_bit_in_units_sixteen_times_smaller(name):
    assert path_deviation(load(name), offset=0.0, factor=16.0, seed=0, bounds="clip") == 0.0


def test_random_search_ends_anywhere_in_the_box_on_pure_noise():
    facts = measure_properties(load("random-search"))
    assert facts.noise_p_value > 0.01
    assert facts.noise_share_on_bounds == 0.0


def test_the_bias_of_clipping_shows_on_pure_noise_and_goes_with_reflection():
    clipped, reflected = (measure_properties(load("de"), bounds=bounds) for bounds in ("clip", "reflect"))
    assert clipped.noise_p_value < 1e-6
    assert clipped.noise_share_on_bounds > 0.1
    assert reflected.noise_p_value > 0.01
    assert reflected.noise_share_on_bounds == 0.0
