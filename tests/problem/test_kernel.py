"""The compiled kernel: Gram matrix, sines, batches, odd sizes and bad input."""

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_arms import random_arm, random_motion

from armlab.common.arrays import Array
from problem.arm import Arm, Joint
from problem.motion import Motion
from problem.regressor import gram_matrix, observation_matrix, rigid_body_torque
from problem.robot_file import load_arm

ARM = random_arm("RRPR", seed=3)
COLUMNS = np.array([5, 12, 20, 23, 29, 30, 31, 39])
RESULTS: tuple[Callable[[Motion], Array], ...] = (
    partial(gram_matrix, ARM, columns=COLUMNS),
    partial(observation_matrix, ARM),
    partial(rigid_body_torque, ARM),
)


@settings(max_examples=30, deadline=None)
@given(samples=st.integers(1, 40), kinds=st.text("RP", min_size=1, max_size=5), seed=st.integers(0, 99))
def test_gram_matrix_is_the_transpose_times_the_chosen_columns(samples: int, kinds: str, seed: int) -> None:
    arm, motion = random_arm(kinds, seed), random_motion(len(kinds), samples, seed, batch=(2,))
    rng = np.random.default_rng(seed)
    columns = np.flatnonzero(rng.uniform(size=10 * len(arm)) < 0.5)
    for one, gram in enumerate(gram_matrix(arm, motion, columns)):
        chosen = observation_matrix(arm, motion.select(np.intp(one)))[:, columns]
        expected = chosen.T @ chosen
        np.testing.assert_allclose(gram, expected, rtol=0, atol=1e-12 * np.abs(expected).max(initial=1.0))


@settings(max_examples=20, deadline=None)
@given(cut=st.integers(0, 7), samples=st.integers(1, 20))
def test_any_split_of_a_batch_gives_the_same_bits(cut: int, samples: int) -> None:
    whole = random_motion(4, samples, batch=(7,))
    first = np.arange(7) < cut
    parts = [[result(whole.select(chosen)) for result in RESULTS] for chosen in (first, ~first)]
    for early, late, together in zip(*parts, [result(whole) for result in RESULTS], strict=True):
        assert np.array_equal(np.concatenate([early, late]), together)


def test_torque_is_the_observation_matrix_times_the_parameters() -> None:
    motion = random_motion(4, 13, batch=(2, 3))
    torque = (observation_matrix(ARM, motion) @ ARM.parameters).reshape(2, 3, 13, 4)
    np.testing.assert_allclose(rigid_body_torque(ARM, motion), torque, rtol=1e-12, atol=1e-9)


def sine_and_cosine(angles: Array) -> tuple[Array, Array]:
    """As the kernel sees them: first moments of a pendulum of unit gravity, tau = sin q mcx + cos q mcy."""
    still = np.eye(4)
    arm = Arm("pendulum", (Joint("j", "revolute", still, still),), gravity=(0.0, -1.0, 0.0))
    zero = np.zeros((len(angles), 1))
    matrix = observation_matrix(arm, Motion(angles[:, None], zero, zero))
    return -matrix[:, 2], matrix[:, 1]


@pytest.mark.parametrize("reach", [1e-9, 1e-3, 0.8, 4.0, 100.0, 1e4])
def test_sine_and_cosine_are_within_two_units_in_the_last_place(reach: float) -> None:
    angles: Array = np.random.default_rng(0).uniform(-reach, reach, 20_000)
    wide = angles.astype(np.longdouble)
    for ours, exact in zip(sine_and_cosine(angles), (np.sin(wide), np.cos(wide)), strict=True):
        error = np.abs(ours - exact) / np.spacing(np.abs(exact.astype(np.float64)))
        assert error.max() <= 2.0


def test_sine_and_cosine_near_multiples_of_a_quarter_turn() -> None:
    angles: Array = np.arange(-2000, 2001) * np.float64(np.pi / 2)
    sine, cosine = sine_and_cosine(angles)
    np.testing.assert_allclose(sine, np.sin(angles), rtol=1e-15, atol=3e-17)
    np.testing.assert_allclose(cosine, np.cos(angles), rtol=1e-15, atol=3e-17)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e300])
def test_a_motion_that_is_not_finite_spoils_only_its_own_trajectory(bad: float) -> None:
    motion = random_motion(4, 9, batch=(3,))
    good = gram_matrix(ARM, motion, COLUMNS)
    motion.position[1, 4, 2] = motion.velocity[1, 4, 2] = bad
    spoilt = gram_matrix(ARM, motion, COLUMNS)
    assert np.array_equal(spoilt[[0, 2]], good[[0, 2]])
    assert not np.all(np.isfinite(spoilt[1]))


def test_more_than_16_joints_are_refused() -> None:
    with pytest.raises(ValueError, match=r"up to 16 joints are supported; 'random-R+' has 17"):
        observation_matrix(random_arm("R" * 17), random_motion(17, 2))


@pytest.mark.parametrize("joints", [2, 4])
def test_a_motion_of_another_number_of_joints_is_refused(joints: int) -> None:
    arm, motion = load_arm("irb120-arm"), random_motion(joints, 5)
    said = f"the motion has {joints} joints, the arm 'irb120-arm' has 3"
    with pytest.raises(ValueError, match=said):
        observation_matrix(arm, motion)
    with pytest.raises(ValueError, match=said):
        gram_matrix(arm, motion, COLUMNS)
    with pytest.raises(ValueError, match=said):
        rigid_body_torque(arm, motion)


@pytest.mark.parametrize("columns", [[3, 2], [2, 2], [-1, 2], [2, 40]])
def test_columns_that_do_not_ascend_or_do_not_exist_are_refused(columns: list[int]) -> None:
    with pytest.raises(ValueError, match="columns should be ascending, from 0 to 39"):
        gram_matrix(ARM, random_motion(4, 5), np.array(columns))


def test_a_wrong_number_of_parameters_is_refused() -> None:
    with pytest.raises(ValueError, match="'random-RRPR' takes 40 parameters"):
        rigid_body_torque(ARM, random_motion(4, 5), np.ones(39))


def test_arrays_of_different_shapes_are_no_motion() -> None:
    with pytest.raises(ValueError, match="three arrays of one shape"):
        Motion(np.zeros((5, 3)), np.zeros((5, 3)), np.zeros((4, 3)))


def test_a_motion_takes_strided_arrays_and_whole_numbers() -> None:
    motion = random_motion(4, 10)
    strided = Motion(*(np.asfortranarray(part) for part in (motion.position, motion.velocity, motion.acceleration)))
    assert np.array_equal(observation_matrix(ARM, strided), observation_matrix(ARM, motion))
    whole = np.ones((2, 4), dtype=int)
    assert np.array_equal(
        observation_matrix(ARM, Motion(whole, whole, whole)), observation_matrix(ARM, Motion(*[np.ones((2, 4))] * 3))
    )
