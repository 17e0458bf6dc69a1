"""Every statistic against a published example, an independent engine, or a case small enough to count by hand."""

import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from armlab.common.statistics import adjust_by_holm
from bench.statistics.critical_difference import critical_difference, indistinguishable_groups
from bench.statistics.ends import quantile_interval
from bench.statistics.pairwise import signed_rank_p
from bench.statistics.performance import (
    Run,
    area_under_curve,
    condense_times,
    expected_running_time,
    performance_profile,
    running_times,
    share_reached,
    targets_between,
)
from bench.statistics.power import powers, signed_rank_power, smallest_detectable_effect
from bench.statistics.superiority import superiority, superiority_coverage

RESULTS = Path(__file__).parents[2] / "results"

# Demšar 2006 (JMLR 7, 1), table 6: AUC of four variants of C4.5 on 14 data sets. The ranks printed there tell the two
# 0.975 of the last row but one apart, which agree to the printed digits.
DEMSAR = pd.DataFrame(
    [
        [0.763, 0.768, 0.771, 0.798],
        [0.599, 0.591, 0.590, 0.569],
        [0.954, 0.971, 0.968, 0.967],
        [0.628, 0.661, 0.654, 0.657],
        [0.882, 0.888, 0.886, 0.898],
        [0.936, 0.931, 0.916, 0.931],
        [0.661, 0.668, 0.609, 0.685],
        [0.583, 0.583, 0.563, 0.625],
        [0.775, 0.838, 0.866, 0.875],
        [1.000, 1.000, 1.000, 1.000],
        [0.940, 0.962, 0.965, 0.962],
        [0.619, 0.666, 0.614, 0.669],
        [0.972, 0.981, 0.97501, 0.975],
        [0.957, 0.978, 0.946, 0.970],
    ],
    columns=["C4.5", "C4.5+m", "C4.5+cf", "C4.5+m+cf"],
)


def test_average_ranks_are_those_that_demsar_prints() -> None:
    found = critical_difference(-DEMSAR)
    assert list(found.ranks) == ["C4.5+m+cf", "C4.5+m", "C4.5+cf", "C4.5"]
    assert found.ranks == pytest.approx({"C4.5": 3.143, "C4.5+m": 2.0, "C4.5+cf": 2.893, "C4.5+m+cf": 1.964}, abs=5e-4)
    assert found.blocks == 14


def test_p_values_of_pairs_are_wilcoxons_after_holms_correction_over_all_of_them() -> None:
    found = critical_difference(-DEMSAR)
    raw = {pair: signed_rank_p(DEMSAR[pair[0]].to_numpy(), DEMSAR[pair[1]].to_numpy()) for pair in found.p}
    assert len(raw) == 6
    smallest = min(raw, key=lambda pair: raw[pair])
    assert found.p[smallest] == pytest.approx(6 * raw[smallest])
    assert all(found.p[pair] >= raw[pair] for pair in raw)


@pytest.mark.parametrize(("blocks", "nothing"), [(9, True), (11, False)])
def test_so_few_problems_that_no_pair_can_be_told_apart_are_noticed(blocks: int, nothing: bool) -> None:
    losses = pd.DataFrame({name: np.arange(float(blocks)) + 10 * k for k, name in enumerate("abcdefgh")})
    found = critical_difference(losses)  # 28 pairs: 28 * 2 / 2^9 > 0.05 > 28 * 2 / 2^11
    assert found.has_too_few_blocks is nothing
    assert (min(found.p.values()) > 0.05) is nothing


def test_friedmans_test_rejects_equality_in_demsars_example() -> None:
    # chi-square 9.28 as printed, without the correction for ties; the corrected one is larger
    assert 0.005 < critical_difference(-DEMSAR).friedman_p < stats.chi2.sf(9.28, 3)


def test_wilcoxons_test_of_demsars_example_rejects_equality_of_c45_with_and_without_m() -> None:
    # T = 12 with 14 data sets, below the critical 21 of the two-sided test at 0.05 (Demšar 2006, section 3.1.3)
    assert signed_rank_p(-DEMSAR["C4.5"].to_numpy(), -DEMSAR["C4.5+m"].to_numpy()) < 0.02


def test_holms_correction_of_its_textbook_example() -> None:
    np.testing.assert_allclose(adjust_by_holm(np.array([0.01, 0.04, 0.03, 0.005])), [0.03, 0.06, 0.06, 0.02])


def test_groups_are_the_longest_runs_of_neighbours_of_which_no_pair_differs() -> None:
    names = list("abcde")
    differs = {("a", "c"), ("a", "d"), ("a", "e"), ("b", "e"), ("d", "e"), ("c", "e")}
    p = {(x, y): 0.01 if (x, y) in differs else 0.5 for i, x in enumerate(names) for y in names[i + 1 :]}
    assert indistinguishable_groups(names, p, 0.05) == (("a", "b"), ("b", "c", "d"))


