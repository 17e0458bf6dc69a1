"""An oracle with recorded positions: the noise of encoders, and what it hides."""

import numpy as np
import pytest
from hidden_cases import case, plan
from scipy.signal import welch

from armlab.common.arrays import Array
from armlab.proof.blind.case_files import encoder_steps
from armlab.proof.blind.effects.friction import Viscous
from armlab.proof.blind.effects.hidden import HiddenEffect
from armlab.proof.blind.effects.springs import Ripple
from armlab.proof.blind.encoder_noise import EncoderNoise, encoder_noise, whiten_with_encoders, whitening_filter
from armlab.proof.blind.naming_oracle import OracleAnswer, ask_oracle
from armlab.proof.blind.noise import Noise
from armlab.proof.blind.simulate import rigid_torque
from armlab.proof.blind.sizing import ORACLE, SimulatedCase
from problem.motion import Motion


def _ask(made: SimulatedCase) -> OracleAnswer:
    (answer,) = ask_oracle(made, 0.0)
    return answer


def test_noise_of_torque_and_encoders_is_white_after_the_filter() -> None:
    noise = Noise("coloured", np.array([0.05, 0.1]), np.array([0.08, 0.02]), 4.0)
    rate, samples = ORACLE.rate_hz, 100_000
    encoders = EncoderNoise(np.array([[1.2, 0.3], [0.3, 0.4]]), np.array([2e-5, 5e-5]), rate)
    rng = np.random.default_rng(0)
    torque = noise.sample(rng, np.zeros((samples, 2)), np.arange(samples) / rate)
    rounding = encoders.step / np.sqrt(12) * rng.standard_normal((samples, 2))
    frequency = np.fft.rfftfreq(samples, 1 / rate)
    bent = np.fft.irfft(-((2 * np.pi * frequency[:, None]) ** 2) * np.fft.rfft(rounding, axis=0), samples, axis=0)
    whitening = whitening_filter(samples, noise, encoders, rate)
    white = whiten_with_encoders((torque + bent @ encoders.inertia.T)[..., None], whitening)[..., 0]
    assert np.cov(white.T) == pytest.approx(np.eye(2), abs=0.02)
    power = welch(white, rate, nperseg=1000, axis=0)[1] * rate / 2
    assert power[5:-5] == pytest.approx(np.ones_like(power[5:-5]), abs=0.4)


def test_rounded_positions_put_the_stated_noise_into_the_predicted_torque() -> None:
    """Rounded positions of a run, differentiated, between 20 and 60 Hz."""
    made = case(rate_hz=500)
    track, rate, step = made.tracks[0], made.plan.rate_hz, encoder_steps(made.plan, 0)
    sampled = track.at(np.arange(0, 5, 1 / rate))
    off = np.rint(sampled.position / step) * step - sampled.position
    frequency = np.fft.rfftfreq(len(off), 1 / rate)
    bent = np.fft.irfft(-((2 * np.pi * frequency[:, None]) ** 2) * np.fft.rfft(off, axis=0), len(off), axis=0)
    arm = made.plan.machine.arm
    moved = rigid_torque(arm, Motion(sampled.position, sampled.velocity, sampled.acceleration + bent))
    induced = moved - rigid_torque(arm, Motion(sampled.position, sampled.velocity, sampled.acceleration))
    heard, power = welch(induced, rate, nperseg=250, axis=0)
    band = (heard > 20) & (heard < 60)
    stated = encoder_noise(arm, track, step, rate).power(heard[band], rate)
    for joint in range(made.plan.machine.joints):
        ratio = power[band, joint] * rate / 2 / stated[:, joint, joint]
        assert np.mean(ratio) == pytest.approx(1, abs=0.3)


def _answers(step_bits: int, monkeypatch: pytest.MonkeyPatch, effect: HiddenEffect) -> OracleAnswer:
    monkeypatch.setattr("armlab.proof.blind.naming_oracle.encoder_steps", lambda *_: _step(step_bits))
    return _ask(case(effect))


def _step(bits: int) -> Array:
    return np.full(plan().machine.joints, 2 * np.pi / 2.0**bits)


def test_encoders_hide_what_is_fast_and_not_what_is_slow(monkeypatch: pytest.MonkeyPatch) -> None:
    slow = Viscous(1, 0.02, 100.0, "linear", {"phase": 0.0})
    fine, coarse = (_answers(bits, monkeypatch, slow) for bits in (40, 14))
    assert fine.multiple_recorded == pytest.approx(fine.multiple, rel=0.05)
    assert coarse.multiple_recorded == pytest.approx(coarse.multiple, rel=0.1)
    fast = Ripple(1, 0.01, 10.0, "sine", {"order": 200.0, "phase": 0.0})
    fine, coarse = (_answers(bits, monkeypatch, fast) for bits in (40, 14))
    assert fine.multiple_recorded == pytest.approx(fine.multiple, rel=0.1)
    assert coarse.multiple_recorded < 0.6 * coarse.multiple
    assert coarse.seen < 0.6 * fine.seen
    assert coarse.right_name < 0.6 * fine.right_name
