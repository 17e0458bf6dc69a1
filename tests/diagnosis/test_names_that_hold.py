"""When a name is withdrawn, when what is left is its own form, and what was no push."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, cast

import engine_cases as cases
import numpy as np
import pytest

from armlab.common.arrays import Array
from armlab.diagnosis.data import Observed, Segment
from armlab.diagnosis.diagnose import diagnose
from armlab.diagnosis.evidence import Evidence
from armlab.diagnosis.pushes import Stretch, reason_no_contact
from armlab.diagnosis.surrogate import Structure
from armlab.diagnosis.tuning import Tuning
from armlab.diagnosis.unknown import is_form_error, names_contradicted_by_residual

TUNING = Tuning()


def _evidence(gain: float, joint: int = 1, usual: bool = False) -> Evidence:
    return Evidence(joint, 1e-9, 1e-9, gain, 1e-9, gain, 1.0, 0.5, 100.0, usual=usual)


def _left(gain: float, joint: int = 1, p_value: float = 1e-9) -> Structure:
    return Structure(joint, gain, p_value, gain, gain, np.zeros(3), ("velocity_2",))


def test_a_law_that_leaves_as_much_as_it_explains_has_the_wrong_name() -> None:
    effects = {4: _evidence(0.3), 7: _evidence(0.5), 9: _evidence(0.3, joint=0)}
    assert names_contradicted_by_residual(effects, (_left(0.6),), TUNING) == {4}


@pytest.mark.parametrize("left", [_left(0.4), _left(0.6, p_value=0.5), _left(0.6, joint=2)])
def test_a_name_holds_where_little_or_nothing_sure_is_left_at_its_joint(left: Structure) -> None:
    assert not names_contradicted_by_residual({4: _evidence(0.3)}, (left,), TUNING)


def test_a_name_that_does_not_hold_is_withdrawn_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two laws that are found in the place of each other would be withdrawn in turn without end."""
    asked: list[frozenset[int]] = []

    def same_again(claimed: Mapping[int, Evidence], *_: object) -> frozenset[int]:
        asked.append(asked[0] if asked else frozenset(number for number, each in claimed.items() if not each.usual))
        assert len(asked) < 10
        return asked[-1]

    monkeypatch.setattr("armlab.diagnosis.diagnose.names_contradicted_by_residual", same_again)
    diagnose(cases.recording(lambda motion, time: 0.05 * motion.velocity**3, seconds=6.0))
    assert asked[0]


def test_friction_that_every_arm_has_keeps_its_name() -> None:
    assert not names_contradicted_by_residual({4: _evidence(0.3, usual=True)}, (_left(0.6),), TUNING)


def test_what_a_named_law_leaves_of_itself_is_no_finding() -> None:
    assert is_form_error(_left(0.4), {4: _evidence(5.0)}, TUNING.unknown)
    assert not is_form_error(_left(0.4), {4: _evidence(1.0)}, TUNING.unknown)
    assert not is_form_error(_left(0.4), {4: _evidence(5.0, usual=True)}, TUNING.unknown)
    assert not is_form_error(_left(0.4), {4: _evidence(5.0, joint=0)}, TUNING.unknown)


TIME = np.arange(0, 20, 0.01)
INSIDE = (TIME > 5) & (TIME < 6)
PUSH = np.where(INSIDE, 3.0 * np.sin(np.pi * (TIME - 5)), 0.0)


def _observed(position: Array, velocity: Array) -> Observed:
    kept = {"position": position[:, None], "velocity": velocity[:, None]}
    whole = (Segment(0, "identify", 0, len(position)),)
    made: Any = SimpleNamespace(rate_hz=100.0, used=lambda joint: whole, kept=kept.__getitem__)
    return cast(Observed, made)


def _reason(push: Array, measured: Array, position: Array, torque: Array) -> str | None:
    """What speaks against a push where `measured` is what acts, in white noise of 0.1 N m."""

    def explained(columns: Array) -> float:
        fitted = columns @ np.linalg.lstsq(columns, measured)[0]
        return float(fitted @ measured) / (2 * 0.1**2)

    observed = _observed(position, np.cos(TIME))

    def lead(law: Array) -> float:
        return explained(push[:, None]) - explained(law)

    return reason_no_contact(Stretch(push, 0, torque, observed), lead, TUNING)


def test_a_push_in_a_state_that_came_often_is_one() -> None:
    assert _reason(PUSH, PUSH, np.sin(TIME), np.sin(2 * TIME)) is None


def test_a_push_is_one_at_an_end_of_the_range_that_was_reached_once_if_no_law_of_that_end_fits() -> None:
    early = np.where(INSIDE, 1 + np.sin(np.pi * (TIME - 5)) ** 2, np.sin(TIME))  # beyond as far before as after
    late = np.where((TIME > 5) & (TIME < 5.5), PUSH, 0.0)  # a push on the way there alone
    assert _reason(late, late, early, np.sin(TIME)) is None


def test_what_follows_the_position_beyond_all_other_stretches_is_no_push() -> None:
    reach = np.where(INSIDE, 1 + np.sin(np.pi * (TIME - 5)), np.sin(TIME))
    assert _reason(PUSH, 3.0 * (reach - 1) * INSIDE, reach, np.sin(TIME)) == "no other stretch has such a position"
    assert _reason(PUSH, 3.0 * (reach - 1) * INSIDE, np.sin(TIME), reach) == "no other stretch has such a torque"


def test_a_push_that_never_ends_is_none() -> None:
    assert _reason(np.full(len(TIME), 3.0), PUSH, np.sin(TIME), TIME) == "it goes on all the time"


def test_a_short_push_is_a_reversal() -> None:
    short = np.where((TIME > 5) & (TIME < 5.1), 3.0, 0.0)
    assert _reason(short, short, np.sin(TIME), np.sin(TIME)) == "the joint hardly moves during it"
