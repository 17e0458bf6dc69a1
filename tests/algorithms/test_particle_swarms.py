"""SPSO and MuPSO step by step, with numbers that can be followed by hand."""

import pickle

import numpy as np
import pytest

from algorithms.contract import Box
from algorithms.mupso import MuPSO, MuPSOParams
from algorithms.spso import SPSO, SPSOParams, fly, land, new_swarm


def column(*values):
    return np.array(values, dtype=float)[:, None]


def test_spso_takes_three_steps_as_computed_by_hand(script, walk, interval):
    rng = script(
        *(0.50, 0.50, 0.25, 0.50),  # r1 of both particles, then r2 of both
        *(0.50, 0.50, 0.50, 0.25),
        *(0.25, 0.50, 0.25, 0.50),
    )
    params = SPSOParams(inertia=0.5, cognitive=1.0, social=2.0)
    state = SPSO.init(params, column(2, 6), interval(0, 10), 3, rng)
    asked, state = walk(SPSO, state, [(5, 3), (2, 3), (9, 1), (9, 9)])
    np.testing.assert_array_equal(asked[0], column(2, 6))
    # bests 2 and 6, global 6:  v = 0 + 0 + 2 * 0.25 * (6 - 2) = 2;  v = 0
    np.testing.assert_array_equal(asked[1], column(4, 6))
    # bests 4 and 6, global 4:  v = 0.5 * 2 = 1;  v = 0 + 0 + 2 * 0.25 * (4 - 6) = -1
    np.testing.assert_array_equal(asked[2], column(5, 5))
    # bests 4 and 5, global 5:  v = 0.5 * 1 + 0.25 * (4 - 5) = 0.25;  v = 0.5 * -1 = -0.5
    np.testing.assert_array_equal(asked[3], column(5.25, 4.5))
    assert rng.numbers == []
    assert SPSO.incumbent(state) == (np.array([5.0]), 1.0)


@pytest.mark.parametrize("shape", [(1, 1), (3, 2), (50, 15), (7, 33)])
def test_flight_and_landing_are_the_equations_in_numpy_to_the_bit(shape):
    chance, n = np.random.default_rng(5), shape[0]
    box = Box(np.full(shape[1], -2.0), np.full(shape[1], 3.0))
    swarm = new_swarm(chance.uniform(-2, 3, shape), box, 0.3, "ours")
    x, v, p, best = swarm.position.copy(), np.zeros(shape), swarm.position.copy(), np.full(n, np.inf)
    for step in range(20):
        fly(swarm, 0.72, 1.45, 1.5, np.random.default_rng(step))
        r1, r2 = np.random.default_rng(step).random((2, *shape))
        g = p[best.argmin()]
        v = np.clip(0.72 * v + 1.45 * (r1 * (p - x)) + 1.5 * (r2 * (g - x)), -1.5, 1.5)  # eq. 2
        x = x + v  # eq. 1
        assert swarm.position.tobytes() == x.tobytes()
        told, fitness = np.clip(x, *box), chance.choice([np.nan, -np.inf, np.inf, *chance.random(3)], n)
        land(swarm, np.asfortranarray(told), fitness)
        v, x, loss = np.where(x == told, v, 0.0), told, np.where(np.isfinite(fitness), fitness, np.inf)
        better = loss < best
        p, best = np.where(better[:, None], told, p), np.minimum(loss, best)
        assert swarm.velocity.tobytes() == v.tobytes()
        assert swarm.personal_best.tobytes() == p.tobytes()
        assert (swarm.leader, *swarm.personal_best_fitness) == (best.argmin(), *best)
        swarm = pickle.loads(pickle.dumps(swarm))


def test_a_swarm_that_is_told_other_points_than_it_has_says_so():
    swarm = new_swarm(np.zeros((3, 2)), Box(np.zeros(2), np.ones(2)), 0.5, "ours")
    for points, fitness in (((2, 2), 2), ((3, 1), 3), ((3, 2), 4)):
        with pytest.raises(ValueError, match=r"^particles \(3, 2\) were told points .* with fitness \([234],\)$"):
            land(swarm, np.zeros(points), np.zeros(fitness))


