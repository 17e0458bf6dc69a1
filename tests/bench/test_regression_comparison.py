"""The two statistics of the regression check: exact small cases, infeasible ends, and the rate of false alarms."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from armlab.common.statistics import adjust_by_holm
from bench.studies.regression.check import best_p_value, compare_ends, location_p_value, p_values
from bench.studies.regression.sweep import Cell

INF = np.inf
finite_ends = st.lists(st.floats(1.0, 1e6), min_size=3, max_size=30).map(np.array)


def test_three_of_five_ends_that_lead_have_one_chance_in_ten_on_each_side() -> None:
    assert best_p_value(np.array([1.0, 2.0, 3.0]), np.array([4.0, 5.0])) == pytest.approx(2 / 10)
    assert best_p_value(np.array([4.0, 5.0]), np.array([1.0, 2.0, 3.0])) == pytest.approx(2 / 10)


@pytest.mark.parametrize("m", [2, 4, 5])
def test_the_chance_of_leading_is_that_of_all_ways_to_split_the_ends(m: int) -> None:
    total = 7
    splits = [np.array(chosen) for chosen in combinations(range(total), m)]
    for k in range(1, m + 1):
        now = np.array([float(k), *range(m + 1, total + 1)])[: total - m]  # all below k belong to the baseline
        baseline = np.setdiff1d(np.arange(total + 1.0), now)[:m]
        leading = [np.sum(split < np.setdiff1d(np.arange(total), split).min()) for split in splits]
        assert best_p_value(baseline, now) == pytest.approx(min(1.0, 2 * np.mean(np.array(leading) >= k)))


def test_holm_multiplies_the_smallest_most_and_never_reverses_an_order() -> None:
    np.testing.assert_allclose(adjust_by_holm(np.array([0.01, 0.04, 0.03])), [0.03, 0.06, 0.06])
    np.testing.assert_allclose(adjust_by_holm(np.array([[0.5, 0.9], [0.2, 0.001]])), [[1.0, 1.0], [0.2, 0.002]])


@given(finite_ends, finite_ends)
def test_log10_of_all_ends_changes_nothing(baseline: np.ndarray, now: np.ndarray) -> None:
    rounded = [np.round(np.log10(ends), 6) for ends in (baseline, now)]  # so that no two ends become equal
    np.testing.assert_array_equal(p_values(*(10.0**ends for ends in rounded)), p_values(*rounded))


@given(finite_ends, finite_ends)
def test_both_statistics_are_two_sided(baseline: np.ndarray, now: np.ndarray) -> None:
    np.testing.assert_allclose(p_values(baseline, now), p_values(now, baseline), rtol=1e-9)


def test_infeasible_ends_are_the_worst() -> None:
    baseline, now = np.linspace(10, 20, 60), np.append(np.linspace(10, 20, 20), np.full(20, INF))
    (comparison,) = compare_ends({Cell("p", "a"): baseline}, {Cell("p", "a"): now})
    assert comparison.differs(0.01)
    assert comparison.worse
    assert comparison.superiority == pytest.approx(0.75, abs=0.02)


def test_cells_without_any_feasible_end_before_and_now_do_not_differ() -> None:
    np.testing.assert_array_equal(p_values(np.full(30, INF), np.full(20, INF)), [1.0, 1.0])


def test_a_better_best_alone_is_found_and_called_better() -> None:
    baseline = np.linspace(10, 20, 300)
    now = np.append(np.linspace(10, 20, 35), [9.0, 9.1, 9.2, 9.3, 9.4])
    (comparison,) = compare_ends({Cell("p", "a"): baseline}, {Cell("p", "a"): now})
    assert comparison.p_location > 0.1
    assert comparison.p_best < 1e-3
    assert not comparison.worse


def test_a_batch_of_runs_gives_the_p_values_of_each_run() -> None:
    rng = np.random.default_rng(1)
    baseline, runs = rng.random((2, 50)), rng.random((5, 2, 20))
    together = p_values(baseline[None], runs)
    for run in range(5):
        for cell in range(2):
            np.testing.assert_allclose(together[run, cell], p_values(baseline[cell], runs[run, cell]), rtol=1e-12)


def test_equal_distributions_raise_an_alarm_no_more_often_than_stated() -> None:
    rng = np.random.default_rng(2)
    runs, cells, rate = 1000, 14, 0.05
    p = p_values(rng.random((runs, cells, 100)), rng.random((runs, cells, 40)))
    alarms = (adjust_by_holm(p.reshape(runs, -1)) <= rate).any(axis=1).mean()
    assert 0.005 < alarms < rate + 3 * np.sqrt(rate * (1 - rate) / runs)


def test_the_rank_sum_is_that_of_all_splits() -> None:
    baseline, now = np.arange(8.0) + 0.5, np.array([0.0, 1.0, 2.0, 4.0, 3.0, 5.0])
    ranks = np.argsort(np.argsort(np.concatenate([now, baseline]))) + 1
    sums = np.array([ranks[list(chosen)].sum() for chosen in combinations(range(14), 6)])
    distance = abs(ranks[:6].sum() - sums.mean())
    exact = np.mean(np.abs(sums - sums.mean()) >= distance)
    assert location_p_value(baseline, now) == pytest.approx(exact, abs=0.01)
