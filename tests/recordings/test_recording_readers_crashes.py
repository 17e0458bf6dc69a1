"""Bytes that once broke a reader, as the fuzzer found them."""

from pathlib import Path

import pytest
from reader_targets import TARGETS, held, seed_of

CRASHES = sorted((Path(__file__).parent / "crashes").glob("*/*"))


@pytest.mark.parametrize("crash", CRASHES, ids=lambda crash: f"{crash.parent.name}-{crash.name[:14]}")
def test_bytes_that_once_broke_a_reader_are_read_or_refused_in_one_line(tmp_path: Path, crash: Path) -> None:
    if crash.parent.name in ("mcap", "db3", "bag"):
        pytest.importorskip("rosbags")
    held(TARGETS[crash.parent.name], crash.read_bytes(), tmp_path)


@pytest.mark.parametrize("name", TARGETS)
def test_the_seed_of_every_fuzzed_reader_is_sound(tmp_path: Path, name: str) -> None:
    target = TARGETS[name]
    (tmp_path / target.file).write_bytes(seed_of(name))
    assert target.read(tmp_path) is not None