def test_every_coordinate_of_a_particle_has_its_own_random_numbers(script, walk):
    box = Box(np.zeros(2), np.full(2, 100.0))
    rng = script(*(0, 0, 0, 0), *(0.25, 0.5, 0, 0))  # r1 of both particles, then r2
    state = SPSO.init(SPSOParams(social=1.0), np.array([[0.0, 0.0], [8.0, 8.0]]), box, 1, rng)
    asked, _ = walk(SPSO, state, [(2, 1), (2, 1)])
    np.testing.assert_array_equal(asked[1], [[2.0, 4.0], [8.0, 8.0]])


def test_defaults_of_spso_and_mupso_are_those_of_table_2():
    assert (SPSOParams().inertia, SPSOParams().cognitive, SPSOParams().social) == (0.72, 1.45, 1.45)
    params = MuPSOParams()
    assert (params.first_inertia, params.last_inertia) == (2.1, 0.6)
    assert (params.cognitive, params.first_social, params.last_social) == (2.24, 1.8, 3.9)
    assert (params.abandonment_threshold, params.abandonment_limit) == (1e-8, 10)
    assert (params.mutation_threshold, params.stagnation) == (1e-3, "second_difference")


@pytest.mark.parametrize("step", [1.0, -1.0])
def test_speed_never_exceeds_the_stated_fraction_of_the_box_width(script, walk, interval, step):
    start = 50 - 40 * step
    state = SPSO.init(
        SPSOParams(velocity_limit=0.05), column(start, 50 + 40 * step), interval(0, 100), 1, script(0, 0, 0.9, 0)
    )
    asked, _ = walk(SPSO, state, [(2, 1), (2, 1)])
    assert asked[1][0, 0] == start + 5 * step


def test_a_coordinate_that_the_bound_policy_moved_loses_its_velocity(script, interval):
    params = SPSOParams(inertia=1.0, cognitive=0.0, social=1.0, velocity_limit=1.0)
    state = SPSO.init(params, column(1, 9), interval(0, 10), 2, script(0, 0, 0.5, 0, 0, 0, 0, 0))
    X, state = SPSO.ask(state)
    state = SPSO.tell(state, X, np.array([2.0, 1.0]))
    X, state = SPSO.ask(state)
    assert X[0, 0] == 5.0
    state = SPSO.tell(state, column(4, 9), np.array([2.0, 1.0]))
    X, state = SPSO.ask(state)
    assert X[0, 0] == 4.0


MUTATING = MuPSOParams(
    first_inertia=2.0,  # with horizon 5: w = 1, 1/2, 1/4, 1/8, 1/16
    last_inertia=0.0625,
    cognitive=1.0,
    first_social=0.5,  # with horizon 5: c2 = 1, 2, 4, 8, 16
    last_social=16.0,
    abandonment_limit=2,
    velocity_limit=1.0,
)


