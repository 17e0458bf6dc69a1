"""Ratings: odds of ten to one are 400 points, intervals are those of the runs, and ties leave all equal."""

import numpy as np
import pandas as pd
import pytest

from bench.statistics.rating import DRAWN_GAMES, rate_algorithms


def losses(wins: int, games: int) -> pd.DataFrame:
    """Repetitions of which `a` wins the first ones against `b`."""
    won = np.arange(games) < wins
    return pd.DataFrame({"a": np.where(won, 1.0, 2.0), "b": np.where(won, 2.0, 1.0)})


def test_the_difference_of_two_is_400_for_odds_of_ten_to_one() -> None:
    games = 1100
    found = rate_algorithms([losses(1000, games)])
    odds = (1000 + DRAWN_GAMES / 2) / (100 + DRAWN_GAMES / 2)
    assert found["a"].value - found["b"].value == pytest.approx(400 * np.log10(odds))
    assert found["a"].value + found["b"].value == pytest.approx(3000)


def test_waiting_times_of_three_rates_have_the_ratings_of_their_rates() -> None:
    rates = np.array([4.0, 2.0, 1.0])  # the chance that one comes first of two is its share of both rates
    times = np.random.default_rng(0).exponential(size=(20_000, 3)) / rates
    found = rate_algorithms([pd.DataFrame(times, columns=list("abc"))])
    values = [found[name].value for name in "abc"]
    assert values == pytest.approx(1500 + 400 * np.log10(rates / 2), abs=10)


def test_an_algorithm_that_always_wins_has_a_finite_rating_and_leads() -> None:
    found = rate_algorithms([losses(15, 15)])
    assert list(found) == ["a", "b"]
    assert np.isfinite(found["a"].value)


def test_what_nobody_finds_is_a_tie() -> None:
    nothing = pd.DataFrame({"a": [np.inf] * 5, "b": [np.inf] * 5})
    assert {rating.value for rating in rate_algorithms([nothing]).values()} == {1500.0}


def test_intervals_hold_the_truth_about_as_often_as_they_say() -> None:
    rng, held = np.random.default_rng(0), 0
    for _ in range(60):
        found = rate_algorithms([losses(int(rng.binomial(40, 0.7)), 40)])
        held += found["a"].low <= 1500 + 200 * np.log10(0.7 / 0.3) <= found["a"].high
    assert 50 <= held <= 60


def test_a_repetition_that_one_lacks_is_left_out() -> None:
    whole = losses(8, 10)
    gap = pd.concat([whole, pd.DataFrame({"a": [np.nan] * 5, "b": [0.0] * 5})], ignore_index=True)
    assert rate_algorithms([gap]) == rate_algorithms([whole])
