"""Our pool of processes and joblib's stand in one process without disturbing each other."""

import subprocess
import sys

import pytest

OURS = """\
    with local_executor(2, None) as executor:
        print(len(executor.submit([]).result(timeout=60).results))
"""
THEIRS = """\
    print(*Parallel(n_jobs=2)(delayed(abs)(number) for number in (-1, -2)))
"""
NESTED = """\
    with local_executor(2, None) as executor:
        print(len(executor.submit([]).result(timeout=60).results))
        print(*Parallel(n_jobs=2)(delayed(abs)(number) for number in (-1, -2)))
        print(len(executor.submit([]).result(timeout=60).results))
"""
HEAD = """\
from joblib import Parallel, delayed
from bench.executors.local import local_executor

if __name__ == "__main__":
"""


@pytest.mark.parametrize(
    ("order", "printed"),
    [(OURS + THEIRS, ["0", "1 2"]), (THEIRS + OURS + THEIRS, ["1 2", "0", "1 2"]), (NESTED, ["0", "1 2", "0"])],
    ids=["ours first", "theirs first", "theirs within ours"],
)
def test_joblib_and_our_executor_work_in_one_process(order: str, printed: list[str]) -> None:
    command = [sys.executable, "-c", HEAD + order]  # of its own: joblib mistakes a pool only at its first use
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.stdout.splitlines() == printed, done.stderr
