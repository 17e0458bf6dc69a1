"""Public recordings for tests: from the local copies or the download cache, never from the network."""

import pytest

from armlab.recordings.public import LOCAL_COPIES_VARIABLE, PUBLIC_RECORDINGS, cache_folder, is_available


def needs_copies(*names: str) -> pytest.MarkDecorator:
    """Skips a test where the raw files of a recording (of all, if none is named) are not on this machine."""
    missing = [name for name in names or PUBLIC_RECORDINGS if not is_available(PUBLIC_RECORDINGS[name])]
    reason = f"no copies of {', '.join(missing)} in the folder {LOCAL_COPIES_VARIABLE} or in the cache {cache_folder()}"
    return pytest.mark.skipif(bool(missing), reason=reason)
