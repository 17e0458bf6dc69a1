"""What a diagnosis says, live or read from a file: the same object with the same names."""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from armlab.common.errors import InputError
from armlab.common.notebook import notebook_html
from armlab.diagnosis.formats import (
    DoubtEntry,
    FindingEntry,
    FitEntry,
    FrictionEntry,
    LeftEntry,
    LocatedEntry,
    Status,
    StoryEntry,
    UnexplainedEntry,
    VerdictFile,
    read_verdict_file,
)
from armlab.diagnosis.motion.motion_result import MotionDiagnosis
from armlab.diagnosis.result import Diagnosis
from armlab.identification.model import Model
from armlab.identification.model_file import read_model_file
from armlab.recordings.motion import MotionRecording
from armlab.recordings.recording import Recording
from armlab.report.verdict_files import MODEL
from problem.joint_words import joint_in_words

if TYPE_CHECKING:  # loaded by those who draw, or ask for a table
    import pandas as pd

    from armlab.common.report.charts import Chart
    from armlab.common.report.figures import ShownFigure

FILE_NAME = "verdict.json"
SHOWN = 4  # findings in a repr; the others are counted


@dataclass(frozen=True, eq=False, repr=False)
class Verdict:
    """What a diagnosis says; its attributes are the keys of `verdict.json`, whether it was read from there or not.

    findings: setup mistakes first, then the differences; each has effect, joint (from 1), parameters by name with
    value, ci95 and unit, equation, probability, rivals. fit: the held-out error of each joint, N m (N), before and
    after. Entries are those of the file's schema. diagnosis: what it was made of, with all signals; None of a verdict
    that was read. folder: where it was read from.
    """

    status: Status
    summary: str
    story: tuple[StoryEntry, ...]
    located: tuple[LocatedEntry, ...]
    findings: tuple[FindingEntry, ...]
    unexplained: tuple[UnexplainedEntry, ...]
    friction: tuple[FrictionEntry, ...]
    left: tuple[LeftEntry, ...]
    doubts: tuple[DoubtEntry, ...]
    fit: tuple[FitEntry, ...]
    diagnosis: Diagnosis | MotionDiagnosis | None = None
    folder: Path | None = None

    @property
    def recording(self) -> Recording | MotionRecording | None:
        """The recording as it was diagnosed, mistakes of its reading corrected; None of a verdict that was read."""
        return None if self.diagnosis is None else self.diagnosis.recording

    @property
    def model(self) -> Model | None:
        """What predicts the torque, `model.yaml` beside a verdict that was read; None where no torque was fitted."""
        if self.folder is None:
            found = self.diagnosis.model if isinstance(self.diagnosis, Diagnosis) else None
            return None if found is None else Model(**vars(found))
        path = self.folder / MODEL
        if not path.is_file() or read_model_file(path).controller is not None:
            return None
        return Model.load(path)

    @property
    def table(self) -> "pd.DataFrame":
        """A row a number of the findings: effect, joint, number, value, its 95 % interval, unit, probability, minor."""
        import pandas as pd

        columns = ("effect", "joint", "number", "value", "low", "high", "unit", "probability", "minor")
        return pd.DataFrame([row for each in self.findings for row in _number_rows(each)], columns=columns).astype(
            {"joint": "Int64"}
        )

    def plot(self, joint: int | None = None) -> "ShownFigure":
        """A figure of the held-out error of each joint; of a joint (from 1): its torque, measured and predicted, or, of
        motion only, its position, measured and replayed.

        Raises InputError where nothing was fitted, and for a joint of a verdict that was read from a file.
        """
        if not self.fit:
            raise InputError("nothing was fitted, so there is nothing to draw: `summary` says why")
        return self._plot_errors() if joint is None else self._plot_joint(joint)

    def _plot_errors(self) -> "ShownFigure":
        from armlab.common.report.charts import FLOOR_LOOK, FOUND_LOOK, GIVEN_LOOK, REFITTED_LOOK
        from armlab.common.report.figures import plot_by_joint

        is_motion = any(each.replay_rms_after is not None for each in self.fit)
        series = [
            (GIVEN_LOOK if is_motion else REFITTED_LOOK, np.array([each.heldout_rms_before for each in self.fit])),
            (FOUND_LOOK, np.array([each.heldout_rms_after for each in self.fit])),
            (FLOOR_LOOK, np.array([each.noise_floor for each in self.fit])),
        ]
        label = f"rms error, {'rad (m)' if is_motion else 'N m (N)'}"
        return plot_by_joint(
            "Error on held-out data", label, [self._joint_name(each.joint) for each in self.fit], series
        )

    def _plot_joint(self, joint: int) -> "ShownFigure":
        from armlab.common.report.figures import plot_chart

        charts = self._joint_charts()
        if joint not in charts:
            raise InputError(f"joint {joint}: give one of {', '.join(map(str, charts))}")
        return plot_chart(charts[joint])

    def _joint_charts(self) -> "dict[int, Chart]":
        """By the number of the joint, from 1; InputError for a verdict without signals."""
        from armlab.report.motion.motion_page import position_charts
        from armlab.report.torque.residuals import select_residuals
        from armlab.report.torque.torque_pictures import torque_charts

        if isinstance(self.diagnosis, MotionDiagnosis):
            return position_charts(self.diagnosis)
        data = None if self.diagnosis is None else select_residuals(self.diagnosis)
        if data is None or self.diagnosis is None:
            raise InputError("a verdict that was read has no signals: call plot() without a joint, or diagnose again")
        return dict(enumerate(torque_charts(self.diagnosis, data), 1))

    def _joint_name(self, joint: int) -> str:
        return f"joint {joint}" if self.diagnosis is None else joint_in_words(self.diagnosis.simulation.arm, joint)

    def __repr__(self) -> str:
        """The status, the first findings as effect@place with their equations, and how many there are."""
        lines = [f"{self._title}; findings: {len(self.findings)}"]
        lines += [f"  {_place(each)}: {each.equation}" for each in self.findings[:SHOWN]]
        if len(self.findings) > SHOWN:
            lines.append(f"  and {len(self.findings) - SHOWN} more findings")
        return "\n".join(lines if self.findings else [*lines, f"  {self.summary}"])

    def _repr_html_(self) -> str:
        rows = [(each.effect, "" if each.joint is None else each.joint, each.equation) for each in self.findings]
        return notebook_html(self._title, self.summary, ("effect", "joint", "equation"), rows)

    @property
    def _title(self) -> str:
        name = self.recording.name if self.recording is not None else self.folder
        return f"Verdict of {name}: {self.status}"


