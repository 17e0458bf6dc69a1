"""What the table says of a set of ends, some of them infeasible."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.statistics import quantile, summarise


def test_summary_of_four_ends_of_which_one_is_infeasible() -> None:
    summary = summarise(np.array([2.0, 4.0, 1.0, 9.0]), np.array([0.0, 0.0, 0.5, 0.0]))
    assert summary.minimum == 2.0  # the 1.0 is infeasible
    assert summary.average == 5.0
    assert summary.standard_deviation == pytest.approx(math.sqrt((9 + 1 + 16) / 2))  # n - 1
    assert summary.median == 6.5  # of 2, 4, 9, inf
    assert summary.lower_quartile == 3.5
    assert summary.upper_quartile == math.inf
    assert summary.feasible_share == 0.75


def test_summary_without_a_feasible_end_has_no_average_and_an_infinite_median() -> None:
    summary = summarise(np.array([2.0, math.nan]), np.array([1.0, 0.0]))
    assert math.isnan(summary.minimum)
    assert math.isnan(summary.average)
    assert summary.median == math.inf
    assert summary.feasible_share == 0.0


def test_one_feasible_end_has_no_standard_deviation() -> None:
    summary = summarise(np.array([3.0, 5.0]), np.array([0.0, 1.0]))
    assert summary.average == 3.0
    assert math.isnan(summary.standard_deviation)


def test_a_quantile_that_falls_on_a_finite_end_below_an_infinite_one_is_finite() -> None:
    assert quantile(np.array([math.inf, 1.0, 2.0]), 0.5) == 2.0


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=40), st.sampled_from([0.25, 0.5, 0.75]))
def test_quantiles_of_finite_values_are_those_of_numpy(values: list[float], share: float) -> None:
    assert quantile(np.array(values), share) == pytest.approx(np.quantile(values, share), rel=1e-12, abs=1e-9)
