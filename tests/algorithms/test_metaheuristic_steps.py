"""GWO, WOA, GOA, DE, random search: three steps against the equations, written out number by number.

The random numbers are injected; every formula below works on plain numbers, one point and coordinate at a time.
"""

import math

import numpy as np
import pytest

from algorithms.contract import Box
from algorithms.de import DE, DEParams, distinct_others
from algorithms.goa import GOA, GOAParams
from algorithms.gwo import GWO, GWOParams
from algorithms.random_search import RandomSearch, RandomSearchParams
from algorithms.woa import WOA, WOAParams

BOX = Box(np.array([-4.0, -2.0]), np.array([4.0, 6.0]))
START = [[1.0, 2.0], [-1.0, 0.5], [2.5, -1.5], [-3.0, 4.0]]
HORIZON = 4
RANDOM = np.random.default_rng(7).random(4000).round(3).tolist()


def cost(x):
    return (x[0] - 1.5) ** 2 + 2 * (x[1] - 1) ** 2


def asked_populations(algorithm, params, rng, steps=4):
    """The first population and the ones after it."""
    state = algorithm.init(params, np.array(START), BOX, HORIZON, rng)
    asked = []
    for _ in range(steps):
        X, state = algorithm.ask(state)
        asked.append(X)
        state = algorithm.tell(state, X, np.array([cost(x) for x in X.tolist()]))
    return asked


def best_of(points, count):
    return sorted(points, key=cost)[:count]


def test_gwo_takes_three_steps_of_equations_3_1_to_3_7(script):
    rng = script(*RANDOM)
    asked = asked_populations(GWO, GWOParams(), rng)
    numbers = iter(RANDOM)
    wolves, seen = START, list(START)
    for step, a in enumerate((2.0, 1.5, 1.0), start=1):
        leaders = best_of(seen, 3)
        r1, r2 = ([[[next(numbers) for _ in x] for x in wolves] for _ in leaders] for _ in range(2))
        moved = []
        for i, x in enumerate(wolves):
            new = []
            for d in range(2):
                X = []
                for k, leader in enumerate(leaders):
                    A, C = 2 * a * r1[k][i][d] - a, 2 * r2[k][i][d]
                    X.append(leader[d] - A * abs(C * leader[d] - x[d]))
                new.append(sum(X) / 3)
            moved.append(new)
        np.testing.assert_allclose(asked[step], moved, rtol=1e-12)
        wolves = moved
        seen += moved


def test_woa_takes_three_steps_of_equations_2_1_to_2_8(script):
    asked = asked_populations(WOA, WOAParams(), script(*RANDOM))
    numbers = iter(RANDOM)
    whales, seen, kinds = START, list(START), set()
    for step, a in enumerate((2.0, 1.5, 1.0), start=1):
        (prey,) = best_of(seen, 1)
        p, turn, which = ([next(numbers) for _ in whales] for _ in range(3))
        r_A, r_C = ([[next(numbers) for _ in x] for x in whales] for _ in range(2))
        moved = []
        for i, x in enumerate(whales):
            new = []
            for d in range(2):
                A, C, t = 2 * a * r_A[i][d] - a, 2 * r_C[i][d], 2 * turn[i] - 1
                if p[i] >= 0.5:
                    kinds.add("spiral")
                    new.append(abs(prey[d] - x[d]) * math.exp(t) * math.cos(2 * math.pi * t) + prey[d])
                elif abs(A) < 1:
                    kinds.add("encircle")
                    new.append(prey[d] - A * abs(C * prey[d] - x[d]))
                else:
                    kinds.add("search")
                    other = whales[int(which[i] * 4)]
                    new.append(other[d] - A * abs(C * other[d] - x[d]))
            moved.append(new)
        np.testing.assert_allclose(asked[step], moved, rtol=1e-12)
        whales = moved
        seen += moved
    assert kinds == {"spiral", "encircle", "search"}


def test_goa_takes_three_steps_of_equation_2_7_in_normalised_coordinates():
    asked = asked_populations(GOA, GOAParams(), None)
    hoppers, seen = START, list(START)
    for step in (1, 2, 3):
        c = 1.0 - step * (1.0 - 4e-5) / HORIZON
        (target,) = best_of(seen, 1)
        moved = [
            [
                c * sum(c * 8.0 / 2 * pull(x, other, d) for other in hoppers if other is not x) + target[d]
                for d in (0, 1)
            ]
            for x in hoppers
        ]
        np.testing.assert_allclose(asked[step], moved, rtol=1e-12)
        hoppers = asked[step].tolist()
        seen += hoppers


