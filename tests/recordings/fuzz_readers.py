"""Fuzzes the readers under coverage guidance (atheris): `fuzz_readers.py --seconds 600 [TARGET ...]`.

Each target gets an equal share of the time in a process of its own. What breaks a promise is written as
`.armlab/fuzz/TARGET/crash-...`; kept in `crashes/TARGET/` it becomes a test.
"""

import argparse
import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

WORK = Path(".armlab/fuzz")
SLOW_S, MEMORY_MB = 20, 2048  # for one input
INSTRUMENTED = ["recordings", "problem"]
PARSERS = {"yaml": ["yaml"], "mcap": ["rosbags"], "db3": ["rosbags"], "bag": ["rosbags"]}  # of others, in Python
EXECUTED = re.compile(r"number_of_executed_units: (\d+)")


def main(arguments: Sequence[str]) -> int:
    """Fuzzes the targets one after the other; 1 if one of them broke a promise."""
    from reader_targets import TARGETS

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("targets", nargs="*", choices=[[], *TARGETS], default=[])
    parser.add_argument("--seconds", type=float, default=600)
    options = parser.parse_args(arguments)
    names = options.targets or list(TARGETS)
    share = max(int(options.seconds / len(names)), 1)
    broken = [name for name in names if not _fuzzed(name, share)]
    return 1 if broken else 0


def _fuzzed(name: str, seconds: int) -> bool:
    """Runs one target and tells what happened in a line; true if its promise held."""
    from reader_targets import seed_of

    folder = WORK / name
    (folder / "corpus").mkdir(parents=True, exist_ok=True)
    (folder / "corpus" / "seed").write_bytes(seed_of(name))
    limits = [f"-max_total_time={seconds}", f"-timeout={SLOW_S}", f"-rss_limit_mb={MEMORY_MB}", "-print_final_stats=1"]
    command = [sys.executable, __file__, "--one", name, f"-artifact_prefix={folder}/", *limits, str(folder / "corpus")]
    with (folder / "log.txt").open("a+", encoding="utf-8", errors="replace") as log:
        start = log.tell()
        code = subprocess.run(command, stdout=log, stderr=log, check=False).returncode
        log.seek(start)
        executed = EXECUTED.findall(log.read())
    verdict = "held" if code == 0 else f"BROKEN, see {folder}/log.txt"
    print(f"{name}: {seconds} s, {executed[-1] if executed else 'unknown'} executions, {verdict}", flush=True)
    return code == 0


def fuzz_one(name: str, options: Sequence[str]) -> None:
    """Fuzzes one target in this process, with libFuzzer's options; does not return."""
    import atheris

    with atheris.instrument_imports(include=INSTRUMENTED + PARSERS.get(name, [])):
        from reader_targets import TARGETS, held, seed_of

        target = replace(TARGETS[name], read=TARGETS[name].fuzzed or TARGETS[name].read)
        folder = TemporaryDirectory()
        held(target, seed_of(name), Path(folder.name))  # imports the parsers that wait until they are needed
    atheris.Setup([sys.argv[0], *options], lambda content: held(target, content, Path(folder.name)))
    atheris.Fuzz()


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        fuzz_one(sys.argv[2], sys.argv[3:])
    sys.exit(main(sys.argv[1:]))
