"""What a recorded current says of the drives that were found.

Its scale and sign are unknown, and some drives log its size alone, or the current of their supply, which goes with the
square of the torque. So it finds no number. But it knows the torque that each law of the drive makes of the recorded
commands and positions, and how well it follows each is evidence that took no part in the diagnosis:

    torque = s clip((kp - ki_speed) e - kd qd + i, -most, most)

most is the limit, less what it falls by with speed where the drive does work. e and qd are as measured. What of a
damping is in the drive, and what in the joint, a motion tells only where the limit acts; a current tells it anywhere.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.motion.estimate import with_damping_inside
from armlab.diagnosis.motion.servo import place
from armlab.diagnosis.motion.servo_simulation import ServoSimulation
from armlab.diagnosis.motion.windows import even_time, held_command, smooth_motion, supply_factor
from armlab.recordings.recording import MotionRun

Form = Literal["signed", "size", "squared"]
LEAST_SAMPLES = 100  # of a current that varies: fewer say nothing


@dataclass(frozen=True)
class CurrentWitness:
    """How the current of a joint follows the torque of its drive: correlations over the held-out runs.

    joint: from 1. form: of the torque that it goes with: the torque itself, its size, or its square. found: with the
    numbers found; given: with those of the simulation, None where it has none; inside: with the numbers found and all
    damping beyond the simulation's in the drive, None where there is none.
    """

    joint: int
    form: Form
    found: float
    given: float | None
    inside: float | None


def correlate_currents(
    runs: Sequence[MotionRun], simulation: ServoSimulation, found: Array
) -> tuple[CurrentWitness, ...]:
    """What the currents of some runs say of each joint; empty without currents that vary.

    found: numbers of the servos, (joints, parameters).
    """
    told = [run for run in runs if run.current is not None]
    out = []
    for row, values in enumerate(found):
        current = np.concatenate([np.asarray(run.current)[:, row] for run in told]) if told else np.zeros(0)
        sound = np.isfinite(current)
        if sound.sum() < LEAST_SAMPLES or np.ptp(current[sound]) == 0:
            continue
        nominal = simulation.nominal.values[row]
        damping = np.where(np.isnan(nominal), 0.0, nominal)
        inside = with_damping_inside(values, damping)
        laws = {"found": values, "given": nominal, "inside": inside}
        torques = {
            name: np.concatenate([drive_torque(run, simulation, row, law) for run in told])[sound]
            for name, law in laws.items()
            if np.isfinite(law[place("kp")])
        }
        current = current[sound]
        forms: tuple[Form, ...] = ("signed",) if current.min() < 0 < current.max() else ("size", "squared")
        follows = {form: {name: _follows(current, torque, form) for name, torque in torques.items()} for form in forms}
        form = max(forms, key=lambda each: follows[each]["found"])
        own = follows[form]
        moved = inside[place("kd")] != values[place("kd")]
        damped = own["inside"] if moved else None
        out.append(CurrentWitness(simulation.number_of(row), form, own["found"], own.get("given"), damped))
    return tuple(out)


def drive_torque(run: MotionRun, simulation: ServoSimulation, row: int, values: Array) -> Array:
    """Torque that a drive makes of the recorded command and position of a joint, (samples,), N m.

    row: of the recorded joints, from 0. values: (parameters,).
    """
    kp, kd, ki, of_speed = (float(values[place(key)]) for key in ("kp", "kd", "ki", "ki_speed"))
    delay, half = float(values[place("delay")]), float(values[place("dead_band")]) / 2
    command = held_command(run, row, run.time - delay, simulation.rate_hz) + float(values[place("offset")])
    error = command - run.position[:, row]
    error = error - np.clip(error, -half, half)
    velocity = np.interp(run.time, even_time(run), smooth_motion(run, simulation.read_delay).velocity[:, row])
    integral, most = np.zeros(len(error)), float(values[place("integral_limit")])
    if ki > 0:
        growth = np.diff(run.time, prepend=run.time[0]) * (ki * error - of_speed * velocity)
        for sample in range(1, len(error)):
            integral[sample] = np.clip(integral[sample - 1] + growth[sample], -most, most)
    asked = (kp - of_speed) * error - kd * velocity + integral
    less = np.where(asked * velocity > 0, float(values[place("limit_slope")]) * np.abs(velocity), 0.0)
    limit = np.maximum(float(values[place("limit")]) - less, 0.0)
    torque = np.clip(asked, -limit, limit)
    supply = supply_factor(run, row, run.time, simulation.supply)
    return np.asarray(torque if supply is None else supply * torque)


def _follows(current: Array, torque: Array, form: Form) -> float:
    """Correlation of a current with a torque, its size or its square; of any sign where it has one."""
    shaped = {"signed": torque, "size": np.abs(torque), "squared": torque**2}[form]
    if np.ptp(shaped) == 0:
        return 0.0
    found = float(np.corrcoef(current if form == "signed" else np.abs(current), shaped)[0, 1])
    return abs(found) if form == "signed" else found
