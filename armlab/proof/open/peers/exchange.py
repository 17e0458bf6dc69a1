"""What goes to a peer's process and what comes back: arrays in a file, filtered alike on both sides.

A peer stands in an environment of its own (its dependencies need not fit ours); its scripts import nothing of this
project but this module and the filter.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from armlab.recordings.filters import Butterworth


@dataclass(frozen=True, eq=False)
class PeerRun:
    """A run at an even rate: smoothed motion and the torque as recorded, each (samples, joints).

    cutoff_hz, step: of the filter that torque and prediction share.
    """

    name: str
    role: str
    position: Array
    velocity: Array
    acceleration: Array
    torque: Array
    rate_hz: float
    cutoff_hz: float
    step: int

    @property
    def low_pass(self) -> Butterworth:
        """The shared filter."""
        return Butterworth(self.rate_hz, self.cutoff_hz, len(self.torque), self.step)

    def thinned(self, every: int) -> "PeerRun":
        """The run with each so-manyth sample, its torque filtered before."""
        rows = slice(None, None, every)
        return replace(
            self,
            position=self.position[rows],
            velocity=self.velocity[rows],
            acceleration=self.acceleration[rows],
            torque=self.low_pass.smooth(self.torque)[rows],
            rate_hz=self.rate_hz / every,
            step=max(self.step // every, 1),
        )


def write_runs(runs: tuple[PeerRun, ...], path: Path) -> None:
    """Writes runs as one .npz file."""
    content: dict[str, Any] = {
        f"{index}/{name}": value for index, run in enumerate(runs) for name, value in vars(run).items()
    }
    np.savez(path, **content)


def read_runs(path: Path) -> Iterator[PeerRun]:
    """The runs of a file."""
    content = np.load(path)
    for index in range(len({name.split("/")[0] for name in content.files})):
        own = {name.split("/")[1]: content[name] for name in content.files if name.split("/")[0] == str(index)}
        yield PeerRun(**{name: value if value.ndim else value.item() for name, value in own.items()})


def write_answer(torques: dict[str, Array], seconds: float, path: Path) -> None:
    """Writes what a peer found: filtered torque by run, and the time of its fit."""
    content: dict[str, Any] = {"seconds": seconds, **torques}
    np.savez(path, **content)
