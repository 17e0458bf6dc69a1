"""Public recordings for tests: from the local copies or the download cache, never from the network."""

import pytest

from recordings.public.fetch import LOCAL_COPIES, at_hand, cache_folder
from recordings.public.registry import PUBLIC


def needs_copies(*names: str) -> pytest.MarkDecorator:
    """Skips a test where the raw files of a recording (of all, if none is named) are not on this machine."""
    missing = [name for name in names or PUBLIC if not at_hand(PUBLIC[name])]
    reason = f"no copies of {', '.join(missing)} in the folder {LOCAL_COPIES} or in the cache {cache_folder()}"
    return pytest.mark.skipif(bool(missing), reason=reason)
