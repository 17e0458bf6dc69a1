"""The public recordings of motion only, diagnosed and compared: results/real/motion.md."""

from collections.abc import Callable, Iterator
from itertools import combinations
from pathlib import Path

import numpy as np

from armlab.common.arrays import Array
from armlab.common.files import write_texts
from armlab.common.markdown import markdown_page, markdown_table
from armlab.diagnosis.motion.compare import MotionComparison, compare_motion
from armlab.diagnosis.motion.diagnose_motion import diagnose_motion
from armlab.diagnosis.motion.motion_result import MotionDiagnosis
from armlab.diagnosis.motion.replay import Replayed, joint_rms, replay, tool_rms
from armlab.diagnosis.motion.servo import KEYS, PARAMETERS, Servos, place
from armlab.proof.open.motion.peer import NO_FIELD, PeerComparison, compare_with_sysid, import_sysid
from armlab.recordings.motion import MotionRecording, load_motion_recording
from armlab.recordings.public_motion import SO101_CONTACT, XL330_GAINS, fetch_motion_recording
from armlab.report.motion.compare_write import comparison_summary
from armlab.report.motion.motion_words import current_phrase, finding_phrases, summary_of

ONE_GAIN = 7.8  # N m/rad: duty a rad at P = 16 (2.66, Duclusaud 2025) times the stall torque of an STS3215 (2.94 N m)


def bench_real_motion(
    results: Path,
    recordings: Path,
    progress: Callable[[str], None] = lambda message: None,
    *,
    peer_windows: int | None = None,
) -> Iterator[str]:
    """Diagnoses the SO-101 and compares the XL330 at its four gains; writes motion.md and yields lines to print.

    recordings: folder for the recordings, which are fetched into it. peer_windows: of the SO-101, on which mujoco.sysid
    is run beside armlab; None leaves that out. Raises InputError for files that are not at hand.
    """
    if peer_windows is not None:
        import_sysid()
    arm = _open("so101", recordings)
    diagnosis = diagnose_motion(arm, progress)
    alone = _replay_one_gain(diagnosis)
    lines = [
        summary_of(diagnosis),
        *finding_phrases(diagnosis, minor=False),
        *(current_phrase(diagnosis.simulation.arm, each) for each in diagnosis.currents),
    ]
    table = _replay_table(diagnosis, alone)
    yield from (*lines, table)
    beside: list[str] = []
    if peer_windows is not None:
        beside = peer_section(compare_with_sysid(diagnosis, peer_windows, progress))
        yield from beside
    servos = {gain: _open(f"xl330-kp-{gain}", recordings) for gain in XL330_GAINS}
    progress("comparing all P in one fit")
    whole = compare_motion(*servos.values())
    yield f"XL330: {comparison_summary(whole)}"
    pairs = []
    for old, new in combinations(XL330_GAINS, 2):
        progress(f"comparing P = {old} and {new}")
        comparison = compare_motion(servos[old], servos[new])
        pairs.append((f"{old} to {new}", f"{new / old:g}", *_pair_cells(comparison), _factor_of_all(whole, old, new)))
        yield f"XL330: {comparison_summary(comparison)}"
    page = markdown_page(
        "Real recordings of motion only",
        "Made by `armlab proof real-motion`. Sources and licences: `armlab/recordings/public_motion.py`.",
        "## SO-101, public MJCF as the simulation",
        f"Held out: {_held_out(diagnosis)}. Left out before any fit, as contact: {_contact()}. "
        f"{diagnosis.seconds:.0f} s for the diagnosis.",
        summary_of(diagnosis),
        "\n".join(f"- {each}" for each in finding_phrases(diagnosis, minor=False)),
        "The current is that of the supply, without sign; it took no part in the diagnosis.",
        "\n".join(f"- {current_phrase(diagnosis.simulation.arm, each)}" for each in diagnosis.currents),
        "Root mean square of simulated minus measured position on the held-out runs, mrad; at the tool mm. Whole arm, "
        f"whole runs. One gain: the simulation with kp {ONE_GAIN} N m/rad and kv 0, nothing else changed.",
        table,
        *beside,
        "## XL330 with a pendulum, gain register P = 100, 200, 400, 800",
        "Nothing but P was changed. Factor: of kp, with its 95 % interval; of the two recordings alone, and of all "
        "four in one fit.",
        markdown_table(("pair", "true factor", "of two", "other changes named", "of all four"), pairs),
        comparison_summary(whole),
    )
    write_texts({"motion.md": page}, results)
    yield f"wrote {results / 'motion.md'}"


def _open(name: str, folder: Path) -> MotionRecording:
    place_of = folder / name
    return load_motion_recording(place_of if place_of.is_dir() else fetch_motion_recording(name, place_of))


def _held_out(diagnosis: MotionDiagnosis) -> str:
    return ", ".join(sorted({run.file for run in diagnosis.recording.with_role("validate")}))


def _contact() -> str:
    return "; ".join(
        f"{name} {', '.join(f'{first:g} to {last:g} s' for first, last in stretches)}"
        for name, stretches in SO101_CONTACT.items()
    )


def _replay_one_gain(diagnosis: MotionDiagnosis) -> tuple[Replayed, ...]:
    """Held-out runs with one gain for all joints in place of the simulation's, and no kv."""
    values = diagnosis.simulation.nominal.values.copy()
    values[:, place("kp")], values[:, place("kd")] = ONE_GAIN, 0.0
    return tuple(replay(diagnosis.simulation, Servos(values), [each.run for each in diagnosis.replayed_after]))


