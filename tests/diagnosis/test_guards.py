"""Guards of the diagnosis as switches."""

import pytest

from diagnosis.settings import GUARDS, Guards, guards_without
from problem.errors import InputError


def test_a_guard_that_is_named_is_off_and_all_others_are_on() -> None:
    off = guards_without(["heldout_gain"])
    assert not off.heldout_gain
    assert all(getattr(off, name) for name in GUARDS if name != "heldout_gain")
    assert guards_without([]) == Guards()


def test_a_guard_that_there_is_not_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(InputError, match=r"--without held_out_gain: no such guard.*heldout_gain"):
        guards_without(["held_out_gain"])
