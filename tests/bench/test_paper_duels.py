"""Duels: effect sizes and paired tests of ends, some of them infeasible."""

import numpy as np
import pandas as pd
import pytest

from bench.statistics.pairwise import duels, duels_against_all, log_losses, signed_rank_p
from bench.statistics.superiority import superiority


def _frame(**ends: list[float]) -> pd.DataFrame:
    rows = [
        {"algorithm": name, "repetition": k, "value": abs(value), "violation": float(value < 0)}
        for name, values in ends.items()
        for k, value in enumerate(values)
    ]
    return pd.DataFrame(rows)


def test_superiority_counts_wins_and_half_of_the_ties() -> None:
    middle, low, high = superiority(np.array([1.0, 2.0]), np.array([2.0, 3.0]))
    assert middle == pytest.approx((2 + 1 + 0.5) / 4)
    assert low <= middle <= high


def test_an_infeasible_end_is_worse_than_any_feasible_one_and_two_are_equal() -> None:
    losses = log_losses(_frame(a=[10.0, 1000.0], b=[-1.0, -5.0]))
    assert losses["a"].tolist() == [1.0, 3.0]
    assert losses["b"][0] == losses["b"][1]
    assert losses["b"][0] - losses["a"].max() > np.ptp(losses["a"])


def test_an_end_of_zero_is_better_than_any_other_and_two_are_equal() -> None:
    losses = log_losses(_frame(a=[0.0, 1e-300], b=[0.0, 1.0]))
    assert losses["a"][0] == losses["b"][0] < losses["a"][1] < losses["b"][1]


def test_equal_ends_give_a_p_value_of_one() -> None:
    assert signed_rank_p(np.ones(5), np.ones(5)) == 1.0


def test_a_clear_winner_is_named_and_a_draw_is_not() -> None:
    rng = np.random.default_rng(0)
    base = rng.uniform(10, 20, 30)
    frame = _frame(mupso=list(base), better=list(base * 0.8), same=list(base[::-1]))
    winners = {duel.rival: duel.winner() for duel in duels_against_all(frame, "mupso")}
    assert winners == {"better": "better", "same": None}


def test_p_values_are_corrected_over_the_duels_fought_together() -> None:
    rng = np.random.default_rng(3)
    base = rng.uniform(10, 20, 20)
    frame = _frame(a=list(base), b=list(base * rng.uniform(0.9, 1.2, 20)), c=list(base * rng.uniform(0.9, 1.3, 20)))
    alone = duels(frame, [("a", "b")])[0].p
    both = {duel.rival: duel.p for duel in duels(frame, [("a", "b"), ("a", "c")])}
    assert alone <= both["b"] <= 2 * alone + 1e-12


def test_repetitions_are_paired_by_their_number_and_not_by_their_row() -> None:
    frame = _frame(a=[1.0, 2.0, 4.0], b=[2.0, 4.0, 8.0])
    shuffled = frame.sample(frac=1.0, random_state=1)
    for name, losses in log_losses(frame).items():
        assert log_losses(shuffled)[name].tolist() == losses.tolist()
