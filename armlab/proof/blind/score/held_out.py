"""The held-out run of a case in the filter of the scorer, and the share of the gap that a diagnosis has closed.

The scorer shares no code with the diagnosis. The torque after a diagnosis is the prediction of its model
(`predicted/<run>.csv` beside the verdict, columns t, tau1, ...); everything else is computed here. The gap lies
between the refitted rigid model and the true floor. Without a prediction, the figures of the verdict are used, and the
row says `reported`.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.proof.blind.effects.hidden import smooth_sign
from armlab.proof.blind.score.cases import JudgedCase
from armlab.proof.blind.simulate import rigid_torque, rotor_torque
from armlab.recordings.differentiate import Signals, differentiate
from armlab.recordings.load import load_recording
from armlab.recordings.recording import Run
from problem.arm import Arm
from problem.base_parameters import base_parameters
from problem.regressor import observation_matrix

SCORE_CUTOFF_HZ = 12.0  # of the scorer's filter: above the reference motions


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Torque and residuals on the held-out run, each (kept, joints), N m, at `time` (kept,), s, low-passed.

    given: of the simulation as it was given. refit: of the best rigid links on the identification runs. friction: of
    the best rigid links with Coulomb and viscous friction and an offset at every joint. after: of the verdict's model,
    None where it predicted nothing. floor: of the true torque without noise.
    """

    time: Array
    torque: Array
    given: Array
    refit: Array
    friction: Array
    after: Array | None
    floor: Array


def filter_held_out_run(case: JudgedCase) -> HeldOut:
    """The held-out run of a case, filtered at 12 Hz."""
    recording = load_recording(case.recording)
    run = recording.with_role("validate")[0]
    signals = _filter_run(run)
    identify = [_filter_run(each) for each in recording.with_role("identify")]
    clean = _resample_evenly(run, signals.run, pd.read_parquet(case.clean).to_numpy())
    predicted = case.folder / "predicted" / f"{Path(run.file).stem}.csv"
    refit, friction = _refit_residuals(recording.arm, identify, signals)
    given = signals.filter(rigid_torque(recording.arm, signals.motion))
    after = None
    if predicted.is_file():
        after = signals.torque - signals.filter(_read_prediction(predicted, signals.run.time))
    return HeldOut(
        time=signals.time,
        torque=signals.torque,
        given=signals.torque - given,
        refit=refit,
        friction=friction,
        after=after,
        floor=signals.torque - signals.filter(clean),
    )


def rms(residual: Array) -> Array:
    """Root mean square of each joint, (joints,), N m."""
    return np.asarray(np.sqrt(np.mean(residual**2, axis=0)))


def _filter_run(run: Run) -> Signals:
    cutoff = min(SCORE_CUTOFF_HZ, 0.4 * run.rate_hz)
    return differentiate(run, cutoff_hz=cutoff, step=max(int(run.rate_hz / (4 * cutoff)), 1))


def _refit_residuals(arm: Arm, identify: list[Signals], signals: Signals) -> tuple[Array, Array]:
    """What rigid links leave of the held-out torque, and what they and plain friction leave, each (kept, joints)."""
    base = base_parameters(arm).columns
    learned = np.vstack([_fit_columns(arm, each, base) for each in identify])
    torque = np.concatenate([_torque_without_rotors(arm, each).ravel() for each in identify])
    there, wanted = _fit_columns(arm, signals, base), _torque_without_rotors(arm, signals)
    links = _fit_residual(learned[:, : len(base)], torque, there[:, : len(base)], wanted)
    return links, _fit_residual(learned, torque, there, wanted)


def _fit_residual(learned: Array, torque: Array, there: Array, wanted: Array) -> Array:
    """What the columns, with the values that they learned, leave of the wanted torque."""
    scale = np.linalg.norm(learned, axis=0)
    values = np.linalg.lstsq(learned / scale, torque, rcond=1e-8)[0] / scale
    return np.asarray(wanted - (there @ values).reshape(wanted.shape))


def _fit_columns(arm: Arm, signals: Signals, base: NDArray[np.intp]) -> Array:
    """Filtered columns of the base parameters, then a sign, a velocity and a constant for each joint."""
    velocity = signals.motion.velocity
    samples, joints = velocity.shape
    friction = np.zeros((samples, joints, joints, 3))
    for joint in range(joints):
        own = velocity[:, joint]
        friction[:, joint, joint] = np.column_stack([smooth_sign(own), own, np.ones(samples)])
    rigid = observation_matrix(arm, signals.motion)[:, base]
    return signals.columns(np.hstack([rigid, friction.reshape(samples * joints, 3 * joints)]))


def _torque_without_rotors(arm: Arm, signals: Signals) -> Array:
    return np.asarray(signals.torque - signals.filter(rotor_torque(arm, signals.motion)))


def _read_prediction(path: Path, time: Array) -> Array:
    """Predicted torque at the even stamps of the filtered run, (samples, joints)."""
    table = pd.read_csv(path)
    known = table["t"].to_numpy(dtype=np.float64)
    return np.column_stack([np.interp(time, known, table[name]) for name in table.columns if name != "t"])


def _resample_evenly(run: Run, even: Run, torque: Array) -> Array:
    """The sealed torque, which stands at the run's samples, at the even stamps of the filtered run."""
    time = run.time if len(run.time) == len(torque) else np.linspace(run.time[0], run.time[-1], len(torque))
    return np.column_stack([np.interp(even.time, time, column) for column in torque.T])


MIN_GAP_RATIO = 1.15  # times the floor: below, the rigid model leaves no gap to close


@dataclass(frozen=True)
class Gap:
    """Shares closed over all joints, None where there is no gap, and whose figures these are.

    closed: from the refitted rigid links. beyond: from rigid links and plain friction, both refitted; None in the clean
    tier, where no friction stands beside what is hidden.
    """

    closed: float | None
    beyond: float | None
    source: Literal["counted", "reported", "none"]


def measure_gap_closed(case: JudgedCase) -> Gap:
    """The share of the gap that the diagnosis of one case has closed."""
    if not case.truth.injected or case.verdict["status"] == "invalid":
        return Gap(None, None, "none")
    if not (case.folder / "predicted").is_dir():
        return _reported_gap(case)
    found = filter_held_out_run(case)
    if found.after is None:
        return _reported_gap(case)
    after, floor = rms(found.after), rms(found.floor)
    beyond = _share_closed(rms(found.friction), after, floor) if case.truth.background else None
    return Gap(_share_closed(rms(found.refit), after, floor), beyond, "counted")


def _share_closed(before: Array, after: Array, floor: Array) -> float | None:
    """(before - after) / (before - floor) of the joints whose gap is worth closing, each by its own floor."""
    worth = before > MIN_GAP_RATIO * floor
    if not worth.any():
        return None
    scaled_before, scaled_after = before[worth] / floor[worth], after[worth] / floor[worth]
    return float(np.sum(scaled_before - scaled_after) / np.sum(scaled_before - 1))


def _reported_gap(case: JudgedCase) -> Gap:
    """From the verdict's own errors and floor, in its own filter."""
    names = ("heldout_rms_before", "heldout_rms_after", "noise_floor")
    figures = np.array([[fit.get(name) for name in names] for fit in case.verdict["fit"]], dtype=np.float64)
    if not len(figures) or not np.all(np.isfinite(figures)) or np.any(figures[:, 2] <= 0):
        return Gap(None, None, "reported")
    return Gap(_share_closed(*figures.T), None, "reported")
