"""What a diagnosis of motion only says: plain data for the verdict, the files and the page."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.motion.choose import ChosenServo
from armlab.diagnosis.motion.motion_tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.replay import Replayed
from armlab.diagnosis.motion.servo import ServoParameter, Servos
from armlab.diagnosis.motion.servo_simulation import ServoSimulation
from armlab.diagnosis.motion.witness import CurrentWitness
from armlab.recordings.motion import MotionRecording

Status = Literal["mismatch", "none", "inconclusive"]


@dataclass(frozen=True)
class ServoFinding:
    """One number of a servo that differs from the simulation's.

    joint: from 1. nominal: of the simulation, NaN where it has none. before, after: error of the joint's replay on
    held-out windows with the number of the simulation and with this one, rad. rivals: other effects at this joint.
    """

    parameter: ServoParameter
    effect: str
    name: str
    joint: int
    value: float
    interval: tuple[float, float]
    nominal: float
    before: float
    after: float
    p_value: float
    rivals: tuple[str, ...]

    def is_shorter(self, sample: float) -> bool:
        """Whether it is a delay or a late reading within one sample, s, which the clock of a drive that holds makes."""
        return self.parameter.key == "delay" and abs(abs(self.value) - abs(self.nominal)) < sample

    def is_lead_of(self, step: float) -> bool:
        """Whether it may be a lead of half a step, s, of a simulator, whose integration makes that."""
        return self.effect == "channel_skew" and self.value > 0 and self.interval[0] < step / 2

    @property
    def holds_nominal(self) -> bool:
        """Whether the interval holds the simulation's number."""
        return self.interval[0] <= self.nominal <= self.interval[1]

    @property
    def equation(self) -> str:
        """The law with its number."""
        return self.parameter.equation.format(joint=self.joint, value=f"{self.value:.4g}")


@dataclass(frozen=True)
class ReplayError:
    """Errors of one joint on held-out data, rad (m).

    before, after: of its replay in windows; replay_before, replay_after: of the whole arm over whole runs; None where
    the simulation has no controller. command: of the command itself, taken as the position. spread: of the position
    about its mean. floor: of the encoder.
    """

    joint: int
    before: float | None
    after: float
    replay_before: float | None
    replay_after: float
    command: float
    spread: float
    floor: float

    def follows_command(self, tuning: MotionTuning = DEFAULT) -> bool:
        """Whether the replay tells more than the command alone, or the mean of the position."""
        return tells_of_a_servo(self.replay_after, min(self.command, self.spread), self.floor, tuning)


def tells_of_a_servo(error: float, without: float, floor: float, tuning: MotionTuning) -> bool:
    """Whether the error of a servo's replay is clearly below that without one, or near the noise; all in rad (m)."""
    return error < max(tuning.max_unexplained * without, tuning.at_floor * floor)


@dataclass(frozen=True, eq=False)
class MotionDiagnosis:
    """What a recording of motion only tells. Without an answer only status and summary are set.

    chosen: of each joint, None for one that stands still or follows no servo. servos: all numbers for the simulation
    after. odd: stretches that a servo does not explain: run, from, to. replayed_before, replayed_after: the
    held-out runs. replayed_alone: squared errors after, of each joint alone, (stretches, joints), rad2. tool: error of
    the tool before and after, m. currents: what those of the held-out runs say. rivals: of each joint, the effects that
    its motion does not tell from a fitted number, by the number's place.
    """

    recording: MotionRecording
    simulation: ServoSimulation
    status: Status
    reason: str = ""
    chosen: tuple[ChosenServo | None, ...] = ()
    servos: Servos | None = None
    findings: tuple[ServoFinding, ...] = ()
    errors: tuple[ReplayError, ...] = ()
    odd: tuple[tuple[str, float, float], ...] = ()
    replayed_before: tuple[Replayed, ...] = ()
    replayed_after: tuple[Replayed, ...] = ()
    replayed_alone: Array = field(default_factory=lambda: np.zeros((0, 0)))
    tool: tuple[float | None, float] = (None, 0.0)
    silent: tuple[int, ...] = ()
    currents: tuple[CurrentWitness, ...] = ()
    rivals: tuple[Mapping[int, tuple[str, ...]], ...] = ()
    seconds: float = 0.0
