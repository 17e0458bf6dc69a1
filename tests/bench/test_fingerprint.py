"""The same code has the same fingerprint in every process."""

import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from algorithms.registry import load
from bench.provenance import fingerprint

SCRIPT = """
from algorithms.registry import load
from bench.provenance import fingerprint
print(fingerprint(load("de"), {"preset": "sphere"}))
"""


def test_a_process_that_finds_other_folders_first_sees_the_same_code() -> None:
    there = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True).stdout.strip()
    assert fingerprint(load("de"), {"preset": "sphere"}) == there


def test_a_problem_of_a_third_party_is_all_of_its_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "their_problems"
    (package / "inner").mkdir(parents=True)
    (package / "__init__.py").touch()
    (package / "inner" / "__init__.py").touch()
    (package / "inner" / "preset.py").write_text("class TheirSettings:\n    pass\n")
    (package / "law.py").write_text("FACTOR = 1\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    entry = EntryPoint("theirs", "their_problems.inner.preset:TheirSettings", "armlab.problems")
    monkeypatch.setattr("bench.provenance.plug_ins", lambda: [entry])
    before = fingerprint(load("de"), {"preset": "theirs"})
    assert fingerprint(load("de"), {"preset": "theirs"}) == before
    (package / "law.py").write_text("FACTOR = 2.0\n")
    assert fingerprint(load("de"), {"preset": "theirs"}) != before
