"""Writes a recording for the peers, runs them, and measures all by the same filter and the same percent."""

import os
import subprocess
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from identification.export.mjcf import mjcf
from identification.export.urdf import urdf
from identification.identifier import Identifier
from identification.peers.exchange import PeerRun, write_runs
from identification.pseudo_inertia import parameters_of, regular_nominal
from identification.real.looks import Looks
from identification.real.study import Study
from identification.structure import Structure
from identification.torque_model import TorqueModel
from identification.validation import relative_percent
from problem.arm import Arm, Joint, Link
from problem.errors import InputError
from recordings.differentiate import Signals
from recordings.filters import LowPass

PLAIN = Link(10.0, (0.0, 0.0, 0.0), (0.4, 0.4, 0.4, 0.0, 0.0, 0.0))  # where a search may start without a CAD model
TIRELESS = 600  # s a peer may take for one recording
PEERS = {"figaroh 1.0": ("figaroh_script.py", "arm.urdf"), "mujoco.sysid": ("sysid_script.py", "arm.xml")}


@dataclass(frozen=True)
class Row:
    """One package on one run: percent of the filtered torque; seconds of the fit; or why there is none."""

    recording: str
    package: str
    run: str
    percent: float | None
    seconds: float | None
    remark: str = ""


def rows(found: Study, python: Path, folder: Path, looks: Looks) -> Iterator[Row]:
    """This package and the peers on the runs of a recording, fitted on the run that identifies."""
    model = found.models[-1].identifier.model_
    signals = [model.signals(run) for run in found.recording.runs]
    for each in found.models[1:]:
        yield from _ours(found, each.name, signals)
    _write(found.recording.arm, signals, folder)
    for package, (script, arm) in PEERS.items():
        yield from _peer(found, package, [str(python), script, arm], signals, folder, looks)


def _ours(found: Study, name: str, signals: list[Signals]) -> Iterator[Row]:
    known = next(model.identifier for model in found.models if model.name == name)
    started = time.process_time()
    identifier = Identifier(
        known.arm, known.components, known.method if name == "chosen" else "weighted", known.pull, known.cutoff_hz,
        known.robot, known.position_factor,
    ).fit(found.recording.with_role("identify"))  # fmt: skip
    seconds = time.process_time() - started
    for each in signals:
        percent = relative_percent(each.torque - identifier.model_.filtered_torque(each), each.torque)
        yield Row(found.recipe.name, f"armlab, {name}", each.run.name, percent, seconds)


def _write(arm: Arm, signals: list[Signals], folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    write_runs(tuple(map(_peer_run, signals)), folder / "runs.npz")
    whole = replace(arm, joints=tuple(map(_limited, arm.joints)), links=arm.links or (PLAIN,) * len(arm))
    inertial = parameters_of(regular_nominal(whole))
    structure = Structure(whole, ())
    model = TorqueModel(arm.name, structure, structure.base.values(inertial), inertial=inertial)
    (folder / "arm.urdf").write_text(urdf(model), encoding="utf-8")
    (folder / "arm.xml").write_text(mjcf(model), encoding="utf-8")


def _limited(joint: Joint) -> Joint:
    """The joint with limits: readers of URDF write a joint without them as a cosine and a sine."""
    return replace(joint, limits=replace(joint.limits, position=(-1e3, 1e3)))


def _peer_run(signals: Signals) -> PeerRun:
    shared, motion = signals.filter, signals.motion
    if not isinstance(shared, LowPass):
        raise ValueError(f"{signals.run.name} did not pass a low-pass")
    return PeerRun(
        signals.run.name, signals.run.role, motion.position, motion.velocity, motion.acceleration, signals.run.torque,
        shared.rate_hz, shared.cutoff_hz, shared.step,
    )  # fmt: skip


def _peer(
    found: Study, package: str, call: list[str], signals: list[Signals], folder: Path, looks: Looks
) -> Iterator[Row]:
    python, script, arm = call
    out = folder / f"{Path(script).stem}.npz"
    out.unlink(missing_ok=True)
    for run in found.recording.with_role("validate"):
        looks.note(found.recording.arm.name, run.name, package)
    try:
        _run(
            [python, str(Path(__file__).parent / script), *(str(folder / name) for name in ("runs.npz", arm)), str(out)]
        )
    except InputError as error:
        yield Row(found.recipe.name, package, "", None, None, str(error))
        return
    content = np.load(out)
    for each in signals:
        percent = relative_percent(each.torque - content[each.run.name], each.torque)
        yield Row(found.recipe.name, package, each.run.name, percent, float(content["seconds"]))


def _run(command: list[str]) -> None:
    """Runs a script that finds this project's packages; InputError with the last line of what went wrong."""
    root = str(Path(__file__).parents[2])
    environment = {**os.environ, "PYTHONPATH": root}
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=TIRELESS, check=False)
    except FileNotFoundError:
        raise InputError(f"no interpreter {command[0]}") from None
    except subprocess.TimeoutExpired:
        raise InputError(f"not finished after {TIRELESS} s") from None
    if done.returncode:
        raise InputError((done.stderr.strip().splitlines() or ["failed without a word"])[-1])
