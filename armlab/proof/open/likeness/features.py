"""What a recording looks like, in numbers: one row of features a joint.

The list was fixed before any of them was computed on a real recording. All are ratios, shares, or logarithms of a time
or a rate, so that the size of an arm tells nothing. The rest of a joint is its low-passed torque without what plain
least squares explains by links, rotors, Coulomb and viscous friction and an offset, fitted to all runs together.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import DataError
from armlab.recordings.cutoff import choose_cutoff
from armlab.recordings.differentiate import resample_evenly
from armlab.recordings.load import load_recording
from armlab.recordings.motion import is_motion_only, load_motion_recording
from armlab.recordings.plain_least_squares import (
    COULOMB_WIDTH,
    HeldOutRows,
    PlainFit,
    fit_plain,
    runs_of_motion,
)
from armlab.recordings.recording import ROLES, Run
from problem.arm import Arm

FEATURES: dict[str, str] = {
    "left_share": "rest over torque without its mean, RMS, log10",
    "rest_correlation": "time in which the correlation of the rest falls to 1/e, over a period of the motion, log10",
    "rest_slow": "power of the rest below a quarter of the band of the motion, share",
    "rest_within": "power of the rest from there to the end of that band, share",
    "noise_above": "torque above the cut-off over torque without its mean, RMS, log10",
    "by_velocity": "share of the rest's power that a curve of velocity explains",
    "by_position": "share of the rest's power that a curve of position explains",
    "by_load": "share of the rest's power that a curve of the torque of the links explains",
    "rate": "samples a second, log10",
    "duration": "length of all runs, s, log10",
    "speed_rms": "RMS over peak of the velocity",
    "slow_share": "share of the time below a tenth of the peak velocity",
    "standing_share": "share of the time below a hundredth of the peak velocity",
    "moving_at_once": "share of the joints that are above a twentieth of their peak velocity, mean over time",
    "position_distinct": "distinct values of the position over samples, log10",
    "torque_distinct": "distinct values of the torque over samples, log10",
    "position_held": "samples with the position of the sample before, share",
    "torque_held": "samples with the torque of the sample before, share",
}


@dataclass(frozen=True)
class LikenessSettings:
    """How features are computed; fixed before the first look.

    bandwidth_multiple: cut-off over the band of the motion, which holds 99 % of the velocity's power. cutoff_hz:
    smallest cut-off. cutoff_share: largest one, of the rate. curve_bins: of a curve of velocity, position or load, of
    equal numbers of rows. min_samples: of a run that counts. min_share: what a logarithm takes for nothing.
    """

    bandwidth_multiple: float = 5.0
    cutoff_hz: float = 1.0
    cutoff_share: float = 0.2
    curve_bins: int = 12
    min_samples: int = 100
    min_share: float = 1e-6


LIKENESS = LikenessSettings()


@dataclass(frozen=True, eq=False)
class RecordingFeatures:
    """Features of one recording, (joints, features), in the order of `FEATURES`; a joint without motion or torque has
    no row."""

    folder: Path
    values: Array


def recording_features(folder: Path) -> RecordingFeatures:
    """The features of a recording folder; DataError where no joint of it has any.

    A recording of motion only takes part with what its drives are asked for, kp (reference - position); kp is 1 where
    the folder does not know it.
    """
    arm, joints, recorded = read_runs(folder)
    band = max(motion_band_hz(run) for run in recorded)
    rate = float(np.median([run.rate_hz for run in recorded]))
    cutoff = min(max(LIKENESS.bandwidth_multiple * band, LIKENESS.cutoff_hz), LIKENESS.cutoff_share * rate)
    fitted_and_judged = [replace(run, role=role) for role in ROLES for run in recorded]
    fit = fit_plain(arm, fitted_and_judged, cutoff, joints)
    links = _links_torque(fit)
    shared = _features_of_all_joints(recorded, fit)
    rows = []
    for joint in range(len(joints)):
        position = np.concatenate([run.position[:, joint] for run in recorded])
        torque = np.concatenate([run.torque[:, joint] for run in recorded])
        if np.ptp(position) > 0 and np.ptp(torque) > 0:
            own = _features_of_joint(recorded, fit, links, band, joint) | shared
            rows.append([own[name] for name in FEATURES])
    if not rows:
        raise DataError(f"{folder} has no joint that moves and has torque")
    return RecordingFeatures(folder, np.array(rows))


def read_runs(folder: Path) -> tuple[Arm, tuple[int, ...], tuple[Run, ...]]:
    """The arm, the places of its recorded joints from 0, and the runs that are long enough, of motion only, too."""
    if is_motion_only(folder):
        moving = load_motion_recording(folder)
        arm, joints, runs = moving.arm, moving.joints, runs_of_motion(moving)
    else:
        recording = load_recording(folder)
        arm, joints, runs = recording.arm, tuple(range(len(recording.arm))), recording.runs
    runs = tuple(run for run in runs if run.samples >= LIKENESS.min_samples)
    if not runs:
        raise DataError(f"{folder} has no run of {LIKENESS.min_samples} samples")
    return arm, joints, runs


def motion_band_hz(run: Run) -> float:
    """The band that holds 99 % of the power of the velocity, Hz."""
    even = resample_evenly(run)
    return choose_cutoff(even.position, even.rate_hz).motion_hz


def _links_torque(fit: PlainFit) -> list[Array]:
    """Torque of the fitted links and rotors on each run, (rows, joints), N m: without what friction and offset make."""
    coulomb, viscous, offset = (
        np.array([fit.value(name, joint + 1) for joint in fit.joints]) for name in ("coulomb", "viscous", "offset")
    )
    width = COULOMB_WIDTH * np.where(fit.top_speed > 0, fit.top_speed, 1.0)
    out = []
    for each in fit.held_out:
        velocity = each.rows.motion.velocity
        friction = coulomb * np.tanh(velocity / width) + viscous * velocity + offset
        out.append(each.rows.torque - each.residual - friction)
    return out


def _features_of_all_joints(recorded: Sequence[Run], fit: PlainFit) -> dict[str, float]:
    speed = np.abs(np.concatenate([each.rows.motion.velocity for each in fit.held_out]))
    peak = np.maximum(speed.max(axis=0), 1e-12)
    return {
        "rate": float(np.log10(np.median([run.rate_hz for run in recorded]))),
        "duration": float(np.log10(sum(run.time[-1] - run.time[0] for run in recorded))),
        "moving_at_once": float(np.mean(speed > peak / 20)),
    }


def _features_of_joint(
    recorded: Sequence[Run], fit: PlainFit, links: Sequence[Array], band_hz: float, joint: int
) -> dict[str, float]:
    runs = fit.held_out
    rest, torque, load, position, velocity = (
        np.concatenate([column[:, joint] for column in columns])
        for columns in (
            [each.residual for each in runs],
            [each.rows.torque for each in runs],
            links,
            [each.rows.motion.position for each in runs],
            [each.rows.motion.velocity for each in runs],
        )
    )
    size = float(np.std(torque))
    above = np.concatenate([_above_cutoff(each, joint) for each in runs])
    slow, within = _rest_spectrum(runs, band_hz, joint)
    speed = np.abs(velocity) / max(float(np.abs(velocity).max()), 1e-12)
    return {
        "left_share": _log_share(_rms(rest), size),
        "rest_correlation": float(np.log10(_correlation_s(runs, joint) * band_hz)),
        "rest_slow": slow,
        "rest_within": within,
        "noise_above": _log_share(_rms(above), size),
        "by_velocity": _explained(rest, velocity),
        "by_position": _explained(rest, position),
        "by_load": _explained(rest, load),
        "speed_rms": _rms(speed),
        "slow_share": float(np.mean(speed < 0.1)),
        "standing_share": float(np.mean(speed < 0.01)),
        "position_distinct": _distinct([run.position[:, joint] for run in recorded]),
        "torque_distinct": _distinct([run.torque[:, joint] for run in recorded]),
        "position_held": _held([run.position[:, joint] for run in recorded]),
        "torque_held": _held([run.torque[:, joint] for run in recorded]),
    }


def _above_cutoff(run: HeldOutRows, joint: int) -> Array:
    """Torque above the cut-off at all samples but those near the ends, N m."""
    torque = run.rows.run.torque[:, joint]
    left = torque - run.rows.low_pass.smooth(torque[:, None])[:, 0]
    return np.asarray(left[run.rows.low_pass.trim : len(left) - run.rows.low_pass.trim])


def _rest_spectrum(runs: Sequence[HeldOutRows], band_hz: float, joint: int) -> tuple[float, float]:
    """Shares of the rest's power below a quarter of the band of the motion, and from there to its end."""
    power = np.zeros(3)
    for each in runs:
        time, rest = each.rows.time, each.residual[:, joint]
        frequency = np.fft.rfftfreq(len(rest), float(time[1] - time[0]))
        spectrum = np.abs(np.fft.rfft(rest)) ** 2
        power += np.bincount(np.digitize(frequency, (band_hz / 4, band_hz)), spectrum, 3)
    total = max(float(power.sum()), 1e-300)
    return float(power[0] / total), float(power[1] / total)


