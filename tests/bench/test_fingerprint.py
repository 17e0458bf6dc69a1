"""The same code has the same fingerprint in every process."""

import subprocess
import sys

from algorithms.registry import load
from bench.fingerprint import fingerprint

SCRIPT = """
from algorithms.registry import load
from bench.fingerprint import fingerprint
print(fingerprint(load("de"), {"preset": "sphere"}))
"""


def test_a_process_that_finds_other_folders_first_sees_the_same_code() -> None:
    there = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True).stdout.strip()
    assert fingerprint(load("de"), {"preset": "sphere"}) == there
