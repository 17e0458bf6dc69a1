"""A changed load of a single joint between recordings of motion only.

The torque of such a recording is kp (command - position), so all that one reads from it is over kp. Another gain
changes gravity and friction by one factor; another load changes gravity and leaves friction alone. With the factors of
gravity l and of friction f, and their standard errors,

    log odds of the load = ((f - l)^2 / (s_f^2 + s_l^2) - (f - 1)^2 / s_f^2) / 2

They are added over the later recordings. Where kp is not stated, the load that the robot file gives to the old
recording sets the scale.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import date

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import DataError
from armlab.diagnosis.changes.comparison import Comparison, conclude, look_plainly
from armlab.diagnosis.changes.named import NamedChange
from armlab.diagnosis.changes.trends import recording_dates
from armlab.diagnosis.result import Rival
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.rows.simulation import read_simulation
from armlab.effects.links import PAYLOAD_FACTS
from armlab.recordings.motion import MotionRecording
from armlab.recordings.plain_least_squares import PlainChanges, compare_plain, prepare_rows, runs_of_motion
from armlab.recordings.recording import Recording, Run
from problem.arm import PARAMETER_NAMES, Arm
from problem.base_parameters import base_parameters

FIRST_MOMENTS = tuple(f"{name}1" for name in PARAMETER_NAMES[1:4])  # of the link, which gravity acts on
GAIN_EFFECT = "controller_gain_error"


def compare_load(
    old: MotionRecording, new: MotionRecording, *more: MotionRecording, dates: Sequence[date] = ()
) -> Comparison | None:
    """The comparison where a load explains the differences better than a gain does; None where it does not.

    Where a gain is out of the question, it may say that nothing changed. It is asked of arms of one joint: the gains of
    several joints have no common scale. dates: as of `compare_motion`.
    """
    if len(old.arm) != 1 or old.arm.links is None:
        return None
    settings = Settings()
    cutoff_hz = settings.tuning.comparison.plain_cutoff_hz
    moved = (old, new, *more)
    runs = [runs_of_motion(each) for each in moved]
    try:
        plain = [compare_plain(old.arm, runs[0], later, cutoff_hz) for later in runs[1:]]
    except DataError:
        return None
    speed = _usual_speed(runs[0], cutoff_hz)
    log_odds = sum(load_against_gain(each, speed) for each in plain)
    if log_odds <= 0:
        return None
    scale = 1.0 if _kp(old) is not None else newton_metres(old.arm, plain[0])
    recordings = [_with_torque(each, own, old, scale) for each, own in zip(moved, runs, strict=True)]
    simulation = read_simulation(recordings[0], None)
    seen = look_plainly(recordings, simulation, settings)
    if seen is None:
        return None
    notes = () if _kp(old) else ("kp is not stated: the load of the robot file in the old recording sets the scale.",)
    found = conclude(seen, recordings, (), notes, recording_dates(moved, dates))
    if log_odds > settings.tuning.comparison.least_evidence:
        return found
    if not any(each.effect == PAYLOAD_FACTS.id for each in found.findings):
        return None
    return replace(found, findings=tuple(_beside_gain(each, log_odds) for each in found.findings))


@dataclass(frozen=True)
class _Factor:
    """New over old, with its standard error."""

    value: float
    error: float


def load_against_gain(plain: PlainChanges, speed: float) -> float:
    """Log odds of another load against another gain. speed: at which friction is taken, rad/s (m/s)."""
    place = {name: number for number, name in enumerate(plain.names)}
    gravity = np.zeros(len(plain.names))
    for name in FIRST_MOMENTS:
        if name in place:
            gravity[place[name]] = plain.old[place[name]]
    friction = np.zeros(len(plain.names))
    friction[[place["coulomb1"], place["viscous1"]]] = 1.0, speed
    load, drag = (_factor(plain, each) for each in (gravity, friction))
    if not (load.error > 0 and drag.error > 0):
        return 0.0
    of_gain = (drag.value - load.value) ** 2 / (load.error**2 + drag.error**2)
    return float((of_gain - (drag.value - 1) ** 2 / drag.error**2) / 2)


def _factor(plain: PlainChanges, direction: Array) -> _Factor:
    """Of the parameters along a direction (columns,); its error is zero where the old recording has none."""
    size = float(plain.old @ direction)
    if size <= 0:
        return _Factor(1.0, 0.0)
    return _Factor(float(plain.new @ direction) / size, float(np.linalg.norm(plain.errors * direction)) / size)


def newton_metres(arm: Arm, plain: PlainChanges) -> float:
    """kp, by the first moments of the robot file over those of the old recording; 1 where they do not agree in sign."""
    base = base_parameters(arm)
    stated = dict(zip((base.names[each] for each in base.columns), base.values(arm.parameters), strict=True))
    found = dict(zip(plain.names, plain.old, strict=True))
    names = [each for each in FIRST_MOMENTS if each in stated and each in found]
    power = sum(stated[each] ** 2 for each in names)
    towards = sum(stated[each] * found[each] for each in names)
    return float(power / towards) if power > 0 and towards > 0 else 1.0


def _usual_speed(runs: Sequence[Run], cutoff_hz: float) -> float:
    """The root mean square of the speed, rad/s (m/s)."""
    return float(np.sqrt(np.mean(np.concatenate([prepare_rows(run, cutoff_hz).motion.velocity for run in runs]) ** 2)))


def _kp(recording: MotionRecording) -> float | None:
    return None if recording.controller is None else recording.controller.kp[0]


def _with_torque(recording: MotionRecording, runs: Sequence[Run], old: MotionRecording, scale: float) -> Recording:
    """As a recording with torque, N m. old: whose robot is the simulation."""
    own = tuple(Run(**{**vars(each), "torque": scale * each.torque}) for each in runs)
    return Recording(recording.folder, recording.robot, old.arm, own, recording.transmission)


def _beside_gain(named: NamedChange, log_odds: float) -> NamedChange:
    """A changed load with the gain among its rivals."""
    if named.effect != PAYLOAD_FACTS.id:
        return named
    rival = Rival(GAIN_EFFECT, named.joint, named.joints, False, log_odds)
    likely = named.probability / (1 + named.probability * np.exp(-log_odds))
    return replace(named, rivals=(*named.rivals, rival), probability=float(likely))
