"""Everything that is to be said about a recording folder: repairs, refusals, and suspicions."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from problem.errors import InputError
from recordings.checks.channels import channel_findings
from recordings.checks.fit import fit_findings, thin
from recordings.checks.zeros import turned_zero
from recordings.load import load_runs, open_recording, with_runs
from recordings.recording import Recording
from recordings.run import Finding, Run


@dataclass(frozen=True, eq=False)
class Check:
    """A recording with the runs that could be read, and what was found.

    findings: by the name of the run, "all runs" for those of the whole recording. refused: why a file could not
    be read, by its name.
    """

    recording: Recording
    findings: tuple[tuple[str, Finding], ...]
    refused: tuple[tuple[str, str], ...]

    @property
    def lines(self) -> tuple[str, ...]:
        """One line a finding, as the terminal shows them."""
        found = [f"{run}: {finding.severity}: {finding.text}" for run, finding in self.findings]
        return (*(f"{file}: refused: {reason}" for file, reason in self.refused), *found)


def check_recording(folder: Path) -> Check:
    """Reads and examines a recording; a run that cannot be used is reported beside the others.

    Raises InputError where `recording.yaml` or the robot file is wrong.
    """
    recording, file = open_recording(folder)
    runs: list[Run] = []
    refused: list[tuple[str, str]] = []
    for entry in file.runs:
        try:
            runs.extend(load_runs(recording, file, entry))
        except InputError as error:
            refused.append((entry.file, str(error)))
    recording = with_runs(recording, runs)
    return Check(recording, tuple(_findings(recording)), tuple(refused))


def _findings(recording: Recording) -> Iterator[tuple[str, Finding]]:
    said: set[tuple[str, Finding]] = set()  # what was found before a file was cut stands at each of its parts
    for run in recording.runs:
        yield from ((run.name, finding) for finding in run.findings if (run.file, finding) not in said)
        said.update((run.file, finding) for finding in run.findings)
        yield from ((run.name, finding) for finding in channel_findings(run, recording.arm))
    whole = recording.findings
    if recording.runs:
        whole = (*whole, *_geometry(recording))
    yield from (("all runs", finding) for finding in whole)


def _geometry(recording: Recording) -> tuple[Finding, ...]:
    """What the torques say of channels, robot and zeros."""
    found = fit_findings(recording.runs, recording.arm)
    if any(finding.kind == "swapped_channels" for finding in found):
        return found
    zero = turned_zero(recording.arm, thin(recording.runs))
    return (*found, zero) if zero else found
