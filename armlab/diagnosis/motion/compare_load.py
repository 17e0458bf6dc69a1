"""A changed load of a single joint between two recordings of motion only.

The torque of such a recording is kp (command - position), so all that one reads from it is over kp. A gain that changed
would have changed gravity, inertia and friction by one factor; a load changes gravity and leaves friction nearly alone.
Both are weighed on the same table as the changes of a recording with torque. Where kp is not stated, the load that the
robot file gives to the old recording sets the scale.
"""

from collections.abc import Sequence

import numpy as np

from armlab.common.errors import DataError
from armlab.diagnosis.compare.comparison import Comparison, conclude, look_plainly
from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.simulation import read_simulation
from armlab.effects.drive import TORQUE_GAIN_FACTS
from armlab.effects.links import PAYLOAD_FACTS
from armlab.recordings.motion import MotionRecording
from armlab.recordings.plain_least_squares import PlainFit, fit_plain, runs_of_motion
from armlab.recordings.recording import Recording, Run
from problem.base_parameters import base_parameters

GRAVITY_NAMES = ("mcx", "mcy", "mcz")


def compare_load(old: MotionRecording, new: MotionRecording) -> Comparison | None:
    """The comparison that explains the difference by another load; None where another cause explains it as well.

    It is asked of arms of one joint: the gains of several joints have no common scale.
    """
    if len(old.arm) != 1 or old.arm.links is None:
        return None
    runs = [runs_of_motion(each) for each in (old, new)]
    try:
        scale = _newton_metres(old, runs[0])
        recordings = [_with_torque(each, own, old, scale) for each, own in zip((old, new), runs, strict=True)]
    except DataError:
        return None
    simulation = read_simulation(recordings[0], None)
    seen = look_plainly(recordings, simulation, Settings())
    if seen is None:
        return None
    effects = {seen.table.groups[each.group].candidate.effect for each in seen.sound.named}
    if PAYLOAD_FACTS.id not in effects or TORQUE_GAIN_FACTS.id in effects:
        return None
    diagnoses = [Diagnosis(each, simulation, "inconclusive", "") for each in recordings]
    notes = () if _kp(old) else ("kp is not stated: the load of the robot file in the old recording sets the scale.",)
    return conclude(seen, diagnoses, notes, ())


def _kp(recording: MotionRecording) -> float | None:
    return None if recording.controller is None else recording.controller.kp[0]


def _newton_metres(recording: MotionRecording, runs: Sequence[Run]) -> float:
    """What the torque of `runs_of_motion` has to be multiplied by: 1 where kp is stated."""
    if _kp(recording) is not None:
        return 1.0
    found = fit_plain(recording.arm, runs, Settings().tuning.comparison.plain_cutoff_hz)
    base = base_parameters(recording.arm)
    known = dict(zip((base.names[each] for each in base.columns), base.values(recording.arm.parameters), strict=True))
    names = [each for each in found.names if each.rstrip("0123456789") in GRAVITY_NAMES and each in known]
    stated, seen = np.array([[known[each], _value(found, each)] for each in names]).T.reshape(2, -1)
    towards = float(stated @ seen)
    return float(stated @ stated) / towards if towards > 0 else 1.0


def _value(found: PlainFit, name: str) -> float:
    return float(found.values[found.names.index(name)])


def _with_torque(recording: MotionRecording, runs: Sequence[Run], old: MotionRecording, scale: float) -> Recording:
    """As a recording with torque, N m. old: whose robot is the simulation."""
    own = tuple(Run(**{**vars(each), "torque": scale * each.torque}) for each in runs)
    return Recording(recording.folder, recording.robot, old.arm, own, recording.transmission)
