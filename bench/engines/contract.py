"""What the runner asks of an engine, and how a configuration chooses one."""

from concurrent.futures import Future
from typing import Annotated, Literal, Protocol, Self

from pydantic import Field, model_validator

from bench.engines.work import Report, Work
from problem.settings import Settings


class Executor(Settings):
    """backend: the engine. address: of a cluster that is running; without one, processes on this machine.

    Dask: `tcp://HOST:PORT` of the scheduler. Ray: `HOST:PORT` of the head, or `auto`.
    """

    backend: Literal["loky", "dask", "ray"] = "loky"
    address: Annotated[str, Field(min_length=1)] | None = None

    @model_validator(mode="after")
    def _address_of_a_cluster(self) -> Self:
        if self.backend == "loky" and self.address:
            raise ValueError("'address' should stand beside backend 'dask' or 'ray': loky works on this machine alone")
        return self


class Engine(Protocol):
    """Takes batches and gives futures of their reports.

    slots: batches that keep all workers busy; more should not be under way. crashes: what a future raises when the
    worker died.
    """

    @property
    def slots(self) -> int: ...

    @property
    def crashes(self) -> tuple[type[BaseException], ...]: ...

    def submit(self, work: Work) -> "Future[Report]":
        """A future of the batch; it may hold one of `crashes`."""
        ...
