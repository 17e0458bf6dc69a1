"""A recording with nothing hidden shows nothing: the first trap of a truth machine is an apparent delay."""

from dataclasses import replace

import numpy as np
import pytest
from hidden_cases import case

from armlab.proof.blind.arms import make_machine
from armlab.proof.blind.case_files import log_run
from armlab.proof.blind.effects.friction import Viscous
from armlab.proof.blind.plan import RunPlan, draw_plan
from armlab.proof.blind.simulate import rigid_torque
from armlab.proof.blind.sizing import SimulatedCase, simulate_case
from armlab.recordings.differentiate import Signals, differentiate
from armlab.recordings.recording import Run
from problem.motion import Motion

FIFTH = 0.2


def _signals(made: SimulatedCase, number: int, cutoff_hz: float = 40.0) -> Signals:
    log = log_run(made, number, noisy=False)
    return differentiate(Run("run", "identify", log.time, log.position, log.torque), cutoff_hz=cutoff_hz)


@pytest.mark.parametrize("name", ["irb120-arm", "irb120", "panda", "scara"])
def test_without_noise_less_than_a_fifth_of_the_noise_is_left(name: str) -> None:
    made = make_machine(name)
    drawn = draw_plan(1004, 0, "clean", True, True)
    runs = tuple(RunPlan(family, 5.0, "identify") for family in ("chirp", "creeping", "point-to-point"))
    level = 0.0015 * made.rating  # the least that is ever drawn
    quiet = replace(drawn.noise, white=level, coloured=0.1 * level)
    result = simulate_case(replace(drawn, machine=made, true_arm=made.arm, runs=runs, rate_hz=250, noise=quiet), ())
    for number in range(len(runs)):
        signals = _signals(result, number)
        left = signals.torque - signals.filter(rigid_torque(made.arm, signals.motion))
        assert np.all(np.sqrt(np.mean(left**2, axis=0)) < FIFTH * level)


@pytest.mark.parametrize("rate_hz", [250, 1000])
def test_nothing_hidden_leaves_no_apparent_delay(rate_hz: int) -> None:
    made = case(rate_hz=rate_hz)
    signals = _signals(made, 0)
    nominal = rigid_torque(made.plan.machine.arm, signals.motion)
    slope = signals.filter(np.gradient(nominal, signals.run.time, axis=0))
    left = signals.torque - signals.filter(nominal)
    assert abs(np.sum(left * slope) / np.sum(slope**2)) < 2e-5  # s


def test_recorded_positions_are_rounded_to_the_encoder_and_torques_are_not_late() -> None:
    made = case()
    true, read = log_run(made, 0, noisy=False), log_run(made, 0)
    assert 0 < np.abs(read.position - true.position).max() < 2e-4
    lags = [
        np.sum(np.roll(read.torque - read.torque.mean(0), -lag, 0) * (true.torque - true.torque.mean(0)))
        for lag in (-1, 0, 1)
    ]
    assert np.argmax(lags) == 1


def test_a_seed_gives_the_same_run_again() -> None:
    first, second = log_run(case(), 0), log_run(case(), 0)
    np.testing.assert_array_equal(first.torque, second.torque)
    np.testing.assert_array_equal(first.position, second.position)


def test_viscous_friction_is_not_late() -> None:
    made = case(Viscous(1, 8.0, 99.0, "linear", {"phase": 0.0}))
    log = log_run(made, 0, noisy=False)
    velocity = np.gradient(log.position, 1 / made.plan.rate_hz, axis=0)
    acceleration = np.gradient(velocity, 1 / made.plan.rate_hz, axis=0)
    motion = Motion(log.position, velocity, acceleration)
    left = (log.torque - rigid_torque(made.plan.machine.arm, motion))[5:-5, 1] - 8.0 * velocity[5:-5, 1]
    lag = -np.sum(left * acceleration[5:-5, 1]) / np.sum(acceleration[5:-5, 1] ** 2) / 8.0
    assert abs(lag) < 2e-5  # s