def _correlation_s(runs: Sequence[HeldOutRows], joint: int) -> float:
    """Time in which the autocorrelation of the rest falls to 1/e, s, mean over runs by their length; at least a row."""
    times = []
    for each in runs:
        rest, step = each.residual[:, joint], float(each.rows.time[1] - each.rows.time[0])
        spectrum = np.abs(np.fft.rfft(rest - rest.mean(), 2 * len(rest))) ** 2
        correlation = np.fft.irfft(spectrum)[: len(rest)]
        below = np.flatnonzero(correlation < correlation[0] / np.e)
        times.append((len(rest), step * max(int(below[0]) if len(below) else len(rest), 1)))
    lengths, seconds = np.array(times).T
    return float(np.average(seconds, weights=lengths))


def _explained(rest: Array, variable: Array) -> float:
    """Share of the rest's power that its means in bins of a variable explain."""
    bins = LIKENESS.curve_bins
    edges = np.quantile(variable, np.linspace(0, 1, bins + 1)[1:-1])
    place = np.searchsorted(edges, variable)
    count = np.maximum(np.bincount(place, minlength=bins), 1)
    means = np.bincount(place, rest, bins) / count
    total = float(np.sum((rest - rest.mean()) ** 2))
    if total == 0:
        return 0.0
    left = float(np.sum((rest - means[place]) ** 2))
    return float(1 - left / total)


def _rms(signal: Array) -> float:
    return float(np.sqrt(np.mean(signal**2)))


def _log_share(part: float, whole: float) -> float:
    return float(np.log10(max(part / whole if whole > 0 else 0.0, LIKENESS.min_share)))


def _distinct(runs: Sequence[Array]) -> float:
    values = np.concatenate(runs)
    return float(np.log10(len(np.unique(values)) / len(values)))


def _held(runs: Sequence[Array]) -> float:
    same = np.concatenate([np.diff(run) == 0 for run in runs])
    return float(np.mean(same))