def test_algorithms_that_are_equal_everywhere_form_one_group() -> None:
    found = critical_difference(pd.DataFrame(np.ones((8, 3)), columns=list("abc")))
    assert found.groups == (("a", "b", "c"),)
    assert math.isnan(found.friedman_p)
    assert set(found.p.values()) == {1.0}


def test_twelve_pairs_that_all_point_one_way_have_the_exact_p_value_of_two_in_4096() -> None:
    wins = np.arange(1.0, 13.0)
    assert signed_rank_p(np.zeros(12), wins) == pytest.approx(2 / 4096)


def test_superiority_is_that_of_the_example_of_the_package_effsize() -> None:
    treatment = np.array([10.0, 10, 20, 20, 20, 30, 30, 30, 40, 50])
    control = np.array([10.0, 20, 30, 40, 40, 50])
    middle, low, high = superiority(treatment, control)  # Cliff's delta -0.25 of values: losses turn it round
    assert middle == pytest.approx((1 + 0.25) / 2)
    assert low < 0.5 < middle < high <= 1.0


@given(st.lists(st.floats(0, 9).map(round), min_size=3, max_size=12), st.integers(0, 99))
def test_superiority_is_the_rank_sum_statistic_over_all_pairs(values: list[int], seed: int) -> None:
    subject = np.array(values, dtype=float)
    rival = np.random.default_rng(seed).integers(0, 9, len(values)).astype(float)
    u = stats.mannwhitneyu(rival, subject).statistic
    assert superiority(subject, rival)[0] == pytest.approx(u / len(values) ** 2)


def test_the_interval_of_a_median_is_that_of_scipys_bootstrap() -> None:
    values = np.random.default_rng(4).lognormal(size=400)
    theirs = stats.bootstrap((values,), np.median, method="percentile", n_resamples=20_000, rng=1).confidence_interval
    low, high = quantile_interval(values)
    spread = theirs.high - theirs.low
    assert low == pytest.approx(theirs.low, abs=0.05 * spread)
    assert high == pytest.approx(theirs.high, abs=0.05 * spread)


def test_the_interval_of_a_median_reaches_infinity_where_many_ends_are_infeasible() -> None:
    low, high = quantile_interval(np.array([1.0, 2.0, 3.0, 4.0, np.inf, np.inf, np.inf]))
    assert np.isfinite(low)
    assert high == np.inf


@pytest.mark.parametrize("effect", [0.56, 0.64, 0.71])
def test_power_is_that_of_the_t_test_with_the_signed_rank_tests_efficiency(effect: float) -> None:
    n = 30 * 3 / math.pi  # asymptotic relative efficiency under normality
    critical, shift = stats.t.ppf(0.975, n - 1), stats.norm.ppf(effect) * math.sqrt(n)
    expected = stats.nct.sf(critical, n - 1, shift) + stats.nct.cdf(-critical, n - 1, shift)
    assert signed_rank_power(30, effect, 0.05) == pytest.approx(expected, abs=0.03)


def test_power_without_an_effect_is_the_level_and_falls_with_the_number_of_comparisons() -> None:
    assert signed_rank_power(30, 0.5, 0.05) == pytest.approx(0.05, abs=0.012)
    large = powers(30, 36)[-1]
    assert large.first_step < large.alone


def test_so_few_repetitions_that_no_win_is_seen_have_no_smallest_effect() -> None:
    assert smallest_detectable_effect(6, 0.05 / 36) is None  # the least p-value of 6 pairs is 2 / 64
    seen = smallest_detectable_effect(30, 0.05)
    assert seen is not None
    assert signed_rank_power(30, seen, 0.05) == pytest.approx(0.8, abs=0.01)


def test_performance_profile_of_three_problems_counted_by_hand() -> None:
    costs = pd.DataFrame({"a": [1.0, 4.0, np.inf], "b": [2.0, 2.0, np.inf], "c": [9.0, np.inf, np.inf]})
    profile = performance_profile(costs, np.array([1.0, 2.0, 10.0]))
    assert profile["a"].tolist() == pytest.approx([1 / 3, 2 / 3, 2 / 3])
    assert profile["b"].tolist() == pytest.approx([1 / 3, 2 / 3, 2 / 3])
    assert profile["c"].tolist() == pytest.approx([0.0, 0.0, 1 / 3])


RUNS = [
    Run(np.array([50.0, 100.0, 150.0]), np.array([np.inf, 20.0, 5.0])),
    Run(np.array([50.0, 100.0]), np.array([10.0, 9.0])),
]


def test_running_times_are_those_of_the_first_population_that_reaches_a_target() -> None:
    targets = np.array([20.0, 10.0, 5.0, 1.0])
    assert running_times(RUNS[0], targets).tolist() == [100.0, 150.0, 150.0, np.inf]
    assert running_times(RUNS[1], targets).tolist() == [50.0, 50.0, np.inf, np.inf]


