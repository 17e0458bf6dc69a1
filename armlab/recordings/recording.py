"""A recording: an arm, its runs in SI units on the joint side, and remarks about them."""

from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self, TypeVar, Unpack

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from problem.arm import Arm

if TYPE_CHECKING:  # by those who ask for frames or figures
    import pandas as pd

    from armlab.common.report.figures import ShownFigure
    from armlab.recordings.from_python import ImportOptions
    from armlab.recordings.motion import MotionRecording

Role = Literal["identify", "validate"]
ROLES: tuple[Role, ...] = ("identify", "validate")
SIGNALS = (
    "position",
    "torque",
    "velocity",
    "current",
    "temperature",
    "voltage",
    "link_position",
    "reference_position",
    "reference_velocity",
    "simulated_torque",
    "simulated_position",
)
EVEN_TOLERANCE = 1e-6  # of a sample: stamps this close to an even grid count as even (they are rounded in the file)


@dataclass(frozen=True)
class Finding:
    """A remark about a recording for its user, in one line.

    kind: a short name like `time_jitter`. severity: `repaired` if the data were changed, `warning` if they look wrong
    and were not changed, `note` if nothing is wrong. joint: from 1, if the remark concerns one joint.
    """

    kind: str
    severity: Literal["repaired", "warning", "note"]
    text: str
    joint: int | None = None


@dataclass(frozen=True, eq=False)
class MotionRun:
    """One run without torque, SI units, on the joint side of the transmission.

    time: (samples,), s, strictly increasing. position: (samples, joints), rad (m for prismatic joints). The other
    signals are None where they were not recorded; a column of NaN in one of them is a joint without that sensor.
    current: A or V of the drives, of unknown scale and sign. temperature, voltage: (samples, sensors), degrees Celsius
    and V. file: name of its file; part: from 1 where one file was cut into several runs, else 0.
    """

    file: str
    role: Role
    time: Array
    position: Array
    _: KW_ONLY
    velocity: Array | None = None
    current: Array | None = None
    temperature: Array | None = None
    voltage: Array | None = None
    link_position: Array | None = None
    reference_position: Array | None = None
    reference_velocity: Array | None = None
    simulated_torque: Array | None = None
    simulated_position: Array | None = None
    part: int = 0
    findings: tuple[Finding, ...] = ()

    @property
    def name(self) -> str:
        """The file, and which part of it."""
        return f"{self.file} part {self.part}" if self.part else self.file

    @property
    def samples(self) -> int:
        """Number of instants."""
        return len(self.time)

    @property
    def joints(self) -> int:
        """Number of joints."""
        return int(self.position.shape[1])

    @property
    def rate_hz(self) -> float:
        """Samples per second: one over the median step."""
        return float(1 / np.median(np.diff(self.time)))

    @property
    def even(self) -> bool:
        """True if the stamps stand on an even grid, as filters need them."""
        grid = np.linspace(self.time[0], self.time[-1], self.samples)
        step = (self.time[-1] - self.time[0]) / (self.samples - 1)
        # a stamp cannot be rounded more finely than its floating-point number
        tolerance = max(EVEN_TOLERANCE * step, 4 * float(np.spacing(np.abs(self.time).max())))
        return bool(np.abs(self.time - grid).max() <= tolerance)

    @property
    def repairs(self) -> tuple[Finding, ...]:
        """The findings that changed data."""
        return tuple(finding for finding in self.findings if finding.severity == "repaired")

    @property
    def signals(self) -> dict[str, Array]:
        """The recorded signals by name, time aside."""
        recorded = {name: getattr(self, name, None) for name in SIGNALS}
        return {name: signal for name, signal in recorded.items() if signal is not None}

    def rows(self, chosen: slice | NDArray[np.intp] | NDArray[np.bool_]) -> Self:
        """The same run with only the chosen rows, or with rows in another order."""
        return self.with_signals(self.time[chosen], {name: signal[chosen] for name, signal in self.signals.items()})

    def with_signals(self, time: Array, signals: dict[str, Array]) -> Self:
        """The same run with other stamps and other values for the named signals."""
        changed: dict[str, Any] = {"time": time, **signals}
        return replace(self, **changed)

    def with_findings(self, *findings: Finding) -> Self:
        """The same run with more findings."""
        return replace(self, findings=(*self.findings, *findings))


@dataclass(frozen=True, eq=False)
class Run(MotionRun):
    """One run with torque: (samples, joints), N m (N for prismatic joints)."""

    torque: Array


