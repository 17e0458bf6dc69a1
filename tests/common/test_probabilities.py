"""Tails and quantiles equal those of scipy.stats."""

import pytest
from scipy import stats

from armlab.common.probabilities import (
    chi_square_tail,
    fisher_tail,
    normal_quantile,
    student_quantile,
    student_tail,
)


@pytest.mark.parametrize("value", [0.0, 0.3, 2.5, 40.0])
@pytest.mark.parametrize("degrees", [1, 3.7, 200])
def test_tails_equal_those_of_scipy_stats(value: float, degrees: float) -> None:
    exact = pytest.approx
    assert student_tail(value, degrees) == exact(stats.t.sf(value, degrees), rel=1e-12)
    assert student_tail(-value, degrees) == exact(stats.t.sf(-value, degrees), rel=1e-12)
    assert fisher_tail(value, 2, degrees) == exact(stats.f.sf(value, 2, degrees), rel=1e-12)
    assert chi_square_tail(value, degrees) == exact(stats.chi2.sf(value, degrees), rel=1e-12)


def test_a_chi_square_below_zero_is_surely_exceeded() -> None:
    assert chi_square_tail(-1e-9, 3) == 1.0


@pytest.mark.parametrize("chance", [1e-6, 0.025, 0.5, 0.975])
def test_quantiles_equal_those_of_scipy_stats(chance: float) -> None:
    assert normal_quantile(chance) == pytest.approx(stats.norm.ppf(chance), rel=1e-12, abs=1e-12)
    assert student_quantile(chance, 7.5) == pytest.approx(stats.t.ppf(chance, 7.5), rel=1e-12, abs=1e-12)
