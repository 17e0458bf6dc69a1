"""Recordings that no diagnosis can be made of, and why."""

import numpy as np

from diagnosis.engine.observed import Observed
from diagnosis.engine.simulation import Simulation
from recordings.checks.fit import fit_findings
from recordings.recording import Recording
from recordings.run import Array

SHORTEST_S = 2.0  # s of motion in all runs that identify
TRAVEL = 1e-3  # rad (m): less is no motion
FAR = 3.0  # a torque that is so many times too large or too small on all joints is in another unit
TELLS = 0.3  # of the torque's scatter: a simulation that explains less on a joint says nothing about its unit
NOTHING = 0.02  # of it, on every joint: no simulation of this arm


def unsound(recording: Recording) -> str | None:
    """The reason in a sentence; None for a recording that can be used."""
    runs = recording.with_role("identify") or recording.runs
    seconds = sum(float(run.time[-1] - run.time[0]) for run in runs)
    if seconds < SHORTEST_S:
        return f"The runs hold {seconds:.2g} s in all: too short to tell physics from chance; record 10 s or more."
    travel = np.max([np.ptp(run.position, axis=0) for run in recording.runs], axis=0)
    if not np.any(travel > TRAVEL):
        return "No joint moves in any run: there is nothing that the torques could be compared with."
    silent = [joint + 1 for joint in range(len(recording.arm)) if all(not np.ptp(run.torque[:, joint]) for run in runs)]
    if silent:
        return f"The torque of joint {', '.join(map(str, silent))} never changes: is the right column named?"
    swapped = next((each for each in fit_findings(runs, recording.arm) if each.kind == "swapped_channels"), None)
    return None if swapped is None else f"The {swapped.text}. Put the columns right before looking for physics."


def misread(observed: Observed, simulation: Simulation) -> str | None:
    """Torque in a wrong unit or of the wrong sign, or the robot of another arm: where all joints say so together."""
    if simulation.kind == "refit" or simulation.inertial is None:
        return None
    gains, shares = _gains(observed, simulation)
    told = shares > TELLS
    if shares.max() < NOTHING:
        return (
            "The simulation explains next to nothing of any joint's torque: the robot file of another arm, or torque "
            "columns that are none?"
        )
    factor = float(np.median(gains[told])) if told.any() else 1.0
    if factor < 0:
        return "The measured torque has the opposite sign of the simulated one: turn its sign in `transmission`."
    if factor > FAR or factor < 1 / FAR:
        return f"The measured torque is about {factor:.3g} times the simulated one: another unit, or gains missing?"
    return None


def _gains(observed: Observed, simulation: Simulation) -> tuple[Array, Array]:
    """Per joint the factor between measured and simulated torque, friction fitted, and the share it explains."""
    simulated = np.concatenate([simulation.filtered(signals) for signals in observed.signals])
    measured, velocity = observed.torque, observed.kept("velocity")
    gains, shares = [], []
    for joint in range(observed.joints):
        friction = np.column_stack([velocity[:, joint], np.sign(velocity[:, joint]), np.ones(observed.rows)])
        column, torque = (
            each - friction @ np.linalg.lstsq(friction, each)[0] for each in (simulated[:, joint], measured[:, joint])
        )
        power = float(column @ column)
        gain = float(column @ torque) / power if power > 0 else 0.0
        gains.append(gain)
        shares.append(gain**2 * power / max(float(torque @ torque), 1e-300))
    return np.array(gains), np.array(shares)