def pull(x, other, d):
    """s(|x_j - x_i|) (x_j - x_i) / d_ij, where the width of the box, 8, is 3 units of distance beyond 1."""
    r = 1 + 3 * abs(other[d] - x[d]) / 8
    return (0.5 * math.exp(-r / 1.5) - math.exp(-r)) * (other[d] - x[d]) / math.dist(x, other)


def test_grasshoppers_in_the_same_place_do_not_push_each_other():
    state = GOA.init(GOAParams(), np.array([[1.0, 1.0]] * 3), BOX, HORIZON, np.random.default_rng(0))
    X, state = GOA.ask(state)
    X, _ = GOA.ask(GOA.tell(state, X, np.zeros(3)))
    np.testing.assert_array_equal(X, np.ones((3, 2)))


def test_goa_computes_large_swarms_in_parts_as_it_does_at_once(monkeypatch):
    at_once = asked_populations(GOA, GOAParams(), None)
    monkeypatch.setattr("algorithms.goa.PAIR_COORDINATES", 8)
    np.testing.assert_array_equal(asked_populations(GOA, GOAParams(), None), at_once)


@pytest.mark.parametrize("crossover_rate", [1.0, 0.3])
def test_de_takes_three_steps_of_rand_1_bin(script, crossover_rate):
    asked = asked_populations(DE, DEParams(crossover_rate=crossover_rate), script(*RANDOM))
    numbers = iter(RANDOM)
    population = START
    for step in (1, 2, 3):
        donors = donors_by_hand([[next(numbers) for _ in population] for _ in range(3)])
        crossed = [[next(numbers) < crossover_rate for _ in x] for x in population]
        forced = [int(next(numbers) * 2) for _ in population]
        trials = [list(x) for x in population]
        for i, (r1, r2, r3) in enumerate(donors):
            for d in range(2):
                if crossed[i][d] or d == forced[i]:
                    difference = population[r2][d] - population[r3][d]
                    trials[i][d] = population[r1][d] + 0.85 * difference
        np.testing.assert_allclose(asked[step], trials, rtol=1e-12)
        population = [t if cost(t) <= cost(x) else x for x, t in zip(population, trials, strict=True)]


def donors_by_hand(draws):
    """Steps ahead in the ring of four rows: from 1, 2, 3, then from the two left, then the last one."""
    rows = []
    for i, (u1, u2, u3) in enumerate(zip(*draws, strict=True)):
        left = [1, 2, 3]
        steps = [left.pop(int(u * len(left))) for u in (u1, u2, u3)]
        rows.append([(i + step) % 4 for step in steps])
    return rows


def test_donors_of_de_are_distinct_others_and_all_choices_are_equally_likely():
    rng = np.random.default_rng(3)
    counts = np.zeros((5, 5, 5, 5), dtype=int)
    for _ in range(4000):
        r1, r2, r3 = distinct_others(5, rng)
        counts[np.arange(5), r1, r2, r3] += 1
    i, r1, r2, r3 = np.nonzero(counts)
    assert len(i) == 5 * 4 * 3 * 2
    assert all(len({*row}) == 4 for row in zip(i, r1, r2, r3, strict=True))
    observed = counts[counts > 0]
    expected = 4000 / 24
    assert np.square(observed - expected).sum() / expected < 5 * 23 + 6 * math.sqrt(2 * 5 * 23)


def test_a_trial_of_de_that_is_as_good_replaces_its_target():
    state = DE.init(DEParams(), np.array(START), BOX, HORIZON, np.random.default_rng(0))
    X, state = DE.ask(state)
    state = DE.tell(state, X, np.ones(4))
    X, state = DE.ask(state)
    state = DE.tell(state, X, np.ones(4))
    np.testing.assert_array_equal(state.population, X)


def test_random_search_draws_uniformly_in_the_box(script):
    asked = asked_populations(RandomSearch, RandomSearchParams(), script(*RANDOM))
    for step in (1, 2, 3):
        u = np.reshape(RANDOM[8 * (step - 1) : 8 * step], (4, 2))
        np.testing.assert_allclose(asked[step], [[-4 + 8 * a, -2 + 8 * b] for a, b in u], rtol=1e-12)


def test_gwo_demotes_a_leader_that_is_overtaken():
    state = GWO.init(GWOParams(), np.array([[1.0], [2.0], [3.0]]), Box(np.zeros(1), np.full(1, 9.0)), 3, None)
    state = GWO.tell(state, np.array([[1.0], [2.0], [3.0]]), np.array([1.0, 2.0, 3.0]))
    state = GWO.tell(state, np.array([[4.0], [5.0], [6.0]]), np.array([0.5, 9.0, 2.0]))
    np.testing.assert_array_equal(state.leaders.position[:, 0], [4.0, 1.0, 2.0])
