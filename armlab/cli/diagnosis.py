"""Commands of the diagnosis: `armlab diagnose` and `armlab next`."""

from datetime import date
from pathlib import Path
from typing import Any

import click

from armlab.cli.options import FiniteNumber, OutputPath
from armlab.cli.output import prints_result, tell_progress
from armlab.cli.safety_options import safety_options
from armlab.common.documents import ResultLines

_FILE = click.Path(path_type=Path)


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
@click.option("--why", multiple=True, metavar="EFFECT@JOINT", help="Say why this is a finding, or none; repeatable.")
@click.option(
    "--survival",
    type=click.IntRange(min=2, max=1000),
    help="Diagnose twice so many recordings simulated from the model found: does each name return, like 20?",
)
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
    why: tuple[str, ...],
    survival: int | None,
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
    if why and (old is not None or motion_only or only_setup):
        raise InputError("--why: only a diagnosis of torque has a log of names, leave it out")
    if survival and (old is not None or motion_only or only_setup):
        raise InputError("--survival: only a diagnosis of torque can be simulated anew, leave it out")
    if motion_only and (baseline or without or as_read or only_setup):
        raise InputError("a recording of motion only takes --out, --set, --mcap, --table, --compare: leave out others")
    if any(change.startswith("motion.") != motion_only for change in changes):
        raise InputError("--set: numbers of motion.* are for recordings of motion only, and these take no others")
    if old is not None and is_motion_only(old) != motion_only:
        raise InputError("--compare: one recording has torque, the other is motion only; they cannot be compared")
    if motion_only and old is None:
        from armlab.report.motion.motion_write import diagnose_motion_recording

        return diagnose_motion_recording(recordings[0], out, tell_progress, changes, mcap, tables, verbose)
    if motion_only and old is not None:
        from armlab.report.motion.compare_write import compare_motion_recordings

        return compare_motion_recordings((old, *recordings), out, _parse_dates(dates), tell_progress)
    if old is not None:
        from armlab.report.changes.comparison_report import compare_recordings

        return compare_recordings((old, *recordings), out, baseline, seed, _parse_dates(dates), tell_progress)
    from armlab.report.torque.write import diagnose_recording

    reading = as_read, only_setup
    return diagnose_recording(
        recordings[0],
        out,
        baseline,
        seed,
        without,
        changes,
        *reading,
        tell_progress,
        mcap,
        tables,
        verbose,
        why,
        survival or 0,
    )


@click.command()
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
    return write_next_experiment(verdict, robot, recording, rivals, budget, links, safety, rate_hz, out, tell_progress)


def _parse_dates(text: str | None) -> tuple[date, ...]:
    """Days written with commas; InputError for what is no day."""
    from armlab.common.errors import InputError

    try:
        return tuple(date.fromisoformat(each.strip()) for each in text.split(",")) if text else ()
    except ValueError:
        raise InputError(f"--dates {text}: should be days like 2026-01-31,2026-02-28") from None
