"""Commands of the diagnosis: what physics is missing, and which experiment to do next."""

from collections.abc import Iterator
from datetime import date
from pathlib import Path
from typing import Any

import click

from armlab.cli.options import FiniteNumber, JobCount, OutputPath, lock_option
from armlab.cli.output import prints_lines, prints_result, tell_progress
from armlab.cli.safety_options import safety_options
from armlab.common.documents import ResultLines

_FILE = click.Path(path_type=Path)


@click.command("next")
@click.argument("verdict", type=_FILE)
@click.option("--robot", required=True, help="A built-in arm, a robot file or a URDF, with the limits of the joints.")
@click.option("--recording", type=_FILE, help="The recording that was diagnosed: counts what it shows already.")
@click.option(
    "--rivals", help="Like viscous_friction@2,time_delay; or library: all that come near [default: of VERDICT]"
)
@click.option("--algorithm", default="l-shade", show_default=True, help="Any registered one.")
@click.option("--evaluations", type=click.IntRange(min=50, max=10_000_000), default=1000, show_default=True)
@click.option(
    "--duration", type=FiniteNumber(min=1, max=600), default=10.0, show_default=True, help="Of the motion, s."
)
@click.option("--harmonics", type=click.IntRange(min=2, max=200), default=8, show_default=True)
@click.option(
    "--links",
    type=click.Choice(["exact", "near", "free"]),
    help="How well links are known [default: exact where the diagnosis left them, else near; free without].",
)
@click.option("--rate", "rate_hz", type=FiniteNumber(min=1, max=100_000), default=250.0, show_default=True, help="Hz.")
@click.option("--out", type=OutputPath(), default=Path("next"), show_default=True)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@safety_options
@prints_result
def next_experiment(
    verdict: Path,
    robot: str,
    recording: Path | None,
    rivals: str | None,
    algorithm: str,
    evaluations: int,
    duration: float,
    harmonics: int,
    links: str | None,
    rate_hz: float,
    out: Path,
    seed: int,
    safety: Any,
) -> ResultLines:
    """Design the motion that decides between rival effects.

    VERDICT: a verdict whose findings have rivals. Writes the motion as CSV, ROS 2 message and RAPID module, with a
    card and a picture. The motion stays near the range of the recording, starts near its first pose, and keeps off
    itself, the floor and the boxes that are given; the card says what was checked and what was not.
    """
    from armlab.cli.next_experiment import write_next_experiment
    from armlab.diagnosis.next.motion import Budget

    budget = Budget(duration, harmonics, algorithm, evaluations, seed)
    return write_next_experiment(verdict, robot, recording, rivals, budget, links, safety, rate_hz, out)


