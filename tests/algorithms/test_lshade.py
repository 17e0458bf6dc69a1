"""L-SHADE: three steps against the paper's equations, its memory, its archive and its shrinking.

The random numbers are injected; every formula works on plain numbers, one point and coordinate at a time.
"""

import math
from statistics import NormalDist

import numpy as np
import pytest

from algorithms.contract import Box
from algorithms.lshade import LSHADE, LSHADEParams, SuccessHistory, _draw_donors

BOX = Box(np.array([-4.0, -2.0]), np.array([4.0, 6.0]))
START = [[1.0, 2.0], [-1.0, 0.5], [2.5, -1.5], [-3.0, 4.0], [0.5, 0.0], [3.0, 3.0], [-2.0, -1.0], [0.0, 5.0]]
HORIZON = 4
RANDOM = (np.random.default_rng(11).random(4000).round(3) * 0.98 + 0.01).tolist()


def cost(x):
    return (x[0] - 1.5) ** 2 + 2 * (x[1] - 1) ** 2


def weighted_lehmer(values, weights):
    return sum(w * v * v for v, w in zip(values, weights, strict=True)) / sum(
        w * v for v, w in zip(values, weights, strict=True)
    )


class ByHand:
    """The paper's Algorithm 1 and 2, point by point, with the same numbers in the same order."""

    def __init__(self, points):
        self.points, self.costs = points, [cost(x) for x in points]
        self.archive, self.M_F, self.M_CR, self.k = [], [0.5] * 6, [0.5] * 6, 0
        self.used, self.numbers = 0, iter(RANDOM)

    def draw(self, count):
        return [next(self.numbers) for _ in range(count)]

    def trials(self):
        n = len(self.points)
        entries = [int(6 * u) for u in self.draw(n)]
        normal = [NormalDist().inv_cdf(u) for u in self.draw(n)]
        means = [self.M_CR[r] for r in entries]
        self.CR = [0.0 if m is None else min(max(m + 0.1 * z, 0.0), 1.0) for m, z in zip(means, normal, strict=True)]
        self.F = [0.0] * n
        while any(f <= 0 for f in self.F):
            again = [i for i, f in enumerate(self.F) if f <= 0]
            for i, u in zip(again, self.draw(len(again)), strict=True):
                self.F[i] = self.M_F[entries[i]] + 0.1 * math.tan(math.pi * (u - 0.5))
        self.F = [min(f, 1.0) for f in self.F]
        ranked = sorted(range(n), key=lambda i: self.costs[i])
        pbest = [ranked[int(2 * u)] for u in self.draw(n)]
        r1, r2 = self.draw(n), self.draw(n)
        crossed = [self.draw(2) for _ in range(n)]
        forced = [int(2 * u) for u in self.draw(n)]
        everyone = self.points + self.archive
        trials = []
        for i, x in enumerate(self.points):
            left = [j for j in range(n) if j != i]
            a = left[int(r1[i] * len(left))]
            left = [j for j in range(len(everyone)) if j not in (i, a)]
            b = left[int(r2[i] * len(left))]
            trial = list(x)
            for d in range(2):
                if crossed[i][d] < self.CR[i] or d == forced[i]:
                    to_best = self.points[pbest[i]][d] - x[d]
                    trial[d] = x[d] + self.F[i] * (to_best + self.points[a][d] - everyone[b][d])
            trials.append(trial)
        return trials

    def select(self, trials):
        costs = [cost(x) for x in trials]
        better = [i for i in range(len(trials)) if costs[i] < self.costs[i]]
        if better:
            gains = [self.costs[i] - costs[i] for i in better]
            weights = [gain / sum(gains) for gain in gains]
            rates = [self.CR[i] for i in better]
            ended = self.M_CR[self.k] is None or max(rates) == 0
            self.M_CR[self.k] = None if ended else weighted_lehmer(rates, weights)
            self.M_F[self.k] = weighted_lehmer([self.F[i] for i in better], weights)
            self.k = (self.k + 1) % 6
        self.archive += [self.points[i] for i in better]
        for i, (new, c) in enumerate(zip(trials, costs, strict=True)):
            if c <= self.costs[i]:
                self.points[i], self.costs[i] = new, c

    def shrink(self):
        self.used += len(self.points)
        size = round((4 - 8) / 40 * self.used + 8)
        kept = sorted(sorted(range(len(self.points)), key=lambda i: self.costs[i])[:size])
        self.points, self.costs = [self.points[i] for i in kept], [self.costs[i] for i in kept]
        assert len(self.archive) <= round(2.6 * size)
        return size


