"""The files of a case: runs as a drive logs them, the recording for the diagnosis, and the answer."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import yaml

from armlab.common.arrays import Array
from armlab.proof.blind.effects.hidden import HiddenEffect
from armlab.proof.blind.formats import (
    InjectedEffect,
    LinkDeviation,
    TrueEffect,
    TrueNoise,
    TrueParameter,
    Truth,
    write_model,
)
from armlab.proof.blind.plan import Plan
from armlab.proof.blind.simulate import FINE_HZ, absorbed_rotors, law_torque
from armlab.proof.blind.sizing import SimulatedCase
from armlab.recordings.recording import Role


@dataclass(frozen=True)
class LoggingSettings:
    """How a drive logs a run; chosen by eye, in the range of industrial drives.

    encoder_bits: range of the resolution, steps a joint turn as powers of two, gear included; the end is left out.
    uneven_share: share of the cases with uneven samples and exact stamps. jitter_s: of stamps that are
    late while the samples are even. torque_resolution_nm, time_resolution_s: what a file keeps of a number.
    """

    encoder_bits: tuple[int, int] = (20, 24)
    uneven_share: float = 0.3
    jitter_s: float = 2e-5
    torque_resolution_nm: float = 1e-5
    time_resolution_s: float = 1e-7


LOGGING = LoggingSettings()


@dataclass(frozen=True, eq=False)
class LoggedRun:
    """One run as logged. clean: (samples, joints), N m, what the torque channels would read without noise."""

    role: Role
    time: Array
    position: Array
    torque: Array
    clean: Array


def log_run(case: SimulatedCase, run: int, noisy: bool = True) -> LoggedRun:
    """A run of a case, sampled at its rate; without noise, rounding and jitter on request."""
    plan, track, rng = case.plan, case.tracks[run], case.plan.stream(f"log {run}")
    stamp, instant = _sample_instants(plan, run, rng, noisy)
    joints, effects = track.joints, case.all_effects
    centre = np.repeat(instant[:, None], joints, axis=1)
    lag = np.sum([effect.lag(joints) for effect in effects] or [np.zeros(joints)], axis=0)
    torque = track.means(track.load + law_torque(effects, track, run), centre - lag, 1 / plan.rate_hz)
    for effect in effects:
        torque = effect.read(torque)
    shift = np.sum([effect.shift(joints) for effect in effects] or [np.zeros(joints)], axis=0)
    sampled = track.at(instant)
    position, role = sampled.position + shift, plan.runs[run].role
    if not noisy:
        return LoggedRun(role, stamp, position, torque, torque)
    step = _draw_encoder_steps(rng, joints)
    noise = plan.noise.sample(plan.stream(f"noise {run}"), sampled.velocity, instant)
    read = plan.noise.quantise(torque + noise)
    return LoggedRun(role, stamp, np.rint(position / step) * step, read, torque)


def encoder_steps(plan: Plan, run: int) -> Array:
    """To what the positions of a run are rounded, (joints,), rad."""
    rng = plan.stream(f"log {run}")
    _sample_instants(plan, run, rng, noisy=True)  # `log_run` draws the instants first
    return _draw_encoder_steps(rng, plan.machine.joints)


def _draw_encoder_steps(rng: np.random.Generator, joints: int) -> Array:
    return np.asarray(2 * np.pi / 2.0 ** rng.integers(*LOGGING.encoder_bits, joints))


def _sample_instants(plan: Plan, run: int, rng: np.random.Generator, noisy: bool) -> tuple[Array, Array]:
    """Stamps and true instants, s: even samples with late stamps, or uneven samples with exact stamps."""
    even = np.arange(round(plan.runs[run].length_s * plan.rate_hz)) / plan.rate_hz
    if not noisy:
        return even, even
    if plan.stream("clock").random() < LOGGING.uneven_share:
        uneven = even + rng.integers(-1, 2, len(even)) / FINE_HZ
        return np.maximum(uneven, 0.0), np.maximum(uneven, 0.0)
    return even + np.abs(rng.normal(0, LOGGING.jitter_s, len(even))), even


EFFECTS_WITH_CONSTANT = ("asymmetric_friction", "cable_stiffness", "gravity_compensator")


def write_case(case: SimulatedCase, observations: Path, truth: Path) -> None:
    """Writes the recording folder `observations`, and `truth` (.json) with the clean torque beside it."""
    runs = write_observation(case, observations)
    truth.parent.mkdir(parents=True, exist_ok=True)
    joints = case.plan.machine.joints
    held_out = [run for run in runs if run.role == "validate"]
    _write_parquet(
        truth.with_suffix(".parquet"), {f"tau{joint + 1}": held_out[0].clean[:, joint] for joint in range(joints)}
    )
    write_model(make_truth(case, runs), truth)


def write_observation(case: SimulatedCase, folder: Path) -> list[LoggedRun]:
    """Writes the recording folder of a case, and returns its runs as logged."""
    runs = [log_run(case, run) for run in range(len(case.plan.runs))]
    folder.mkdir(parents=True)
    for number, run in enumerate(runs, 1):
        _write_table(folder / f"run-{number}.parquet", run, case.plan.machine.joints)
    write_yaml(folder / "robot.yaml", case.plan.machine.settings())
    write_yaml(folder / "recording.yaml", _recording_settings(case, runs))
    return runs


def make_truth(case: SimulatedCase, runs: list[LoggedRun]) -> Truth:
    """The answer to a case."""
    plan = case.plan
    sizes = zip(case.hidden, case.sized.targets, case.multiples, strict=True)
    floor = np.sqrt(np.mean(np.concatenate([run.torque - run.clean for run in runs]) ** 2, axis=0))
    return Truth(
        schema="truth/1",
        case=plan.name,
        tier=plan.tier,
        kind=plan.kind,
        engine=plan.engine,
        arm=plan.machine.name,
        joints=plan.machine.joints,
        rate_hz=plan.rate_hz,
        motions=tuple(run.family for run in plan.runs),
        injected=tuple(
            InjectedEffect(**_effect_facts(effect, plan.realistic), target=target, multiple=multiple)
            for effect, target, multiple in sizes
        ),
        passed_over=case.sized.passed_over,
        background=tuple(
            TrueEffect(**_effect_facts(effect, _is_mixed_with_friction(effect, case.hidden)))
            for effect in plan.background
        ),
        cad_errors=tuple(
            LinkDeviation(effect="inertial_parameter_error", joint=link, relative=error)
            for link, error in enumerate(plan.cad_errors, 1)
        ),
        absorbed_rotors=tuple(joint + 1 for joint in absorbed_rotors(plan.machine.arm)),
        noise=TrueNoise(
            kind=plan.noise.kind,
            white=tuple(plan.noise.white.tolist()),
            coloured=tuple(plan.noise.coloured.tolist()),
            corner_hz=plan.noise.corner_hz,
        ),
        noise_floor=tuple(floor.tolist()),
    )


def _effect_facts(effect: HiddenEffect, mixed_up: bool) -> dict[str, Any]:
    """The fields of a `TrueEffect`. mixed_up: whether other friction of its joint adds to its own."""
    blurred = effect.blurred if mixed_up else ()
    return {
        "effect": effect.effect,
        "joint": effect.place,
        "joints": effect.joints,
        "outside": effect.is_outside,
        "form": effect.form,
        "obvious_form": effect.form == effect.forms[0],
        "equivalent": effect.equivalent,
        "parameters": {
            name: TrueParameter(
                value=tuple(value) if isinstance(value, list) else value,
                unit=effect.units[name],
                comparable=name in effect.comparable and name not in blurred,
            )
            for name, value in effect.parameters().items()
        },
        "size": effect.size,
        "shape": effect.shape,
    }


def _is_mixed_with_friction(effect: HiddenEffect, hidden: tuple[HiddenEffect, ...]) -> bool:
    """True for plain friction and offsets at a joint where a hidden effect holds such terms itself."""
    here = [other for other in hidden if other.joint == effect.joint]
    constant = any(other.effect in EFFECTS_WITH_CONSTANT for other in here)
    return constant if effect.effect == "torque_offset" else any(other.companions for other in here)


def _recording_settings(case: SimulatedCase, runs: list[LoggedRun]) -> dict[str, Any]:
    joints = range(1, case.plan.machine.joints + 1)
    columns = {
        "time": "t",
        "position": [f"q{joint}" for joint in joints],
        "torque": [f"tau{joint}" for joint in joints],
    }
    return {
        "schema": "recording/1",
        "robot": "robot.yaml",
        "sample_rate_hz": float(case.plan.rate_hz),
        "columns": columns,
        "units": {"time": "s", "position": "rad", "torque": "N.m"},
        "runs": [{"file": f"run-{number}.parquet", "role": run.role} for number, run in enumerate(runs, 1)],
    }


def write_yaml(path: Path, content: dict[str, Any]) -> None:
    """Writes a settings file of a recording folder, lists of numbers in one line."""
    path.write_text(yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=110), encoding="utf-8")


def _write_table(path: Path, run: LoggedRun, joints: int) -> None:
    columns = {"t": np.rint(run.time / LOGGING.time_resolution_s) * LOGGING.time_resolution_s}
    columns |= {f"q{joint + 1}": run.position[:, joint] for joint in range(joints)}
    torque = np.rint(run.torque / LOGGING.torque_resolution_nm) * LOGGING.torque_resolution_nm
    _write_parquet(path, columns | {f"tau{joint + 1}": torque[:, joint] for joint in range(joints)})


def _write_parquet(path: Path, columns: dict[str, Array]) -> None:
    pq.write_table(pa.table(columns), path, compression="zstd")