def test_mupso_takes_five_steps_with_a_mutation_as_computed_by_hand(script, walk, interval):
    rng = script(
        *(0.50, 0.50, 0.50, 0.25),  # r1 of both particles, then r2 of both
        *(0.50, 0.25, 0.50, 0.50),
        *(0.25, 0.75),  # the new swarm
        *(0.50, 0.50, 0.125, 0.5),
        *(0.50, 0.50, 0.50, 0.25),
    )
    state = MuPSO.init(MUTATING, column(4, 8), interval(0, 16), 5, rng)
    asked, state = walk(MuPSO, state, [(7, 7), (7, 7), (7, 7)])
    # it 1, w 1, c2 1, bests 4 and 8, global 4:  v = 0;  v = 1 * 0.25 * (4 - 8) = -1
    np.testing.assert_allclose(asked[1], column(4, 7), rtol=1e-14)
    # it 2, w 1/2, c2 2:  v = 0;  v = 0.5 * -1 + 0.25 * (8 - 7) + 2 * 0.5 * (4 - 7) = -3.25
    np.testing.assert_allclose(asked[2], column(4, 3.75), rtol=1e-14)
    assert MuPSO.incumbent(state) == (np.array([4.0]), 7.0)
    asked, state = walk(MuPSO, state, [(9, 8), (8.5, 8), (9, 9)])
    # it 3: 16 * 0.25 and 16 * 0.75, at rest, 7.0 forgotten
    np.testing.assert_array_equal(asked[0], column(4, 12))
    # it 4, w 1/8, c2 8, bests 4 and 12, global 12:  v = 8 * 0.125 * (12 - 4) = 8;  v = 0
    np.testing.assert_allclose(asked[1], column(12, 12), rtol=1e-14)
    # it 5, w 1/16, c2 16, bests 12 and 12:  v = 8 / 16 = 0.5;  v = 0
    np.testing.assert_allclose(asked[2], column(12.5, 12), rtol=1e-14)
    assert state.mutations == [3]
    assert MuPSO.incumbent(state) == (np.array([12.0]), 8.0)


def run_on_fitness(best_of_steps, params=None, points=4):
    """The state after the swarm's best took these values one after the other."""
    rng = np.random.default_rng(0)
    box = Box(np.zeros(2), np.ones(2))
    state = MuPSO.init(params or MuPSOParams(), rng.random((points, 2)), box, len(best_of_steps), rng)
    for best in best_of_steps:
        X, state = MuPSO.ask(state)
        state = MuPSO.tell(state, X, np.full(points, float(best)))
    return state


def test_mutation_replaces_whole_swarm_after_ten_stagnant_iterations():
    state = run_on_fitness([5.0] * 10)
    before, _ = MuPSO.ask(state)
    assert state.mutations == []
    state = run_on_fitness([5.0] * 11)
    after, state = MuPSO.ask(state)
    assert state.mutations == [11]
    assert (before != after).all()
    assert not state.swarm.velocity.any()
    assert MuPSO.incumbent(state)[1] == np.inf


def test_the_swarm_that_mutated_must_stagnate_ten_iterations_again():
    assert run_on_fitness([5.0] * 35).mutations == [11, 22, 33]


def test_growing_improvement_counts_as_stagnant_in_the_literal_equation_6():
    growing = [100.0 - 0.5 * k * k for k in range(6)]
    assert run_on_fitness(growing).q == 5
    assert run_on_fitness(growing, MuPSOParams(stagnation="no_improvement")).q == 0


def test_shrinking_improvement_resets_the_counter_in_the_literal_equation_6():
    assert run_on_fitness([100.0, 90.0, 85.0]).q == 0
    assert run_on_fitness([100.0, 90.0, 85.0], MuPSOParams(stagnation="no_improvement")).q == 0


def test_counter_of_no_improvement_counts_only_iterations_that_gain_less_than_the_threshold():
    params = MuPSOParams(stagnation="no_improvement")
    assert run_on_fitness([3.0, 2.0, 2.0, 2.0 - 1e-9], params).q == 2
    assert run_on_fitness([3.0, 2.0, 2.0, 2.0 - 1e-7], params).q == 0


@pytest.mark.parametrize(
    ("fitness", "finished", "mutates"), [(1e-9, True, False), (1e-5, False, False), (2e-3, False, True)]
)
def test_equation_7_ends_mutates_or_in_the_gap_between_flies_on(fitness, finished, mutates):
    state = run_on_fitness([fitness] * 11)
    assert MuPSO.finished(state) is finished
    _, state = MuPSO.ask(state)
    assert bool(state.mutations) is mutates


def test_a_swarm_that_finds_nothing_finite_stagnates_and_mutates():
    assert run_on_fitness([np.inf] * 12).mutations == [11]


def test_unknown_reading_of_equation_6_is_refused():
    with pytest.raises(ValueError, match="second_difference"):
        MuPSOParams(stagnation="none")