def test_three_steps_are_those_of_the_paper(script):
    by_hand = ByHand([list(x) for x in START])
    rng = script(*RANDOM)
    state = LSHADE.init(LSHADEParams(), np.array(START), BOX, HORIZON, rng)
    X, state = LSHADE.ask(state)
    np.testing.assert_array_equal(X, START)
    state = LSHADE.tell(state, X, np.array(by_hand.costs))
    sizes = [by_hand.shrink()]
    for _ in range(3):
        expected = by_hand.trials()
        X, state = LSHADE.ask(state)
        np.testing.assert_allclose(X, expected, rtol=1e-12)
        state = LSHADE.tell(state, X, np.array([cost(x) for x in X.tolist()]))
        by_hand.select(expected)
        sizes.append(by_hand.shrink())
    assert sizes == [7, 6, 6, 5]
    assert by_hand.archive
    np.testing.assert_allclose(state.archive, by_hand.archive, rtol=1e-12)
    np.testing.assert_allclose(state.history.scaling, by_hand.M_F, rtol=1e-12)
    np.testing.assert_allclose(state.history.crossover, by_hand.M_CR, rtol=1e-12)


def test_the_population_shrinks_linearly_to_four_at_the_end_of_the_horizon_and_stays_there():
    rng = np.random.default_rng(0)
    start = rng.uniform(*BOX, (40, 2))
    state = LSHADE.init(LSHADEParams(), start, BOX, 9, rng)
    used, sizes = 0, []
    for _ in range(40):
        X, state = LSHADE.ask(state)
        state = LSHADE.tell(state, X, np.array([cost(x) for x in X.tolist()]))
        used += len(X)
        sizes.append((used, len(state.population), len(state.archive)))
    assert all(size == max(round(40 - 36 * used / 400), 4) for used, size, _ in sizes)
    assert sizes[-1][1] == 4
    assert all(archived <= round(2.6 * size) for _, size, archived in sizes)


def test_a_trial_that_is_only_as_good_takes_the_place_of_its_target_but_is_no_success():
    state = LSHADE.init(LSHADEParams(), np.array(START), BOX, 100, np.random.default_rng(0))
    X, state = LSHADE.ask(state)
    state = LSHADE.tell(state, X, np.ones(8))
    X, state = LSHADE.ask(state)
    state = LSHADE.tell(state, X, np.ones(8))
    np.testing.assert_array_equal(state.population, X)
    assert len(state.archive) == 0
    assert state.history.scaling.tolist() == [0.5] * 6


def test_a_rate_of_which_only_zeros_succeeded_stays_zero_for_good():
    history = SuccessHistory(np.array([0.5]), np.array([0.5]))
    history.learn(np.array([0.4, 0.8]), np.array([0.0, 0.0]), np.array([1.0, 1.0]))
    history.learn(np.array([0.4]), np.array([0.9]), np.array([1.0]))
    assert math.isnan(history.crossover[0])
    assert history.rates(50, np.random.default_rng(0))[1].tolist() == [0.0] * 50


def test_an_entry_is_the_mean_of_what_succeeded_weighted_by_the_gain():
    history = SuccessHistory(np.array([0.5, 0.5]), np.array([0.5, 0.5]))
    history.learn(np.array([0.4, 0.8]), np.array([0.2, 1.0]), np.array([3.0, 1.0]))
    assert history.scaling.tolist() == pytest.approx([(0.75 * 0.16 + 0.25 * 0.64) / (0.75 * 0.4 + 0.25 * 0.8), 0.5])
    assert history.crossover.tolist() == pytest.approx([(0.75 * 0.04 + 0.25) / (0.75 * 0.2 + 0.25), 0.5])


def test_a_step_out_of_the_losses_weighs_as_much_as_the_largest_finite_gain():
    history = SuccessHistory(np.array([0.5]), np.array([0.5]))
    history.learn(np.array([0.4, 0.8]), np.array([0.5, 0.5]), np.array([np.inf, 2.0]))
    assert history.scaling[0] == pytest.approx((0.16 + 0.64) / 1.2)


def test_donors_are_distinct_from_each_other_and_the_target_and_all_choices_are_equally_likely():
    rng = np.random.default_rng(3)
    counts = np.zeros((4, 4, 6), dtype=int)
    for _ in range(5000):
        first, second = _draw_donors(4, 6, rng)
        counts[np.arange(4), first, second] += 1
    target, first, second = np.nonzero(counts)
    assert len(target) == 4 * 3 * 4
    assert all(len({*row}) == 3 for row in zip(target, first, second, strict=True))
    observed, expected = counts[counts > 0], 5000 / 12
    assert np.square(observed - expected).sum() / expected < 44 + 6 * math.sqrt(2 * 44)


def test_scaling_factors_are_positive_and_one_at_most():
    history = SuccessHistory(np.full(6, 0.05), np.full(6, 0.5))
    scaling, crossover = history.rates(2000, np.random.default_rng(1))
    assert 0 < scaling.min() < scaling.max() == 1.0
    assert np.median(crossover) == pytest.approx(0.5, abs=0.01)
