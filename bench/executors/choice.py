"""The executor that the settings name; the packages of a cluster are imported only where it is used."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module

from armlab.common.errors import InputError
from armlab.common.packages import missing_package
from bench.executors.contract import BatchExecutor, ExecutorSettings
from bench.executors.local import local_executor

_CLUSTER_EXECUTORS = {
    "dask": ("bench.executors.dask_cluster", "dask_executor"),
    "ray": ("bench.executors.ray_cluster", "ray_executor"),
}


@contextmanager
def open_executor(
    settings: ExecutorSettings, workers: int, timeout_s: float | None, isolated: bool = False
) -> Iterator[BatchExecutor]:
    """The executor of these settings for the time of a run. workers: processes, where no cluster is named.

    isolated: a single worker is a process of its own, too.

    Raises InputError, in one line, for a missing package and for a cluster that does not answer.
    """
    if settings.backend == "loky":
        with local_executor(workers, timeout_s, isolated) as executor:
            yield executor
        return
    module, name = _CLUSTER_EXECUTORS[settings.backend]
    try:
        make = getattr(import_module(module), name)
    except ModuleNotFoundError as error:
        raise InputError(missing_package(error, f"executor '{settings.backend}'") or str(error)) from None
    with make(settings.address, workers, timeout_s) as executor:
        yield executor