def verdict_of(file: VerdictFile, diagnosis: Diagnosis | MotionDiagnosis | None, folder: Path | None) -> Verdict:
    """The verdict with the content of a file; a key that the file does not have is empty."""
    keys = (each.name for each in fields(Verdict) if each.name in VerdictFile.model_fields)
    content: dict[str, Any] = {key: () if getattr(file, key) is None else getattr(file, key) for key in keys}
    return Verdict(**content, diagnosis=diagnosis, folder=folder)


def read_verdict(path: str | Path) -> Verdict:
    """The verdict in a folder that `armlab diagnose --out` wrote, or in its `verdict.json`.

    Raises InputError, in one line, where it is none.

        for finding in armlab.read_verdict("verdict").findings:
            print(finding.effect, finding.joint, finding.equation)
    """
    if not isinstance(path, str | PathLike):
        raise InputError(
            f"read_verdict takes the path of a verdict's folder or {FILE_NAME}, not {type(path).__name__}: to diagnose "
            "DataFrames, give what armlab.Recording.from_dataframe makes of them to armlab.diagnose"
        )
    place = Path(path)
    file = place / FILE_NAME if place.is_dir() else place
    return verdict_of(read_verdict_file(file), None, file.parent)


def _number_rows(finding: FindingEntry) -> Iterator[tuple[object, ...]]:
    """A row a number; a vector has a row a component."""
    common = finding.probability, bool(finding.minor)
    for name, each in finding.parameters.items():
        values = np.atleast_1d(each.value)
        ends = np.full((len(values), 2), np.nan) if each.ci95 is None else np.reshape(each.ci95, (-1, 2))
        for place, (value, (low, high)) in enumerate(zip(values.tolist(), ends.tolist(), strict=True), 1):
            number = f"{name} {place}" if isinstance(each.value, tuple) else name
            yield finding.effect, finding.joint, number, value, low, high, each.unit, *common
    if not finding.parameters:
        yield finding.effect, finding.joint, "", np.nan, np.nan, np.nan, "", *common


def _place(finding: FindingEntry) -> str:
    return finding.effect if finding.joint is None else f"{finding.effect}@{finding.joint}"