def _replay_table(diagnosis: MotionDiagnosis, alone: tuple[Replayed, ...]) -> str:
    """Errors of the command itself, the simulation, one gain and the numbers found, run by run and pooled."""
    before, after = diagnosis.replayed_before, diagnosis.replayed_after
    rows = []
    for number, run in enumerate([*(each.run.name for each in after), "all"]):
        chosen = slice(None) if run == "all" else slice(number, number + 1)
        commands = np.concatenate([_command_error(each) for each in after[chosen]])
        rows.append((run, "command itself", *_cells(np.sqrt(np.mean(commands**2, axis=0))), ""))
        for name, part in (("simulation", before[chosen]), ("one gain", alone[chosen]), ("found", after[chosen])):
            rows.append((run, name, *_cells(joint_rms(part)), f"{1e3 * tool_rms(part):.3g}"))
    ratio = joint_rms(after) / joint_rms(before)
    rows.append(
        ("all", "found / simulation", *(f"{each:.2f}" for each in ratio), f"{tool_rms(after) / tool_rms(before):.2f}")
    )
    joints = [f"joint {number + 1}" for number in range(len(diagnosis.errors))]
    return markdown_table(("run", "prediction", *joints, "tool"), rows)


def peer_section(comparison: PeerComparison) -> list[str]:
    """The part of the page on armlab and mujoco.sysid: what they were given, errors and times, numbers found."""
    task, sysid, alone = comparison.task, comparison.sysid, comparison.alone
    joints = [f"joint {number + 1}" for number in range(len(task.free))]
    peer, judged = comparison.peer, joint_rms(comparison.peer.replayed)
    fits = {
        "armlab, diagnosis": comparison.diagnosis,
        "armlab, the same fit": alone,
        "mujoco.sysid": peer,
    }
    errors = [
        (
            name,
            *_cells(joint_rms(fit.replayed)),
            f"{1e3 * tool_rms(fit.replayed):.2f}",
            f"{fit.seconds:.3g}",
            "" if fit.processor_seconds is None else f"{fit.processor_seconds:.3g}",
        )
        for name, fit in fits.items()
    ]
    errors += [
        (
            f"{name} / mujoco.sysid",
            *(f"{each:.2f}" for each in joint_rms(fit.replayed) / judged),
            f"{tool_rms(fit.replayed) / tool_rms(peer.replayed):.2f}",
            f"{fit.seconds / peer.seconds:.3g}",
            ""
            if fit.processor_seconds is None or peer.processor_seconds is None
            else f"{fit.processor_seconds / peer.processor_seconds:.3g}",
        )
        for name, fit in fits.items()
        if fit is not peer
    ]
    found = [task.start, *(fit.servos for fit in fits.values())]
    numbers = [
        (
            f"joint {row + 1}",
            f"{PARAMETERS[column].key}, {PARAMETERS[column].unit}",
            *(f"{servos.values[row, column]:.4g}" for servos in found),
        )
        for row, column in np.argwhere(task.free).tolist()
    ]
    missing = " and ".join(PARAMETERS[KEYS.index(key)].effect.replace("_", " ") for key in NO_FIELD)
    return [
        "### mujoco.sysid beside armlab",
        f"`armlab, diagnosis` is the one above: all {len(task.stretches)} windows, with the choice of the numbers, "
        f"intervals and replays. The other two are given {int(task.free.sum())} of the numbers that it fitted, "
        f"{len(task.windows)} of its windows ({task.seconds:.0f} s), spread evenly over those that it does not call "
        f"odd, the public MJCF as the start, and the same bounds; {missing} have no field in MuJoCo and are left out. "
        "mujoco.sysid fits all joints at once through the whole arm, on all processors; "
        f"`armlab/proof/open/motion/peer.py` says with which settings. It ended after {sysid.iterations} iterations "
        f"({sysid.ended}), and was within 1 % of its last cost after {sysid.reached:.3g} s. The fit of armlab takes "
        f"{alone.seconds / peer.seconds:.2g} of its time, and {alone.seconds / sysid.reached:.2g} of its time to that "
        "cost. Replay of all held-out runs: mrad; at the tool mm; time in s.",
        markdown_table(("fit", *joints, "tool", "time", "processor time"), errors),
        "Numbers, with the start.",
        markdown_table(("joint", "number", "start", *fits), numbers),
    ]


def _command_error(replayed: Replayed) -> Array:
    return np.asarray(replayed.run.reference_position) - replayed.run.position


def _cells(errors: Array) -> tuple[str, ...]:
    return tuple(f"{1e3 * each:.1f}" for each in errors)


def _pair_cells(comparison: MotionComparison) -> tuple[str, str]:
    """The factor of kp with its interval, and what else is named."""
    factor = "not named"
    for each in comparison.changed:
        if each.parameter.key == "kp" and each.ratio is not None:
            factor = f"{each.ratio[0]:.2f} ({each.ratio[1]:.2f} to {each.ratio[2]:.2f})"
    others = [
        f"{each.parameter.key} {each.old:.3g} to {each.new:.3g}"
        for each in comparison.changed
        if each.parameter.key != "kp"
    ]
    return factor, ", ".join(others) or "none"


def _factor_of_all(comparison: MotionComparison, old: int, new: int) -> str:
    """The factor of kp between two of the four recordings that were fitted together."""
    kp = next(each for each in comparison.changes if each.parameter.key == "kp")
    value, low, high = kp.levels.between(XL330_GAINS.index(old), XL330_GAINS.index(new)).factor
    return f"{value:.2f} ({low:.2f} to {high:.2f})"
