"""Identification and prediction as functions for scripts and notebooks."""

from dataclasses import dataclass
from pathlib import Path

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.notebook import notebook_html
from armlab.common.settings import suggest_name
from armlab.effects.contract import Candidate
from armlab.identification.identifier import METHODS
from armlab.identification.identify import IdentifyOptions, fit_identifier, wrong_reading
from armlab.identification.model import Model
from armlab.identification.torque_model import TorqueModel
from armlab.identification.validation import RunError, format_percent, run_error
from armlab.recordings.given import GivenRecording, torque_recording_of
from armlab.recordings.identifiable import require_identifiable, require_torque
from armlab.recordings.recording import Recording

SHOWN = 4  # runs in a repr; the others are counted


def identify(
    recording: GivenRecording,
    method: str | None = None,
    *,
    components: tuple[Candidate, ...] | None = None,
    cutoff_hz: float | None = None,
    as_read: bool = False,
) -> Model:
    """The model of the arm that fits the runs with the role `identify`, with 95 % intervals.

    recording: or the path of its folder. method: an estimator of `armlab identify --method`; the one that predicts
    best if left out. components: viscous and Coulomb friction, rotor inertia and offset at each joint if left out; with
    others the method is `weighted` if left out. cutoff_hz: of the low-pass, the one that predicts best if left out.
    as_read: the recording and the robot file are not doubted. Raises InputError where no run identifies, where the runs
    do not fit the arm, or where the recording is read wrongly.

        model = armlab.identify("my-recording")
        model.save("model.yaml")
    """
    if method is not None and method not in METHODS:
        raise InputError(f"unknown method {method!r}: {suggest_name(method, list(METHODS))}")
    recording = torque_recording_of(recording)
    require_identifiable(recording)
    wrong = None if as_read else wrong_reading(recording)
    if wrong is not None:
        raise InputError(f"{recording.name}: {wrong.sentence} `as_read=True` identifies it all the same")
    identifier, _ = fit_identifier(recording, IdentifyOptions(method, cutoff_hz, components=components))
    return identifier.model_


@dataclass(frozen=True, eq=False)
class Prediction:
    """A model beside a recording. errors: one a run. torque: by the name of the run, (samples, joints), N m (N)."""

    recording: Recording
    errors: tuple[RunError, ...]
    torque: dict[str, Array]

    def __repr__(self) -> str:
        lines = [f"Prediction of {self.recording.name!r}: error in percent of the torque, filtered and as recorded"]
        for each in self.errors[:SHOWN]:
            lines.append(f"  {each.run} ({each.role}): {_filtered_and_recorded(each)}")
        return "\n".join(lines + _count_more(len(self.errors), "runs"))

    def _repr_html_(self) -> str:
        rows = [
            (each.run, each.role, format_percent(each.relative_percent), format_percent(each.recorded_percent))
            for each in self.errors
        ]
        text = "Error in percent of the torque."
        return notebook_html(
            f"Prediction of {self.recording.name}", text, ("run", "role", "filtered", "recorded"), rows
        )


def predict(model: TorqueModel | str | Path, recording: GivenRecording) -> Prediction:
    """The torque of a model for every run of a recording, and its errors.

    model: of `identify`, of a verdict, or the path of a `model.yaml`. recording: or the path of its folder.
    Raises InputError where the model has another number of joints than the recording, and for torque that is none.
    """
    recording = torque_recording_of(recording)
    if isinstance(model, str | Path):
        model = Model.load(model)
    if not isinstance(model, TorqueModel):
        raise InputError(f"model should be a model, or the path of a model.yaml, not {type(model).__name__}")
    if len(model.arm) != len(recording.arm):
        raise InputError(f"the model has {len(model.arm)} joints, {recording.name} has {len(recording.arm)}")
    require_torque(recording)
    errors = tuple(run_error(model, model.signals(run), arm=recording.arm) for run in recording.runs)
    return Prediction(recording, errors, {run.name: model.predict(run) for run in recording.runs})


def _filtered_and_recorded(error: RunError) -> str:
    return f"{format_percent(error.relative_percent)}, {format_percent(error.recorded_percent)}"


def _count_more(count: int, what: str) -> list[str]:
    return [f"  and {count - SHOWN} more {what}"] if count > SHOWN else []
