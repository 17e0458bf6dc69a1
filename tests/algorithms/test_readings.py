"""The readings of the algorithms: steps against plain loops over points and coordinates, with injected numbers.

All variables of these loops are plain numbers, and the random ones come from a list in the order of the sources.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from algorithms import registry
from algorithms.check import check_algorithm
from algorithms.contract import Box
from algorithms.de import DE, DEParams
from algorithms.goa import EXTRA_LIMIT, GOA, GOAParams
from algorithms.gwo import GWO, GWOParams
from algorithms.spso import SPSO, SPSOParams
from algorithms.woa import WOA, WOAParams
from bench.execute import stated_params

BOX = Box(np.array([-4.0, -2.0, 1.0]), np.array([4.0, 6.0, 3.0]))
START = np.array([[1.0, 2.0, 1.5], [-1.0, 0.5, 2.0], [2.5, -1.5, 1.1], [-3.0, 4.0, 2.9]])
HORIZON = 4
READINGS = [
    (name, reading)
    for name, readings in {
        "mupso": ["text"],
        "spso": ["text"],
        **{name: ["text", "program"] for name in ("woa", "gwo", "goa", "de")},
    }.items()
    for reading in readings
]


def cost(x):
    return (x[0] - 1.5) ** 2 + 2 * (x[1] - 1) ** 2 + (x[2] - 2.0) ** 2


def after_first(algorithm, params, rng, start=START, box=BOX):
    """The state after the first population."""
    state = algorithm.init(params, start.copy(), box, HORIZON, rng)
    X, state = algorithm.ask(state)
    return algorithm.tell(state, X, np.array([cost(x) for x in X.tolist()]))


@pytest.mark.parametrize(("name", "reading"), READINGS)
def test_every_reading_keeps_the_contract(name, reading):
    algorithm = registry.load(name)

    class Read(algorithm):
        @staticmethod
        def init(params, *start):
            return algorithm.init(replace(params, reading=reading), *start)

    check_algorithm(Read)


def test_ours_is_left_out_of_what_names_a_trial_and_the_others_are_not():
    assert "reading" not in stated_params(WOAParams())
    assert stated_params(WOAParams(reading="program"))["reading"] == "program"


def test_the_program_of_woa_has_one_number_a_whale_and_lets_whales_move_in_turn():
    numbers = np.random.default_rng(3)
    state = after_first(WOA, WOAParams(reading="program"), np.random.default_rng(3))
    moved, _ = WOA.ask(state)
    r_A, r_C, r_l, p = numbers.random((4, 4)).tolist()
    others = (numbers.random((4, 3)) * 4).astype(int).tolist()
    whales = START.tolist()
    prey = min(whales, key=cost)[:]
    a, a2, kinds = 2.0, -1.0, set()
    for i in range(4):
        A, C, turn = 2 * a * r_A[i] - a, 2 * r_C[i], (a2 - 1) * r_l[i] + 1
        old = whales[i][:]
        for j in range(3):
            if p[i] >= 0.5:
                kinds.add("spiral")
                whales[i][j] = abs(prey[j] - old[j]) * math.exp(turn) * math.cos(2 * math.pi * turn) + prey[j]
            else:
                kinds.add("prey" if abs(A) < 1 else "random")
                target = prey[j] if abs(A) < 1 else whales[others[i][j]][j]
                whales[i][j] = target - A * abs(C * target - old[j])
    np.testing.assert_allclose(moved, whales, rtol=1e-12)
    assert len(kinds) >= 2


def test_the_text_of_woa_asks_for_the_length_of_the_vector(script):
    p, l_and_whale = [0.1] * 4, [0.5] * 8
    r_A = [0.9, 0.9, 0.9] * 4  # |A| is 0.8 a coordinate where a = 1, and 1.39 in all
    state = after_first(WOA, WOAParams(first_a=1.0, reading="text"), script(*p, *l_and_whale, *r_A, *[0.5] * 12))
    moved, _ = WOA.ask(state)
    A, whale = 2 * 0.9 - 1, START[2]
    np.testing.assert_allclose(moved, whale - A * np.abs(whale - START))


def test_the_program_of_gwo_forgets_a_leader_that_is_overtaken():
    state = GWO.init(GWOParams(reading="program"), START.copy(), BOX, HORIZON, np.random.default_rng(0))
    X, state = GWO.ask(state)
    state = GWO.tell(state, X, np.array([5.0, 3.0, 4.0, 1.0]))
    assert state.leaders.fitness.tolist() == [1.0, 4.0, np.inf]  # 5 and 3 were overtaken as first ones
    np.testing.assert_array_equal(state.leaders.position, [START[3], START[2], np.zeros(3)])


def test_the_text_of_gwo_ends_on_one_point():
    state = after_first(GWO, GWOParams(reading="text"), np.random.default_rng(1))
    for _ in range(HORIZON):
        X, state = GWO.ask(state)
        state = GWO.tell(state, X, np.array([cost(x) for x in X.tolist()]))
    assert np.ptp(X, axis=0).max() < 1e-12


def test_the_text_of_goa_is_equation_2_7_in_the_units_of_the_coordinates():
    state = after_first(GOA, GOAParams(reading="text"), np.random.default_rng(0))
    moved, _ = GOA.ask(state)
    c = 1 - (1 / HORIZON) * (1 - 4e-5)
    target = min(START.tolist(), key=cost)
    for i in range(4):
        for d in range(3):
            total = 0.0
            for j in range(4):
                if i != j:
                    gap = START[j][d] - START[i][d]
                    s = 0.5 * math.exp(-abs(gap) / 1.5) - math.exp(-abs(gap))
                    total += c * (BOX.upper[d] - BOX.lower[d]) / 2 * s * gap / math.dist(START[i], START[j])
            assert moved[i, d] == pytest.approx(c * total + target[d], rel=1e-12)


def test_the_program_of_goa_works_on_planes_and_adds_a_coordinate_where_their_number_is_odd():
    state = after_first(GOA, GOAParams(reading="program"), np.random.default_rng(5))
    extra = np.random.default_rng(5).uniform(-EXTRA_LIMIT, EXTRA_LIMIT, 4).tolist()
    moved, state = GOA.ask(state)
    points = [[*x, e] for x, e in zip(START.tolist(), extra, strict=True)]
    width = [8.0, 8.0, 2.0, 2 * EXTRA_LIMIT]
    best = min(range(4), key=lambda i: cost(START[i]))
    c = 1 - 2 * (1 - 4e-5) / (HORIZON + 1)
    wanted = [[0.0] * 4 for _ in points]
    for i, one in enumerate(points):
        for k in (0, 2):
            for d in (k, k + 1):
                total = 0.0
                for other in points:
                    distance = math.dist(one[k : k + 2], other[k : k + 2])
                    r = 2 + math.fmod(distance, 2)
                    s = 0.5 * math.exp(-r / 1.5) - math.exp(-r)
                    total += width[d] * c / 2 * s * (other[d] - one[d]) / (distance + np.finfo(float).eps)
                wanted[i][d] = c * total + points[best][d]
    np.testing.assert_allclose(moved, np.array(wanted)[:, :3], rtol=1e-12)
    extra = np.clip(np.array(wanted)[:, 3], -EXTRA_LIMIT, EXTRA_LIMIT)
    np.testing.assert_allclose(state.position[:, 3], extra, rtol=1e-12)


def test_the_text_of_de_keeps_a_target_that_is_equally_good():
    for reading, kept in (("text", START), ("ours", START + 1.0)):
        state = after_first(DE, DEParams(reading=reading), np.random.default_rng(0))
        state = DE.tell(state, START + 1.0, state.fitness.copy())
        np.testing.assert_array_equal(state.population, kept)


def test_the_program_of_de_turns_one_random_order_twice():
    start = np.random.default_rng(8).random((9, 3))
    state = after_first(DE, DEParams(reading="program"), np.random.default_rng(2), start)
    X, _ = DE.ask(state)
    rng = np.random.default_rng(2)
    turns = (rng.permutation(4)[:2] + 1).tolist()
    first = rng.permutation(9).tolist()
    for i in range(9):
        r1, r2, r3 = first[i], first[(i + turns[0]) % 9], first[(i + turns[0] + turns[1]) % 9]
        np.testing.assert_allclose(X[i], start[r3] + 0.85 * (start[r1] - start[r2]), rtol=1e-12)


def test_the_text_of_a_particle_swarm_has_no_limit_and_flies_on_at_the_bounds(script):
    for reading, velocity in (("text", 12.0), ("ours", 0.0)):
        box = Box(np.array([0.0]), np.array([1.0]))
        params = SPSOParams(inertia=1.0, cognitive=0.0, social=24.0, reading=reading)
        state = SPSO.init(params, np.array([[0.5], [1.0]]), box, HORIZON, script(*[0.5] * 8))
        X, state = SPSO.ask(state)
        state = SPSO.tell(state, X, np.array([2.0, 1.0]))
        X, state = SPSO.ask(state)
        assert X[0, 0] == (0.5 + 6.0 if reading == "text" else 0.5 + 0.5)
        state = SPSO.tell(state, np.clip(X, 0.0, 0.9), np.array([3.0, 3.0]))
        assert state.swarm.velocity[0, 0] == (6.0 if reading == "text" else velocity)
