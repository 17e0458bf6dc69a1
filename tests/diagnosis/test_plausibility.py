"""Numbers that no engineer believes, and intervals that say nothing, are no findings."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from armlab.diagnosis.torque.evidence.plausibility import reason_implausible
from armlab.diagnosis.tuning import PlausibilityTuning
from armlab.effects.contract import Candidate
from armlab.effects.friction import ViscousFriction
from armlab.effects.memory import ViscousDrift
from armlab.effects.parameters import Interval, ParameterValue
from armlab.effects.springs import TorqueRipple
from armlab.effects.timing import TimeDelay, TorqueSkew
from problem.robot_file import load_arm

ARM = load_arm("staubli-tx40")


@dataclass(frozen=True)
class RunStandIn:
    rate_hz: float = 1000.0


@dataclass(frozen=True)
class SignalsStandIn:
    run: RunStandIn = RunStandIn()


@dataclass(frozen=True)
class ObservedStandIn:
    """A recording at 1 kHz."""

    signals: tuple[SignalsStandIn, ...] = (SignalsStandIn(),)


def reason(candidate: Candidate, *values: tuple[str, float, Interval], exact: bool = False) -> str | None:
    named = tuple(ParameterValue(name, value, interval, "") for name, value, interval in values)
    observed: Any = ObservedStandIn()
    return reason_implausible(candidate, named, observed, exact=exact, tuning=PlausibilityTuning())


def test_a_coefficient_that_may_be_zero_is_no_finding() -> None:
    assert "may be zero" in str(reason(ViscousFriction.at(ARM, 1), ("coefficient", 0.9, (-0.45, 2.24))))


def test_a_coefficient_that_is_known_is_a_finding() -> None:
    assert reason(ViscousFriction.at(ARM, 1), ("coefficient", 0.9, (0.7, 1.1))) is None


def test_friction_does_not_warm_within_seconds() -> None:
    drift = ViscousDrift.at(ARM, 1, shape=(3.0,))
    assert "not plausible" in str(reason(drift, ("time_constant", 3.0, (2.0, 4.0))))
    assert reason(drift, ("time_constant", 600.0, (400.0, 800.0))) is None


@pytest.mark.parametrize("shift", [TimeDelay.at(ARM, 1), TorqueSkew.at(ARM, 2)])
def test_a_shift_below_one_sampling_interval_is_a_finding_of_a_model_alone_that_leaves_nothing(
    shift: Candidate,
) -> None:
    short = ("seconds", 0.0006, (0.0005, 0.0007))
    assert "sampling interval" in str(reason(shift, short))
    assert reason(shift, short, exact=True) is None
    assert reason(shift, ("seconds", 0.004, (0.003, 0.005))) is None


def test_the_torque_of_all_joints_does_not_lead_but_a_channel_may() -> None:
    early = ("seconds", -0.006, (-0.007, -0.005))
    assert "may be zero" in str(reason(TimeDelay.at(ARM, 1), early))
    assert "should be positive" in str(TimeDelay.at(ARM, 1, shape=(0.001,)).objection(np.array([-0.006])))
    assert reason(TorqueSkew.at(ARM, 2), early) is None


def test_a_drift_is_known_though_its_time_constant_is_not() -> None:
    drift = ViscousDrift.at(ARM, 1, shape=(600.0,))
    assert reason(drift, ("time_constant", 600.0, (-50.0, 2000.0)), ("final", 3.0, (-40.0, 50.0))) is None


def test_a_wave_of_unknown_phase_is_no_finding() -> None:
    ripple = TorqueRipple.at(ARM, 1, shape=(30.0,))
    assert "wider" in str(reason(ripple, ("order", 30.0, (29.9, 30.1)), ("phase", 0.0, (-3.0, 3.0))))
    assert reason(ripple, ("order", 30.0, (29.9, 30.1)), ("phase", 0.0, (-0.1, 0.1))) is None
