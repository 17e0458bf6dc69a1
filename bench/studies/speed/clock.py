"""Fair timing on a busy machine: the competitors take turns, processor time counts, and medians are compared."""

import time
from collections.abc import Callable, Mapping
from statistics import median

Task = Callable[[], object]


def median_seconds(tasks: Mapping[str, Task], rounds: int, calls: int = 1) -> dict[str, float]:
    """Median processor seconds of one call of each task; in each round every task has its turn of `calls` calls.

    Each task is called once before the clock starts, so that compilation and caches do not count.
    """
    for task in tasks.values():
        task()
    taken: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(rounds):
        for name, task in tasks.items():
            started = time.process_time()
            for _ in range(calls):
                task()
            taken[name].append((time.process_time() - started) / calls)
    return {name: median(seconds) for name, seconds in taken.items()}
