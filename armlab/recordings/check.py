"""The check of a recording folder: repairs, refused files, and warnings about channels and geometry."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.documents import Document
from armlab.common.errors import InputError
from armlab.recordings.clock import MAX_BRIDGED_GAP
from armlab.recordings.dead_joints import NO_TORQUE
from armlab.recordings.identifiable import has_no_torque, reason_not_identifiable, reason_still
from armlab.recordings.load import load_runs, open_recording, with_runs
from armlab.recordings.motion import (
    MotionRecording,
    is_motion_only,
    load_motion_runs,
    open_motion_recording,
    with_motion_runs,
)
from armlab.recordings.motion_check import check_answers
from armlab.recordings.possible import (
    LIMIT_TOLERANCE_FACTOR,
    MIN_SLOPE_CORRELATION,
    block_means,
    correlation,
    has_usual_position,
)
from armlab.recordings.reading.answer import Answer, read_rightly
from armlab.recordings.reading.signs import compare_standstill
from armlab.recordings.reading.tuning import ReadingTuning
from armlab.recordings.recording import AnyRun, Finding, MotionRun, Recording, Run
from armlab.recordings.recording_file import RecordingFile, RunEntry
from problem.arm import Arm, CoupledJoint
from problem.impossible_bodies import find_impossible_bodies
from problem.joint_words import joint_in_words, joints_in_words
from problem.simulator_check import check_with_mujoco, left_out_of_urdf

FACTOR_OF_UNITS = 3.0  # times a limit: less beyond it is a peak, or a limit of long use
RESTING_SHARE = 1e-3  # of the speed of the fastest joint of a run: a joint that is slower rests
REGULAR_SHARE = 0.9  # of the steps between changes of the positions, that are whole holds of a slower reader
MIN_FROZEN_TIME_S = 0.25  # a torque that repeats to the last digit for so long while its joint moves


def check_channels(run: MotionRun, arm: Arm) -> tuple[Finding, ...]:
    """Warnings about the channels of a run, joint by joint."""
    findings = _find_held_rows(run)
    for joint in range(run.joints):
        findings += _find_dead_channels(run, arm, joint) + _find_limit_violations(run, arm, joint)
        if isinstance(run, Run):
            findings += _find_frozen_torque(run, arm, joint)
        findings += _check_velocity(run, arm, joint)
    return tuple(findings)


SIGNS = (
    "joint_names",
    "rate",
    "held_rows",
    "beyond_limits",
    "velocity_mismatch",
    "lost_rows",
    "standstill",
    "encoder_period",
    "unsigned_current",
    NO_TORQUE,
)  # kinds of findings that are cheap signs of a mistake in the reading


def signs_of_wrong_reading(recording: Recording | MotionRecording) -> tuple[Finding, ...]:
    """Warnings about names, clock, limits and standstill, each once: cheap signs of a mistake in the reading."""
    found = [*recording.findings]
    for run in recording.runs:
        found += [*run.findings, *check_channels(run, recording.arm)]
    if isinstance(recording, Recording):
        links = recording.arm.parameters if recording.arm.links is not None else None
        found += compare_standstill(recording, links, ReadingTuning())
    first = {(each.kind, each.joint): each for each in reversed(found) if each.kind in SIGNS}
    return tuple(reversed(first.values()))


def _find_held_rows(run: MotionRun) -> list[Finding]:
    """Whether all positions change at every so many-th row alone, as where a log is written faster than it is read."""
    steps = np.diff(np.flatnonzero(np.any(np.diff(run.position, axis=0) != 0, axis=1)))
    rows = int(np.median(steps)) if len(steps) else 1
    if rows < 2 or np.mean(steps % rows == 0) < REGULAR_SHARE:
        return []
    read = f"{run.rate_hz / rows:.4g} Hz, not {run.rate_hz:.4g} Hz"
    text = f"positions change every {rows} rows alone: they were read at {read}; keep the last row before each change"
    return [Finding("held_rows", "warning", text)]


def _joint_warning(kind: str, joint: int, text: str) -> list[Finding]:
    return [Finding(kind, "warning", text, joint + 1)]


def _find_dead_channels(run: MotionRun, arm: Arm, joint: int) -> list[Finding]:
    found, own = [], joint_in_words(arm, joint + 1)
    for name, signal in run.signals.items():
        is_left_out = name == "torque" and joint in arm.unmeasured
        if name in ("torque", "velocity") and np.ptp(signal[:, joint]) == 0 and not is_left_out:
            found += _joint_warning("dead_channel", joint, f"{name} of {own} is constant: a dead channel?")
    if np.ptp(run.position[:, joint]) == 0:
        found += _joint_warning("still_joint", joint, f"position of {own} is constant: locked, or dead?")
    return found


def _find_frozen_torque(run: Run, arm: Arm, joint: int) -> list[Finding]:
    torque, position = run.torque[:, joint], run.position[:, joint]
    longest, start = _longest_repetition(torque)
    least = max(int(MIN_FROZEN_TIME_S * run.rate_hz), 20)
    if longest < least or longest == run.samples:
        return []
    moved = np.ptp(position[start : start + longest])
    if moved < 0.01 * np.ptp(position):
        return []
    where = f"{run.time[start]:.4g} s to {run.time[start + longest - 1]:.4g} s"
    own = joint_in_words(arm, joint + 1)
    text = f"torque of {own} repeats one value from {where} while the joint moves: frozen channel?"
    return _joint_warning("frozen_channel", joint, text)


def _longest_repetition(values: Array) -> tuple[int, int]:
    """Length and start of the longest stretch of one and the same value."""
    starts = np.append(0, np.flatnonzero(np.diff(values) != 0) + 1)
    lengths = np.diff(np.append(starts, len(values)))
    longest = int(np.argmax(lengths))
    return int(lengths[longest]), int(starts[longest])


def _find_limit_violations(run: MotionRun, arm: Arm, joint: int) -> list[Finding]:
    limits = arm.joints[joint].limits
    low, high = run.position[:, joint].min(), run.position[:, joint].max()
    found, own = [], joint_in_words(arm, joint + 1)
    length, force = ("rad", "N m") if arm.joints[joint].kind == "revolute" else ("m", "N")
    if not has_usual_position(arm.joints[joint], low, high):
        text = (
            f"position of {own} runs from {low:.4g} to {high:.4g} {length}, its limits are "
            f"{limits.position[0]:.4g} and {limits.position[1]:.4g} {length}: another unit, zero or robot?"
        )
        found += _joint_warning("beyond_limits", joint, text)
    fastest = float(np.abs(block_means(np.gradient(run.position[:, [joint]], run.time, axis=0))).max())
    if fastest > LIMIT_TOLERANCE_FACTOR * limits.velocity:
        doubt = ": another unit or clock?" if fastest > FACTOR_OF_UNITS * limits.velocity else ""
        text = f"{own} moves at {fastest:.4g} {length}/s, its limit is {limits.velocity:.4g} {length}/s{doubt}"
        found += _joint_warning("beyond_limits", joint, text)
    peak = float(np.abs(run.torque[:, joint]).max()) if isinstance(run, Run) else 0.0
    if peak > LIMIT_TOLERANCE_FACTOR * limits.torque:
        doubt = ": another unit?" if peak > FACTOR_OF_UNITS * limits.torque else ""
        text = f"torque of {own} reaches {peak:.4g} {force}, its limit is {limits.torque:.4g} {force}{doubt}"
        found += _joint_warning("beyond_limits", joint, text)
    return found


def _check_velocity(run: MotionRun, arm: Arm, joint: int) -> list[Finding]:
    """Compares a velocity channel with the slope of the position; averages remove the steps of the encoder."""
    if run.velocity is None or np.ptp(run.velocity[:, joint]) == 0:
        return []
    slopes = block_means(np.gradient(run.position, run.time, axis=0))
    velocity = block_means(run.velocity[:, joint : joint + 1])[:, 0]
    likeness = np.array([correlation(velocity, slope) for slope in slopes.T])
    if likeness[joint] >= MIN_SLOPE_CORRELATION:
        return _check_velocity_scale(run, velocity, slopes[:, joint], arm, joint)
    fastest = float(slopes.std(axis=0).max())
    if max(slopes[:, joint].std(), velocity.std()) <= RESTING_SHARE * fastest:
        return []
    best, own = int(np.argmax(np.abs(likeness))), joint_in_words(arm, joint + 1)
    if abs(likeness[best]) < MIN_SLOPE_CORRELATION:
        text = f"velocity of {own} does not follow its position (correlation {likeness[joint]:.2f})"
    elif best == joint:
        text = f"velocity of {own} has the opposite sign of its position's slope"
    else:
        text = f"velocity of {own} follows the position of {joint_in_words(arm, best + 1)}: swapped channels?"
    return _joint_warning("velocity_mismatch", joint, text)


def _check_velocity_scale(run: MotionRun, velocity: Array, slope: Array, arm: Arm, joint: int) -> list[Finding]:
    scale = float(velocity @ slope / (slope @ slope))
    if _is_near_one(scale):
        return []
    own = joint_in_words(arm, joint + 1)
    jumps = _places_of_lost_rows(run, joint)
    text = f"velocity of {own} is {scale:.4g} times its position's slope"
    if len(jumps) > 1:
        period = float(np.median(np.diff(run.time[jumps])))
        text += (
            f", and fits it between jumps of the position, one every {period:.3g} s: rows are missing there while the "
            "stamps go on, so the clock of the file is too slow"
        )
        return _joint_warning("lost_rows", joint, text)
    return _joint_warning("velocity_mismatch", joint, f"{text}: another unit or gear?")


def _is_near_one(scale: float) -> bool:
    return 0.9 < scale < 1.1


def _places_of_lost_rows(run: MotionRun, joint: int) -> NDArray[np.intp]:
    """Rows after which the position moves by more than a bridged gap of its velocity, which fits it elsewhere."""
    assert run.velocity is not None
    velocity = (run.velocity[1:, joint] + run.velocity[:-1, joint]) / 2
    integrated, moved = velocity * np.diff(run.time), np.diff(run.position[:, joint])
    fast = np.abs(velocity) >= np.sqrt(np.mean(velocity**2))
    jumps = fast & (np.abs(moved) > MAX_BRIDGED_GAP * np.abs(integrated))
    rest = moved[fast & ~jumps]
    scale = float(integrated[fast & ~jumps] @ rest / (rest @ rest)) if rest.any() else 0.0
    return np.flatnonzero(jumps) if _is_near_one(scale) else np.array([], dtype=np.intp)


@dataclass(frozen=True, eq=False)
class CheckResult:
    """A recording with the runs that could be read, and what was found.

    findings: by the name of the run, "all runs" for those of the whole recording. refused: why a file could not
    be read, by its name.
    """

    recording: Recording | MotionRecording
    findings: tuple[tuple[str, Finding], ...]
    refused: tuple[tuple[str, str], ...]

    @property
    def lines(self) -> tuple[str, ...]:
        """One line a finding, as the terminal shows them."""
        found = [f"{run}: {finding.severity}: {finding.text}" for run, finding in self.findings]
        return (*(f"{file}: refused: {reason}" for file, reason in self.refused), *found)

    @property
    def document(self) -> Document:
        """The same for programs."""
        return {
            "recording": self.recording.name,
            "runs": [
                {"name": run.name, "role": run.role, "samples": run.samples, "rate_hz": run.rate_hz}
                for run in self.recording.runs
            ],
            "refused": [{"file": file, "reason": reason} for file, reason in self.refused],
            "findings": [
                {"run": run, "kind": each.kind, "severity": each.severity, "joint": each.joint, "text": each.text}
                for run, each in self.findings
            ],
        }


def check_recording(folder: Path, progress: Callable[[str], None] = lambda message: None) -> CheckResult:
    """Reads and examines a recording; a run that cannot be used is reported beside the others.

    progress: is told what is being done. Raises InputError where `recording.yaml` or the robot file is wrong.
    """
    progress("reading the recording")
    if is_motion_only(folder):
        moved, file = open_motion_recording(folder)
        motions, refused = _read_runs(lambda entry: load_motion_runs(moved, file, entry), file)
        recording = with_motion_runs(moved, motions)
        answers = check_answers(motions, recording.arm) if motions else ()
        beside = _compare_with_simulator(recording, with_actuators=recording.controller is None)
        beside = (*_find_impossible_links(recording), *_stated_laws(recording.arm), *beside)
        findings = _collect_findings(recording, recording.recorded_arm, (*recording.findings, *beside, *answers))
        return CheckResult(recording, tuple(findings), refused)
    empty, file = open_recording(folder)
    runs, refused = _read_runs(lambda entry: load_runs(empty, file, entry), file)
    whole = with_runs(empty, runs)
    tells_nothing = _find_nothing_to_identify(whole)
    is_readable = bool(runs) and not has_no_torque(runs) and reason_still(runs) is None
    progress("asking how it is to be read")
    geometry = (*tells_nothing, *(_check_geometry(whole) if is_readable else ()))
    beside = _compare_with_simulator(whole, with_actuators=False)
    beside = (*_find_impossible_links(whole), *_stated_laws(whole.arm), *beside)
    return CheckResult(
        whole, tuple(_collect_findings(whole, whole.arm, (*whole.findings, *beside, *geometry))), refused
    )


def _find_nothing_to_identify(recording: Recording) -> tuple[Finding, ...]:
    """A warning where no command can identify anything from the recording."""
    reason = reason_not_identifiable(recording) if recording.with_role("identify") else None
    return () if reason is None else (Finding("not_identifiable", "warning", reason),)


def _read_runs(
    read: Callable[[RunEntry], tuple[AnyRun, ...]], file: RecordingFile
) -> tuple[list[AnyRun], tuple[tuple[str, str], ...]]:
    """The runs that can be read, and why each of the others is refused."""
    runs: list[AnyRun] = []
    refused: list[tuple[str, str]] = []
    for entry in file.runs:
        try:
            runs.extend(read(entry))
        except InputError as error:
            refused.append((entry.file, str(error)))
    return runs, tuple(refused)


def _collect_findings(
    recording: Recording | MotionRecording, arm: Arm, whole: tuple[Finding, ...]
) -> Iterator[tuple[str, Finding]]:
    """Findings of each run, and those of the whole recording. arm: the joints of the columns."""
    reported: set[tuple[str, Finding]] = set()  # a file that is split has the findings of the whole at each part
    for run in recording.runs:
        yield from ((run.name, finding) for finding in run.findings if (run.file, finding) not in reported)
        reported.update((run.file, finding) for finding in run.findings)
        yield from ((run.name, finding) for finding in check_channels(run, arm))
    yield from (("all runs", finding) for finding in whole)


def _find_impossible_links(recording: Recording | MotionRecording) -> tuple[Finding, ...]:
    """Warnings of links of the robot that no body can be."""
    path = recording.folder / recording.robot
    if not path.is_file() or path.suffix == ".xml":
        return ()
    found = find_impossible_bodies(path.read_text(encoding="utf-8"), path)
    hint = "which `armlab recording import --repair` writes"
    return tuple(Finding("impossible_link", "warning", f"{each.words}, {hint}") for each in found)


def _stated_laws(arm: Arm) -> tuple[Finding, ...]:
    """A note of what the robot file says of its joints and of weight; none where it has links alone."""
    own = {
        "viscous friction": [law.damping for law in arm.joint_laws],
        "Coulomb friction": [law.friction for law in arm.joint_laws],
        "a spring": [law.stiffness for law in arm.joint_laws],
        "weight that it holds itself": [link.mass for link in arm.compensated],
    }
    places = {name: [joint for joint, value in enumerate(values, 1) if value] for name, values in own.items()}
    parts = [f"{name} at {joints_in_words(arm, joints)}" for name, joints in places.items() if joints]
    parts += [_coupling_in_words(arm, each) for each in arm.coupled]
    return (Finding("simulation", "note", f"in the simulation, by its file: {'; '.join(parts)}"),) if parts else ()


def _coupling_in_words(arm: Arm, coupled: CoupledJoint) -> str:
    """The line on which a coupled joint moves, and that its link is no unknown."""
    start = f" {'-' if coupled.offset < 0 else '+'} {abs(coupled.offset):g}" if coupled.offset else ""
    line = f"{coupled.joint.name} = {coupled.multiplier:g} {arm.joints[coupled.leader].name}{start}"
    return f"{line} (a coupled joint, whose link is as the file has it)"


def _compare_with_simulator(recording: Recording | MotionRecording, with_actuators: bool) -> tuple[Finding, ...]:
    """Whether the torque of an MJCF is MuJoCo's own, and what of it or of a URDF is left out; nothing of other robots.

    with_actuators: whether those of the file are the drives.
    """
    path = recording.folder / recording.robot
    if path.suffix == ".urdf":
        left_out = left_out_of_urdf(path)
        text = f"left out of {recording.robot}, what it states for Gazebo alone: {'; '.join(left_out)}"
        return (Finding("simulator", "warning", text),) if left_out else ()
    if path.suffix != ".xml":
        return ()
    found = check_with_mujoco(path, with_actuators)
    text = f"the torque of {recording.robot} is that of MuJoCo to {found.difference:.1g} of the largest"
    if not found.agrees:
        text = f"the torque of {recording.robot} differs from MuJoCo's by {found.difference:.2g} of the largest"
    text += f"; left out: {'; '.join(found.left_out)}" if found.left_out else ""
    return (Finding("simulator", "note" if found.agrees else "warning", text),)


def _check_geometry(recording: Recording) -> tuple[Finding, ...]:
    """Warnings about standstill, and about how the recording is to be read."""
    tuning, inertial = ReadingTuning(), recording.arm.parameters if recording.arm.links is not None else None
    return (*compare_standstill(recording, inertial, tuning), *_check_reading(recording, inertial, tuning))


def _check_reading(recording: Recording, inertial: Array | None, tuning: ReadingTuning) -> tuple[Finding, ...]:
    answer: Answer = read_rightly(recording, inertial, tuning)
    findings = [each.finding for each in answer.doubts]
    for each in answer.mistakes:
        rivals = "".join(f"; or {rival.text}" for rival in each.rivals)
        worst = joint_in_words(recording.arm, each.worst_joint)
        text = f"{each.description}{rivals} (error of {worst} {each.share_before:.0%}, read so {each.share_after:.0%})"
        findings.append(Finding("setup", "warning", text, each.mistake.joint))
    return tuple(findings)
