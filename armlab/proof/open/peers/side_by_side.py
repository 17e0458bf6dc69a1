"""Compares this package with its peers on the same runs and writes `peers.md`.

A recording is written for the peers, their scripts run, and all are measured by the same filter and the same percent.
"""

import os
import subprocess
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from armlab.common.errors import InputError
from armlab.common.files import write_whole
from armlab.common.markdown import markdown_page, markdown_table
from armlab.identification.export import build_simulator_model, mjcf_document, urdf_document
from armlab.identification.identifier import Identifier
from armlab.identification.structure import Structure
from armlab.identification.torque_model import TorqueModel
from armlab.identification.validation import relative_percent
from armlab.proof.open.peers.exchange import PeerRun, write_runs
from armlab.proof.open.real_identification.identify_recording import Study
from armlab.proof.open.real_identification.looks import Looks
from armlab.recordings.differentiate import Signals
from problem.arm import Arm, Joint, Link
from problem.pseudo_inertia import parameters_of, regular_nominal

PLACEHOLDER_LINK = Link(
    10.0, (0.0, 0.0, 0.0), (0.4, 0.4, 0.4, 0.0, 0.0, 0.0)
)  # where a search may start without a CAD model
PEER_TIMEOUT_S = 600  # s a peer may take for one recording
PEERS = {"figaroh 1.0": ("figaroh_script.py", "arm.urdf"), "mujoco.sysid": ("sysid_script.py", "arm.xml")}


@dataclass(frozen=True)
class PeerResult:
    """One package on one run: percent of the filtered torque; seconds of the fit; or why there is none."""

    recording: str
    package: str
    run: str
    percent: float | None
    seconds: float | None
    remark: str = ""


def compare_peers(study: Study, python: Path, folder: Path, looks: Looks) -> Iterator[PeerResult]:
    """This package and the peers on the runs of a recording, fitted on the run that identifies."""
    model = study.chosen.model_
    signals = [model.signals(run) for run in study.recording.runs]
    for name in ("friction", "chosen"):
        yield from _own_results(study, name, signals, looks)
    _write_inputs(study.recording.arm, signals, folder)
    for package, (script, arm) in PEERS.items():
        yield from _peer_results(study, package, [str(python), script, arm], signals, folder, looks)


def _own_results(study: Study, name: str, signals: list[Signals], looks: Looks) -> Iterator[PeerResult]:
    known = study.models[name]
    for run in study.recording.with_role("validate"):
        looks.note(study.recipe.name, run.name, f"armlab, {name}")
    started = time.process_time()
    identifier = Identifier(
        known.arm,
        known.components,
        known.method if name == "chosen" else "weighted",
        known.pull,
        known.cutoff_hz,
        known.robot,
        known.position_factor,
    ).fit(study.recording.with_role("identify"))
    seconds = time.process_time() - started
    for each in signals:
        percent = relative_percent(each.torque - identifier.model_.filtered_torque(each), each.torque)
        yield PeerResult(study.recipe.name, f"armlab, {name}", each.run.name, percent, seconds)


def _write_inputs(arm: Arm, signals: list[Signals], folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    write_runs(tuple(map(_peer_run, signals)), folder / "runs.npz")
    whole = replace(
        arm, joints=tuple(map(_with_position_limits, arm.joints)), links=arm.links or (PLACEHOLDER_LINK,) * len(arm)
    )
    inertial = parameters_of(regular_nominal(whole))
    structure = Structure(whole, ())
    model = TorqueModel(arm.name, structure, structure.base.values(inertial), inertial=inertial)
    exported = build_simulator_model(model)
    (folder / "arm.urdf").write_text(urdf_document(exported), encoding="utf-8")
    (folder / "arm.xml").write_text(mjcf_document(exported), encoding="utf-8")


def _with_position_limits(joint: Joint) -> Joint:
    """The joint with limits: readers of URDF write a joint without them as a cosine and a sine."""
    return replace(joint, limits=replace(joint.limits, position=(-1e3, 1e3)))


def _peer_run(signals: Signals) -> PeerRun:
    shared, motion = signals.filter, signals.motion
    return PeerRun(
        signals.run.name,
        signals.run.role,
        motion.position,
        motion.velocity,
        motion.acceleration,
        signals.run.torque,
        shared.rate_hz,
        shared.cutoff_hz,
        shared.step,
    )


def _peer_results(
    study: Study, package: str, call: list[str], signals: list[Signals], folder: Path, looks: Looks
) -> Iterator[PeerResult]:
    python, script, arm = call
    out = folder / f"{Path(script).stem}.npz"
    out.unlink(missing_ok=True)
    for run in study.recording.with_role("validate"):
        looks.note(study.recipe.name, run.name, package)
    try:
        _run_script(
            [python, str(Path(__file__).parent / script), *(str(folder / name) for name in ("runs.npz", arm)), str(out)]
        )
    except InputError as error:
        yield PeerResult(study.recipe.name, package, "", None, None, str(error))
        return
    content = np.load(out)
    for each in signals:
        percent = relative_percent(each.torque - content[each.run.name], each.torque)
        yield PeerResult(study.recipe.name, package, each.run.name, percent, float(content["seconds"]))


def _run_script(command: list[str]) -> None:
    """Runs a script that finds this project's packages; InputError with the last line of what went wrong."""
    root = str(Path(__file__).parents[4])
    environment = {**os.environ, "PYTHONPATH": root}
    try:
        done = subprocess.run(
            command, env=environment, capture_output=True, text=True, timeout=PEER_TIMEOUT_S, check=False
        )
    except FileNotFoundError:
        raise InputError(f"no interpreter {command[0]}") from None
    except subprocess.TimeoutExpired:
        raise InputError(f"not finished after {PEER_TIMEOUT_S} s") from None
    if done.returncode:
        raise InputError((done.stderr.strip().splitlines() or ["failed without a word"])[-1])


HOW_TO_READ = """\
Percent of ||tau - tau_hat|| / ||tau|| over all joints: fitted on the run that identifies, the same smoothed motion,
the same low-pass on torque and prediction. Seconds: processor time of one fit without start-up and imports; that of
armlab includes smoothing, differentiation and intervals, the others get the motion ready. mujoco.sysid stops after
60 iterations.

`armlab, friction`, figaroh and mujoco.sysid have viscous and Coulomb friction, rotor inertia and offset at every
joint (`armlab, friction` and figaroh without a prior, joints weighted by their errors; mujoco.sysid: bodies that can
exist); `armlab, chosen` is the structure that cross-validation chose."""


def write_peers(rows: Sequence[PeerResult], folder: Path) -> Path:
    """Path of the page; InputError where it cannot be written."""
    path = folder / "peers.md"
    table = markdown_table(("recording", "run", "package", "percent", "seconds"), map(_table_row, rows))
    write_whole(path, markdown_page("The same recordings through other packages", HOW_TO_READ, table))
    return path


def _table_row(row: PeerResult) -> tuple[str, ...]:
    if row.percent is None or row.seconds is None:
        return row.recording, "", row.package, row.remark, ""
    return row.recording, row.run, row.package, f"{row.percent:.2f}", f"{row.seconds:.2g}"
