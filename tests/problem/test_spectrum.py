"""Both ends of the spectrum of an observation matrix, beside numpy, and when the Gram matrix is not trusted."""

from unittest.mock import Mock

import numpy as np
import pytest
from random_arms import random_arm, random_motion

import problem.spectrum
from armlab.common.arrays import Array
from problem.arm import Arm
from problem.base_parameters import base_parameters
from problem.motion import Motion
from problem.regressor import observation_matrix
from problem.robot_file import built_in_arms, load_arm
from problem.spectrum import MAX_COLUMNS, MAX_GRAM_CONDITION, Spectrum, find_spectrum, spectra_of_gram_matrices

ARM = load_arm("irb120-arm")
COLUMNS = base_parameters(ARM).columns


def test_condition_number_is_infinite_where_nothing_moves() -> None:
    assert Spectrum.of(np.zeros((1, 3))).condition_number.tolist() == [np.inf]


@pytest.mark.parametrize("unit_columns", [False, True])
def test_the_spectrum_is_that_of_the_observation_matrix(unit_columns: bool) -> None:
    motion = random_motion(3, 40, batch=(5,))
    spectrum = find_spectrum(ARM, motion, COLUMNS, unit_columns)
    for one in range(5):
        matrix = observation_matrix(ARM, motion.select(np.intp(one)))[:, COLUMNS]
        if unit_columns:
            matrix = matrix / np.linalg.norm(matrix, axis=0)
        values = np.linalg.svd(matrix, compute_uv=False)
        assert spectrum.smallest[one] == pytest.approx(values[-1], rel=1e-9)
        assert spectrum.largest[one] == pytest.approx(values[0], rel=1e-12)
        assert spectrum.mean_logarithm[one] == pytest.approx(np.log(values).mean(), rel=1e-9)


def nearly_singular(size: float) -> Motion:
    """States that differ from one another by little."""
    motion = random_motion(3, 60, batch=(1,))
    parts = (motion.position, motion.velocity, motion.acceleration)
    return Motion(*(part[:, :1] + size * (part - part[:, :1]) for part in parts))


