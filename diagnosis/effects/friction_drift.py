"""All forms of friction that changes as the joint warms."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.effects.contract import Candidate, Family, Scene, Value
from diagnosis.effects.drift import CoulombDrift, ViscousDrift
from diagnosis.effects.term import moves, restored_by
from diagnosis.effects.warming import HeatedFriction, ThermometerFriction
from problem.arm import Arm
from recordings.run import Array

OF_RECORDING = (0.1, 0.3, 1.0)  # time constants of a first look
TIME_RANGE = (0.02, 3.0)  # of the whole recording
FORMS = (ViscousDrift, CoulombDrift, HeatedFriction, ThermometerFriction)


@dataclass(frozen=True)
class DriftFamily(Family):
    """Drift by time and heat at each joint, runs cold or following one another; by temperature where recorded."""

    effect: str = "friction_drift"

    def candidates(self, arm: Arm, scenes: Sequence[Scene]) -> list[list[Candidate]]:
        """Several forms a joint."""
        clocks = [()] if len(scenes) == 1 else [(), _clock(scenes)]
        total = sum(float(scene.time[-1]) for scene in scenes)
        found: list[list[Candidate]] = []
        for joint in (joint for joint in range(1, len(arm) + 1) if moves(scenes, joint)):
            power = float(np.mean([np.mean(scene.motion.velocity[:, joint - 1] ** 2) for scene in scenes]))
            for clock in clocks:
                details = {"bounds": ((TIME_RANGE[0] * total, TIME_RANGE[1] * total),), "began": clock}
                for form, more in ((ViscousDrift, {}), (CoulombDrift, {}), (HeatedFriction, {"power": power})):
                    found.append([form.at(arm, joint, shape=(x * total,), **details, **more) for x in OF_RECORDING])
            found += _by_temperature(arm, joint, scenes)
        return found

    def restored(
        self, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Value], form: str = ""
    ) -> tuple[Candidate, Array]:
        """Drift of runs that begin cold."""
        return restored_by(FORMS, arm, joints, parameters, form)


def _clock(scenes: Sequence[Scene]) -> tuple[tuple[str, float], ...]:
    """Seconds before each run, as if they followed one another, and before one that comes after them."""
    ends = np.cumsum([0.0, *(float(scene.time[-1] + scene.step) for scene in scenes)])
    return tuple(zip([*(scene.run for scene in scenes), ""], ends.tolist(), strict=True))


def _by_temperature(arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[list[Candidate]]:
    """One candidate for each thermometer that changes; every run needs them."""
    channels = [scene.temperature for scene in scenes if scene.temperature is not None]
    if len(channels) < len(scenes):
        return []
    lows, highs = (np.array([bound(each, axis=0) for each in channels]) for bound in (np.nanmin, np.nanmax))
    spans = zip(lows.min(axis=0).tolist(), highs.max(axis=0).tolist(), strict=True)
    return [
        [ThermometerFriction.at(arm, joint, sensor=sensor, span=(low, high))]
        for sensor, (low, high) in enumerate(spans)
        if high > low
    ]


FRICTION_DRIFT = DriftFamily()