@click.command()
@click.argument("recordings", type=click.Path(path_type=Path), nargs=-1, required=True, metavar="RECORDING...")
@click.option("--out", type=OutputPath(), required=True, help="Folder for verdict, report and model.")
@click.option(
    "--baseline",
    type=click.Choice(["nominal", "refit", "simulated"]),
    help="What is compared [default: nominal where there is a simulation].",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of random waves in surrogates.")
@click.option("--compare", "old", type=click.Path(path_type=Path), help="An older recording: what changed since?")
@click.option("--dates", help="With --compare: day of each recording, like 2026-01-31,2026-02-28.")
@click.option("--without", multiple=True, metavar="GUARD", help="Switch a guard off, to see what it is worth.")
@click.option(
    "--set", "changes", multiple=True, metavar="NUMBER=VALUE", help="Another tuning number, like noise.max_order=8."
)
@click.option("--as-read", is_flag=True, help="Do not look for mistakes of signs, columns, units, zeros.")
@click.option("--only-setup", is_flag=True, help="Look for these mistakes alone, not for physics.")
@click.option("--mcap", is_flag=True, help="Write signals.mcap for Foxglove, PlotJuggler, ros2 bag, too.")
@click.option(
    "--table",
    "tables",
    type=click.Choice(["latex", "pdf", "svg"]),
    multiple=True,
    help="Write the table of joints for a paper, too: joints.tex, .pdf, .svg; repeatable.",
)
@click.option("--verbose", is_flag=True, help="Print every finding with its evidence, what is left, and all errors.")
@prints_result
def diagnose(
    recordings: tuple[Path, ...],
    out: Path,
    baseline: str | None,
    seed: int,
    old: Path | None,
    dates: str | None,
    without: tuple[str, ...],
    changes: tuple[str, ...],
    as_read: bool,
    only_setup: bool,
    mcap: bool,
    tables: tuple[str, ...],
    verbose: bool,
) -> ResultLines:
    """Find the physics that the simulation of RECORDING lacks.

    Says whether the recording is read wrongly, where the simulation is wrong, which effects are missing, and how much
    better it predicts with them. With --compare OLD: what changed from OLD to RECORDING, and to each further one.
    """
    from armlab.common.errors import InputError
    from armlab.recordings.motion import is_motion_only

    if old is not None and changes:
        raise InputError("--set: a comparison takes the usual tuning numbers, leave out --set or --compare")
    if as_read and only_setup:
        raise InputError("--as-read and --only-setup: give one of them")
    if old is not None and mcap:
        raise InputError("--mcap: a comparison has no predicted signals, leave out --mcap or --compare")
    if old is not None and tables:
        raise InputError("--table: a comparison has no table of joints, leave out --table or --compare")
    if old is not None and verbose:
        raise InputError("--verbose: a comparison prints all that it found, leave out --verbose or --compare")
    if old is None and len(recordings) > 1:
        raise InputError("one recording is diagnosed at a time: give --compare to compare several")
    motion_only = is_motion_only(recordings[0])
    if motion_only and (baseline or without or as_read or only_setup):
        raise InputError("a recording of motion only takes --out, --set, --mcap, --table, --compare: leave out others")
    if any(change.startswith("motion.") != motion_only for change in changes):
        raise InputError("--set: numbers of motion.* are for recordings of motion only, and these take no others")
    if old is not None and is_motion_only(old) != motion_only:
        raise InputError("--compare: one recording has torque, the other is motion only; they cannot be compared")
    if motion_only and old is None:
        from armlab.report.motion.write import diagnose_motion_recording

        return diagnose_motion_recording(recordings[0], out, tell_progress, changes, mcap, tables, verbose)
    if motion_only and old is not None:
        from armlab.report.motion.compare_write import compare_motion_recordings

        return compare_motion_recordings((old, *recordings), out, tell_progress)
    if old is not None:
        from armlab.report.changes.report import compare_recordings

        return compare_recordings((old, *recordings), out, baseline, seed, _parse_dates(dates), tell_progress)
    from armlab.report.torque.write import diagnose_recording

    return diagnose_recording(
        recordings[0], out, baseline, seed, without, changes, as_read, only_setup, tell_progress, mcap, tables, verbose
    )


@click.command()
@click.option("--out", type=OutputPath(), help="File for the page [default: the terminal].")
@prints_result
def tuning(out: Path | None) -> ResultLines:
    """List the tuning numbers of the diagnosis.

    Each with its value, unit, meaning and source, as Markdown. Their names are those of `diagnose --set` and
    `ablate --vary`.
    """
    from armlab.common.files import write_texts
    from armlab.diagnosis.tuning import Tuning, tuning_numbers, tuning_page

    if out is None:
        yield tuning_page().rstrip("\n")
    else:
        write_texts({out.name: tuning_page()}, out.parent)
        yield f"wrote {out}"
    return {"tuning": list(tuning_numbers(Tuning())), "files": [] if out is None else [out]}


@click.command("export-model")
@click.argument("model", type=click.Path(path_type=Path))
@click.argument("out", type=click.Path(path_type=Path))
@click.option(
    "--into",
    type=click.Path(path_type=Path),
    help="Robot file that takes the numbers [default: that of the model, the whole one where joints are locked].",
)
@lock_option
@prints_result
def export_model(model: Path, out: Path, into: Path | None, lock: tuple[str, ...]) -> ResultLines:
    """Export MODEL as URDF or MJCF.

    MODEL: a model.yaml with links. OUT: a .urdf file, or an .xml file for MJCF. Where the joints of a gripper were
    locked for the recording, they move in OUT; --lock says where they stood if the file of MODEL does not.
    """
    from armlab.identification.write_simulator import export_model as write
    from problem.locked_joints import parse_locks

    return write(model, out, into, parse_locks(lock))


@click.command()
@click.option("--results", type=OutputPath(), default=Path("results/real"), show_default=True)
@click.option("--recordings", type=OutputPath(), default=Path(".armlab/recordings"), show_default=True)
@click.option("--only", multiple=True, help="Name of a public recording or of a folder, repeatable [default: all].")
@click.option(
    "--part",
    type=click.Choice(["all", "folders", "public"]),
    default="all",
    show_default=True,
    help="Recording folders below ARMLAB_RECORDINGS, or the public recordings that are fetched.",
)
@click.option("--facts", type=_FILE, help="What is known of the folders: facts/1, see docs/recordings.md.")
@click.option("--jobs", type=JobCount(), default=2, show_default=True, help="Folders that are diagnosed at a time.")
@click.option(
    "--work",
    type=OutputPath(),
    default=Path(".armlab/real"),
    show_default=True,
    help="Verdicts of the folders, and the page of all of them, the unlicensed included.",
)
@click.option(
    "--peers", type=click.Path(path_type=Path), help="Python that has figaroh and mujoco[sysid]: adds peers.md."
)
@click.option(
    "--leave-one-out", is_flag=True, help="Choose settings of the diagnosis on all arms but one, and judge them on it."
)
@prints_lines
def real(
    results: Path,
    recordings: Path,
    only: tuple[str, ...],
    part: str,
    facts: Path | None,
    jobs: int,
    work: Path,
    peers: Path | None,
    leave_one_out: bool,
) -> Iterator[str]:
    """Diagnose recordings of real arms, and judge what is said.

    Each folder below ARMLAB_RECORDINGS that holds a recording.yaml, or old/ and new/ with one each, is diagnosed or
    compared in a process of its own. With --facts FILE the verdict is held against what is known: facts named, told as
    a class or as a cause, minor or missed; what is wrong or extra. Held-out errors stand beside those of identify and
    of plain least squares. Writes folders.md, folders.csv and folders_joints.csv with the folders whose facts do not
    say `licence: none`, and a page of all folders into the work folder. An interrupted command continues.

    Public recordings are identified and diagnosed on the same runs. Writes arms.md, arms.csv and arms.svg; with
    --leave-one-out leave_one_out.md and .csv instead.
    """
    from armlab.common.errors import InputError
    from armlab.proof.open.real_arms.leave_one_out import leave_arms_out
    from armlab.proof.open.real_folders.bench import FolderBench
    from armlab.proof.open.real_folders.parts import PublicBench, bench_real
    from armlab.recordings.public import local_copies

    if leave_one_out and (peers is not None or facts is not None or part == "folders"):
        raise InputError("--leave-one-out takes public recordings alone: leave out --peers, --facts, --part folders")
    if part == "public" and facts is not None:
        raise InputError("--facts are about folders: leave out --facts or --part public")
    if leave_one_out:
        return leave_arms_out(results, recordings, only, tell_progress)
    folders = None if part == "public" else FolderBench(local_copies(), facts, results, work, jobs)
    arms = None if part == "folders" else PublicBench(results, recordings, peers)
    return bench_real(folders, arms, only, tell_progress)


@click.command("real-motion")
@click.option("--results", type=click.Path(path_type=Path), default=Path("results/real"), show_default=True)
@click.option("--recordings", type=click.Path(path_type=Path), default=Path(".armlab/recordings"), show_default=True)
@click.option("--peer", type=click.Choice(["sysid"]), help="Run mujoco.sysid beside armlab on the SO-101, too.")
@click.option("--peer-windows", type=click.IntRange(min=1), help="Windows for both, of about 10 s [default: 24].")
@prints_lines
def real_motion(results: Path, recordings: Path, peer: str | None, peer_windows: int | None) -> Iterator[str]:
    """Diagnose public recordings of position servos.

    An SO-101 arm against its public MJCF, and an XL330 servo at four gains, pair by pair. Writes motion.md.
    """
    from armlab.common.errors import InputError
    from armlab.proof.open.motion.peer import WINDOWS
    from armlab.proof.open.motion.real import bench_real_motion

    if peer is None and peer_windows is not None:
        raise InputError("--peer-windows has no part without --peer sysid: give both")
    windows = None if peer is None else peer_windows or WINDOWS
    return bench_real_motion(results, recordings, tell_progress, peer_windows=windows)


@click.command()
@click.argument("folders", nargs=-1, type=click.Path(path_type=Path), metavar="[RECORDING]...")
@click.option("--results", type=OutputPath(), default=Path("results/relations"), show_default=True)
@click.option("--recordings", type=OutputPath(), default=Path(".armlab/recordings"), show_default=True)
@click.option("--only", multiple=True, help="Name of a recording [default: all at hand].")
@click.option("--part", type=click.Choice(["all", "quick", "null-pairs"]), default="all", show_default=True)
@prints_lines
def relations(
    folders: tuple[Path, ...], results: Path, recordings: Path, only: tuple[str, ...], part: str
) -> Iterator[str]:
    """Check relations that need no truth on real recordings.

    A recording against itself has no change, the found model explains its recording, other units change nothing, and
    others. Writes relations.md; an interrupted command continues. Parts: the short relations, or those of stretches
    that are independent of each other, between which nothing has changed (null-pairs.md).
    """
    from armlab.proof.open.relations.bench import bench_relations
    from armlab.proof.open.relations.relations import NULL_PAIRS, QUICK, RELATIONS

    names = {"all": tuple(RELATIONS), "quick": QUICK, "null-pairs": NULL_PAIRS}[part]
    return bench_relations(results, recordings, folders, only, names, tell_progress)


@click.command("real-concealed")
@click.option("--results", type=OutputPath(), default=Path("results/real"), show_default=True)
@click.option("--recordings", type=OutputPath(), default=Path(".armlab/recordings"), show_default=True)
@click.option("--only", multiple=True, help="Name of a public recording [default: all].")
@click.option("--seed", type=int, help="Draws random cases; 1000-1999 are for development [default: a fixed plan].")
@click.option("--cases", type=click.IntRange(min=1), default=16, show_default=True, help="Random ones of a recording.")
@click.option("--out", type=OutputPath(), help="Folder for the tables of random cases [default: RESULTS].")
@click.option("--jobs", type=JobCount(), default=1, show_default=True, help="Processes for random cases.")
@click.option("--make", "made", type=OutputPath(), help="Only write random cases: observations and answers.")
@click.option("--observation", type=_FILE, help="Only diagnose one of these observations, into --out.")
@click.option("--judge", "answered", type=_FILE, help="Only judge a folder of random cases that were diagnosed.")
@prints_lines
def real_concealed(
    results: Path,
    recordings: Path,
    only: tuple[str, ...],
    seed: int | None,
    cases: int,
    out: Path | None,
    jobs: int,
    made: Path | None,
    observation: Path | None,
    answered: Path | None,
) -> Iterator[str]:
    """Judge diagnoses of effects concealed in real recordings.

    Conceals effects in public recordings of real arms, diagnoses them, and compares. Writes concealed.md,
    concealed.csv and concealed.svg; with --seed the tables cases.csv, claims.csv and recordings.csv, which
    `armlab prove --tier real` scores.
    """
    from armlab.proof.open.real_concealed.at_random import (
        REAL_ARMS,
        RandomCases,
        conceal_at_random,
        examine_observation,
        judge_cases,
        make_cases,
    )
    from armlab.proof.open.real_concealed.report import conceal_in_recordings

    steps = [name for name, given in (("--make", made), ("--observation", observation), ("--judge", answered)) if given]
    if len(steps) > 1:
        raise click.UsageError(f"{' and '.join(steps)} are steps of their own: give one of them")
    if observation is not None:
        return examine_observation(observation, out or results, tell_progress)
    if seed is None:
        if steps:
            raise click.UsageError(f"{steps[0]} needs --seed, that of the random cases")
        return conceal_in_recordings(results, recordings, only, tell_progress)
    settings = RandomCases(only or REAL_ARMS, cases, seed)
    if made is not None:
        return make_cases(settings, recordings, results, made, tell_progress)
    if answered is not None:
        return judge_cases(settings, answered, out or results)
    return conceal_at_random(settings, recordings, results, out or results, jobs, tell_progress)


@click.command()
@click.argument("robot")
@click.argument("trajectory")
@click.option(
    "--noise",
    multiple=True,
    type=FiniteNumber(min=0, min_open=True),
    help="Of the torque, N m: once, or once a joint [default: 1 %].",
)
@click.option("--joints", type=click.IntRange(min=1), help="How many of its first joints move [default: all].")
@click.option("--out", type=OutputPath(), help="Folder for the card as page, tables and pictures.")
@prints_result
def confusability(
    robot: str, trajectory: str, noise: tuple[float, ...], joints: int | None, out: Path | None
) -> ResultLines:
    """List the effects that TRAJECTORY cannot tell apart.

    Needs no recording: it tells before anyone records the trajectory.

    ROBOT: a file or a built-in name. TRAJECTORY: a CSV with t, q1, ... in s and rad, a recording folder, or the name
    of a trajectory in results/best_known.json.
    """
    from armlab.report.confusability.report import write_card

    return write_card(robot, trajectory, joints, noise, out)


def _parse_dates(text: str | None) -> tuple[date, ...]:
    """Days written with commas; InputError for what is no day."""
    from armlab.common.errors import InputError

    try:
        return tuple(date.fromisoformat(each.strip()) for each in text.split(",")) if text else ()
    except ValueError:
        raise InputError(f"--dates {text}: should be days like 2026-01-31,2026-02-28") from None
