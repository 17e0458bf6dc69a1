"""The executor on a Ray cluster; needs the extra `cluster`."""

import logging
import socket
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import ray
from ray.exceptions import LocalRayletDiedError, NodeDiedError, ObjectLostError, OutOfMemoryError, WorkerCrashedError

from armlab.common.errors import InputError
from bench.executors.contract import BatchExecutor, Work, WorkReport, run_in_worker

_BATCHES_PER_WORKER = 2  # batches a worker, so that none waits for the next one
_CONNECT_TIMEOUT_S = 30


@dataclass(frozen=True)
class RayExecutor:
    """Batches as Ray tasks of one core each. The dispatch handles crashes, so Ray itself does not retry."""

    task: Any
    slots: int
    timeout_s: float | None
    crashes: tuple[type[BaseException], ...] = (
        WorkerCrashedError,
        OutOfMemoryError,
        NodeDiedError,
        LocalRayletDiedError,
        ObjectLostError,
    )

    def submit(self, work: Work) -> "Future[WorkReport]":
        future: Future[WorkReport] = self.task.remote(list(work), self.timeout_s).future()
        return future


@contextmanager
def ray_executor(address: str | None, workers: int, timeout_s: float | None) -> Iterator[BatchExecutor]:
    """A running cluster, or a cluster on this machine for the time of the run.

    Raises InputError if no cluster answers.
    """
    quiet: dict[str, Any] = {"logging_level": logging.ERROR, "log_to_driver": False}
    local: dict[str, Any] = {"address": "local", "num_cpus": workers, "include_dashboard": False}
    try:
        if address:
            _check_address_answers(address)
        ray.init(**quiet, **({"address": address} if address else local))
    except (OSError, ValueError, RuntimeError) as error:
        raise InputError(f"no Ray cluster answers at {address}: {error}".splitlines()[0]) from None
    try:
        cores = int(ray.cluster_resources().get("CPU", 1))
        yield RayExecutor(ray.remote(max_retries=0, num_cpus=1)(run_in_worker), _BATCHES_PER_WORKER * cores, timeout_s)
    finally:
        ray.shutdown()


def _check_address_answers(address: str) -> None:
    """Check that a process listens at HOST:PORT; Ray itself would wait for many minutes."""
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if host:
        socket.create_connection((host, int(port)), timeout=_CONNECT_TIMEOUT_S).close()
