"""How much of the gap between the refitted rigid model and the true floor a diagnosis has closed.

Counted on the held-out run, in the scorer's own filter, from the torque that the verdict's model predicts
(`predicted/<run>.csv` beside the verdict, columns t, tau1, ...). Where there is no prediction the verdict's own
figures are taken, and the row says so.
"""

from pathlib import Path

import numpy as np
import pandas as pd

from concealed.score.reading import Judged
from concealed.simulate import rotor_torque
from problem.arm import Arm
from problem.base_parameters import base_parameters
from problem.regressor import observation_matrix
from recordings.differentiate import Signals, differentiate
from recordings.load import load_recording
from recordings.run import Array, Run

CUTOFF_HZ = 12.0  # of the scorer's filter: above the reference motions
LEAST_GAP = 1.15  # times the floor: where the rigid model is nearly there, no gap is left to close


def gap_closed(case: Judged) -> tuple[float | None, str]:
    """Share of the gap that is closed over all joints, None where there is none, and whose figures these are."""
    if not case.truth["injected"] or case.verdict["status"] == "invalid":
        return None, "none"
    if not (case.folder / "predicted").is_dir():
        return _reported(case)
    recording = load_recording(case.recording)
    run = recording.with_role("validate")[0]
    predicted = case.folder / "predicted" / f"{Path(run.file).stem}.csv"
    held_out = _signals(run)
    identify = [_signals(each) for each in recording.with_role("identify")]
    after = held_out.torque - held_out.filter(_prediction(predicted, held_out.run.time))
    floor = held_out.torque - held_out.filter(_even(run, held_out.run, pd.read_parquet(case.clean).to_numpy()))
    before = _refit(recording.arm, identify, held_out)
    return _share(*(_rms(each) for each in (before, after, floor))), "counted"


def _share(before: Array, after: Array, floor: Array) -> float | None:
    """(before - after) / (before - floor) of the joints whose gap is worth closing, each by its own floor."""
    worth = before > LEAST_GAP * floor
    if not worth.any():
        return None
    scaled = [each[worth] / floor[worth] for each in (before, after)]
    return float(np.sum(scaled[0] - scaled[1]) / np.sum(scaled[0] - 1))


def _reported(case: Judged) -> tuple[float | None, str]:
    """From the verdict's own errors and floor, in its own filter."""
    names = ("heldout_rms_before", "heldout_rms_after", "noise_floor")
    figures = np.array([[fit.get(name) for name in names] for fit in case.verdict["fit"]], dtype=np.float64)
    if not len(figures) or not np.all(np.isfinite(figures)) or np.any(figures[:, 2] <= 0):
        return None, "reported"
    return _share(*figures.T), "reported"


def _signals(run: Run) -> Signals:
    cutoff = min(CUTOFF_HZ, 0.4 * run.rate_hz)
    return differentiate(run, cutoff_hz=cutoff, step=max(int(run.rate_hz / (4 * cutoff)), 1))


def _refit(arm: Arm, identify: list[Signals], held_out: Signals) -> Array:
    """What the best rigid links leave of the held-out torque, (kept, joints)."""
    columns = base_parameters(arm).columns
    rows = [signals.columns(observation_matrix(arm, signals.motion)[:, columns]) for signals in identify]
    torques = [_without_rotors(arm, signals).ravel() for signals in identify]
    scale = np.linalg.norm(np.vstack(rows), axis=0)
    values = np.linalg.lstsq(np.vstack(rows) / scale, np.concatenate(torques), rcond=1e-8)[0] / scale
    predicted = held_out.columns(observation_matrix(arm, held_out.motion)[:, columns]) @ values
    return np.asarray(_without_rotors(arm, held_out) - predicted.reshape(held_out.torque.shape))


def _without_rotors(arm: Arm, signals: Signals) -> Array:
    return np.asarray(signals.torque - signals.filter(rotor_torque(arm, signals.motion)))


def _prediction(path: Path, time: Array) -> Array:
    """Predicted torque at the even stamps of the filtered run, (samples, joints)."""
    table = pd.read_csv(path)
    known = table["t"].to_numpy(dtype=np.float64)
    return np.column_stack([np.interp(time, known, table[name]) for name in table.columns if name != "t"])


def _even(run: Run, even: Run, torque: Array) -> Array:
    """The sealed torque, which stands at the run's samples, at the even stamps of the filtered run."""
    time = run.time if len(run.time) == len(torque) else np.linspace(run.time[0], run.time[-1], len(torque))
    return np.column_stack([np.interp(even.time, time, column) for column in torque.T])


def _rms(residual: Array) -> Array:
    return np.asarray(np.sqrt(np.mean(residual**2, axis=0)))
