"""Time of Table 3 beside that of an earlier commit: `python -m tools.time_against COMMIT [ROUNDS]`.

Both trees run `armlab table3` in one process, in turns, with the libraries of this environment. Printed are seconds of
processor time, the start of Python included, and the ratio of the least of each: other work on the machine only adds.
"""

import os
import resource
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).resolve().parents[1]
ROUNDS = 3


def main(commit: str, rounds: int) -> None:
    """Prints the times and their ratio. Raises CalledProcessError where git, the build or a run fails."""
    with TemporaryDirectory() as folder:
        earlier = Path(folder) / "tree"
        _run(ROOT, "git", "worktree", "add", "--quiet", "--detach", str(earlier), commit)
        try:
            _run(earlier, sys.executable, "setup.py", "--quiet", "build_ext", "--inplace")
            times = [(_time_table3(earlier, folder), _time_table3(ROOT, folder)) for _ in range(rounds)]
        finally:
            _run(ROOT, "git", "worktree", "remove", "--force", str(earlier))
    before, now = (min(each) for each in zip(*times, strict=True))
    for first, second in times:
        print(f"{commit}: {first:.2f} s, this tree: {second:.2f} s")
    print(f"ratio of the least: {now / before:.2f}")


def _time_table3(tree: Path, folder: str) -> float:
    """Processor time of one run without anything stored, seconds."""
    with TemporaryDirectory(dir=folder) as out:
        places = ["--store", f"{out}/runs.sqlite", "--results", f"{out}/results"]
        before = _processor_seconds()
        _run(tree, sys.executable, "-m", "armlab.cli.main", "table3", "--workers", "1", *places)
        return _processor_seconds() - before


def _processor_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _run(tree: Path, *command: str) -> None:
    subprocess.run(
        command, cwd=tree, env={**os.environ, "PYTHONPATH": str(tree)}, check=True, stdout=subprocess.DEVNULL
    )


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else ROUNDS)
