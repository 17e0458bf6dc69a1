"""The detection limit is the size that an oracle finds nine times out of ten: checked by trying."""

import numpy as np
import pytest
from hidden_cases import case
from scipy.stats import chi2

from armlab.proof.blind.effects.drives import Rotor
from armlab.proof.blind.effects.friction import Viscous
from armlab.proof.blind.noise import Noise, draw_noise
from armlab.proof.blind.sizing import ORACLE, Oracle, candidate_count, limit_noncentrality

SAMPLES, JOINTS, TRIALS = 1500, 2, 600
NOISE = Noise("coloured", np.array([0.05, 0.1]), np.array([0.08, 0.02]), 4.0)


def _columns() -> tuple[np.ndarray, np.ndarray]:
    """An effect's torque and a free column that resembles it, (samples, joints)."""
    time = np.arange(SAMPLES) / ORACLE.rate_hz
    wave = np.sin(2 * np.pi * 0.7 * time)
    return np.column_stack([wave, 0 * wave]), np.column_stack([0.8 * wave + 0.6 * np.cos(3 * time), 0.3 + 0 * wave])


def _statistics(size: float, noise: Noise) -> np.ndarray:
    """The oracle's chi-square in recordings of an effect of that size."""
    rng, (effect, free) = np.random.default_rng(0), _columns()
    time = np.arange(SAMPLES) / ORACLE.rate_hz
    white = [
        [noise.whitened(each[:, joint], joint, ORACLE.rate_hz) for joint in range(JOINTS)] for each in (effect, free)
    ]
    column, beside = np.concatenate(white[0]), np.concatenate(white[1])
    column = column - beside * (beside @ column) / (beside @ beside)
    found = []
    for _ in range(TRIALS):
        torque = noise.sample(rng, np.zeros((SAMPLES, JOINTS)), time) + size * effect + 2.0 * free
        rows = np.concatenate([noise.whitened(torque[:, joint], joint, ORACLE.rate_hz) for joint in range(JOINTS)])
        found.append((column @ rows) ** 2 / (column @ column))
    return np.array(found)


def test_an_effect_of_one_limit_is_found_nine_times_out_of_ten() -> None:
    effect, free = _columns()
    oracle = Oracle(NOISE).with_free_columns([free[..., None]])
    limit = 1 / oracle.multiple([effect])
    critical = chi2.isf(ORACLE.family_wise_level / candidate_count(JOINTS), 1)
    assert np.mean(_statistics(limit, NOISE) > critical) == pytest.approx(0.9, abs=0.04)
    assert np.mean(_statistics(2 * limit, NOISE) > critical) > 0.995


def test_the_oracle_rarely_finds_what_is_not_there() -> None:
    assert np.mean(_statistics(0.0, NOISE) > chi2.isf(0.05, 1)) == pytest.approx(0.05, abs=0.03)


def test_whitened_noise_is_white_with_unit_variance() -> None:
    sample = NOISE.sample(np.random.default_rng(1), np.zeros((200_000, JOINTS)), np.arange(200_000) / ORACLE.rate_hz)
    for joint in range(JOINTS):
        white = NOISE.whitened(sample[:, joint], joint, ORACLE.rate_hz)
        assert np.var(white) == pytest.approx(1, abs=0.02)
        for lag in (1, 2, 10, 50):
            assert abs(np.mean(white[lag:] * white[:-lag])) < 0.01


def test_a_free_column_equal_to_the_effect_leaves_nothing_to_find() -> None:
    effect, _ = _columns()
    assert Oracle(NOISE).with_free_columns([effect[..., None]]).multiple([effect]) < 1e-6


def test_noncentrality_grows_with_the_library() -> None:
    assert limit_noncentrality(2) < limit_noncentrality(7)


def test_multiples_grow_in_proportion_to_the_effect() -> None:
    small = case(Viscous(1, 0.05, 9.0, "linear", {"phase": 0.0}))
    large = case(Viscous(1, 0.2, 9.0, "linear", {"phase": 0.0}))
    assert large.multiples[0] == pytest.approx(4 * small.multiples[0], rel=0.03)


def test_friction_and_links_off_hide_a_rotor_in_the_realistic_tier() -> None:
    rotor = Rotor(1, 0.05, 1.0, "armature")
    assert case(rotor).multiples[0] > 5
    assert case(rotor, tier="realistic").multiples[0] < 0.01


def test_noise_is_some_tenths_of_a_per_cent_of_the_rating() -> None:
    rating = np.array([60.0, 10.0])
    for seed in range(50):
        noise = draw_noise(np.random.default_rng(seed), "coloured", rating, True)
        assert np.all((noise.level > 0.0014 * rating) & (noise.level < 0.0041 * rating))


def test_where_a_joint_stands_still_its_torque_tells_nothing() -> None:
    effect, free = _columns()
    resting = np.zeros((SAMPLES, JOINTS), dtype=bool)
    resting[500:510, 0] = True
    oracle = Oracle(NOISE, (resting,)).with_free_columns([free[..., None]])
    changed, pulse = effect.copy(), np.zeros((SAMPLES, JOINTS))
    changed[500:510, 0] += 7.0
    pulse[500:510, 0] = 1.0
    assert oracle.multiple([changed]) == pytest.approx(oracle.multiple([effect]))
    assert oracle.multiple([pulse]) == pytest.approx(0.0, abs=1e-9)
    assert oracle.multiple([effect]) < Oracle(NOISE).with_free_columns([free[..., None]]).multiple([effect])
