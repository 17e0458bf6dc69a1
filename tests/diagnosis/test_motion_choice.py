"""Choices between servos: starts of a limit, and damping in the joint or in the drive."""

from dataclasses import replace

import numpy as np
import pytest

from armlab.diagnosis.motion.choose import (
    ChosenServo,
    GainOfNumber,
    chance_of_gain,
    chance_of_match,
    first_guesses,
)
from armlab.diagnosis.motion.estimate import ServoFit
from armlab.diagnosis.motion.joint_replay import replay_joint
from armlab.diagnosis.motion.servo import HIGHEST, KEYS, LOWEST, NEUTRAL, USUAL, Key, place
from armlab.diagnosis.motion.windows import Windows, phase_of_steps, smallest_step, supply_factor
from armlab.recordings.recording import MotionRun

GAIN = GainOfNumber(share=0.5, enough=0.02, p_value=1e-6, rms_without=2e-3, rms_with=1e-3)


def numbers(**values: float) -> np.ndarray:
    out = NEUTRAL.copy()
    for key, value in values.items():
        out[KEYS.index(key)] = value
    return out


def chosen_servo(nominal: np.ndarray, *named: Key, **fitted: float) -> ChosenServo:
    """A servo whose numbers are those of the simulation but for the fitted ones."""
    values = nominal.copy()
    for key, value in fitted.items():
        values[KEYS.index(key)] = value
    fit = ServoFit(values, np.array(USUAL), lambda: np.eye(sum(USUAL)) * 1e-4, 1e-3, 1e-4, 24, np.zeros(1))
    none = np.zeros(0, dtype=np.intp)
    return ChosenServo(nominal, fit, fit.free, {place(key): GAIN for key in named}, none, cost=0.0)


def test_a_change_of_damping_goes_into_the_drive_as_a_whole() -> None:
    nominal = numbers(kp=8.0, kd=0.3, damping=0.1, friction=0.05)
    inside = chosen_servo(nominal, "damping", damping=0.25).with_damping_inside()
    assert inside is not None
    assert inside.fit.values[[place("kd"), place("damping")]] == pytest.approx([0.45, 0.1])
    assert inside.with_damping_inside() is None


def test_damping_stays_where_it_is_without_a_change_and_where_kd_would_be_negative() -> None:
    nominal = numbers(kp=8.0, kd=0.1, damping=0.3, friction=0.05)
    assert chosen_servo(nominal, damping=0.35).with_damping_inside() is None
    assert chosen_servo(nominal, "damping", damping=0.1).with_damping_inside() is None


def test_damping_is_told_beside_the_kd_that_is_stated_where_no_other_kd_was_found() -> None:
    both, nominal = [place("kd"), place("damping")], numbers(kp=20.0, kd=0.5)
    outside = chosen_servo(nominal, "damping", kd=0.01, damping=1.26)
    assert outside.beside_kd(0.5)[both] == pytest.approx([0.5, 0.77])
    inside = chosen_servo(nominal, "damping", kd=1.27, damping=0.0)
    assert inside.beside_kd(0.5)[both] == pytest.approx([1.27, 0.0])
    assert chosen_servo(nominal, "kd", kd=0.01, damping=1.26).beside_kd(0.5)[both] == pytest.approx([0.01, 1.26])
    limited = chosen_servo(numbers(kp=20.0, kd=0.5, limit=3.0), "damping", kd=0.01, damping=1.26)  # another servo
    assert limited.beside_kd(0.5)[both] == pytest.approx([0.01, 1.26])
    weak = chosen_servo(nominal, "damping", kd=0.0, damping=0.4)  # the joint cannot drive itself
    assert weak.beside_kd(0.5)[both] == pytest.approx([0.0, 0.4])


def test_named_numbers_alone_differ_from_the_simulation() -> None:
    values, free = chosen_servo(numbers(kp=8.0, friction=0.05), "friction", kp=9.0, friction=0.08).named
    assert values[[place("kp"), place("friction")]] == pytest.approx([8.0, 0.08])
    assert [KEYS[each] for each in np.flatnonzero(free)] == ["friction"]


def test_a_fit_of_a_torque_limit_starts_below_that_of_the_simulation(still: Windows) -> None:
    known = numbers(kp=20.0, limit=3.0)
    assert [each[place("limit")] for each in first_guesses(still, known, place("limit"))] == pytest.approx(
        [0.6, 1.2, 1.8, 2.25, 2.7]
    )
    weak = replace(still, measured=still.measured + 0.95)
    reached = [each[place("limit")] for each in first_guesses(weak, known, place("limit"))]
    assert reached == pytest.approx([0.2, 0.4, 0.6, 0.75, 0.9])


def test_windows_at_rest_do_not_make_a_gain_less_sure() -> None:
    gains = np.arange(1.0, 17.0)
    assert chance_of_gain(np.append(gains, 0.0)) == pytest.approx(2.0**-16)
    assert chance_of_gain(np.zeros(4)) == 1.0