AnyRun = TypeVar("AnyRun", bound=MotionRun)


@dataclass(frozen=True, eq=False)
class Transmission:
    """How raw channels become joint signals: q = position @ raw + offset, tau = torque @ (gains * raw).

    position, torque: (joints, channels). offset: (joints,), rad (m). gains: (channels,), N m (N) per A or V,
    ones where the torque itself was recorded. Kept for information: the runs are on the joint side already.
    """

    position: Array
    offset: Array
    torque: Array
    gains: Array


@dataclass(frozen=True, eq=False)
class Recording:
    """What `recording.yaml` and its runs hold, in SI units on the joint side.

    robot: as the file names it (a path beside it or a built-in name). simulation: the model to compare with,
    None where the file names none. recorded: the day. findings: those that concern more than one run.
    """

    folder: Path
    robot: str
    arm: Arm
    runs: tuple[Run, ...]
    transmission: Transmission
    simulation: Path | None = None
    sample_rate_hz: float | None = None
    findings: tuple[Finding, ...] = ()
    recorded: date | None = None

    @classmethod
    def from_dataframe(
        cls,
        frame: "pd.DataFrame | Sequence[pd.DataFrame] | Mapping[Any, pd.DataFrame]",
        robot: str | Path | None = None,
        *,
        validate: Any = None,
        out: str | Path | None = None,
        **options: "Unpack[ImportOptions]",
    ) -> "Recording | MotionRecording":
        """The recording in a DataFrame, or in several, one a run: a list, or a dictionary by the names of the runs.

        robot: a built-in name or a robot file. validate: what takes no part in any fit: other frames, or, for a single
        frame, True for its rows, such as `frame["t"] > 30`; each stretch of rows is a run. options: columns by signal,
        units and the others of `import_recording`, needed only where names do not tell; an index that is no bare count
        is a column, too. Checked, refused and repaired as the same numbers in a file would be; the findings say what
        each signal was taken from. out: new folder that keeps it. Without torque, and with reference_position, it is a
        MotionRecording. Raises InputError, in one line.

            Recording.from_dataframe(frame, robot="arm.urdf", position="q*", torque="tau*", units={"torque": "N.m"})
        """
        from armlab.recordings.from_python import recording_of_frames

        return recording_of_frames(frame, robot, validate=validate, out=out, **options)

    @property
    def name(self) -> str:
        """Name of the folder."""
        return self.folder.resolve().name

    def __getitem__(self, signal: str) -> "pd.DataFrame":
        """A signal of all runs, SI units: rows by run and time, a column a joint; `recording["torque"].loc["run.csv"]`
        is that of one run.
        """
        from armlab.recordings.views import signal_frame

        return signal_frame(self.runs, self.arm, signal)

    def plot(self, run: str | None = None) -> "ShownFigure":
        """A figure of position and torque, recorded and filtered. run: its name, the first if left out."""
        from armlab.recordings.views import plot_run, run_named

        return plot_run(run_named(self.runs, run), self.arm)

    def __repr__(self) -> str:
        """The robot, the first runs, and how many findings there are."""
        title = f"Recording {self.name!r} of {self.arm.name}; joints: {len(self.arm)}"
        return describe_runs(title, self.runs, self.findings)

    def with_role(self, role: Role) -> tuple[Run, ...]:
        """The runs that identify, or those that validate."""
        return tuple(run for run in self.runs if run.role == role)

    def runs_to_identify(self) -> tuple[Run, ...]:
        """The runs that identify; InputError where there is none."""
        runs = self.with_role("identify")
        if not runs:
            raise InputError(f"{self.folder} has no run to identify from: give one of its runs the role identify")
        return runs


def describe_runs(title: str, runs: Sequence[MotionRun], findings: Sequence[Finding]) -> str:
    """A title, the first runs of a recording, and how many repairs and warnings there are."""
    lines = [f"{title}, runs: {len(runs)}"]
    for run in runs[:3]:
        lines.append(f"  {run.name} ({run.role}): {run.samples} samples at {run.rate_hz:.5g} Hz")
    if len(runs) > 3:
        lines.append(f"  and {len(runs) - 3} more runs")
    found = [each.severity for each in (*findings, *(each for run in runs for each in run.findings))]
    return "\n".join([*lines, f"  findings: {found.count('repaired')} repairs, {found.count('warning')} warnings"])