@pytest.mark.parametrize("unit_columns", [False, True])
def test_a_nearly_singular_motion_takes_the_exact_route_and_agrees_with_numpy(
    unit_columns: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    motion = nearly_singular(1e-3)
    exactly = Mock(side_effect=problem.spectrum._singular_values)
    monkeypatch.setattr("problem.spectrum._singular_values", exactly)
    condition = find_spectrum(ARM, motion, COLUMNS, unit_columns).condition_number[0]
    matrix = observation_matrix(ARM, motion.select(np.intp(0)))[:, COLUMNS]
    if unit_columns:
        matrix = matrix / np.linalg.norm(matrix, axis=0)
    exactly.assert_called_once()
    assert condition > MAX_GRAM_CONDITION
    assert condition == pytest.approx(np.linalg.cond(matrix), rel=1e-6)


@pytest.mark.parametrize("size", [1.0, 0.5, 0.2, 0.1, 0.05, 0.02])
def test_the_condition_number_is_numpys_to_1e_7_on_either_route(size: float) -> None:
    motion = nearly_singular(size)
    condition = find_spectrum(ARM, motion, COLUMNS, False).condition_number[0]
    exact = np.linalg.cond(observation_matrix(ARM, motion.select(np.intp(0)))[:, COLUMNS])
    assert condition == pytest.approx(exact, rel=1e-7)


def test_a_column_without_any_excitation_has_no_unit_length_but_an_infinite_condition() -> None:
    still = Motion(*np.zeros((3, 1, 20, 3)))
    assert find_spectrum(ARM, still, COLUMNS, True).condition_number[0] == np.inf


def arms_of_every_kind() -> list[Arm]:
    """The built-in arms, and random ones of two to seven joints of both kinds: 48."""
    rng = np.random.default_rng(0)
    own = [load_arm(name) for name in built_in_arms()]
    kinds = ("".join(rng.choice(list("RRRP"), size=2 + number % 6)) for number in range(48 - len(own)))
    return own + [random_arm(letters, number) for number, letters in enumerate(kinds)]


def test_the_condition_numbers_of_10_000_trajectories_of_48_arms_are_numpys_near_singular_ones_too() -> None:
    conditions: list[float] = []
    for seed, arm in enumerate(arms_of_every_kind()):
        columns = base_parameters(arm).columns
        samples = 2 * len(columns) // len(arm) + 3
        size = 10.0 ** np.random.default_rng(seed).uniform(-4, 1, (209, 1, 1))
        wide = random_motion(len(arm), samples, seed, (209,))
        parts = (wide.position, wide.velocity, wide.acceleration)
        motion = Motion(*(part[:, :1] + np.minimum(size, 1.0) * (part - part[:, :1]) for part in parts))
        values = np.linalg.svd(observation_matrix(arm, motion)[..., columns], compute_uv=False)
        expected = values[:, 0] / values[:, -1]
        found = find_spectrum(arm, motion, columns, False).condition_number
        tolerance = 4 * np.finfo(float).eps * (len(columns) + np.minimum(expected, MAX_GRAM_CONDITION) ** 2)
        assert np.all(np.abs(found / expected - 1) <= tolerance), arm.name
        conditions += expected.tolist()
    assert len(conditions) > 10_000
    assert np.mean(np.array(conditions) > MAX_GRAM_CONDITION) > 0.1


def gram_matrix_of(singular_values: Array, seed: int) -> Array:
    """A Gram matrix (n, n) with given singular values (n,)."""
    rotation = np.linalg.qr(np.random.default_rng(seed).normal(size=(len(singular_values),) * 2))[0]
    gram: Array = (rotation * singular_values**2) @ rotation.T
    return np.asarray((gram + gram.T) / 2)


@pytest.mark.parametrize("size", [1, 2, 3, 15, 60, 208])
def test_the_ends_and_the_mean_are_those_of_the_given_singular_values(size: int) -> None:
    values = np.sort(np.exp(np.random.default_rng(size).uniform(-2, 2, (6, size))), axis=1)
    found, unknown = spectra_of_gram_matrices(np.stack([gram_matrix_of(row, size) for row in values]))
    assert unknown == 0
    np.testing.assert_allclose(found.smallest, values[:, 0], rtol=1e-12)
    np.testing.assert_allclose(found.largest, values[:, -1], rtol=1e-14 * size)
    np.testing.assert_allclose(found.condition_number, values[:, -1] / values[:, 0], rtol=1e-12)
    np.testing.assert_allclose(found.mean_logarithm, np.log(values).mean(axis=1), rtol=0, atol=1e-12)


@pytest.mark.parametrize("equal", [2, 5, 20, 39, 40])
def test_singular_values_that_meet_at_either_end_are_found(equal: int) -> None:
    low, high = np.linspace(1, 30, 40), np.linspace(1, 30, 40)
    low[:equal], high[-equal:] = 1, 30
    found, _ = spectra_of_gram_matrices(np.stack([gram_matrix_of(values, 3) for values in (low, high)]))
    np.testing.assert_allclose(found[:2], [[1, 1 if equal < 40 else 30], [30 if equal < 40 else 1, 30]], rtol=1e-12)


def test_the_spectrum_of_a_diagonal_matrix_is_its_diagonal() -> None:
    found, _ = spectra_of_gram_matrices(np.diag([4.0, 1.0, 9.0, 16.0])[None])
    assert [part[0] for part in found] == pytest.approx([1.0, 4.0, 4.0, np.log(24) / 4], rel=1e-15)


@pytest.mark.parametrize("power", [-900, -300, 300, 900])
def test_a_power_of_two_scales_the_ends_and_changes_no_other_bit(power: int) -> None:
    gram = gram_matrix_of(np.linspace(1, 30, 12), 0)[None]
    (plain, _), (scaled, _) = spectra_of_gram_matrices(gram), spectra_of_gram_matrices(np.ldexp(gram, power))
    assert np.array_equal(np.ldexp(plain[:2], power // 2), scaled[:2])
    assert plain.condition_number == scaled.condition_number
    np.testing.assert_allclose(scaled.mean_logarithm - plain.mean_logarithm, power / 2 * np.log(2), rtol=1e-12)


@pytest.mark.parametrize(
    "bad",
    [
        np.zeros((3, 3)),
        -np.eye(3),
        np.diag([1.0, 1.0, -1e-9]),
        np.diag([1.0, 1.0, 0.99 / MAX_GRAM_CONDITION**2]),
        np.full((3, 3), np.nan),
        np.full((3, 3), np.inf),
    ],
)
def test_a_matrix_that_is_not_definite_enough_has_no_spectrum_and_spoils_no_other(bad: Array) -> None:
    good = np.stack([gram_matrix_of(np.array([1.0, 2.0, 3.0]), seed) for seed in range(6)])
    expected, _ = spectra_of_gram_matrices(good)
    spoilt = good.copy()
    spoilt[2] = bad
    found, unknown = spectra_of_gram_matrices(spoilt)
    assert unknown == 1
    others = np.arange(6) != 2
    for part, whole in zip(found, expected, strict=True):
        assert np.isnan(part[2])
        assert np.array_equal(part[others], whole[others])


@pytest.mark.parametrize("columns", [0, MAX_COLUMNS + 1])
def test_a_matrix_without_columns_or_with_too_many_is_refused(columns: int) -> None:
    with pytest.raises(ValueError, match=f"should have 1 to 208 columns, not {columns}"):
        spectra_of_gram_matrices(np.ones((1, columns, columns)))


@pytest.mark.parametrize("cut", range(1, 7))
def test_any_split_of_a_population_gives_the_same_bits(cut: int) -> None:
    gram = np.stack([gram_matrix_of(np.linspace(1, 9 + seed, 7), seed) for seed in range(7)])
    parts = [np.stack(spectra_of_gram_matrices(part)[0]) for part in (gram[:cut], gram[cut:])]
    assert np.array_equal(np.concatenate(parts, axis=1), np.stack(spectra_of_gram_matrices(gram)[0]))
