"""Linear filters beside those of scipy."""

import numpy as np
import pytest
from scipy.signal import bilinear, butter, lfilter, sosfilt, sosfiltfilt

from armlab.common.linear_filter import LinearFilter

NOISE = np.random.default_rng(3).normal(size=(400, 11)).cumsum(axis=0)


@pytest.mark.parametrize(("order", "cutoff_hz"), [(2, 7.0), (4, 3.0), (4, 90.0), (8, 20.0)])
def test_butterworth_is_that_of_scipy(order: int, cutoff_hz: float) -> None:
    sections = butter(order, cutoff_hz, fs=200.0, output="sos")
    ours = LinearFilter.butterworth(order, cutoff_hz, 200.0)
    scale = np.abs(NOISE).max()
    np.testing.assert_allclose(ours.forwards(NOISE[:, 0]), sosfilt(sections, NOISE[:, 0]), rtol=0, atol=1e-12 * scale)
    theirs = sosfiltfilt(sections, NOISE, axis=0, padlen=30)
    np.testing.assert_allclose(ours.both_ways(NOISE, 30), theirs, rtol=0, atol=1e-11 * scale)


@pytest.mark.parametrize("columns", range(1, 12))
def test_columns_are_the_same_to_the_bit_in_any_company(columns: int) -> None:
    low_pass = LinearFilter.butterworth(4, 5.0, 200.0)
    alone = np.column_stack([low_pass.both_ways(each, 20) for each in NOISE.T[:columns]])
    np.testing.assert_array_equal(low_pass.both_ways(NOISE[:, :columns], 20), alone)


@pytest.mark.parametrize("rows", [slice(0, 400), slice(17, 390, 4), slice(3, None, 400), slice(5, 5)])
def test_rows_are_those_of_the_whole(rows: slice) -> None:
    low_pass = LinearFilter.butterworth(4, 5.0, 200.0)
    np.testing.assert_array_equal(low_pass.both_ways(NOISE, 20, rows), low_pass.both_ways(NOISE, 20)[rows])


def test_rows_are_in_ascending_order() -> None:
    with pytest.raises(ValueError, match="ascending"):
        LinearFilter.butterworth(4, 5.0, 200.0).both_ways(NOISE, 20, slice(None, None, -1))


@pytest.mark.parametrize("shape", [(400,), (400, 3), (400, 3, 2)])
def test_a_signal_keeps_its_shape_and_what_is_constant_its_level(shape: tuple[int, ...]) -> None:
    level = LinearFilter.butterworth(4, 5.0, 200.0).both_ways(np.full(shape, 3.0), 20)
    np.testing.assert_allclose(level, np.full(shape, 3.0), rtol=1e-12)


def test_a_padding_that_the_signal_does_not_have_is_refused() -> None:
    with pytest.raises(ValueError, match="padding of 400 samples"):
        LinearFilter.butterworth(4, 5.0, 200.0).both_ways(NOISE, 400)


def test_a_lag_is_that_of_scipy_and_starts_where_it_is_told() -> None:
    keep, signal = 0.9, NOISE[:, 0]
    theirs, _ = lfilter([1 - keep], [1, -keep], signal, zi=[keep * signal[0]])
    lag = LinearFilter.first_order_lag(keep)
    np.testing.assert_allclose(lag.forwards(signal, lag.settled * signal[0]), theirs, rtol=0, atol=1e-12)


@pytest.mark.parametrize("above", [(0.0, 0.0, 9.0), (0.0, 3.0, 0.0), (1.0, 0.2, 0.5)])
def test_a_transfer_function_is_that_of_scipy(above: tuple[float, ...]) -> None:
    below = (1.0, 0.4, 9.0)
    taps = bilinear(np.trim_zeros(above, "f"), below, 50.0)
    ours = LinearFilter.bilinear(above, below, 50.0).forwards(NOISE[:, 0])
    np.testing.assert_allclose(ours, lfilter(*taps, NOISE[:, 0]), rtol=0, atol=1e-10)


def test_a_settled_filter_keeps_a_constant() -> None:
    low_pass = LinearFilter.butterworth(8, 5.0, 200.0)
    np.testing.assert_allclose(low_pass.forwards(np.full(50, 3.0), 3.0 * low_pass.settled), 3.0, rtol=1e-9)


def test_more_sections_than_the_kernel_has_are_refused() -> None:
    with pytest.raises(ValueError, match="at most 4 sections"):
        LinearFilter.butterworth(10, 5.0, 200.0)
