"""The whole diagnosis of a recording, from its runs to everything that can be said."""

import time

from diagnosis.engine.rounds import Progress, found
from diagnosis.result import Diagnosis
from diagnosis.settings import Baseline, Settings
from diagnosis.stages import prepared
from recordings.recording import Recording


def diagnose(
    recording: Recording,
    baseline: Baseline | None = None,
    seed: int = 0,
    settings: Settings | None = None,
    progress: Progress = lambda message: None,
) -> Diagnosis:
    """Where the simulation and the recording differ, what physics is missing, and how much better it then predicts.

    baseline: what is compared; the simulation where there is one if left out. seed: of the surrogates' random waves.
    progress: is told what is being done. Raises InputError where the wanted baseline is not there.
    """
    started = time.perf_counter()
    ready = prepared(recording, baseline, seed, settings or Settings(), progress)
    if isinstance(ready, Diagnosis):
        return ready
    return ready.told(found(ready.begun(progress), progress), started, progress)
