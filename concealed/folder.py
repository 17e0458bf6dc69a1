"""A case on the disk: the recording that a diagnosis may see, and the answer that it may not."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import yaml

from concealed.effects.hidden import Hidden
from concealed.outside import Outside
from concealed.passes import Simulated
from concealed.record import Logged, logged
from concealed.shares import absorbed_rotors
from recordings.run import Array

WITH_CONSTANT = ("asymmetric_friction", "cable_stiffness", "gravity_compensator")
TORQUE_STEP, TIME_STEP = 1e-5, 1e-7  # N m and s: what is kept of a number


def write_case(case: Simulated, observations: Path, truth: Path) -> None:
    """Writes the recording folder `observations`, and `truth` (.json) with the clean torque beside it."""
    runs = [logged(case, run) for run in range(len(case.plan.runs))]
    observations.mkdir(parents=True)
    truth.parent.mkdir(parents=True, exist_ok=True)
    joints = case.plan.machine.joints
    for number, run in enumerate(runs, 1):
        _write_table(observations / f"run-{number}.parquet", run, joints)
    _write_yaml(observations / "robot.yaml", case.plan.machine.settings())
    _write_yaml(observations / "recording.yaml", _recording(case, runs))
    held_out = [run for run in runs if run.role == "validate"]
    _write_parquet(
        truth.with_suffix(".parquet"), {f"tau{joint + 1}": held_out[0].clean[:, joint] for joint in range(joints)}
    )
    truth.write_text(json.dumps(answer(case, runs), indent=1) + "\n", encoding="utf-8")


def answer(case: Simulated, runs: list[Logged]) -> dict[str, Any]:
    """The truth about a case; `multiple` counts detection limits."""
    plan = case.plan
    sizes = zip(case.hidden, case.sized.targets, case.multiples, strict=True)
    floor = np.sqrt(np.mean(np.concatenate([run.torque - run.clean for run in runs]) ** 2, axis=0))
    return {
        "schema": "truth/1",
        "case": plan.name,
        "tier": plan.tier,
        "kind": plan.kind,
        "arm": plan.machine.name,
        "joints": plan.machine.joints,
        "rate_hz": plan.rate_hz,
        "motions": [run.family for run in plan.runs],
        "injected": [
            {**described(effect, plan.realistic), "target": target, "multiple": multiple}
            for effect, target, multiple in sizes
        ],
        "passed_over": list(case.sized.passed_over),
        "background": [described(effect, _mixed_up(effect, case.hidden)) for effect in plan.background],
        "cad_errors": [
            {"effect": "inertial_parameter_error", "joint": link, "relative": error}
            for link, error in enumerate(plan.cad_errors, 1)
        ],
        "absorbed_rotors": [joint + 1 for joint in absorbed_rotors(plan.machine.arm)],
        "noise": plan.noise.facts(),
        "noise_floor": floor.tolist(),
    }


def described(effect: Hidden, mixed_up: bool) -> dict[str, Any]:
    """An effect in the words of the vocabulary, with the law that made it.

    mixed_up: whether it stands beside friction of its joint that adds to its own.
    """
    units, blurred = effect.units(), effect.blurred if mixed_up else ()
    parameters = {
        name: {"value": value, "unit": units[name], "comparable": name in effect.comparable and name not in blurred}
        for name, value in effect.parameters().items()
    }
    return {
        "effect": effect.effect,
        "joint": effect.place,
        "joints": list(effect.joints),
        "outside": isinstance(effect, Outside),
        "form": effect.form,
        "obvious_form": effect.form == effect.forms[0],
        "equivalent": list(effect.equivalent),
        "parameters": parameters,
        "size": effect.size,
        "shape": effect.shape,
    }


def _mixed_up(effect: Hidden, hidden: tuple[Hidden, ...]) -> bool:
    """True for plain friction and offsets at a joint where a hidden effect holds such terms itself."""
    here = [other for other in hidden if other.joint == effect.joint]
    constant = any(other.effect in WITH_CONSTANT for other in here)
    return constant if effect.effect == "torque_offset" else any(other.companions for other in here)


def _recording(case: Simulated, runs: list[Logged]) -> dict[str, Any]:
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


def _write_yaml(path: Path, content: dict[str, Any]) -> None:
    path.write_text(yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=110), encoding="utf-8")


def _write_table(path: Path, run: Logged, joints: int) -> None:
    columns = {"t": np.rint(run.time / TIME_STEP) * TIME_STEP}
    columns |= {f"q{joint + 1}": run.position[:, joint] for joint in range(joints)}
    torque = np.rint(run.torque / TORQUE_STEP) * TORQUE_STEP
    _write_parquet(path, columns | {f"tau{joint + 1}": torque[:, joint] for joint in range(joints)})


def _write_parquet(path: Path, columns: dict[str, Array]) -> None:
    pq.write_table(pa.table(columns), path, compression="zstd")