def test_the_matched_filter_sees_what_few_windows_tell_and_not_what_one_tells() -> None:
    rng = np.random.default_rng(3)
    count, samples = 20, 100
    window = np.repeat(np.arange(count), samples)
    noise = rng.normal(0, 1e-3, len(window))
    wave = 4e-3 * np.sin(np.linspace(0, 30, samples))
    assert chance_of_match(window, noise, noise, 1e-3) == 1.0
    change = np.where(window < 3, np.tile(wave, count), 0.0)
    assert chance_of_match(window, noise + change, noise, 1e-3) < 1e-6
    assert chance_of_match(window, noise + np.where(window == 7, change, 0.0), noise, 1e-3) > 0.05
    widened = chance_of_match(window, noise + 0.1 * change, noise, 0.0)  # no encoder: what the law leaves out
    assert chance_of_match(window, noise + 0.1 * change, noise, 1e-3) < widened
    guesses = [change * rng.choice([-1, 1]) for _ in range(200)]  # learned from noise: without relation to the errors
    chances = []
    for guess in guesses:
        errors = rng.permutation(noise)
        chances.append(chance_of_match(window, errors, errors - 0.1 * guess, 1e-3))
    assert np.mean(np.array(chances) < 0.05) < 0.1


def test_the_step_of_an_encoder_is_the_smallest_one_and_its_phase_that_of_the_positions() -> None:
    position = 0.0004 + 0.0015 * np.array([0.0, 1.0, 2.0, 7.0]) + 1e-9 * np.arange(4)
    step = smallest_step(position)
    assert step == pytest.approx(0.0015, rel=1e-5)
    assert phase_of_steps(position, step) == pytest.approx(0.0004, abs=1e-7)
    assert phase_of_steps(position, 0.0) == 0.0


def test_a_drive_that_reads_steps_acts_on_the_nearest_one(still: Windows) -> None:
    step, kp = 0.01, 2.0
    time = 1e-3 * np.arange(60)
    samples = {"begin": np.array([0, 60]), "row": np.arange(60), "fraction": np.zeros(60), "position": np.zeros(60)}
    windows = replace(still, measured=np.zeros((1, 60)), encoder_step=step, **samples)
    values = numbers(kp=kp, offset=0.3 * step)
    moved = replay_joint(windows, values, reads_steps=True)[0]
    expected = 0.5 * kp * 0.3 * step / 0.1 * time**2  # the torque of the first step, until the next one is nearer
    first = expected < 0.5 * step
    assert first.sum() > 10
    np.testing.assert_allclose(moved[first], expected[first], atol=1e-9)
    shifted = replay_joint(replace(windows, encoder_phase=0.3 * step), values, reads_steps=True)[0]
    np.testing.assert_allclose(shifted, 0.0, atol=1e-12)  # where it reads its command, it rests
    smooth = replay_joint(windows, values)[0]
    assert moved[first][-1] - smooth[first][-1] > 5e-7  # whose torque falls on the way


def test_a_number_that_no_sample_tells_has_no_interval() -> None:
    free = np.array([key in ("kp", "limit") for key in KEYS])
    fit = ServoFit(numbers(kp=8.0, limit=2.0), free, lambda: np.diag([1e-4, 0.0]), 1e-3, 1e-4, 20, np.zeros(1))
    low, high = fit.interval()
    limit, kp = place("limit"), place("kp")
    assert (low[limit], high[limit]) == (LOWEST[limit], HIGHEST[limit])
    assert 7.5 < low[kp] < 8.0 < high[kp] < 8.5


@pytest.fixture
def still() -> Windows:
    """One window of a joint that stands 1 rad from its command."""
    steps, none = 60, np.zeros((1, 60))
    integers = np.zeros(1, dtype=np.int64)
    return Windows(
        step_s=1e-3,
        history=0,
        command=np.zeros((1, steps)),
        inertia=none + 0.1,
        load=none,
        slope=none,
        unit_inertia=none,
        unit_load=none,
        unit_slope=none,
        measured=none - 1.0,
        supply=None,
        first_velocity=np.zeros(1),
        run=integers,
        start=integers,
        path_command=none,
        path_measured=none,
        integral=np.zeros(1),
        begin=np.array([0, 1]),
        row=integers,
        fraction=np.zeros(1),
        position=np.zeros(1),
        encoder_step=0.0,
        encoder_phase=0.0,
    )


def test_a_drive_that_commands_a_voltage_gives_less_torque_as_its_copper_warms() -> None:
    time, zero = np.array([0.0, 1.0]), np.zeros((2, 1))
    run = MotionRun("run.csv", "identify", time, zero, voltage=np.array([[12.0], [6.0]]))
    warm = replace(run, temperature=np.array([[25.0], [77.0]]))
    assert supply_factor(run, 0, time, None) is None
    assert supply_factor(run, 0, time, 12.0) == pytest.approx([1.0, 0.5])
    assert supply_factor(warm, 0, time, 12.0) == pytest.approx([1.0, 0.5 / (1 + 0.003854 * 52)], rel=1e-3)
