"""Small experiments that are really run, for tests of what is made of results."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from bench.run import Progress, RunOptions, run_experiment

CONFIG = """\
name: small
problem: [{preset: sphere, dimension: 3, shift_seed: 1}, {preset: rastrigin, dimension: 2, shift_seed: 2}]
algorithms: [spso, l-shade, random-search]
swarm_size: 6
iterations: 9
repetitions: 7
seed: 1
"""


class Ran(NamedTuple):
    """A configuration and the store that holds its outcomes."""

    config: Path
    store: Path


class _Silent:
    def update(self, n: int) -> object:
        return None


@contextmanager
def _no_bar(total: int, done: int) -> Iterator[Progress]:
    yield _Silent()


def ran(folder: Path, text: str = CONFIG) -> Ran:
    """Run a configuration in a folder."""
    config = folder / f"{text.splitlines()[0].removeprefix('name: ')}.yaml"
    config.write_text(text)
    store = folder / "runs.sqlite"
    run_experiment(config, RunOptions(store, folder / "results", workers=1), _no_bar)
    return Ran(config, store)
