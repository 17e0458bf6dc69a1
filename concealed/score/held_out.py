"""The held-out run of a case in the scorer's own filter: what was measured, and what each model leaves of it.

The scorer shares no code with what it judges: torque after a diagnosis is the one that the verdict's model predicts
(`predicted/<run>.csv` beside the verdict, columns t, tau1, ...); all else is computed here.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from concealed.effects.hidden import sign
from concealed.score.reading import Judged
from concealed.simulate import rigid_torque, rotor_torque
from problem.arm import Arm
from problem.base_parameters import base_parameters
from problem.regressor import observation_matrix
from recordings.differentiate import Signals, differentiate
from recordings.load import load_recording
from recordings.run import Array, Run

CUTOFF_HZ = 12.0  # of the scorer's filter: above the reference motions


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


def held_out(case: Judged) -> HeldOut:
    """The held-out run of a case, filtered at 12 Hz."""
    recording = load_recording(case.recording)
    run = recording.with_role("validate")[0]
    signals = _signals(run)
    identify = [_signals(each) for each in recording.with_role("identify")]
    clean = _even(run, signals.run, pd.read_parquet(case.clean).to_numpy())
    predicted = case.folder / "predicted" / f"{Path(run.file).stem}.csv"
    refit, friction = _refits(recording.arm, identify, signals)
    given = signals.filter(rigid_torque(recording.arm, signals.motion))
    return HeldOut(
        time=signals.time,
        torque=signals.torque,
        given=signals.torque - given,
        refit=refit,
        friction=friction,
        after=signals.torque - signals.filter(_prediction(predicted, signals.run.time))
        if predicted.is_file()
        else None,
        floor=signals.torque - signals.filter(clean),
    )


def rms(residual: Array) -> Array:
    """Root mean square of each joint, (joints,), N m."""
    return np.asarray(np.sqrt(np.mean(residual**2, axis=0)))


def _signals(run: Run) -> Signals:
    cutoff = min(CUTOFF_HZ, 0.4 * run.rate_hz)
    return differentiate(run, cutoff_hz=cutoff, step=max(int(run.rate_hz / (4 * cutoff)), 1))


def _refits(arm: Arm, identify: list[Signals], signals: Signals) -> tuple[Array, Array]:
    """What rigid links leave of the held-out torque, and what they and plain friction leave, each (kept, joints)."""
    base = base_parameters(arm).columns
    learned = np.vstack([_columns(arm, each, base) for each in identify])
    torque = np.concatenate([_without_rotors(arm, each).ravel() for each in identify])
    there, wanted = _columns(arm, signals, base), _without_rotors(arm, signals)
    left = (_left(learned[:, :number], torque, there[:, :number], wanted) for number in (len(base), learned.shape[1]))
    return next(left), next(left)


def _left(learned: Array, torque: Array, there: Array, wanted: Array) -> Array:
    """What the columns, with the values that they learned, leave of the wanted torque."""
    scale = np.linalg.norm(learned, axis=0)
    values = np.linalg.lstsq(learned / scale, torque, rcond=1e-8)[0] / scale
    return np.asarray(wanted - (there @ values).reshape(wanted.shape))


def _columns(arm: Arm, signals: Signals, base: NDArray[np.intp]) -> Array:
    """Filtered columns of the base parameters, then a sign, a velocity and a constant for each joint."""
    velocity = signals.motion.velocity
    samples, joints = velocity.shape
    friction = np.zeros((samples, joints, joints, 3))
    for joint in range(joints):
        own = velocity[:, joint]
        friction[:, joint, joint] = np.column_stack([sign(own), own, np.ones(samples)])
    rigid = observation_matrix(arm, signals.motion)[:, base]
    return signals.columns(np.hstack([rigid, friction.reshape(samples * joints, 3 * joints)]))


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
