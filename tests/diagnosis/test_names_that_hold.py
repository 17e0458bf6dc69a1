"""When what is left is the form of a law, and what was no push."""

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from armlab.common.arrays import Array
from armlab.diagnosis.torque.evidence.evidence import Evidence
from armlab.diagnosis.torque.evidence.pushes import Stretch, reason_no_contact
from armlab.diagnosis.torque.evidence.unknown import is_form_error
from armlab.diagnosis.torque.search.surrogate import Structure
from armlab.diagnosis.tuning import Tuning

TUNING = Tuning()


def _evidence(gain: float, joint: int = 1, usual: bool = False) -> Evidence:
    return Evidence(joint, 1e-9, 1e-9, gain, 1e-9, gain, 1.0, 0.5, 100.0, usual=usual)


def _left(gain: float, joint: int = 1, p_value: float = 1e-9) -> Structure:
    return Structure(joint, gain, p_value, gain, gain, np.zeros(3), ("velocity_2",))


def test_what_a_named_law_leaves_of_itself_is_no_finding() -> None:
    assert is_form_error(_left(0.4), {4: _evidence(5.0)}, TUNING.unknown)
    assert not is_form_error(_left(0.4), {4: _evidence(1.0)}, TUNING.unknown)
    assert not is_form_error(_left(0.4), {4: _evidence(5.0, usual=True)}, TUNING.unknown)
    assert not is_form_error(_left(0.4), {4: _evidence(5.0, joint=0)}, TUNING.unknown)


RATE_HZ = 200.0
TIME = np.arange(0, 20, 1 / RATE_HZ)
LOW_PASS = butter(4, 20.0, fs=RATE_HZ, output="sos")


def _filtered(columns: Array) -> Array:
    return np.asarray(sosfiltfilt(LOW_PASS, columns, axis=0)[::4])


def _half_sine(start: float, end: float) -> Array:
    return np.where((start < TIME) & (end > TIME), np.sin(np.pi * (TIME - start) / (end - start)), 0.0)


def _box(start: float, end: float) -> Array:
    return np.where((start < TIME) & (end > TIME), 1.0, 0.0)


def _reason(window: Array, acts: Array, position: Array, torque: Array, unsettled_s: float = 0.0) -> str | None:
    """What speaks against a push in a window where `acts` is what acts, 3 N m at its peak, in noise of 0.1 N m."""
    moving = np.full(len(TIME), True)
    stretch = Stretch(window, position, np.cos(TIME), torque, moving, unsettled_s > TIME, RATE_HZ, _filtered)
    measured = _filtered(3.0 * acts[:, None])[:, 0]

    def explained(columns: Array) -> float:
        return float(measured @ columns @ np.linalg.lstsq(columns, measured)[0]) / (2 * 0.1**2)

    def lead(law: Array) -> float:
        return explained(_filtered(window[:, None])) - explained(law)

    return reason_no_contact(stretch, lead, TUNING)


def _beyond(start: float, end: float) -> Array:
    """A state that goes beyond all else between two instants, as far before their middle as after it."""
    return np.where((start < TIME) & (end > TIME), 1 + _half_sine(start, end) ** 2, np.sin(TIME))


def test_a_push_in_a_state_that_came_often_is_one() -> None:
    push = _half_sine(5, 6)
    assert _reason(push, push, np.sin(TIME), np.sin(2 * TIME)) is None


@pytest.mark.parametrize("where", ["position", "torque"])
def test_a_push_at_an_end_of_the_range_that_was_reached_once_is_one_if_no_law_of_that_end_fits(where: str) -> None:
    push, once = _half_sine(4.6, 6.0), _beyond(5.2, 6.0)
    states = (once, np.sin(TIME)) if where == "position" else (np.sin(TIME), once)
    assert _reason(push, push, *states) is None
    assert _reason(push, (once - 1) * _box(5.2, 6.0), *states) == f"no other stretch has such a {where}"


@pytest.mark.parametrize("power", [0, 1, 2])
def test_a_law_of_what_is_beyond_all_other_stretches_is_no_push(power: int) -> None:
    once = _beyond(5.0, 6.0)
    law = (once - 1) ** power * _box(5.0, 6.0)
    for window in (_half_sine(5.0, 6.0), _box(5.0, 6.0)):
        assert _reason(window, law, once, np.sin(TIME)) == "no other stretch has such a position"


def test_a_push_that_never_ends_is_none() -> None:
    assert _reason(np.ones(len(TIME)), _half_sine(5, 6), np.sin(TIME), TIME) == "it goes on all the time"


def test_a_short_push_is_a_reversal() -> None:
    short = _box(5.0, 5.1)
    assert _reason(short, short, np.sin(TIME), np.sin(TIME)) == "the joint hardly moves during it"


def test_a_push_before_friction_with_a_memory_has_settled_is_none() -> None:
    push, often = _half_sine(1.0, 2.0), (np.sin(TIME), np.sin(2 * TIME))
    assert _reason(push, push, *often, unsettled_s=3.0) == "the friction of the joint may have been bent before"
    assert _reason(push, push, *often, unsettled_s=1.2) is None
