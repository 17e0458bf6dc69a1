"""What a user is told about a mistake."""

from collections.abc import Callable

import pytest

from armlab.common.errors import InputError


def refusal(act: Callable[..., object], *given: object, **settings: object) -> str:
    """The message of the InputError that an act raises; it has to be one line."""
    with pytest.raises(InputError) as raised:
        act(*given, **settings)
    message = str(raised.value)
    assert "\n" not in message
    return message
