"""A recording: an arm, its runs, and the simulation that they are compared with."""

from dataclasses import dataclass
from pathlib import Path

from problem.arm import Arm
from recordings.run import Array, Finding, Role, Run


@dataclass(frozen=True, eq=False)
class Transmission:
    """How raw channels become joint signals: q = position @ raw + offset, tau = torque @ (gains * raw).

    position, torque: (joints, channels). offset: (joints,), rad (m). gains: (channels,), N m (N) per A or V,
    ones where the torque itself was recorded. Every run has passed it already: kept to know, not to use.
    """

    position: Array
    offset: Array
    torque: Array
    gains: Array


@dataclass(frozen=True, eq=False)
class Recording:
    """What `recording.yaml` and its runs hold, in SI units on the joint side.

    robot: as the file names it (a path beside it or a built-in name). simulation: the model to compare with,
    None where the file names none. findings: those that concern more than one run.
    """

    folder: Path
    robot: str
    arm: Arm
    runs: tuple[Run, ...]
    transmission: Transmission
    simulation: Path | None = None
    sample_rate_hz: float | None = None
    findings: tuple[Finding, ...] = ()

    @property
    def name(self) -> str:
        """Name of the folder."""
        return self.folder.resolve().name

    def with_role(self, role: Role) -> tuple[Run, ...]:
        """The runs that identify, or those that validate."""
        return tuple(run for run in self.runs if run.role == role)
