"""Whether anything tells the scale of a servo's torques."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from armlab.diagnosis.motion import second_thoughts
from armlab.diagnosis.motion.servo import KEYS, place


def is_open(gain: float, low: float, high: float) -> bool:
    """Of a servo on a joint whose links have most of the inertia. gain, low, high: of kp."""
    values, ends = np.zeros(len(KEYS)), np.zeros((2, len(KEYS)))
    values[place("kp")], ends[:, place("kp")] = gain, (low, high)
    chosen = SimpleNamespace(fit=SimpleNamespace(values=values, interval=lambda: ends))
    return second_thoughts._is_scale_open(cast(Any, chosen), cast(Any, SimpleNamespace(inertia=np.ones(5))))


def test_a_gain_that_is_as_uncertain_as_it_is_large_tells_no_scale(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(second_thoughts, "has_weak_load", lambda *_: False)
    assert is_open(56.0, 20.0, 159.0)
    assert not is_open(56.0, 40.0, 80.0)


def test_where_gravity_is_weak_the_inertia_of_the_links_tells_the_scale(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(second_thoughts, "has_weak_load", lambda *_: True)
    assert not is_open(56.0, 40.0, 80.0)
