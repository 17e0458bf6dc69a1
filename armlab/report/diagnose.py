"""The diagnosis of a recording with its summary in words, for scripts and notebooks."""

from dataclasses import replace

from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.settings import Baseline, Settings
from armlab.diagnosis.torque import diagnose as engine
from armlab.recordings.recording import Recording
from armlab.report.account.summary import summary_of


def diagnose(
    recording: Recording,
    baseline: Baseline | None = None,
    seed: int = 0,
    settings: Settings | None = None,
    as_read: bool = False,
) -> Diagnosis:
    """Where the simulation and the recording differ, and what physics is missing, with a summary in words.

    Arguments and errors: those of `armlab.diagnosis.torque.diagnose.diagnose`.

        print(armlab.diagnose(armlab.read_recording("my-recording")).summary)
    """
    found = engine.diagnose(recording, baseline, seed, settings, as_read=as_read)
    return replace(found, summary=summary_of(found))
