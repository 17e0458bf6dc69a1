"""The files of a field case: a recording folder as drives and people leave it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from armlab.common.arrays import Array
from armlab.proof.blind.case_files import write_yaml
from armlab.proof.blind.field.field_plan import FieldPlan
from armlab.proof.blind.field.field_runs import FieldCase
from armlab.recordings.recording import Role

DIGITS = 8  # of a number in a file
STAMP_S = 1e-6  # of a time in a file


@dataclass(frozen=True, eq=False)
class FieldLog:
    """One run as logged. clean: (samples, joints), N m, as the channels read it without noise and steps."""

    role: Role
    time: Array
    position: Array
    velocity: Array
    torque: Array
    clean: Array


def log_field_run(case: FieldCase, number: int) -> FieldLog:
    """A run of a case as its drives log it, every row once and in order."""
    run, plan = case.runs[number], case.plan
    log, rng, track = plan.log, plan.stream(f"log {number}"), run.track
    even = np.arange(int(track.time[-1] * log.rate_hz)) / log.rate_hz
    instant = np.clip(even + log.jitter / log.rate_hz * np.clip(rng.normal(size=len(even)), -2, 2), 0, track.time[-1])
    sampled = track.at(instant)
    motor = np.column_stack([np.interp(instant, track.time, column) for column in run.torque.T])
    if case.lag.any():
        late = case.late(track.time, run.torque)
        motor = np.column_stack([np.interp(instant, track.time, column) for column in late.T])
    clean = case.read(motor)
    noise = case.spread * log.noise_of(rng, np.abs(sampled.velocity) / plan.machine.speed)
    torque = _in_steps(clean + noise, log.torque_step * case.spread)
    torque = torque[np.arange(len(torque)) // log.slow_torque * log.slow_torque]
    encoder = 2 * plan.half_turns / 2.0**log.encoder_bits
    dither = encoder * log.encoder_noise * rng.standard_normal(sampled.position.shape)
    position = _in_steps(sampled.position + case.shift + dither, encoder)
    kept = np.maximum.accumulate(np.where(rng.random(len(even)) < log.held, 0, np.arange(len(even))))
    position, torque = position[kept], torque[kept]
    return FieldLog(run.plan.role, instant, position, sampled.velocity[kept], torque, clean[kept])


def write_field_observation(case: FieldCase, folder: Path) -> list[FieldLog]:
    """Writes the recording folder of a case, and returns its runs as logged."""
    folder.mkdir(parents=True)
    runs = [log_field_run(case, number) for number in range(len(case.runs))]
    for number, run in enumerate(runs, 1):
        rng = case.plan.stream(f"rows {number}")
        table = _with_stumbles(_table(case.plan, run), case.plan, rng)
        path = folder / f"run-{number}{case.plan.log.suffix}"
        if path.suffix == ".csv":
            table.to_csv(path, index=False, float_format=f"%.{DIGITS}g", lineterminator="\n")
        else:
            table.to_parquet(path, index=False, compression="zstd")
    write_yaml(folder / "robot.yaml", _robot(case.plan))
    write_yaml(folder / "recording.yaml", _recording(case.plan, runs))
    return runs


def _in_steps(signal: Array, step: Array) -> Array:
    """A signal (samples, joints) rounded to steps (joints,); a step of zero leaves it as it is."""
    fine = np.where(step > 0, step, 1.0)
    return np.asarray(np.where(step > 0, np.rint(signal / fine) * fine, signal))


def _table(plan: FieldPlan, run: FieldLog) -> pd.DataFrame:
    joints = range(plan.machine.joints)
    columns: dict[str, Array] = {"t": np.rint(run.time / STAMP_S) * STAMP_S}
    columns |= {f"q{joint + 1}": run.position[:, joint] for joint in joints}
    if plan.log.velocity:
        columns |= {f"v{joint + 1}": run.velocity[:, joint] for joint in joints}
    name = "i" if plan.log.as_current else "tau"
    gains = np.array(_gains(plan)) if plan.log.as_current else np.ones(len(joints))
    return pd.DataFrame(columns | {f"{name}{joint + 1}": run.torque[:, joint] / gains[joint] for joint in joints})


def _with_stumbles(table: pd.DataFrame, plan: FieldPlan, rng: np.random.Generator) -> pd.DataFrame:
    """Some rows are missing, some come twice."""
    times = np.where(rng.random(len(table)) < plan.log.dropped, 0, 1)
    times += rng.random(len(table)) < plan.log.doubled
    times[[0, -1]] = 1
    return table.iloc[np.repeat(np.arange(len(table)), times)]


def _gains(plan: FieldPlan) -> list[float]:
    """N m (N) per A of each drive, with three digits as data sheets give them."""
    return [float(f"{rating / 8:.3g}") for rating in plan.machine.rating]


def _robot(plan: FieldPlan) -> dict[str, Any]:
    settings = plan.machine.settings()
    if not plan.has_links:
        settings = {key: value for key, value in settings.items() if key not in ("links", "rotor_inertia")}
    return settings


def _recording(plan: FieldPlan, runs: list[FieldLog]) -> dict[str, Any]:
    joints = range(1, plan.machine.joints + 1)
    slides = [joint.type == "prismatic" for joint in plan.machine.file.joints]
    torque = "current" if plan.log.as_current else "torque"
    columns: dict[str, Any] = {"time": "t", "position": [f"q{joint}" for joint in joints]}
    units: dict[str, Any] = {"time": "s", "position": ["m" if each else "rad" for each in slides]}
    if plan.log.velocity:
        columns["velocity"] = [f"v{joint}" for joint in joints]
        units["velocity"] = ["m/s" if each else "rad/s" for each in slides]
    columns[torque] = [f"{'i' if plan.log.as_current else 'tau'}{joint}" for joint in joints]
    units[torque] = "A" if plan.log.as_current else ["N" if each else "N.m" for each in slides]
    return {
        "schema": "recording/1",
        "robot": "robot.yaml",
        "sample_rate_hz": float(plan.log.rate_hz),
        "columns": columns,
        "units": units,
        **({"gains": _gains(plan)} if plan.log.as_current else {}),
        "runs": [{"file": f"run-{number}{plan.log.suffix}", "role": run.role} for number, run in enumerate(runs, 1)],
    }
