"""The same recording in another form: thinned, resampled, cut, with another clock and other names, or a law added."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from armlab.common.arrays import Array
from armlab.recordings.differentiate import differentiate, resample_at
from armlab.recordings.recording import Recording, Run

THINNED_EVERY = 5  # rows, of which one is left out
RESAMPLED_RATE = 0.9  # of the rate
NOISE = 1e-9  # of a signal's own unit
FEWER_SHARE = 0.6  # of the time of each run
CLOCK_SHIFT_S = 1234.5
WHOLE = "whole"
FIRST_S, LAST_S, STRETCH_S, ROW_STEPS = (4.0, 6.0, 12.0), 6.0, 3.0, (2, 3, 5)  # what is cut from a recording
ADDED_SHARE = 0.3  # of the root mean square of the torque
SPOILT_SCALES, SPOILT_NOISE = (0.3, 1.6), 0.3  # of the torque of a joint; of the deviation of each joint's torque


def with_runs(recording: Recording, runs: list[Run]) -> Recording:
    """The recording with other runs."""
    return replace(recording, runs=tuple(runs))


def thinned(recording: Recording) -> Recording:
    """One of five rows left out."""
    kept = [run.rows(np.arange(run.samples) % THINNED_EVERY != THINNED_EVERY - 1) for run in recording.runs]
    return with_runs(recording, kept)


def resampled(recording: Recording) -> Recording:
    """All signals at nine tenths of the rate."""
    out = []
    for run in recording.runs:
        count = int(RESAMPLED_RATE * (run.samples - 1))
        out.append(resample_at(run, run.time[0] + np.arange(count) / (RESAMPLED_RATE * run.rate_hz)))
    return with_runs(recording, out)


def with_noise(recording: Recording) -> Recording:
    """Positions and torques with noise far below their resolution."""
    rng = np.random.default_rng(0)
    out = []
    for run in recording.runs:
        noisy = {
            name: getattr(run, name) + NOISE * rng.standard_normal(getattr(run, name).shape)
            for name in ("position", "torque")
        }
        out.append(run.with_signals(run.time, noisy))
    return with_runs(recording, out)


def every_other_second(recording: Recording, first: int, seconds: float) -> Recording:
    """The even (first 0) or odd (first 1) stretches of some seconds, each as a run of its own."""
    out = []
    for run in recording.runs:
        number = np.floor((run.time - run.time[0]) / seconds).astype(int)
        whole = int((run.time[-1] - run.time[0] + 1.5 / run.rate_hz) / seconds)
        out += [replace(run.rows(number == part), part=part + 1) for part in range(first, whole, 2)]
    return with_runs(recording, out)


def half(recording: Recording, part: int) -> Recording:
    """The first (part 0) or the second (1) half of each run."""
    halves = [(run, part * (run.samples // 2)) for run in recording.runs]
    kept = [run.rows(slice(start, start + run.samples // 2)) for run, start in halves]
    return with_runs(recording, [replace(run, part=part + 1) for run in kept])


def ends(recording: Recording, seconds: float, last: bool = False) -> Recording:
    """The first seconds of each run, or the last ones."""
    out = []
    for run in recording.runs:
        since = run.time[-1] - run.time if last else run.time - run.time[0]
        out.append(run.rows(since <= seconds))
    return with_runs(recording, out)


def every_row(recording: Recording, step: int) -> Recording:
    """One of some rows, as a slower logger has them."""
    return with_runs(recording, [run.rows(slice(None, None, step)) for run in recording.runs])


def parts_of(recording: Recording) -> Iterator[tuple[str, Recording]]:
    """The whole recording, and what is cut from it with a name for each: ends, halves, stretches and fewer rows.

    What is as long as the whole, or holds no row, is left out.
    """
    yield WHOLE, recording
    cut = {f"first {seconds:g} s": ends(recording, seconds) for seconds in FIRST_S}
    cut |= {f"last {LAST_S:g} s": ends(recording, LAST_S, last=True)}
    cut |= {f"half {part + 1}": half(recording, part) for part in range(2)}
    for first, name in enumerate(("even", "odd")):
        cut[f"{name} {STRETCH_S:g} s"] = every_other_second(recording, first, STRETCH_S)
    cut |= {f"every row in {step}": every_row(recording, step) for step in ROW_STEPS}
    rows = sum(run.samples for run in recording.runs)
    yield from ((name, each) for name, each in cut.items() if 0 < sum(run.samples for run in each.runs) < rows)


def scaled(recording: Recording, joint: int, scale: float) -> Recording:
    """The torque of a joint (from 0) read by another scale."""
    factors = np.where(np.arange(len(recording.arm)) == joint, scale, 1.0)
    runs = [run.with_signals(run.time, {"torque": factors * run.torque}) for run in recording.runs]
    return with_runs(recording, runs)


def delayed(recording: Recording, seconds: float) -> Recording:
    """The torque of all joints recorded later than the motion."""
    runs = []
    for run in recording.runs:
        late = [np.interp(run.time - seconds, run.time, each) for each in run.torque.T]
        runs.append(run.with_signals(run.time, {"torque": np.column_stack(late)}))
    return with_runs(recording, runs)


def spoilt(recording: Recording) -> Iterator[tuple[str, Recording]]:
    """Copies whose torque is wrong, with a name for each: of one joint too small or too large, of all joints noisy."""
    joint, rng = loaded_joint(recording), np.random.default_rng(0)
    for scale in SPOILT_SCALES:
        yield f"torque of joint {joint + 1} times {scale:g}", scaled(recording, joint, scale)
    noisy = []
    for run in recording.runs:
        noise = SPOILT_NOISE * np.std(run.torque, axis=0) * rng.standard_normal(run.torque.shape)
        noisy.append(run.with_signals(run.time, {"torque": run.torque + noise}))
    yield f"noise of {SPOILT_NOISE:g} of each torque", with_runs(recording, noisy)


def one_run(recording: Recording, run: Run) -> Recording:
    """One run alone: blocks of it validate."""
    return with_runs(recording, [replace(run, role="identify")])


def fewer_rows(recording: Recording) -> Recording:
    """The first part of each run."""
    return with_runs(recording, [run.rows(slice(0, int(FEWER_SHARE * run.samples))) for run in recording.runs])


def rewritten(recording: Recording) -> Recording:
    """Runs in another order, clocks shifted, joints renamed, positions by way of degrees."""
    runs = []
    for run in reversed(recording.runs):
        turned = np.deg2rad(np.rad2deg(run.position))
        runs.append(run.with_signals(run.time + CLOCK_SHIFT_S, {"position": turned}))
    joints = tuple(replace(joint, name=f"axis {number}") for number, joint in enumerate(recording.arm.joints, 1))
    return replace(with_runs(recording, runs), arm=replace(recording.arm, joints=joints))


def loaded_joint(recording: Recording) -> int:
    """The joint (from 0) that is moved most, in units of its own torque."""
    travel = np.max([np.ptp(run.position, axis=0) for run in recording.runs], axis=0)
    return int(np.argmax(travel))


def with_viscous_friction(recording: Recording, joint: int) -> Recording:
    """More viscous friction at a joint, of a share of its torque."""
    torque = np.concatenate([run.torque[:, joint] for run in recording.runs])
    velocities = [_velocity(run)[:, joint] for run in recording.runs]
    speed = float(np.sqrt(np.mean(np.concatenate(velocities) ** 2)))
    size = ADDED_SHARE * float(np.std(torque)) / max(speed, 1e-12)
    out = []
    for run, velocity in zip(recording.runs, velocities, strict=True):
        changed = run.torque.copy()
        changed[:, joint] += size * velocity
        out.append(run.with_signals(run.time, {"torque": changed}))
    return with_runs(recording, out)


def _velocity(run: Run) -> Array:
    """At every stamp, (samples, joints)."""
    signals = differentiate(run)
    velocity = signals.motion.velocity
    columns = [np.interp(run.time, signals.run.time, velocity[:, joint]) for joint in range(velocity.shape[1])]
    return np.column_stack(columns)