def test_expected_running_time_adds_what_failures_cost() -> None:
    # successes after 100 and 200 evaluations and a failure that used 1000: 1300 for two successes
    times = np.array([[100.0, np.inf], [200.0, np.inf], [np.inf, np.inf]])
    assert expected_running_time(times, np.array([300.0, 300.0, 1000.0])).tolist() == [650.0, np.inf]


def test_the_share_of_targets_reached_counts_all_runs_and_targets() -> None:
    times = np.array([[100.0, np.inf], [50.0, 400.0]])
    assert share_reached([condense_times(times)], np.array([49.0, 50.0, 100.0, 1000.0])).tolist() == [
        0.0,
        0.25,
        0.5,
        0.75,
    ]


def test_targets_are_evenly_spaced_in_the_logarithm_from_easy_to_hard() -> None:
    assert targets_between(1000.0, 10.0, 3).tolist() == pytest.approx([1000.0, 100.0, 10.0])


def test_the_area_under_a_staircase_is_that_of_its_rectangles() -> None:
    run = Run(np.array([10.0, 30.0]), np.array([100.0, 10.0]))
    # log10 scaled from 1 .. 1000: worst (1) for 10 evaluations, 2/3 for 20, 1/3 for the last 10 of 40
    assert area_under_curve(run, 1.0, 1000.0, 40) == pytest.approx((10 + 20 * 2 / 3 + 10 / 3) / 40)


def test_a_run_that_finds_nothing_feasible_has_an_area_of_one_and_a_perfect_one_nearly_zero() -> None:
    never = Run(np.array([10.0, 20.0]), np.array([np.inf, np.inf]))
    at_once = Run(np.array([1.0, 20.0]), np.array([1.0, 1.0]))
    assert area_under_curve(never, 1.0, 10.0, 20) == 1.0
    assert area_under_curve(at_once, 1.0, 10.0, 20) == pytest.approx(1 / 20)


def test_the_interval_of_superiority_holds_near_one_half_and_near_one() -> None:
    for name, by_repetitions in superiority_coverage(seed=3, simulations=400).items():
        for repetitions, by_effect in by_repetitions.items():
            for effect, share in by_effect.items():
                assert share >= 0.93 - 2 * 0.0128, (name, repetitions, effect)  # two standard errors of the simulation


def test_the_committed_coverage_is_at_least_93_percent_for_every_distribution_repetition_and_effect() -> None:
    committed = json.loads((RESULTS / "coverage" / "coverage.json").read_text())["superiority"]
    assert (0.93 * 0.07 / committed["simulations"]) ** 0.5 < 0.002  # so that the simulation decides
    by_distribution = committed["coverage"]
    assert len(by_distribution) == 8
    for name, by_repetitions in by_distribution.items():
        assert list(by_repetitions) == ["12", "15", "30"]
        for by_effect in by_repetitions.values():
            assert (min(by_effect), max(by_effect)) == ("0.5", "0.99")
            assert min(by_effect.values()) >= 0.93, name


def test_the_documentation_names_the_least_committed_coverage_of_each_distribution() -> None:
    text = (RESULTS.parent / "docs" / "comparing.md").read_text()
    committed = json.loads((RESULTS / "coverage" / "coverage.json").read_text())["superiority"]["coverage"]
    for name, by_repetitions in committed.items():
        least = min(share for by_effect in by_repetitions.values() for share in by_effect.values())
        assert f"{100 * least:.1f} " in text, name


def test_an_interval_of_superiority_has_a_width_and_one_end_where_all_pairs_agree() -> None:
    middle, low, high = superiority(np.zeros(12), np.arange(1.0, 13.0))
    assert (middle, high) == (1.0, 1.0)
    assert low**12 == pytest.approx(0.025)  # twelve pairs without a common end agree with probability low^12
    assert superiority(np.ones(12), np.zeros(12)) == (0.0, 0.0, pytest.approx(1 - low))
    assert superiority(np.zeros(5), np.zeros(5))[0] == 0.5


def test_against_an_algorithm_that_always_ends_alike_the_interval_is_that_of_a_binomial_share() -> None:
    expected = stats.binomtest(24, 30).proportion_ci(method="exact")
    found = superiority(np.zeros(40), np.repeat([1.0, -1.0], [24, 6]))
    assert found == pytest.approx((0.8, expected.low, expected.high))


def test_zero_is_within_every_factor_of_zero_and_nothing_else_is() -> None:
    profile = performance_profile(pd.DataFrame([{"a": 0.0, "b": 1e-9, "c": np.inf}]), np.array([1.0, 10.0]))
    assert profile.to_numpy().tolist() == [[1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
