"""From the settings of a run to its engine."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module

from bench.engines.contract import Engine, Executor
from bench.engines.local import local_engine
from problem.errors import InputError

_CLUSTERS = {"dask": ("bench.engines.dask_cluster", "dask_engine"), "ray": ("bench.engines.ray_cluster", "ray_engine")}


@contextmanager
def engine(executor: Executor, workers: int, timeout_s: float | None) -> Iterator[Engine]:
    """The engine of these settings, for the time of a run. workers: processes where no cluster is named.

    Raises InputError, in one line, for a missing package and for a cluster that does not answer.
    """
    if executor.backend == "loky":
        with local_engine(workers, timeout_s) as made:
            yield made
        return
    module, name = _CLUSTERS[executor.backend]
    try:
        make = getattr(import_module(module), name)
    except ModuleNotFoundError as error:
        raise InputError(
            f"executor '{executor.backend}' needs the package '{error.name}': pip install 'armlab[cluster]'"
        ) from None
    with make(executor.address, workers, timeout_s) as made:
        yield made
