"""Commands `armlab proof ...` on recordings of real arms, and the coverage of intervals."""

import json
from collections.abc import Iterator
from pathlib import Path

import click

from armlab.cli.options import JobCount, OutputPath
from armlab.cli.output import prints_lines, tell_progress
from armlab.common.errors import InputError

_FILE = click.Path(path_type=Path)


@click.command()
@click.option("--results", type=OutputPath(), default=Path("results/real"), show_default=True)
@click.option("--recordings", type=OutputPath(), default=Path(".armlab/recordings"), show_default=True)
@click.option("--only", multiple=True, help="Name of a public recording or of a folder, repeatable [default: all].")
@click.option(
    "--part",
    type=click.Choice(["all", "folders", "public", "pieces"]),
    default="all",
    show_default=True,
    help="Recording folders below ARMLAB_RECORDINGS, the public recordings that are fetched, or halves and thinned "
    "copies of the folders; all: folders and public.",
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

    With --part pieces both halves of each recording of which facts are known, and one of two rows of it, are judged by
    what is known of the whole: pieces.md, pieces.csv and pieces_joints.csv.

    Public recordings are identified and diagnosed on the same runs. Writes arms.md, arms.csv and arms.svg; with
    --leave-one-out leave_one_out.md and .csv instead.
    """
    from armlab.proof.open.real_arms.leave_one_out import leave_arms_out
    from armlab.proof.open.real_folders.all_folders import FolderProof, prove_pieces
    from armlab.proof.open.real_folders.parts import PublicProof, prove_on_real_arms
    from armlab.recordings.public import local_copies

    if leave_one_out and (peers is not None or facts is not None or part in ("folders", "pieces")):
        raise InputError(f"--leave-one-out takes public recordings alone: leave out --peers, --facts, --part {part}")
    if peers is not None and part in ("folders", "pieces"):
        raise InputError(f"--peers are run on public recordings: leave out --peers or --part {part}")
    if part == "public" and facts is not None:
        raise InputError("--facts are about folders: leave out --facts or --part public")
    if leave_one_out:
        return leave_arms_out(results, recordings, only, tell_progress)
    folders = None if part == "public" else FolderProof(local_copies(), facts, results, work, jobs)
    if folders is not None and part == "pieces":
        return prove_pieces(folders, only)
    arms = None if part == "folders" else PublicProof(results, recordings, peers)
    return prove_on_real_arms(folders, arms, only, tell_progress)


@click.command()
@click.option("--results", type=click.Path(path_type=Path), default=Path("results/real"), show_default=True)
@click.option("--recordings", type=click.Path(path_type=Path), default=Path(".armlab/recordings"), show_default=True)
@click.option("--peer", type=click.Choice(["sysid"]), help="Run mujoco.sysid beside armlab on the SO-101, too.")
@click.option("--peer-windows", type=click.IntRange(min=1), help="Windows for both, of about 10 s [default: 24].")
@prints_lines
def real_motion(results: Path, recordings: Path, peer: str | None, peer_windows: int | None) -> Iterator[str]:
    """Diagnose public recordings of position servos.

    An SO-101 arm against its public MJCF, and an XL330 servo at four gains, pair by pair. Writes motion.md.
    """
    from armlab.proof.open.motion.peer import WINDOWS
    from armlab.proof.open.motion.public_servos import bench_real_motion

    if peer is None and peer_windows is not None:
        raise InputError("--peer-windows has no part without --peer sysid: give both")
    windows = None if peer is None else peer_windows or WINDOWS
    return bench_real_motion(results, recordings, tell_progress, peer_windows=windows)


@click.command()
@click.option("--results", type=OutputPath(), default=Path("results/real"), show_default=True)
@click.option("--recordings", type=OutputPath(), default=Path(".armlab/recordings"), show_default=True)
@click.option("--only", multiple=True, help="Name of a public recording [default: all].")
@click.option("--seed", type=int, help="Draws the cases; 1000-1999 are for development.")
@click.option("--cases", type=click.IntRange(min=1), default=16, show_default=True, help="Of a recording.")
@click.option("--out", type=OutputPath(), help="Folder for the tables [default: RESULTS].")
@click.option("--make", "made", type=OutputPath(), help="Write the cases: observations and answers.")
@click.option("--observation", type=_FILE, help="Diagnose one of these observations, into --out.")
@click.option("--judge", "answered", type=_FILE, help="Judge a folder of cases that were diagnosed.")
@prints_lines
def real_concealed(
    results: Path,
    recordings: Path,
    only: tuple[str, ...],
    seed: int | None,
    cases: int,
    out: Path | None,
    made: Path | None,
    observation: Path | None,
    answered: Path | None,
) -> Iterator[str]:
    """Take one step of `armlab proof run --tier real`.

    Conceals effects in public recordings of real arms at random, diagnoses one of them, or judges what was said: then
    it writes the tables cases.csv, claims.csv and recordings.csv.
    """
    from armlab.proof.open.real_concealed.at_random import (
        REAL_ARMS,
        RandomCases,
        examine_observation,
        judge_cases,
        make_cases,
    )

    steps = [name for name, given in (("--make", made), ("--observation", observation), ("--judge", answered)) if given]
    if len(steps) != 1:
        raise click.UsageError("--make, --observation and --judge are steps of their own: give one of them")
    if observation is not None:
        return examine_observation(observation, out or results, tell_progress)
    if seed is None:
        raise click.UsageError("--seed is needed, that of the cases")
    settings = RandomCases(only or REAL_ARMS, cases, seed)
    if made is not None:
        return make_cases(settings, recordings, results, made, tell_progress)
    assert answered is not None
    return judge_cases(settings, answered, out or results)


@click.command()
@click.option("--results", type=OutputPath(), default=Path("results/real"), show_default=True)
@click.option("--recordings", type=OutputPath(), default=Path(".armlab/recordings"), show_default=True)
@click.option("--only", multiple=True, help="Name of a public recording [default: all five arms].")
@prints_lines
def real_conditioning(results: Path, recordings: Path, only: tuple[str, ...]) -> Iterator[str]:
    """Test on real arms whether a small condition number helps.

    Identifies each public recording from many windows and predicts the runs that validate. Writes conditioning.md,
    two tables and a picture.
    """
    from armlab.proof.open.conditioning.conditioning_study import study_conditioning

    return study_conditioning(results, recordings, only, tell_progress)


@click.command()
@click.argument("folders", nargs=-1, type=click.Path(path_type=Path), metavar="[RECORDING]...")
@click.option("--results", type=OutputPath(), default=Path("results/relations"), show_default=True)
@click.option("--recordings", type=OutputPath(), default=Path(".armlab/recordings"), show_default=True)
@click.option("--only", multiple=True, help="Name of a recording [default: all at hand].")
@click.option("--part", type=click.Choice(["all", "quick", "null-pairs", "parts"]), default="all", show_default=True)
@prints_lines
def relations(
    folders: tuple[Path, ...], results: Path, recordings: Path, only: tuple[str, ...], part: str
) -> Iterator[str]:
    """Check relations that need no truth on real recordings.

    A recording against itself has no change, the found model explains its recording, other units change nothing, and
    others. Writes relations.md; an interrupted command continues. Parts: the short relations; those of stretches that
    are independent of each other, between which nothing has changed (null-pairs.md); or whether verdicts on cut and
    spoilt copies contradict themselves (parts.md).
    """
    from armlab.proof.open.relations.all_relations import check_relations
    from armlab.proof.open.relations.relations import NULL_PAIRS, PARTS, QUICK, RELATIONS

    names = {"all": tuple(RELATIONS), "quick": QUICK, "null-pairs": NULL_PAIRS, "parts": (PARTS,)}[part]
    return check_relations(results, recordings, folders, only, names, tell_progress)


@click.command()
@click.option("--experiments", type=click.IntRange(min=10), default=1000, show_default=True)
@click.option("--seed", type=int, default=0, show_default=True)
@click.option("--results", type=OutputPath(), default=Path("results/coverage"), show_default=True)
@click.option(
    "--part",
    type=click.Choice(["all", "identification", "superiority"]),
    default="all",
    show_default=True,
    help="Measure a part alone; the file keeps the other one.",
)
@prints_lines
def coverage(experiments: int, seed: int, results: Path, part: str) -> Iterator[str]:
    """Measure how often 95 % intervals contain the truth.

    Simulates experiments and identifies them, and compares simulated ends of two algorithms (A12). Writes
    coverage.json.
    """
    from armlab.common.files import write_texts
    from armlab.proof.open.coverage import measure_coverage
    from bench.statistics.superiority import COVERAGE_SIMULATIONS, describe_coverage, superiority_coverage

    path = results / "coverage.json"
    found = json.loads(path.read_text()) if part != "all" and path.exists() else {}
    if part != "superiority":
        found |= yield from measure_coverage(experiments, seed)
    if part != "identification":
        held = superiority_coverage(seed)
        found["superiority"] = {"seed": seed, "simulations": COVERAGE_SIMULATIONS, "coverage": held}
        yield from describe_coverage(held)
    yield from map(str, write_texts({path.name: json.dumps(found, indent=2, allow_nan=False) + "\n"}, results))
